"""Fragility curves of a sweep: the state that each run reached, curves with bands, and the reason where there is no
curve.

A run counts if it reached its end, if its structure could not stand at the start, or if it had reached the heaviest
state before it failed. Other failed runs are unknown, and their number is reported.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

from array_types import Array
from coupler.case.paths import BadPath, place_of
from coupler.case.records import NoSuchData, read_record
from coupler.case.sweep import DamageState, Fragility
from coupler.commands.sweep.fit import Fits, bootstrap, check, fit, separation
from coupler.commands.sweep.folder import Spec
from coupler.commands.sweep.results import FREE, Results
from coupler.program.quantities import as_said

POINTS = 121
"""Number of points of a curve."""
MOST_LEVELS = 20
"""Different intensities up to which each has a bar of its own; more are put into BARS."""
BARS = 10
LEAST_FOUND = 0.9
"""Share of the samples of a bootstrap that must have a fit, else their band would leave out the rest."""
CONVERGENCE = (0.125, 0.25, 0.5, 0.75, 1.0)
"""Shares of the runs for which the width of the band is reported."""
ORDERS = 5
"""Number of random orders of the runs over which the width is averaged."""
AGREES = 1e-2
"""Largest relative difference of β and θ from those of a second search."""


@dataclass(frozen=True)
class Runs:
    """x (n,): intensity · state (n,): 0 for none, k for the k-th · unknown, without, crossed: runs that failed before
    their state was known, that have no intensity, and whose lighter state is not reached"""

    x: Array
    state: Array
    unknown: int
    without: int
    crossed: int


def curves(spec: Spec, results: Results, f: Fragility) -> dict:
    """Everything about one table of [[sweep.fragility]], as plain data."""
    runs = read_runs(results, f)
    units = {c.name: c.unit for c in results.columns}
    column = next(c for c in results.columns if c.name == f.measure)
    result = {
        "name": f.name,
        "what": f.what,
        "measure": {"name": f.measure, "what": plain_meaning(column.meaning), "unit": column.unit},
        "confidence": f.confidence,
        "states": [
            {"name": s.name, "what": s.what or s.name, "rule": _rule(s, units[s.quantity])} for s in f.state
        ],
        "runs": len(runs.x),
        "unknown": runs.unknown,
        "without": runs.without,
        "crossed": runs.crossed,
        "bars": bars(runs, len(f.state), f.confidence),
        "refused": "",
        "left_out": [],
        "curves": [],
        "convergence": [],
        "exact": _exact(spec, f),
    }
    kept, left_out = usable(runs, [s.name for s in f.state])
    result["left_out"] = left_out
    drawn = bool(spec.sweep.seeds) or any(v.distribution for v in spec.sweep.vary)
    why = refusal(runs, kept, [s.name for s in f.state], drawn, column.unit)
    if why:
        return result | {"refused": why}
    state = _renumbered(runs.state, kept)
    best = fit(runs.x, state, len(kept))
    if not best.found[0] or best.slope[0] <= 0.0:
        return result | {"refused": _no_growth(best, f)}
    _agree(best, runs.x, state)
    seed = spec.sweep.seed
    samples = bootstrap(runs.x, state, len(kept), f.bootstrap, seed)
    return (
        result
        | _fitted(runs, f, kept, best, samples)
        | {
            "convergence": convergence(runs.x, state, len(kept), f, seed),
        }
    )


def plain_meaning(meaning: str) -> str:
    """The meaning of a column, without the keys it sets and its origin."""
    return meaning.partition(": sets")[0].removesuffix(FREE)


def read_runs(results: Results, f: Fragility) -> Runs:
    """Intensity and state of every run that has both."""
    x, state, unknown, without, crossed = [], [], 0, 0, 0
    for record in results.records:
        reached = [_reached(record, s) for s in f.state]
        if all(r is None for r in reached):
            unknown += record["outcome"] != "not yet"
            continue
        highest = max((k for k, r in enumerate(reached, start=1) if r), default=0)
        if highest < len(f.state) and any(r is None for r in reached[highest:]):
            unknown += 1
            continue
        intensity = record[f.measure]
        if not isinstance(intensity, int | float) or not math.isfinite(intensity) or intensity <= 0.0:
            without += 1
            continue
        crossed += any(r is False for r in reached[:highest])
        x.append(float(intensity))
        state.append(highest)
    return Runs(np.array(x), np.array(state, int), unknown, without, crossed)


def _reached(record: dict, s: DamageState) -> bool | None:
    """Whether a run reached a state; None where this is unknown."""
    outcome, value = record["outcome"], record[s.quantity]
    if outcome == "cannot stand":
        return True if s.cannot_stand else None
    if math.isfinite(value) and value >= s.at_least:
        return True
    return False if outcome == "done" and math.isfinite(value) else None


def _rule(s: DamageState, unit: str) -> str:
    return f"{s.quantity} ≥ {as_said(s.at_least, unit)}" + (
        ", or cannot stand at the start" if s.cannot_stand else ""
    )


def usable(runs: Runs, names: list[str]) -> tuple[list[int], list[str]]:
    """Numbers of the states that have a curve, and what is left out with the reason."""
    kept, out = [], []
    for k, name in enumerate(names, start=1):
        count = int((runs.state >= k).sum())
        heavier = int((runs.state >= k + 1).sum()) if k < len(names) else -1
        if count == 0:
            out.append(f"{name}: none of {len(runs.x)} runs reached it")
        elif count == len(runs.x):
            out.append(f"{name}: all of {len(runs.x)} runs reached it")
        elif count == heavier:
            out.append(f"{name}: every run that reached it reached {names[k]} too, so both have one curve")
        else:
            kept.append(k)
    return kept, out


def refusal(runs: Runs, kept: list[int], names: list[str], drawn: bool, unit: str) -> str:
    """Why no curve can be fitted; empty where one can. drawn: whether runs differ in more than the intensity, which is
    in `unit`."""
    if not kept:
        return "no state is reached by some of the runs and not by others; give intensities between"
    if len(np.unique(runs.x)) < 2:
        return "all runs have the same intensity; a curve needs several"
    parted = [(names[k - 1], separation(runs.x, runs.state >= k)) for k in kept]
    if all(gap is not None for _, gap in parted):
        name, (low, high) = parted[0]
        if low == high:
            at = as_said(low, unit)
            where = f"no run below {at} reached '{name}', every run above did, and of those at {at} some"
            more = "add runs at intensities around this one"
        else:
            ends = [as_said(x, unit) for x in (low, high)]
            below, above = ends if ends[0] != ends[1] else (f"{x:.7g} {unit}" for x in (low, high))
            where = f"no run up to {below} reached '{name}' and every run from {above} on did"
            more = "add runs between these two"
        why = f"perfectly separated: {where}, so the dispersion has no likelihood maximum (it would be 0)"
        if drawn:
            return f"{why}; {more}"
        return (
            f"{why}. Runs that differ in nothing but the intensity always are: draw strengths (sweep.vary with a "
            f"distribution, or joints.distribution with sweep.seeds), or {more}"
        )
    return ""


def _no_growth(best: Fits, f: Fragility) -> str:
    if best.found[0]:
        return f"the states become rarer with {f.measure}: it is no intensity of what breaks the structure"
    return "the likelihood has no maximum: the runs are separated but for a few"


def _renumbered(state: Array, kept: list[int]) -> Array:
    return np.searchsorted(np.array(kept), state, side="right")


def _agree(best: Fits, x: Array, state: Array) -> None:
    """Raises AssertionError where a second search (`check`) finds another curve: a mistake in the program."""
    dispersion, median = check(x, state, best.cut.shape[1])
    same = np.allclose([best.dispersion[0], *best.median[0]], [dispersion, *median], rtol=AGREES)
    assert same, f"fit {best.dispersion[0]}, {best.median[0]}; second search {dispersion}, {median}"


def _fitted(runs: Runs, f: Fragility, kept: list[int], best: Fits, samples: Fits) -> dict:
    """Curves with their bands; bands are refused where too many samples of the bootstrap have no fit."""
    low, high = runs.x.min(), runs.x.max()
    x = np.geomspace(low / (high / low) ** 0.1, high * (high / low) ** 0.1, POINTS)
    share, rising = float(samples.found.mean()), float(samples.rising.mean())
    banded = share >= LEAST_FOUND
    ends = 50.0 * (1.0 - f.confidence), 50.0 * (1.0 + f.confidence)
    found, p = [], best.probability(x)[0]
    good = Fits(samples.slope[samples.found], samples.cut[samples.found], samples.found[samples.found])
    bands = np.percentile(good.probability(x), ends, axis=0) if banded else None
    centred = rising >= LEAST_FOUND
    medians = np.percentile(samples.median[samples.rising], ends, axis=0) if centred else None
    for row, k in enumerate(kept):
        found.append(
            {
                "state": f.state[k - 1].name,
                "median": float(best.median[0, row]),
                "median_band": None if medians is None else medians[:, row].tolist(),
                "x": x.tolist(),
                "p": p[row].tolist(),
                "low": None if bands is None else bands[0, row].tolist(),
                "high": None if bands is None else bands[1, row].tolist(),
            }
        )
    beta = dispersion_band(samples, f.confidence) if banded else None
    why = "since too few runs lie where some reach a state and others do not; add runs there"
    note = ""
    if not banded:
        note = f"no bands: {1 - share:.0%} of the samples of the bootstrap have no fit, {why}"
    elif not centred:
        note = (
            f"no bands of medians: {1 - rising:.0%} of the samples of the bootstrap have no curve that rises with "
            f"{f.measure}, {why}"
        )
    return {
        "curves": found,
        "dispersion": float(best.dispersion[0]),
        "dispersion_band": beta,
        "found": share,
        "note": note,
    }


def dispersion_band(samples: Fits, confidence: float) -> list[float]:
    """Ends of the band of β = 1/b from those of the slope b. Samples that fall with the intensity (b < 0) lie beyond
    the flat one: where the band of b reaches to 0, that of β has no upper end."""
    tail = 50.0 * (1.0 - confidence)
    steep, flat = np.percentile(samples.slope[samples.found], [100.0 - tail, tail])
    return [float(1.0 / b) if b > 0.0 else math.inf for b in (steep, flat)]


def bars(runs: Runs, states: int, confidence: float) -> list[list[dict]]:
    """For each state the share of runs that reached it at each intensity, or in groups of them, with exact binomial
    intervals (Clopper and Pearson 1934)."""
    if not len(runs.x):
        return [[] for _ in range(states)]
    levels = np.unique(runs.x)
    if len(levels) <= MOST_LEVELS:
        groups = [runs.x == level for level in levels]
    else:
        groups = [np.isin(np.arange(len(runs.x)), part) for part in np.array_split(np.argsort(runs.x), BARS)]
    return [[_bar(runs, own, k, confidence) for own in groups] for k in range(1, states + 1)]


def _bar(runs: Runs, own: Array, k: int, confidence: float) -> dict:
    count, n = int((runs.state[own] >= k).sum()), int(own.sum())
    interval = binomtest(count, n).proportion_ci(confidence, method="exact")
    x = float(np.exp(np.log(runs.x[own]).mean()))
    return {"x": x, "count": count, "runs": n, "low": float(interval.low), "high": float(interval.high)}


def convergence(x: Array, state: Array, states: int, f: Fragility, seed: int) -> list[dict]:
    """Width of the band at the median of the first curve against the number of runs, over random orders of them."""
    rng = np.random.default_rng(seed + 1)
    orders = [rng.permutation(len(x)) for _ in range(ORDERS)]
    ends = 50.0 * (1.0 - f.confidence), 50.0 * (1.0 + f.confidence)
    rows = []
    for share in CONVERGENCE:
        n = round(share * len(x))
        widths = []
        for order in orders if share < 1.0 else orders[:1]:
            own = order[:n]
            found = bootstrap(x[own], state[own], states, max(100, f.bootstrap // 5), seed)
            if found.rising.mean() >= LEAST_FOUND:
                median = found.median[found.rising, 0]
                low, high = np.percentile(median, ends)
                widths.append(float(np.log(high / low)))
        if widths:
            rows.append(
                {"runs": n, "width": float(np.mean(widths)), "least": min(widths), "most": max(widths)}
            )
    return rows


def _exact(spec: Spec, f: Fragility) -> list[dict]:
    """Known probabilities from a file, a curve for each state that is a column of it. Raises NoSuchData."""
    if f.exact is None:
        return []
    try:
        table = read_record(Path(place_of(f.exact, spec.case_file.parent)))
    except BadPath as error:
        raise NoSuchData([f"sweep.fragility {f.name}: exact: {error}"]) from error
    wanted = [s.name for s in f.state if s.name in table]
    if f.measure not in table or not wanted:
        raise NoSuchData(
            [
                f"{f.exact}: needs the column '{f.measure}' and one for a state ({', '.join(s.name for s in f.state)})"
            ]
        )
    return [{"state": n, "x": table[f.measure].tolist(), "p": table[n].tolist()} for n in wanted]
