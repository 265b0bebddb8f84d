"""The page docs/benchmarks.md out of results: `surgebreak verify --json | python -m coupler.verify.page`."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable

from coupler.provenance import machine, versions
from coupler.verify.registry import NOT_COVERED, Result, checks

NOTES = {
    "P05": "The contact nodes lie 1 % of the half size inside the edge (`node_radius`), so the base is that much "
    "narrower: atan(0.99 b/h) = 26.3°.",
    "P09": "The dashpot is tuned for a face and the whole mass; at a corner the effective mass is smaller and e comes "
    "out too large below 1.",
    "P10": "YADE's rotation of a body with three different inertias gains energy, 0.7 % in 6 s at 0.1 ms here, less "
    "in proportion to the substep.",
    "P33": "The projection with θ = 0.6 damps waves in proportion to the step.",
    "P36": "No gate and no bed friction: the front leads.",
    "P38": "The pressure after the impact lies well above the measured band, with cells of H/32 and in a taller tank "
    "too; the cause is not known.",
    "P39": "H3: highest surface over the gauge, splashes included.",
    "P41": "Measured between 5 and 11 depths from the gate; 0.018 m is two cells, and a run that differed by round-off "
    "gave 1.16 m/s there.",
    "P50": "Where the top of a box is less than half a cell above the water, its lift is up to 4 % short; half the "
    "cell puts it right.",
    "P51": "Linear elements underestimate the added mass of a cube with sharp edges: 13 % at a/6, 5.5 % at a/12, "
    "3.8 % at a/16. It is the same at every density ratio.",
    "P52": "The period is measured over few swings and moves by 1 to 2 % with the substep and the number of passes.",
}
"""What is known about cases that miss a tolerance."""


def page(results: list[Result]) -> str:
    """The whole page."""
    failed = [r.id for r in results if not r.passed]
    cases = list(dict.fromkeys(r.id for r in results))
    passed = len(cases) - len(set(failed))
    parts = [
        "# Benchmarks",
        "Made from `surgebreak verify --json | python -m coupler.verify.page`. Errors are shown with the processor "
        "time that the case took; the figures of a case come from one run, booked to the first of them.",
        f"{_machine()}",
        f"{passed} of {len(cases)} cases pass, {len(results) - len(failed)} of {len(results)} figures; "
        f"{sum(r.cpu_s for r in results):.0f} CPU s.",
        *(_case(id, [r for r in results if r.id == id]) for id in cases),
        "## Not covered",
        "\n".join(f"- {id}: {why}" for id, why in NOT_COVERED.items()),
    ]
    return "\n\n".join(parts) + "\n"


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
