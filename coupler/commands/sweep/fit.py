"""Log-normal fragility curves by maximum likelihood: ordered probit on the logarithm of the intensity.

    P(state ≥ k | x) = Φ((ln x - ln θ_k)/β) = Φ(b ln x - c_k),    k = 1 ... K,   c_1 < c_2 < ... < c_K

with one dispersion β = 1/b of all states, so that curves do not cross (Charvet et al., Natural Hazards 73 (2014) 2073);
θ_k = exp(c_k/b) is the median. One state: the binomial likelihood of Baker, Earthquake Spectra 31 (2015) 579. The
likelihood is log-concave in b and c (Pratt, J. Am. Stat. Assoc. 76 (1981) 103), so Newton's method with shorter steps
finds its one maximum. Many sets of weights are solved at once: statsmodels, which a test compares with, takes some
ten times as long for the thousand samples of a band. `check` seeks the maximum of one set another way in every sweep.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.special import log_ndtr, ndtr, ndtri

from array_types import Array

MOST_ITERATIONS = 60
MOST_HALVINGS = 30
ENOUGH = 1e-10
"""Increase of the log-likelihood in a step, over the number of runs, below which the maximum counts as found."""


@dataclass(frozen=True)
class Fits:
    """slope b (s,) · cut c (s, K) of ln x · found (s,) bool: whether a finite maximum was found"""

    slope: Array
    cut: Array
    found: Array

    @property
    def rising(self) -> Array:
        """(s,) bool: whether there is a fit in which states become more probable with the intensity; only then are
        dispersion and median those of a curve."""
        return self.found & (self.slope > 0.0)

    @property
    def dispersion(self) -> Array:
        """β (s,); not finite where there is no fit"""
        with np.errstate(all="ignore"):
            return 1.0 / self.slope

    @property
    def median(self) -> Array:
        """θ (s, K), in the unit of the intensity; not finite where there is no fit"""
        with np.errstate(all="ignore"):
            return np.exp(self.cut / self.slope[:, None])

    def probability(self, x: Array) -> Array:
        """P(state ≥ k | x) (s, K, len(x)) at intensities x (n,)."""
        return ndtr(self.slope[:, None, None] * np.log(x) - self.cut[:, :, None])


def fit(x: Array, state: Array, states: int, weight: Array | None = None) -> Fits:
    """Fits of runs with intensity x (n,) > 0 and state (n,) in 0 ... states, for each row of weight (s, n).

    weight: how often each run counts; absent: once, s = 1. A set in which some state is reached by no run or by all
    of them, or whose runs are separated, has no maximum: its `found` is False.
    """
    weight = np.ones((1, len(x))) if weight is None else np.asarray(weight, float)
    logs = np.log(x)
    middle, spread = logs.mean(), logs.std()
    if spread == 0.0:
        return _none(len(weight), states)
    z, y, w = _grouped((logs - middle) / spread, np.asarray(state), weight)
    total = w.sum(axis=1)
    share = np.stack([(w * (y >= k)).sum(axis=1) / total for k in range(1, states + 1)], axis=1)
    usable = (share > 0.0).all(axis=1) & (share < 1.0).all(axis=1)
    usable &= (np.diff(share, axis=1) < 0.0).all(axis=1) & _overlap(z, y, w, states)
    theta = np.concatenate([np.zeros((len(w), 1)), -ndtri(np.clip(share, 1e-9, 1 - 1e-9))], axis=1)
    found = usable.copy()
    theta[usable], found[usable] = _newton(theta[usable], z, y, w[usable], total[usable])
    slope = theta[:, 0] / spread
    cut = theta[:, 1:] + (slope * middle)[:, None]
    return Fits(slope, cut, found)


def _none(sets: int, states: int) -> Fits:
    return Fits(np.full(sets, np.nan), np.full((sets, states), np.nan), np.zeros(sets, bool))


def _grouped(z: Array, y: Array, weight: Array) -> tuple[Array, Array, Array]:
    """Merge runs of the same intensity and state into one weighted run."""
    pairs, group = np.unique(np.stack([z, y]), axis=1, return_inverse=True)
    columns = np.zeros((len(weight), pairs.shape[1]))
    for k in range(pairs.shape[1]):
        columns[:, k] = weight[:, group == k].sum(axis=1)
    return pairs[0], pairs[1].astype(int), columns


def _overlap(z: Array, y: Array, w: Array, states: int) -> Array:
    """Sets (s,) bool in which some run that reached a state has a smaller intensity than one that did not; otherwise
    the likelihood increases with b without bound."""
    found = np.zeros(len(w), bool)
    for k in range(1, states + 1):
        below = np.where((w > 0.0) & (y < k), z, -np.inf).max(axis=1)
        above = np.where((w > 0.0) & (y >= k), z, np.inf).min(axis=1)
        found |= below > above
    return found


def _newton(theta: Array, z: Array, y: Array, w: Array, total: Array) -> tuple[Array, Array]:
    """The maxima (s, 1 + K) from starts theta, and whether each was found."""
    value = _likelihood(theta, z, y, w)
    open_ = np.ones(len(theta), bool)
    found = np.zeros(len(theta), bool)
    for _ in range(MOST_ITERATIONS):
        if not open_.any():
            break
        now, old = theta[open_], value[open_]
        gradient, hessian = _derivatives(now, z, y, w[open_])
        hessian -= 1e-12 * total[open_, None, None] * np.eye(theta.shape[1])
        step = -np.linalg.solve(hessian, gradient[:, :, None])[:, :, 0]
        share = np.ones(len(now))
        for _ in range(MOST_HALVINGS):
            trial = now + share[:, None] * step
            reached = _likelihood(trial, z, y, w[open_])
            worse = ~(reached >= old - 1e-12 * total[open_])
            if not worse.any():
                break
            share[worse] *= 0.5
        gain = np.einsum("si,si->s", gradient, step)
        theta[open_], value[open_] = trial, reached
        done = (gain < ENOUGH * total[open_]) & ~worse
        rows = np.flatnonzero(open_)
        found[rows[done]] = True
        open_[rows[done]] = False
    return theta, found


def _ends(theta: Array, z: Array, y: Array) -> tuple[Array, Array]:
    """Arguments u > v (s, m) of P(y) = Φ(u) - Φ(v): b z - c_y and b z - c_{y+1}; infinite at the ends."""
    sets = len(theta)
    cuts = np.concatenate([np.full((sets, 1), -np.inf), theta[:, 1:], np.full((sets, 1), np.inf)], axis=1)
    line = theta[:, :1] * z
    return line - cuts[:, y], line - cuts[:, y + 1]


def _log_probability(u: Array, v: Array) -> Array:
    """ln(Φ(u) - Φ(v)), in the tail where both are small; NaN where u < v."""
    swap = v > 0.0  # Φ(u) - Φ(v) = Φ(-v) - Φ(-u)
    high, low = np.where(swap, -v, u), np.where(swap, -u, v)
    with np.errstate(all="ignore"):
        first, second = log_ndtr(high), log_ndtr(low)
        return np.where(u > v, first + np.log1p(-np.exp(second - first)), np.nan)


def _likelihood(theta: Array, z: Array, y: Array, w: Array) -> Array:
    """Of each set (s,); NaN where cuts are out of order."""
    return (w * _log_probability(*_ends(theta, z, y))).sum(axis=1)


def _derivatives(theta: Array, z: Array, y: Array, w: Array) -> tuple[Array, Array]:
    """Gradient (s, 1 + K) and Hessian (s, 1 + K, 1 + K) of the log-likelihood."""
    u, v = _ends(theta, z, y)
    p = _log_probability(u, v)
    with np.errstate(all="ignore"):
        ru, rv = np.exp(-0.5 * u**2 - p), np.exp(-0.5 * v**2 - p)
        ru, rv = ru / np.sqrt(2 * np.pi), rv / np.sqrt(2 * np.pi)
        uu = np.where(np.isfinite(u), u, 0.0) * ru  # -φ'(u)/P
        vv = np.where(np.isfinite(v), v, 0.0) * rv
    sets, size = theta.shape
    gradient, hessian = np.zeros((sets, size)), np.zeros((sets, size, size))
    # d ln P/du = ru, d ln P/dv = -rv; second: -uu - ru², vv - rv², ru rv
    huu, hvv, huv = -uu - ru**2, vv - rv**2, ru * rv
    gradient[:, 0] = (w * (ru - rv) * z).sum(axis=1)
    hessian[:, 0, 0] = (w * (huu + 2 * huv + hvv) * z**2).sum(axis=1)
    for k in range(1, size):
        own, above = y == k, y + 1 == k  # where c_k is in u, and in v
        gradient[:, k] = -(w * ru)[:, own].sum(axis=1) + (w * rv)[:, above].sum(axis=1)
        mixed = -((w * (huu + huv) * z)[:, own].sum(axis=1) + (w * (hvv + huv) * z)[:, above].sum(axis=1))
        hessian[:, 0, k] = hessian[:, k, 0] = mixed
        hessian[:, k, k] = (w * huu)[:, own].sum(axis=1) + (w * hvv)[:, above].sum(axis=1)
        if k + 1 < size:
            between = (w * huv)[:, own].sum(axis=1)
            hessian[:, k, k + 1] = hessian[:, k + 1, k] = between
    return gradient, hessian


def bootstrap(x: Array, state: Array, states: int, samples: int, seed: int) -> Fits:
    """Fits of samples drawn from the runs, each as many as there are runs, with replacement."""
    rng = np.random.default_rng(seed)
    n = len(x)
    weight = rng.multinomial(n, np.full(n, 1.0 / n), size=samples)
    return fit(x, state, states, weight)


def separation(x: Array, reached: Array) -> tuple[float, float] | None:
    """The intensities between which the runs change from not reaching a state to reaching it, if they are perfectly
    separated; None where they overlap. reached (n,) bool contains both values."""
    low, high = x[~reached].max(), x[reached].min()
    return (float(low), float(high)) if low <= high else None


def check(x: Array, state: Array, states: int) -> tuple[float, Array]:
    """β and θ (K,) by another way than `fit`: the shares P(state = k) as differences of the curves, whose logarithms a
    search without derivatives (Nelder and Mead, scipy) adds up and maximises over ln β, ln θ_1 and the gaps of ln θ."""
    logs = np.log(x)

    def curves(p: Array) -> tuple[float, Array]:
        return np.exp(p[0]), p[1] + np.concatenate([[0.0], np.cumsum(np.exp(p[2:]))])

    def unlikely(p: Array) -> float:
        beta, medians = curves(p)
        reached = ndtr((logs - medians[:, None]) / beta)
        between = -np.diff(reached, axis=0, prepend=1.0, append=0.0)
        return -float(np.log(np.maximum(between[state, np.arange(len(x))], 1e-300)).sum())

    start = np.array([np.log(logs.std()), logs.mean(), *[np.log(logs.std())] * (states - 1)])
    for _ in range(2):  # a search that starts again where it ended leaves a simplex that has shrunk too early
        options = {"xatol": 1e-9, "fatol": 1e-12, "maxiter": 20000, "maxfev": 20000}
        start = minimize(unlikely, start, method="Nelder-Mead", options=options).x
    beta, medians = curves(start)
    return float(beta), np.exp(medians)
