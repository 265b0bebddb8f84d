"""The command `surgebreak benchmark`: all measurements in one run, each in a process of its own."""

from __future__ import annotations

import json
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

from coupler.commands.benchmark import cutting, debris, scenes, threads
from coupler.commands.benchmark.part import LAW
from coupler.program import provenance
from coupler.program.errors import BadCall, ExitCode, SurgebreakError
from coupler.program.extras import need
from coupler.program.process import run_module, trouble
from yade_scripts.blocks.faces import touching_faces
from yade_scripts.stock.scene import described, timed
from yade_scripts.stock.script import LAWS, run_script, stock_law

SIZES, QUICK_SIZES = (56, 500, 1000, 5000), (1000,)
AT = 1000
"""Joints at which targets are set."""
POINTS = (1, 3)
"""Stock bonds along each edge of a joint: one a joint, as usual, and nine as in our joints."""
VISITS = 2_000_000
"""Bonds times substeps of a stock measurement, in RECORDS parts of which the cheapest counts."""
RECORDS = 5
WATER_NODES, WATER_QUICK = (30_000, 100_000), (10_000,)
THREADS_NODES, THREADS_QUICK = (30_000, 205_000), (10_000,)
MOST_ON_TWO, MOST_SERIAL = 1.0 / 1.7, 0.07
"""Targets at 1.2 million cells: time on two threads over that on one, share of the step that one thread does alone."""
LEAST_TOLD = 0.01
"""Least share of a step at which a kernel is listed."""
SOLVER_UNKNOWNS, SOLVER_QUICK = (10_000, 100_000, 300_000), (10_000,)
MOST_PER_100K_CELLS = 30_000.0
"""Target [us]: a step of the water at 100 000 nodes, a fifth of the tank wet."""
HOUSES, MOST_ASLEEP = 20, 1.5
"""Target [times]: so many buildings of which one is hit, over one alone."""
MOST_PER_JOINT, MOST_PER_BUILDING = 1.0, 1000.0
"""Targets [us]: the joint engine a joint and substep at AT joints, an intact building of 500 blocks a substep."""


class PartFailed(SurgebreakError):
    """A measurement ended with an error."""


@dataclass(frozen=True)
class Line:
    """One figure in CPU microseconds, of a substep unless it says otherwise; of: what it was divided by; target: its
    limit or None."""

    what: str
    blocks: int
    """Number of blocks; for the water alone, nodes of its mesh."""
    joints: int
    """Number of joints; for the water alone and for solvers, unknowns of the pressure."""
    us: float
    of: str
    target: float | None = None

    @property
    def kept(self) -> bool:
        return self.target is None or self.us <= self.target


def benchmark(quick: bool, as_json: bool, only: str | None = None) -> ExitCode:
    """Measure and print; exits with DIVERGED if a target is missed. only: one of GROUPS, None: all. Raises BadCall for
    another name."""
    if only is not None and only not in GROUPS:
        raise BadCall([f"--only {only}: choose one of {', '.join(GROUPS)}"])
    chosen = GROUPS if only is None else (only,)
    if "solver" in chosen:
        need("benchmark")  # now, not after the measurements before it
    sizes = QUICK_SIZES if quick else SIZES
    lines: list[Line] = []
    if not as_json:
        print(_heading(), flush=True)
    for name in chosen:
        for line in GROUPS[name](sizes):
            lines.append(line)
            if not as_json:
                print(_reported(line), flush=True)
    if as_json:
        about = {"machine": provenance.machine(), "versions": provenance.versions()}
        print(json.dumps(about | {"lines": [asdict(line) | {"kept": line.kept} for line in lines]}, indent=1))
    return ExitCode.DONE if all(line.kept for line in lines) else ExitCode.DIVERGED


def _heading() -> str:
    machine, versions = provenance.machine(), provenance.versions()
    named = ", ".join(
        f"{name} {versions[name]}" for name in ("surgebreak", "yade", "numba", "numpy") if name in versions
    )
    columns = f"{'CPU time of a substep':58}{'blocks':>8}{'joints':>8}{'us':>10}"
    return f"{machine['processor']}, {machine['cores']} cores, one thread; {named}\n{columns}"


def _reported(line: Line) -> str:
    target = "" if line.target is None else f"  target {line.target:g}: {'kept' if line.kept else 'MISSED'}"
    us = f"{line.us:.0f}" if line.us >= 1000.0 else f"{line.us:.3g}"
    return f"{line.what:58}{line.blocks:8}{line.joints:8}{us:>10} {line.of}{target}"


def _part(kind: str, size: int = 0) -> dict:
    done = run_module("coupler.commands.benchmark.part", kind, size, capture_output=True, text=True)
    if done.returncode != 0:
        raise PartFailed(f"benchmark {kind} {size}: {trouble(done.returncode, done.stderr)}")
    return json.loads(done.stdout.splitlines()[-1])


def _engine(sizes):
    """The joint engine: the cost that joints add to blocks, and the cost of its kernel alone."""
    for size in sizes:
        m = _part("joints", size)
        n, J = m["blocks"], m["joints"]
        added = 1e6 * (m["substep"] - m["without_joints"]) / J
        alone = 1e6 * m["kernel"] / J
        yield Line("joint engine", n, J, added, "a joint", MOST_PER_JOINT if size == AT else None)
        yield Line("  of it the kernel, 9 points a joint", n, J, alone, "a joint")
        yield Line("  of it reading, writing, accounts", n, J, added - alone, "a joint")
        yield Line(
            "  blocks without joints (YADE's integration)", n, J, 1e6 * m["without_joints"] / n, "a block"
        )


def _scenes(sizes):
    m = _part("building")
    whole = 1e6 * m["substep"]
    limit = MOST_PER_BUILDING * m["blocks"] / 500.0
    yield Line("intact building, joints and contact on", m["blocks"], m["joints"], whole, "in all", limit)
    yield Line("  the same", m["blocks"], m["joints"], whole / m["blocks"], "a block")
    m = _part("pile")
    what = f"pile of loose blocks, {m['contacts']} contacts"
    yield Line(what, m["blocks"], 0, 1e6 * m["substep"] / m["blocks"], "a block")
    yield Line("  the same", m["blocks"], 0, 1e6 * m["substep"] / m["contacts"], "a contact")


SLACK = 1.3
"""Allowed scatter of a cost that should be zero."""


def _dead(sizes):
    """Failed joints: a substep with all joints failed should cost as much as one without joints."""
    m = _part("dead", AT)
    bare = 1e6 * m["without_joints"]
    for alive, cost in zip(m["alive"], m["cost"]):
        target = SLACK * bare if alive == 0 else None
        yield Line(
            f"wall with {alive} of {m['joints']} joints alive",
            m["blocks"],
            alive,
            1e6 * cost,
            "in all",
            target,
        )
    yield Line("  the same blocks without joints", m["blocks"], 0, bare, "in all")


def _sleep(sizes):
    """Sleeping buildings: the cost of many, of which one is hit, compared with that of one alone that is hit."""
    one, many = _part("town", 1), _part("town", HOUSES)
    if one["broken"] != many["broken"]:
        raise PartFailed(
            f"benchmark town: {one['broken']} joints broke of one, {many['broken']} among {HOUSES}"
        )
    for m, what in ((one, "one building, hit"), (many, f"{HOUSES} buildings, one hit, the others asleep")):
        yield Line(what, m["blocks"], m["joints"], 1e6 * m["hit"], "0.2 s of the hit")
    yield Line(
        "  many over one", many["blocks"], many["joints"], many["hit"] / one["hit"], "times", MOST_ASLEEP
    )


def _cutting(sizes):
    """Cost of cutting the water's cells by blocks."""
    for what, bodies, us, target in cutting.figures(_part("cutting")):
        yield Line(what, bodies, 0, us, "a cut cell", target)


def _debris(sizes):
    """Cost of blocks in a coupled step, part by part, and the pressure solve relative to one without blocks."""
    found, n = debris.costs(), debris.BLOCKS
    for name, what in debris.PARTS.items():
        yield Line(f"coupled step, {what}", n, 0, 1e3 * found.full[name], "a step")
    for what, table in (("without blocks", found.bare), ("with the blocks held", found.held)):
        yield Line(f"  the pressure {what}, same mesh", 0, 0, 1e3 * table["pressure"], "a step")
    none, held = found.shares
    yield Line("  a solve with blocks over one without them", n, 0, none, "times", debris.MOST)
    yield Line("  the same over one with the blocks held", n, 0, held, "times")


def _water(sizes):
    """A step of the water by stage, CPU time for 100 000 cells of the mesh, and in a tank twice as high."""
    for nodes in WATER_QUICK if sizes == QUICK_SIZES else WATER_NODES:
        found = _part("water", nodes)
        low, high = found["low"], found["high"]
        share = 1e6 * 1e5 / low["cells"]
        n, u = low["nodes"], low["unknowns"]
        target = MOST_PER_100K_CELLS if nodes == WATER_NODES[-1] else None
        yield Line(
            "step of the water, 20 % of the tank wet", n, u, share * low["step"], "a 100k cells", target
        )
        for stage, seconds in (*low["stages"].items(), ("rest", low["rest"])):
            yield Line(f"  {stage}", n, u, share * seconds, "a 100k cells")
        yield Line("  whole step", n, u, 1e6 * low["step"], "a step")
        yield Line("  the same water, tank twice as high", high["nodes"], u, 1e6 * high["step"], "a step")


def _solver(sizes):
    """Solvers for the pressure to 1e-8: set-up, and iterations from a guess that is 2 % off."""
    for unknowns in SOLVER_QUICK if sizes == QUICK_SIZES else SOLVER_UNKNOWNS:
        for where, found in _part("solver", unknowns).items():
            for name, m in found["solvers"].items():
                blocks = 25 if where == "wall" else 0
                us, iterations = 1e6 * (m["setup"] + m["warm"]), m["iterations"][1]
                what = f"{name}, {iterations} its, set-up {1e3 * m['setup']:.3g} ms"
                yield Line(what, blocks, found["unknowns"], us, "a solve")


def _stock(sizes):
    """YADE's own laws on the same walls."""
    for size in sizes:
        for points in POINTS if size == AT else POINTS[:1]:
            blocks = scenes.wall(size)
            faces = touching_faces(blocks)
            scene = described(blocks, faces, LAW, points, 0.5, (0.0, 0.0, 0.0))
            for name in LAWS:
                yield _stock_line(name, scene, len(blocks), len(faces), points)


def _stock_line(name: str, scene: dict, blocks: int, joints: int, points: int) -> Line:
    law = stock_law(name)
    count = max(20, VISITS // (joints * points**2 * RECORDS))
    substep = 1e-5
    made = timed(scene, law.variant, RECORDS * count * substep, substep, RECORDS)
    with tempfile.TemporaryDirectory() as folder:
        figures = run_script(law, made, Path(folder)).figures
    what = f"{law.title}, {points**2} bond{'s' if points > 1 else ''} a joint"
    return Line(what, blocks, joints, 1e6 * figures["cheapest_substep"] / joints, "a joint, whole substep")


def _threads(sizes):
    """Wall time of a step of the water by number of threads, its serial share, and Amdahl's law."""
    for nodes in THREADS_QUICK if sizes == QUICK_SIZES else THREADS_NODES:
        found = _part("threads", nodes)
        n, one = found["nodes"], found["wall"]["1"]
        yield from _machine(found["machine"])
        for number, seconds in found["wall"].items():
            yield Line(f"step of the water, {number} threads", n, 0, 1e6 * seconds, "a step, wall clock")
            if number != "1":
                goal = MOST_ON_TWO if number == "2" and nodes == THREADS_NODES[-1] else None
                yield Line(
                    f"  speed-up {one / seconds:.2f}; time over that of one",
                    n,
                    0,
                    seconds / one,
                    "times",
                    goal,
                )
        goal = MOST_SERIAL if nodes == THREADS_NODES[-1] else None
        yield Line("  serial share of one thread's processor time", n, 0, found["serial"], "of all", goal)
        yield Line("  the same as time", n, 0, 1e6 * found["outside"], "a step")
        for after, before, count, seconds in found["pieces"]:
            what = f"  {count:.3g} times between {_named(after)} and {_named(before)}"
            yield Line(what, n, 0, 1e6 * seconds, "a step")
        for cores in threads.MORE:
            yield Line(
                f"  {cores} cores by Amdahl's law",
                n,
                0,
                threads.amdahl(found["serial"], cores),
                "times as fast",
            )


def _named(kernel: str | None) -> str:
    return "start or end" if kernel is None else kernel.strip("_")


def _machine(found):
    """What threads give on this machine: speed-ups of two loops, and the time to hand over a loop."""
    for number, spent in found.items():
        if number != "1":
            compute, triad = (found["1"][name] / spent[name] for name in ("compute", "triad"))
            yield Line(
                f"this machine, {number} threads: a loop that only computes", 0, 0, compute, "times as fast"
            )
            yield Line(f"this machine, {number} threads: a triad in memory", 0, 0, triad, "times as fast")
        yield Line(
            f"this machine, {number} threads: an empty loop", 0, 0, 1e6 * spent["empty"], "a call, wall clock"
        )


def _roofline(sizes):
    """Kernels of the water: the least memory that they move, and the rate compared with that of a triad."""
    for nodes in THREADS_QUICK if sizes == QUICK_SIZES else WATER_NODES[-1:]:
        found = _part("roofline", nodes)
        n, best, share = found["nodes"], found["bandwidth"], 1e6 * 1e5 / found["cells"]
        yield Line("memory, triad of one thread", n, 0, best / 1e9, "GB/s")
        yield Line("step of the water", n, 0, share * found["step"], "a 100k cells")
        kernels = sorted(found["kernels"].items(), key=lambda item: -item[1][0])
        for name, (seconds, moved) in kernels:
            if seconds > LEAST_TOLD * found["step"]:
                rate = moved / seconds
                what = f"  {name.strip('_')}: {rate / 1e9:.3g} GB/s, {rate / best:.0%} of memory's"
                yield Line(what, n, 0, share * seconds, "a 100k cells")
        shared = sum(seconds for _, (seconds, _) in kernels)
        moved = sum(moved for _, (_, moved) in kernels)
        yield Line("  all of these loops", n, 0, share * shared, "a 100k cells")
        yield Line("  the same at the bandwidth of memory", n, 0, share * moved / best, "a 100k cells")


GROUPS = {
    "joints": _engine,
    "scenes": _scenes,
    "dead": _dead,
    "sleep": _sleep,
    "cutting": _cutting,
    "debris": _debris,
    "water": _water,
    "solver": _solver,
    "threads": _threads,
    "roofline": _roofline,
    "stock": _stock,
}
"""Measurements by the name that --only takes."""
