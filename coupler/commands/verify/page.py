"""The page docs/benchmarks.md out of results: `surgebreak verify --json | python -m coupler.commands.verify.page`."""

from __future__ import annotations

import json
import math
import re
import sys
from collections.abc import Iterable

from coupler.commands.verify.registry import NOT_COVERED, TOLD, Result, checks
from coupler.program.provenance import machine, versions

NOTES = {
    "P38": "Without friction the mean pressure is that of published frictionless δ-SPH to 0.03. Friction of smooth "
    "walls brings it down to the measured one, but by an amount that depends on the cells, as nothing mixes the "
    "boundary layer; on H/64 sensors 2 and 3 read what was measured: [water](water.md).",
    "P39": "H3 lies behind the box: water closes the wake from one side too early, because all cells "
    "are split along the same diagonal; mirrored cells (tank.split) cure it "
    "([water](water.md#which-way-the-cells-are-split)). When the jet comes down differs from run to run.",
    "P40": "P3 is 1.2 cells below the edge of the box. With one unknown for both faces of the edge it reads 0.45 to "
    "0.81 of the measured impulse on cells of 4.2 to 6.3 cm, with unknowns of their own 0.69 to 0.83; what is missing "
    "then is the first 40 ms. The front comes that late by the record's clock, which runs ahead of a dam that "
    "vanishes at t = 0, and by the tip of the front, which is under a cell ([water](water.md#against-measurements)).",
    "P62": "Next to an edge the pressure goes like the square root of the distance; linear cells spread that over two.",
    "P63": "At 60 degrees the force is 6 to 7 % too large on all cells: the sheet that runs back along the plate is a "
    "quarter as thick as the jet. By the ledger on 8 cells the scheme's own lines sum to 0.1 % of the "
    "force: the water loses 4.7 % more momentum across the plate than the jet brings, since its sheets grow thicker "
    "and so move off the plate, 1.3 % come from the sides of the slice and 0.5 % are weight.",
    "P42": "The wave is less than half a cell high, its run-up one to two cells of water; where the tongue tears off "
    "a film decides: 0.064 to 0.099 d on 24 and 48 cells over the depth, with variants of damping and transport; "
    "round-off alone moves it by 0.004 d.",
    "P55": "With four cells over the diameter the speed is 5 to 6 % low: linear velocities are too coarse there (spun, "
    "the sphere feels 1.04 of the moment of Stokes; 1.003 with eight cells). At Re 1.5 the digitised records do not "
    "agree: the speeds add up to a gap of 4 D at 1.82 s, the record of the gap says 1.94 s, and the largest speed, "
    "0.0370, is a single point above a plateau of 0.0366 m/s.",
    "P56": "The sheet of water that reaches the cubes is 3 to 5 cm deep, less than a cell of edge/3. Of the momentum "
    "that it brings over the width of a cube, 45 N from 0.8 to 1.0 s, a held column gets less than half there and two "
    "thirds on cells of half the size: the rest is lost where the level set is corrected ([water](water.md#weak)). "
    "Cubes sealed or wetted from below move alike. The stack slides from 28 N on; its lowest cube leaves it from 52 N "
    "on.",
    "P52": "The period is measured over few swings and moves by 1 to 2 % with the substep and the number of passes.",
}
"""What is known about cases that miss a tolerance."""


def page(results: list[Result]) -> str:
    """The whole page."""
    failed = [r.id for r in results if not r.passed]
    judged = [r for r in results if r.judged]
    cases = list(dict.fromkeys(r.id for r in results))
    passed = len(cases) - len(set(failed))
    parts = [
        "# Benchmarks",
        "Made from `surgebreak verify --json | python -m coupler.commands.verify.page`. Errors are shown with the "
        "processor time that the case took; the figures of a case come from one run, booked to the first of them.",
        f"{_machine()}",
        f"{passed} of {len(cases)} cases pass, {len(judged) - len(failed)} of {len(judged)} figures, "
        f"{len(results) - len(judged)} more are reported and not judged; "
        f"{sum(r.cpu_s for r in results):.0f} CPU s. A case passes if all of its figures do.",
        _overview(results, cases),
        *(_case(id, [r for r in results if r.id == id]) for id in cases),
    ]
    if NOT_COVERED:
        parts += ["## Not covered", "\n".join(f"- {id}: {why}" for id, why in NOT_COVERED.items())]
    return "\n\n".join(parts) + "\n"


def _overview(results: list[Result], cases: list[str]) -> str:
    """A row a case: how many of its figures keep their limit, the one nearest to it or farthest beyond, its time."""
    rows = []
    for id in cases:
        everything = [r for r in results if r.id == id]
        own = [r for r in everything if r.judged]
        kept, title = sum(r.passed for r in own), checks()[id].title
        count = f"{kept} of {len(own)}" if kept == len(own) else f"**{kept} of {len(own)}**"
        nearest = max(map(_of_limit, own))
        worst = f"{100 * nearest:.0f} %" if math.isfinite(nearest) else "–"
        anchor = re.sub(r"[^\w\- ]", "", f"{id}: {title}".lower()).replace(" ", "-")
        rows.append(
            f"| [{id}](#{anchor}) | {title} | {count} | {worst} | {sum(r.cpu_s for r in everything):.0f} |"
        )
    head = "| case | what | figures kept | largest error, of its limit | CPU s |\n|---|---|--:|--:|--:|"
    return "\n".join([head, *rows])


def _of_limit(r: Result) -> float:
    """Error over its limit; 0 where only equality passes and it does; infinite without a figure."""
    if r.error is None or r.tolerance is None:
        return math.inf
    return r.error / r.tolerance if r.tolerance > 0.0 else 0.0 if r.passed else math.inf


def _machine() -> str:
    here = machine()
    packages = ", ".join(f"{name} {number}" for name, number in versions().items())
    return f"{here['processor']}, {here['cores']} cores, one thread; {packages}."


def _case(id: str, results: list[Result]) -> str:
    case = checks()[id]
    rows = "\n".join(_row(r) for r in results)
    missed = not all(r.passed for r in results)
    note = f"\n\n{NOTES[id]}" if missed and id in NOTES else ""
    head = "| quantity | value | expected | error | limit | | CPU s |\n|---|--:|--:|--:|--:|---|--:|"
    return f"## {id}: {case.title}\nAgainst: {case.source}.\n\n{head}\n{rows}{note}"


def _row(r: Result) -> str:
    quantity = r.quantity.replace("|", "\\|")
    if r.value is None:
        return f"| {r.reason} | | | | | **no** | {r.cpu_s:.1f} |"
    error, limit = (f"{100 * v:.3g} %" if r.relative else f"{v:.3g}" for v in (r.error, r.tolerance))
    verdict = "yes" if r.passed else "**no**"
    if not r.judged:
        quantity, limit, verdict = quantity.replace(f" {TOLD}", ""), "–", "reported"
    return (
        f"| {quantity} | {r.value:.6g} | {r.expected:.6g} | {error} | {limit} | {verdict} | {r.cpu_s:.1f} |"
    )


def read(lines: Iterable[str]) -> list[Result]:
    """Results from the JSON lines of the command."""
    rows = [json.loads(line) for line in lines if line.startswith("{")]
    return [Result(**{("passed" if k == "pass" else k): v for k, v in row.items()}) for row in rows]


def main() -> None:
    """JSON lines in, page out."""
    sys.stdout.write(page(read(sys.stdin)))


if __name__ == "__main__":
    main()
