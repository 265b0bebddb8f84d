"""Convex parts divided into blocks of a size along their own directions, in line or in a running bond."""

from __future__ import annotations

import math

import numpy as np

from array_types import Array
from coupler.geometry.drawing.convex_parts import ROUND_OFF, Part, directions


def divided(body, part: Part, size: tuple[float, float], bond: str) -> list[Part]:
    """A convex part in equal pieces; body: it as a manifold3d.Manifold.

    size [m]: wanted length of a block along the part and its height across that; across its thickness it is one
    block, or as many as come nearest to the length. bond: 'stack' or 'running', every other course by half a block.
    """
    axes = directions(part.corners)
    span = np.ptp(part.corners @ axes.T, axis=0)
    count = _counts(span, size)
    if count == [1, 1, 1]:
        return [part]
    low = (part.corners @ axes.T).min(axis=0)
    found = []
    for k, course in enumerate(_sliced(body, axes[2], low[2], _cuts(span[2], count[2]))):
        shifted = bond == "running" and k % 2 == 1
        for wythe in _sliced(course, axes[0], low[0], _cuts(span[0], count[0])):
            found += _sliced(wythe, axes[1], low[1], _cuts(span[1], count[1], shifted))
    return [_as_part(piece) for piece in found]


def how_many(part: Part, size: tuple[float, float]) -> int:
    """Approximate number of pieces into which `divided` would cut a part."""
    return math.prod(_counts(np.ptp(part.corners @ directions(part.corners).T, axis=0), size))


def _counts(span: Array, size: tuple[float, float]) -> list[int]:
    return [_pieces(span[0], size[0]), _pieces(span[1], size[0]), _pieces(span[2], size[1])]


def _pieces(length: float, size: float) -> int:
    """The whole number of pieces whose size comes nearest."""
    return max(1, round(length / size - ROUND_OFF))


def _cuts(length: float, count: int, shifted: bool = False) -> Array:
    """Places of the cuts between equal pieces; shifted: by half a piece, with half a piece at either end."""
    step = length / count
    return step * (np.arange(count) + 0.5) if shifted else step * np.arange(1, count)


def _sliced(body, axis: Array, low: float, cuts: Array) -> list:
    """The body cut across an axis at low + cuts, from the low end to the high one; empty pieces are left out."""
    found, rest = [], body
    for cut in cuts:
        rest, piece = rest.split_by_plane(axis.tolist(), float(low + cut))
        found.append(piece)
    return [piece for piece in [*found, rest] if not piece.is_empty()]


def _as_part(piece) -> Part:
    from coupler.geometry.drawing.convex_parts import mesh_of

    return Part(mesh_of(piece)[0], piece.volume())
