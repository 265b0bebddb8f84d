"""Random draws for one scene: the same seed and number give the same draws on every machine."""

from __future__ import annotations

import math

import numpy as np

DIGITS = 6
"""Significant digits of drawn numbers: case files that people can read."""


class Dice:
    """Random numbers of scene `number` of `seed`, both ≥ 0; another stream leaves the first as it is."""

    def __init__(self, seed: int, number: int, *stream: int):
        self._rng = np.random.Generator(np.random.PCG64([seed, number, *stream]))

    def chance(self, share: float) -> bool:
        """True with the probability `share`."""
        return bool(self._rng.random() < share)

    def between(self, low: float, high: float) -> float:
        """Uniform in [low, high)."""
        return low + (high - low) * float(self._rng.random())

    def decades(self, low: float, high: float) -> float:
        """Uniform in the logarithm, both above 0."""
        return rounded(math.exp(self.between(math.log(low), math.log(high))))

    def whole(self, low: int, high: int) -> int:
        """A whole number from low to high, both included."""
        return int(self._rng.integers(low, high + 1))

    def one(self, choices):
        """One of the choices; a dict gives the weight of each."""
        if not isinstance(choices, dict):
            return choices[self.whole(0, len(choices) - 1)]
        place = self.between(0.0, sum(choices.values()))
        for choice, weight in choices.items():
            place -= weight
            if place < 0.0:
                return choice
        return choice

    def some(self, choices, share: float) -> list:
        """Each of the choices with the probability `share`."""
        return [choice for choice in choices if self.chance(share)]

    def direction(self) -> list[float]:
        """A unit vector (3,), uniformly distributed over directions."""
        vector = self._rng.standard_normal(3)
        return [rounded(x) for x in vector / np.linalg.norm(vector)]


def rounded(value: float, digits: int = DIGITS) -> float:
    """A number rounded to that many significant digits."""
    return float(f"{value:.{digits}g}")
