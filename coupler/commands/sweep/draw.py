"""Samples of distributions: points of the unit cube (Latin hypercube, Sobol, random), then the inverse of each F.

normal       F^-1(u) = mean + deviation Phi^-1(u)
lognormal    median exp(dispersion Phi^-1(u));  of mean m and variation c: dispersion² = ln(1 + c²),
             median = m/sqrt(1 + c²)
weibull      scale (-ln(1 - u))^(1/shape);      of mean m and variation c: shape from
             c² = Γ(1 + 2/k)/Γ(1 + 1/k)² - 1,  scale = m/Γ(1 + 1/k)
cut off      F^-1(F(lower) + u (F(upper) - F(lower)))
whole        uniform: each whole number from low to high has the same probability; others are rounded
"""

from __future__ import annotations

import hashlib
import json
import warnings

import numpy as np
from scipy import stats
from scipy.optimize import brentq
from scipy.special import gammaln
from scipy.stats import qmc

from array_types import Array


def seed_of(*what: object) -> int:
    """A whole number below 2^31 that depends on the arguments alone and is the same on every machine."""
    text = json.dumps(what, sort_keys=True, default=float).encode()
    return int.from_bytes(hashlib.blake2b(text, digest_size=8).digest()) >> 33


def cube(sample: str, samples: int, dimensions: int, seed: int) -> Array:
    """Points (samples, dimensions) of the open unit cube; of saltelli (samples (2 + dimensions), dimensions).

    With sobol and random the first points stay the same when there are to be more."""
    if dimensions == 0:
        return np.zeros((samples, 0))
    if sample == "saltelli":
        return _saltelli(_inside(_sobol(samples, 2 * dimensions, seed)))
    if sample == "sobol":
        return _inside(_sobol(samples, dimensions, seed))
    rng = np.random.default_rng(seed)
    if sample == "random":
        return _inside(rng.random((samples, dimensions)))
    return _inside(qmc.LatinHypercube(dimensions, rng=rng).random(samples))


def _sobol(samples: int, dimensions: int, seed: int) -> Array:
    with warnings.catch_warnings():  # of a number that is no power of two; the plan tells it
        warnings.simplefilter("ignore", UserWarning)
        return qmc.Sobol(dimensions, rng=np.random.default_rng(seed)).random(samples)


def _inside(points: Array) -> Array:
    """Points moved off 0 and 1, where unbounded distributions are infinite."""
    tiny = np.finfo(float).eps
    return np.clip(points, tiny, 1.0 - tiny)


def _saltelli(pairs: Array) -> Array:
    """A, B, and for each dimension A with that column of B, one below the other (Saltelli et al. 2010)."""
    dimensions = pairs.shape[1] // 2
    a, b = pairs[:, :dimensions], pairs[:, dimensions:]
    mixed = [np.where(np.arange(dimensions) == i, b, a) for i in range(dimensions)]
    return np.concatenate([a, b, *mixed])


def distribution(kind: str, given: dict[str, float]):
    """The frozen distribution of scipy; given: its pair of numbers in SI. Raises ValueError for
    parameters that make no distribution."""
    if kind == "uniform":
        if not given["low"] < given["high"]:
            raise ValueError(f"low = {given['low']:g} is not below high = {given['high']:g}")
        return stats.uniform(given["low"], given["high"] - given["low"])
    if kind == "normal":
        deviation = given["deviation"] if "deviation" in given else given["variation"] * abs(given["mean"])
        _positive("deviation", deviation)
        return stats.norm(given["mean"], deviation)
    if kind == "lognormal":
        median, dispersion = given.get("median"), given.get("dispersion")
        if median is None:
            _positive("mean", given["mean"])
            dispersion = np.sqrt(np.log1p(given["variation"] ** 2))
            median = given["mean"] / np.sqrt(1.0 + given["variation"] ** 2)
        _positive("median", median)
        return stats.lognorm(dispersion, scale=median)
    scale, shape = given.get("scale"), given.get("shape")
    if scale is None:
        _positive("mean", given["mean"])
        shape = weibull_shape(given["variation"])
        scale = given["mean"] / np.exp(gammaln(1.0 + 1.0 / shape))
    _positive("scale", scale)
    return stats.weibull_min(shape, scale=scale)


def whole_numbers(given: dict[str, float], lower: float | None, upper: float | None):
    """The frozen distribution of scipy in which every whole number of a uniform one, cut off at lower and upper, is
    equally likely. Raises ValueError where there is none."""
    ends = (
        max(given["low"], -np.inf if lower is None else lower),
        min(given["high"], np.inf if upper is None else upper),
    )
    low, high = (float(f"{end:.12g}") for end in ends)  # 600 cm are 6 m
    first, last = int(np.ceil(low)), int(np.floor(high))
    if first > last:
        raise ValueError(f"there is no whole number from {low:g} to {high:g}")
    return stats.randint(first, last + 1)


def weibull_shape(variation: float) -> float:
    """The exponent at which the standard deviation is this share of the mean. Raises ValueError."""

    def over(k: float) -> float:
        return gammaln(1.0 + 2.0 / k) - 2.0 * gammaln(1.0 + 1.0 / k) - np.log1p(variation**2)

    low, high = 0.05, 2e4
    if not over(low) > 0.0 > over(high):
        raise ValueError(f"variation = {variation:g}: a Weibull distribution has 0.0001 to 1000")
    return float(brentq(over, low, high, rtol=1e-13))


def _positive(name: str, value: float) -> None:
    if not value > 0.0:
        raise ValueError(f"{name} = {value:g} is not above 0")


def quantiles(frozen, u: Array, lower: float | None = None, upper: float | None = None) -> Array:
    """Values (n,) at the shares u (n,) of a distribution that may be cut off. Raises ValueError where nothing is
    left of it."""
    first = 0.0 if lower is None else frozen.cdf(lower)
    last = 1.0 if upper is None else frozen.cdf(upper)
    if not last - first > 1e-9:
        raise ValueError(f"between lower and upper are {max(last - first, 0.0):.2g} of the distribution")
    return frozen.ppf(first + u * (last - first))
