"""The page docs/benchmarks.md from results: `surgebreak verify --json | python -m coupler.commands.verify.page`."""

from __future__ import annotations

import json
import math
import re
import sys
from collections.abc import Iterable

from coupler.commands.verify.registry import NOT_COVERED, TOLD, Result, checks
from coupler.program.provenance import machine, versions

NOTES = {
    "P38": "Without friction the mean pressure agrees with published frictionless δ-SPH to 0.03. Friction of smooth "
    "walls reduces it to the measured value, but by an amount that depends on the cells, because nothing "
    "mixes the boundary layer; on cells of H/64 sensors 2 and 3 agree with the measurement. It is the cells on the "
    'bed that count, which are halved once and twice in the rows "on the bed"; cells that are half or a quarter as '
    "high there, and as long as elsewhere, do as well for a tenth of the time: [water](water.md).",
    "P40": "P3 is 1.2 cells below the edge of the box. With one unknown for both faces of the edge it gives 0.45 to "
    "0.81 of the measured impulse on cells of 4.2 to 6.3 cm, and with separate unknowns 0.70 to 0.84; the "
    "rest is missing in the first 40 ms. The front is late by this time according to the clock of the record, "
    "which is ahead of a dam that vanishes at t = 0, and because the tip of the front is thinner than a cell "
    "([water](water.md#against-measurements)).",
    "P62": "Next to an edge the pressure varies with the square root of the distance; linear cells spread this "
    "variation over two cells. The plate is half of D thick: with two cells over D and fewer, thinner than "
    "two cells. There narrow openings are closed (`openings = wide`), elsewhere every opening counts (`all`)."
    " With `wide` also there, the plate acts as if it were up to half a cell longer at each edge that does "
    "not lie on nodes: 1.00 to 1.12 times the force on a plate of width D with eight cells over D, depending "
    "on its place, and 1.10 to 1.21 with four (before walls that the water has left had air); with `all` 0.95 "
    "to 1.01 and 0.93 to 1.03. With a quarter of the step the plate of width D receives 2 % more on eight "
    "cells; the plate of width D/2 on four cells 11 %, from 0.94 to 1.05 of its force. Where cells are halved around "
    "the plate, both of its edges see the same diagonals; the place that is judged is the worst of four, and their "
    "mean is within 1.5 % ([the diagonals](variants.md#the-edges-of-plates-in-jets)).",
    "P41": "The bore into two cells of still water is 5.5 % too slow (4.6 % with the correction of the level set "
    "spread over five cells in calm water, too), the one into four cells 4.4 %.",
    "P53": "Each swing is smaller than the reference by 0.02 to 0.03 of the drop height. Half of the step changes the "
    "first swing by 0.002 (in a tank 0.9 m wide). It was 0.03 smaller, and the third one 0.06, while the load of a "
    "sphere that moves in one substep a step was reduced over half of its way as if it took many; cells of R/8 gave "
    "0.006 more at that time.",
    "P55": "With four cells over the diameter the speed is 5 to 6 % low, because linear velocities are too coarse "
    "there (a spinning sphere is subject to 1.04 times the moment of Stokes; 1.003 times with eight cells). "
    "At Re 1.5 the digitised records contradict each other: the integral of the speed gives a gap of 4 D at "
    "1.82 s, the record of the gap gives 1.94 s, and the largest speed, 0.0370 m/s, is a single point above a "
    "plateau of 0.0366 m/s.",
    "P52": "The period is measured over few oscillations and changes by 1 to 2 % with the substep and the number of "
    "passes.",
}
"""What is known about cases that exceed a tolerance."""
ALWAYS = {
    "P56": "The sheet of water that reaches the cubes is 3 to 5 cm deep: less than a cell of edge/3, three to four "
    "cells of edge/12. It brings 45 N over the width of a cube from 0.8 to 1.0 s. A part of that passes by: a"
    " column held in their place receives 38.7 and 38.0 N on cells of edge/12 and edge/6, and 30.8 N"
    " on edge/3 ([theory](theory.md#3-coupling)). Friction decides how the stack fails, and nobody has measured "
    "it. In the record the top cube sinks by 10 cm while it moves by 3 cm: the lowest cube leaves the stack "
    "and the other two tip over backwards. With 0.15 between all faces, from a simulation of this experiment "
    "with contacts between faces (an example of DualSPHysics, compared with the same record), they do so "
    "here, 0.1 s before the measured ones. With 0.25 the lowest cube is only 25 mm ahead at 1.1 s, and with "
    "0.45 between cubes and 0.35 on the bed, which re-simulations with contacts between particles use, the "
    "stack slides as a whole: the top cube is then at 1.97, 2.09 and 2.22 m at 1.2, 1.4 and 1.6 s, and does "
    "not fall. Agreement within the limits is therefore evidence for the load on the lowest cube, and for the"
    " mechanism, but not independent of the choice of this coefficient.",
    "P43": "The record has no water before the wave, and its front arrives 0.4 to 0.7 s before that of the "
    "shallow-water equations, which squares of 5 and of 10 cm give within 0.06 s of one another; with 5 mm of water "
    "in the channel instead of 20 mm it would be 0.2 to 0.3 s, so that clock or water are in doubt. The front "
    "is therefore judged by these equations. Cells are three times as wide as high, and hold water 0.4 of a "
    "layer deep ahead of the wave. If the water in the face of the bore does not keep its momentum, the front is "
    "0.3 to 0.5 s late.",
    "P42": "On cells of d/24 the wave is less than half a cell high, and its run-up one to two cells of water. There "
    "the run-up is chance: from 0.054 d on, noise of the level set inside the bed breaks the tongue, a fifth to "
    "a half of a cell deep, into lumps; with the beach moved by 0, 0.014 and 0.138 d it is 0.073, 0.076 and "
    "0.082 d, variants of damping, step and correction gave 0.064 to 0.083 d, and the versions of the program so"
    " far 0.066 to 0.085 d. Besides, a tenth of a cell counts as dry: in the shallow-water equations the depth "
    "exceeds a tenth of d/24, d/48 and d/96 up to 0.078, 0.082 and 0.085 d. Judged are therefore cells a quarter"
    " as large on the beach (`[[tank.refine]]`, two levels, from a tenth of the depth under still water up), "
    "with which the run-up is eight cells high. There the run-up with the same three places of the beach (0.014 "
    "and 0.138 d are two thirds of the length and of the height of these cells) is 0.086, 0.084 and 0.087 d; the"
    " tip flickers, and the highest median over half a second is 0.083, 0.084 and 0.085 d. With cells of d/48 "
    "the run-up is 0.079 to 0.087 d in five runs ([theory](theory.md#25-cells-of-several-sizes-and-meshes-that-"
    "end-on-a-bed)). Agreement within the limit is therefore evidence for a tongue on such cells, not for one "
    "that is thinner than a cell. Waves of this height ran up 0.075 d in the laboratory. On the fitted bed with "
    "8 layers the tongue is thinner than a cell, and the figure depends on where the columns lie: with beach and"
    " columns moved by 0 to 0.02 d it was 0.074 to 0.089 d in an earlier version. The shallow-water equations "
    "give 0.080 d where a tenth of a cell counts as dry; at 0.005 of a layer the run is at 0.083 d.",
    "P39": "H3 lies behind the box. When the jet falls there is chance, and depends on the diagonals along which "
    "the cells are split ([water](water.md#which-way-the-cells-are-split)). For 18 columns whose widths differ "
    "by up to 1 mm (8e-4 of the width) an earlier version had an rms of 0.0515 ± 0.0038 m there (mean and standard "
    "deviation; 0.045 to 0.060), and six of 18 kept the limit: whether one run keeps it says little. H1, H2 and H4 "
    "varied by less than 0.002.",
    "P40": "Water is under no tension. While the nodes of thin sheets lost momentum to the correction of the level "
    "set ([theory](theory.md#22-step)) the lowest pressure was chance: for the 18 columns of "
    "[P39](#p39-spheric-test-2-levels) it lay between 0 and −131 Pa, and once at −354 Pa.",
    "P63": "Jets are 24 widths long, and the means are taken from 6 to 18 D/U: theory is that of an endless jet, and "
    "on one cell the plate receives in three steps what it lacked in the three before ([how long a jet has to "
    "be](variants.md#how-long-a-jet-has-to-be)). What is missed are sheets thinner than a cell: of a jet at 30 degrees "
    "one fifteenth runs back along the plate, a quarter of a cell with four cells over the jet. On two cells and one "
    "the force depends on where jet and plate lie between the nodes, and a single place says little: the reported rows "
    "have mean, standard deviation and worst of eight, and [where the load is "
    "lost](variants.md#where-a-sheet-on-two-cells-loses-its-load) was found by a balance of momentum.",
    "P61": "The wave is the solitary wave of 0.0307 m that the benchmark prescribes; the gauge before the inflow "
    "recorded 0.0279 m ([what that "
    "changes](variants.md#fluxes-through-the-planes-of-the-medians-on-meshes-that-fit-a-bed)). The side behind"
    " the island lets waves out. Cells at the shore are 8 cm wide. With the island moved by 0, 1, −1 and 10 mm"
    " along the wave an earlier version had 0.080, 0.078, 0.091 and 0.080 m facing the wave and 0.078, 0.090, "
    "0.083 and 0.079 m in the lee, and another one 0.093 and 0.094 m. A part of that was a fault: once in a "
    "while the shift of the surface was solved wrongly on flat cells, and water that was going back rose by 3 "
    "cm in one step ([theory](theory.md#25-cells-of-several-sizes-and-meshes-that-end-on-a-bed)). How much the"
    " figures depend on the place of the island without it was not measured.",
}
"""What has to be known to judge the figures of a case, whether it passes or not."""


def page(results: list[Result]) -> str:
    """The whole page."""
    failed = [r.id for r in results if r.missed]
    judged = [r for r in results if r.judged]
    cases = list(dict.fromkeys(r.id for r in results))
    passed = len(cases) - len(set(failed))
    parts = [
        "# Benchmarks",
        "This page is made by `surgebreak verify --json | python -m coupler.commands.verify.page`. Errors are shown "
        "with the processor time of the case; the quantities of a case come from one run, whose time is given with "
        "the first of them.",
        f"{_machine()}",
        f"{passed} of {len(cases)} cases pass, and {len(judged) - len(failed)} of {len(judged)} quantities are within "
        f"their limits; {len(results) - len(judged)} more are reported and not judged. All cases took "
        f"{sum(r.cpu_s for r in results):.0f} CPU s. A case passes if all of its quantities are within their limits.",
        _overview(results, cases),
        *(_case(id, [r for r in results if r.id == id]) for id in cases),
    ]
    if NOT_COVERED:
        parts += [
            "## Checks that are not covered",
            "\n".join(f"- {id}: {why}" for id, why in NOT_COVERED.items()),
        ]
    return "\n\n".join(parts) + "\n"


def _overview(results: list[Result], cases: list[str]) -> str:
    """One row per case: quantities within their limits, the largest error as a share of its limit, CPU time."""
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
    titles = "| case | subject | quantities within limits | largest error, share of its limit | CPU s |"
    return "\n".join([titles, "|---|---|--:|--:|--:|", *rows])


def _of_limit(r: Result) -> float:
    """Error as a share of its limit; 0 where the limit is zero and is met; infinite where there is no value."""
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
    missed = any(r.missed for r in results)
    told = [ALWAYS.get(id), NOTES.get(id) if missed else None]
    note = "".join(f"\n\n{text}" for text in told if text)
    head = "| quantity | value | expected | error | limit | | CPU s |\n|---|--:|--:|--:|--:|---|--:|"
    return f"## {id}: {case.title}\nCompared with: {case.source}.\n\n{head}\n{rows}{note}"


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
