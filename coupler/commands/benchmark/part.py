"""One measurement in this process: `python -m coupler.commands.benchmark.part KIND [SIZE]` prints a JSON object.

Times are CPU seconds of this process, the best of REPEATS, over as many substeps as take about CHUNK seconds.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable

import surgebreak  # noqa: F401 - before NumPy, which takes from it how many threads it may use

# isort: split
import numpy as np

from coupler.commands.benchmark import scenes
from coupler.commands.benchmark.cutting import cutting
from kernels.memory import keep_memory
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.equilibrium import settle
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters

REPEATS, CHUNK = 5, 0.15
STILL = (0.0, 0.0, 0.0)
LAW = JointParameters(1e6, 1e-3, points=3, damping=0.0)
CONTACT = ContactLaw(restitution=0.3, friction=0.5)
STIFF = ContactLaw(stiffness=1e9, restitution=0.3, friction=0.5)
HOUSE_LAW = JointParameters(0.15e6, 0.01)
HOUSE_CONTACT = ContactLaw(restitution=0.2, friction=0.5)
SHARE = 0.02
"""Share of the strength by which the tractions of sleeping joints may be wrong."""
PUSH, HIT, HIT_STEP = 1e6, 0.2, 0.01
"""Force [N] on each block of the front of the first house, its duration [s] and the step [s]."""
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Shares of the blocks that are removed with all their joints."""


def best(work: Callable[[int], None]) -> float:
    """CPU seconds of one of the units of work(count)."""
    count, spent = 1, 0.0
    while spent < CHUNK / 4:
        count *= 2
        spent = _spent(work, count)
    count = max(1, int(count * CHUNK / spent))
    return min(_spent(work, count) for _ in range(REPEATS)) / count


def _spent(work: Callable[[int], None], count: int) -> float:
    began = time.process_time()
    work(count)
    return time.process_time() - began


def substep(structure: Structure) -> float:
    """CPU seconds of a substep."""
    dt = structure.stable_substep()[0]
    dt = dt if np.isfinite(dt) else 1e-5
    structure.advance(dt, dt)
    return best(lambda count: structure.advance(count * dt, dt))


def kernel(structure: Structure) -> float:
    """CPU seconds of one visit of all live joints, with history and energies."""
    x, v, R = structure.centre(), structure.velocity(), structure.rotation()
    F, dt = np.zeros((structure.n, 6)), structure.stable_substep()[0]

    def work(count: int) -> None:
        for _ in range(count):
            structure.joints.forces(x, v, R, F, dt, advance=True)

    work(1)
    return best(work)


def joints(size: int) -> dict:
    """The joint engine: a wall with joints, without contact; and the same blocks without joints."""
    blocks = scenes.wall(size)
    with Structure(blocks, None, LAW, gravity=STILL) as s:
        found = {"blocks": s.n, "joints": len(s.joints), "substep": substep(s), "kernel": kernel(s)}
    with Structure(blocks, None, None, gravity=STILL) as s:
        return found | {"without_joints": substep(s)}


def building(size: int) -> dict:
    """An intact building on the ground, joints and contact on, weight carried."""
    with Structure(scenes.building(), CONTACT, LAW, ground=0.0) as s:
        return {"blocks": s.n, "joints": len(s.joints), "substep": substep(s)}


def pile(size: int) -> dict:
    """Loose cubes that all touch their neighbours and the ground, under their weight."""
    with Structure(scenes.pile(), STIFF, None, ground=0.0) as s:
        return {"blocks": s.n, "joints": 0, "substep": substep(s), "contacts": len(s.contacts().a)}


def town(size: int) -> dict:
    """`size` buildings that stand settled, the first hit from the front: CPU seconds of HIT in steps of HIT_STEP."""
    with Structure(scenes.houses(size), HOUSE_CONTACT, HOUSE_LAW, ground=0.0, sleep=SHARE) as s:
        settle(s)
        front = np.flatnonzero(s.centre()[: s.n // size, 0] < 1.0)
        load = np.zeros((s.n, 6))
        s.advance(HIT_STEP)  # compiles what is not, and falls asleep
        began, broken = time.process_time(), 0
        load[front, 0] = PUSH
        for _ in range(round(HIT / HIT_STEP)):
            s.set_load(load)
            broken += len(s.advance(HIT_STEP).broken)
        spent = time.process_time() - began
        return {"blocks": s.n, "joints": len(s.joints), "hit": spent, "broken": broken}


def dead(size: int) -> dict:
    """A wall whose blocks are taken away share by share, which breaks their joints."""
    cost, alive = [], []
    with Structure(scenes.wall(size), None, LAW, gravity=STILL) as s:
        gone = np.zeros(s.n, bool)
        for share in SHARES:
            rows = np.setdiff1d(np.arange(round(share * s.n)), np.flatnonzero(gone))
            gone[rows] = True
            _take_away(s, rows)
            cost.append(substep(s))
            alive.append(int(s.joint_table().alive.sum()))
        found = {"blocks": s.n, "joints": len(s.joints), "alive": alive, "cost": cost}
    with Structure(scenes.wall(size), None, None, gravity=STILL) as s:
        return found | {"without_joints": substep(s)}


def _take_away(structure: Structure, rows: np.ndarray) -> None:
    """Move blocks to separate places, far from all others."""
    if len(rows):
        shift = np.zeros((len(rows), 3))
        shift[:, 1] = 10.0 * (1 + rows)
        structure.displace(rows, shift, np.tile(np.eye(3), (len(rows), 1, 1)))


def water(size: int) -> dict:
    """A step of the water by stage, also in a tank twice as high."""
    from coupler.commands.benchmark.water import taller_tank

    return taller_tank(size)


def solver(size: int) -> dict:
    """Solvers for the pressure, without and with blocks in it."""
    from coupler.commands.benchmark.solver import solver as measured

    return {"alone": measured(size), "wall": measured(size, wall=True)}


def threads(size: int) -> dict:
    """A step of the water on one thread and on more."""
    from coupler.commands.benchmark.threads import threads as measured

    return measured(size)


def roofline(size: int) -> dict:
    """Kernels of the water against the bandwidth of memory."""
    from coupler.commands.benchmark.threads import roofline as measured

    return measured(size)


KINDS = {
    "joints": joints,
    "building": building,
    "pile": pile,
    "town": town,
    "dead": dead,
    "cutting": cutting,
    "water": water,
    "solver": solver,
    "threads": threads,
    "roofline": roofline,
}


def main() -> None:
    """Print the measurement as JSON, the last line of the output."""
    keep_memory()
    kind, size = sys.argv[1], int(sys.argv[2])
    print(json.dumps(KINDS[kind](size)))


if __name__ == "__main__":
    main()
