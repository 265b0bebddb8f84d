"""Which touching faces are joined and by which law: one for all, others between chosen pairs, with random strengths.

The strength of each joint is T_max f, with f of mean 1 and coefficient of variation c drawn in the order of the joints:

    Weibull      f = (-ln u)^(1/m) / Γ(1 + 1/m),   c² = Γ(1 + 2/m)/Γ(1 + 1/m)² - 1      (Weibull, J. Appl. Mech. 18
    (1951) 293) log-normal   f = exp(s z - s²/2),              s² = ln(1 + c²)

The opening at failure is not scaled, so stiffness and work of separation are proportional to the strength.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from scipy.optimize import brentq

from array_types import Array
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import FixedPlane, TouchingFaces
from yade_scripts.joints.cohesion import JointParameterError, JointParameters

MOST_KINDS = 6
"""Strengths that are listed one by one."""
LEAST = 1e-3
"""Smallest coefficient of variation: below it strengths are equal."""


@dataclass(frozen=True)
class PairJoints:
    """The joints between what is called `a` and what is called `b` (names, groups or materials of blocks; names or
    materials of planes); parameters None: none."""

    a: str
    b: str
    parameters: JointParameters | None


@dataclass(frozen=True)
class Scatter:
    """distribution · variation: standard deviation over mean of the strengths · seed: the same one gives the same
    strengths."""

    distribution: Literal["weibull", "lognormal"]
    variation: float
    seed: int = 1

    def __post_init__(self):
        if self.distribution not in ("weibull", "lognormal"):
            raise JointParameterError(
                f"joints.distribution = '{self.distribution}'; it must be 'weibull' or 'lognormal'"
            )
        if not LEAST <= self.variation <= 1.0:
            raise JointParameterError(f"joints.variation = {self.variation}; it must lie in {LEAST} to 1")

    def factors(self, count: int) -> Array:
        """f (count,) of mean 1."""
        random = np.random.default_rng(self.seed)
        if self.distribution == "lognormal":
            s = math.sqrt(math.log1p(self.variation**2))
            return np.array([math.exp(s * z - 0.5 * s * s) for z in random.standard_normal(count)])
        m = weibull_modulus(self.variation)
        mean = math.gamma(1.0 + 1.0 / m)
        return np.array([(-math.log1p(-u)) ** (1.0 / m) / mean for u in random.random(count)])


def weibull_modulus(variation: float) -> float:
    """m of a Weibull distribution whose standard deviation is `variation` of its mean, LEAST to 1."""

    def excess(m: float) -> float:
        return math.gamma(1.0 + 2.0 / m) / math.gamma(1.0 + 1.0 / m) ** 2 - 1.0 - variation**2

    return float(brentq(excess, 0.9, 2.0 / LEAST))


@dataclass(frozen=True)
class JointRules:
    """everywhere: the law where no pair says otherwise · pairs: of several that fit, the last counts · called: more
    names of blocks for the pairs, such as that of their building, by the names of the blocks."""

    everywhere: JointParameters
    pairs: tuple[PairJoints, ...] = ()
    scatter: Scatter | None = None
    called: Mapping[str, Collection[str]] = field(default_factory=dict, hash=False)

    @property
    def plain(self) -> bool:
        """Whether all joints have the same law."""
        return not self.pairs and self.scatter is None

    def of_faces(
        self, faces: list[TouchingFaces], blocks: list[Block], planes: list[FixedPlane]
    ) -> list[JointParameters | None]:
        """The law of each pair of faces before strengths scatter, None: no joint."""
        block_names = [{b.name, b.group, b.material, *self.called.get(b.name, ())} for b in blocks]
        plane_names = [{p.name, p.material} for p in planes]
        found = []
        for face in faces:
            ends = block_names[face.a], block_names[face.b] if face.b >= 0 else plane_names[-1 - face.b]
            fitting = [pair.parameters for pair in self.pairs if _fits(pair, *ends)]
            law = fitting[-1] if fitting else self.everywhere
            on_plane = face.b < 0 and not self.everywhere.ground and not fitting
            found.append(None if on_plane else law)
        return found

    def scattered(self, laws: list[JointParameters]) -> list[JointParameters]:
        """The same with a strength for each joint."""
        if self.scatter is None:
            return laws
        factors = self.scatter.factors(len(laws)).tolist()
        return [replace(law, strength=f * law.strength) for law, f in zip(laws, factors)]

    def described(self, laws: list[JointParameters]) -> str:
        """A description in one line."""
        text = self.everywhere.described()
        if self.pairs:
            other = sum(law != self.everywhere for law in laws)
            text += f"; {other} of {len(laws)} joints by joints.pair or a preset" if other else ""
            kinds = Counter((law.strength, law.opening_at_failure) for law in laws)
            if self.scatter is None and len(kinds) <= MOST_KINDS:
                listed = (
                    f"{n} of {t / 1e6:.4g} MPa and {1e3 * d:.3g} mm" for (t, d), n in kinds.most_common()
                )
                text += f"; joints: {', '.join(listed)}"
        if self.scatter is not None:
            s = self.scatter
            text += f"; strengths {s.distribution}, {s.variation:g} of their mean, seed {s.seed}"
        return text


def _fits(pair: PairJoints, one: set, other: set) -> bool:
    return (pair.a in one and pair.b in other) or (pair.b in one and pair.a in other)
