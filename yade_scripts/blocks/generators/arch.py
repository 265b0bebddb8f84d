"""An arch of wedge-shaped blocks (voussoirs) on a circle, with or without the abutments that it springs from.

    R = (s²/4 + h²) / (2 h)      radius of the inner circle through span s and rise h
    sin φ = s / (2 R)            half the angle that the arch spans; 90° for the half circle, h = s/2

The joints are plane and point to the centre of the circle; inner and outer faces are its chords.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Array
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.polyhedra import BlockError


@dataclass(frozen=True)
class Arch:
    """foot (3,) [m]: middle of the span at the level of the springing, inner edge · span, rise [m] of the inner circle

    thickness [m] along the joints · width [m] across · count: number of voussoirs · along: "x" or "y", of the span
    abutment: (length, depth) [m] of two blocks that the arch springs from, None for no abutments; each reaches
    `depth` below the springing, and its upper face continues the joint.

    Raises BlockError for lengths that are not positive, a rise above half the span, fewer than two voussoirs, another
    name of `along`, or an abutment shorter than the seat of the arch.
    """

    name: str
    foot: Array
    span: float
    rise: float
    thickness: float
    width: float
    count: int
    along: str = "x"
    abutment: tuple[float, float] | None = None

    def __post_init__(self):
        for what in ("span", "rise", "thickness", "width"):
            if not getattr(self, what) > 0.0:
                raise BlockError(f"arch '{self.name}': {what} = {getattr(self, what)} m; it must be positive")
        if self.rise > 0.5 * self.span * (1.0 + 1e-12):
            raise BlockError(
                f"arch '{self.name}': rise = {self.rise} m of a span of {self.span} m; an arch of a circle rises by at "
                f"most half its span ({0.5 * self.span} m)"
            )
        if self.count < 2:
            raise BlockError(f"arch '{self.name}': count = {self.count}; an arch has at least two voussoirs")
        if self.along not in ("x", "y"):
            raise BlockError(f"arch '{self.name}': along = {self.along!r}; it must be 'x' or 'y'")
        seat = self.thickness * np.sin(self.half_angle)
        if self.abutment is not None and not (
            self.abutment[0] >= seat * (1.0 - 1e-9) and self.abutment[1] > 0.0
        ):
            raise BlockError(
                f"arch '{self.name}': abutment = {self.abutment} m; its length must be at least that of the seat "
                f"({seat:.4g} m) and its depth positive"
            )

    @property
    def radius(self) -> float:
        """R of the inner circle [m]."""
        return (0.25 * self.span**2 + self.rise**2) / (2.0 * self.rise)

    @property
    def half_angle(self) -> float:
        """φ between the crown and a springing [rad]."""
        return float(np.arccos(np.clip(1.0 - self.rise / self.radius, -1.0, 1.0)))


def arch_blocks(arch: Arch, **more) -> list[Block]:
    """Voussoirs NAME-0 .., from the side of the smaller coordinate; more: further fields of every Block."""
    angles = np.linspace(-arch.half_angle, arch.half_angle, arch.count + 1)
    rings = [
        np.stack([r * np.sin(angles), r * np.cos(angles) + arch.rise - arch.radius], axis=1)
        for r in (arch.radius, arch.radius + arch.thickness)
    ]
    return [
        _prism(
            arch,
            f"{arch.name}-{k}",
            np.array([rings[0][k], rings[0][k + 1], rings[1][k + 1], rings[1][k]]),
            **more,
        )
        for k in range(arch.count)
    ]


def abutment_blocks(arch: Arch, **more) -> list[Block]:
    """NAME-low and NAME-high, by their coordinate along the span; none without arch.abutment."""
    if arch.abutment is None:
        return []
    (length, depth), inner = arch.abutment, 0.5 * arch.span
    seat = arch.thickness * np.array([np.sin(arch.half_angle), np.cos(arch.half_angle)])
    outline = [
        (inner, -depth),
        (inner + length, -depth),
        (inner + length, seat[1]),
        (inner + seat[0], seat[1]),
        (inner, 0.0),
    ]
    corners = np.array(
        [p for p, q in zip(outline, outline[1:] + outline[:1]) if np.hypot(*np.subtract(p, q)) > 1e-9 * inner]
    )
    sides = {"low": corners[::-1] * [-1.0, 1.0], "high": corners}
    return [_prism(arch, f"{arch.name}-{side}", outline, **more) for side, outline in sides.items()]


def _prism(arch: Arch, name: str, outline: Array, **more) -> Block:
    """Block over a convex outline (k, 2) [m], given along the span and upwards, of the arch's width."""
    half = 0.5 * arch.width
    flat = [np.c_[outline[:, 0], np.full(len(outline), w), outline[:, 1]] for w in (-half, half)]
    corners = np.vstack(flat)
    if arch.along == "y":
        corners = corners[:, [1, 0, 2]] * [-1.0, 1.0, 1.0]
    return Block.standing(name, np.asarray(arch.foot, float) + corners, **more)
