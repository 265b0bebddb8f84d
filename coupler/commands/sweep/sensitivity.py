"""The dependence of a result on the drawn quantities, with confidence intervals.

For samples of one set: partial rank correlations (Spearman's, after the ranks of the other quantities have been
removed by least squares; Helton and Davis, Reliab. Eng. Syst. Saf. 81 (2003) 23), with intervals by bootstrap. They
lie between -1 and 1 and measure how monotonic a dependence is. For pairs of sets (saltelli): Sobol indices of first
order and total, by scipy's estimators, with intervals by its bootstrap; they are shares of the variance.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import rankdata, sobol_indices

from array_types import Array
from coupler.commands.sweep.folder import Spec
from coupler.commands.sweep.results import Results

SAMPLES = 1000
"""Number of samples of a bootstrap."""
CONFIDENCE = 0.9
LEAST = 8
"""Number of runs in excess of the drawn quantities that rank correlations need."""


def sensitivities(spec: Spec, results: Results) -> list[dict]:
    """For every quantity of sweep.sensitivity: the method and a row for each drawn quantity, or why there is none."""
    return [_of(spec, results, name) for name in spec.sweep.sensitivity]


def _of(spec: Spec, results: Results, name: str) -> dict:
    drawn = [c.name for c in spec.columns if c.drawn]
    y = np.array(results.column(name), float)
    x = np.array([results.column(d) for d in drawn], float).T
    sobol = spec.sweep.sample == "saltelli"
    result = {
        "quantity": name,
        "how": "Sobol indices" if sobol else "partial rank correlations",
        "rows": [],
        "refused": "",
    }
    found = sobol_rows if sobol else rank_rows
    rows = found(x, y, drawn, spec)
    return result | ({"refused": rows} if isinstance(rows, str) else {"rows": rows})


def rank_rows(x: Array, y: Array, names: list[str], spec: Spec) -> list[dict] | str:
    """Partial rank correlations of y (n,) with the columns of x (n, d); NaN in y is left out."""
    there = np.isfinite(y)
    x, y = x[there], y[there]
    if len(y) < x.shape[1] + LEAST:
        return f"{len(y)} runs have a number; {x.shape[1] + LEAST} or more are needed"
    if np.ptp(y) == 0.0:
        return "it is the same in all runs"
    rng = np.random.default_rng(spec.sweep.seed)
    best = partial_ranks(x, y)
    drawn = [partial_ranks(x[own], y[own]) for own in rng.integers(0, len(y), (SAMPLES, len(y)))]
    low, high = np.nanpercentile(np.array(drawn), _ends(), axis=0)
    return [
        {"name": n, "value": float(v), "low": float(a), "high": float(b)}
        for n, v, a, b in zip(names, best, low, high)
    ]


def _ends() -> tuple[float, float]:
    return 50.0 * (1.0 - CONFIDENCE), 50.0 * (1.0 + CONFIDENCE)


def partial_ranks(x: Array, y: Array) -> Array:
    """(d,): for each column, the correlation between the residuals of its ranks and of the ranks of y after regression
    on the ranks of the other columns."""
    ranks = np.array([rankdata(column) for column in (*x.T, y)])
    inner = np.linalg.pinv(np.corrcoef(ranks))
    return -inner[-1, :-1] / np.sqrt(np.diag(inner)[:-1] * inner[-1, -1])


def sobol_rows(x: Array, y: Array, names: list[str], spec: Spec) -> list[dict] | str:
    """First-order and total indices from the rows A, B, AB_1 ... AB_d of the plan."""
    n, d = spec.sweep.samples, len(names)
    if len(y) != n * (d + 2) * spec.sweep.repeats or spec.sweep.repeats > 1:
        return "repeats do not go with Sobol indices: their scatter would count as that of the quantities"
    if not np.isfinite(y).all():
        return (
            f"{int((~np.isfinite(y)).sum())} of {len(y)} runs have no number; Sobol indices need all of them"
        )
    if np.ptp(y) == 0.0:
        return "it is the same in all runs"
    parts = y.reshape(d + 2, 1, n)
    func = {"f_A": parts[0], "f_B": parts[1], "f_AB": parts[2:]}
    found = sobol_indices(func=func, n=n)
    spread = found.bootstrap(confidence_level=CONFIDENCE, n_resamples=SAMPLES)
    return [
        {
            "name": name,
            "value": float(found.first_order.ravel()[k]),
            "low": float(spread.first_order.confidence_interval.low.ravel()[k]),
            "high": float(spread.first_order.confidence_interval.high.ravel()[k]),
            "total": float(found.total_order.ravel()[k]),
            "total_low": float(spread.total_order.confidence_interval.low.ravel()[k]),
            "total_high": float(spread.total_order.confidence_interval.high.ravel()[k]),
        }
        for k, name in enumerate(names)
    ]
