"""A building over a footprint of any shape without holes: walls as rings of convex strips, slabs of convex pieces.

Each edge of the outline has a wall of thickness t on its inner side; two walls meet on the mitre of their corner. A
wall is cut across into blocks: quadrilaterals in plan, which share whole faces.  A slab is cut along lines through the
corners of the outline, in the frame of its longest edge, and evenly between them: all pieces of a footprint with right
angles are rectangles.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from array_types import Array
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.generators.cuts import check_count, equal_cuts, pieces
from yade_scripts.blocks.polyhedra import BlockError

SLIVER = 0.01
"""Share of a block's plan below which a piece of a slab beside a slanting edge is left out."""
SAME = 1e-6
"""Share of a block's edge within which two cuts are merged."""
STRAIGHT = 1e-9
"""Share of the square of an edge below which three points lie on a line."""


@dataclass(frozen=True)
class Ring:
    """outline (k, 2) [m], counter-clockwise, without double points · base, height [m] · thickness, block, course [m] as
    of `building.Building`, floor_thickness [m] of slabs · storeys · roof: slab on top · density [kg/m³] · material"""

    outline: Array
    base: float
    height: float
    thickness: float
    block: float
    course: float
    floor_thickness: float
    storeys: int = 1
    roof: bool = True
    density: float = 2400.0
    name: str = "building"
    material: str = "block"


def ring_blocks(r: Ring) -> list[Block]:
    """Walls NAME-wall0n0 (storey, edge), floors and roof.

    Raises BlockError for a footprint without room between its walls."""
    storey = r.height / r.storeys
    if storey <= r.floor_thickness:
        raise BlockError(
            f"building '{r.name}': {r.storeys} storeys in {r.height:g} m leave no wall between slabs of "
            f"{r.floor_thickness:g} m"
        )
    inner, floor = _inner(r), convex_pieces(r.outline, r.block, r.name)
    length = np.linalg.norm(np.roll(r.outline, -1, axis=0) - r.outline, axis=1)
    across = sum(pieces(a, r.block) for a in length)
    check_count(r.name, r.storeys * (across * pieces(storey, r.course) + len(floor)))
    more = {"density": r.density, "material": r.material}
    found = []
    for k in range(r.storeys):
        foot, top = r.base + k * storey, r.base + (k + 1) * storey
        has_slab = r.roof or k < r.storeys - 1
        head = top - (r.floor_thickness if has_slab else 0.0)
        courses = equal_cuts(foot, head, r.course)
        for name, plan in _wall_plans(r, inner, k):
            for c, (low, high) in enumerate(pairwise(courses)):
                found.append(_prism(f"{name}-{c}", plan, low, high, group="wall", **more))
        if has_slab:
            kind = "roof" if k == r.storeys - 1 else "floor"
            for n, plan in enumerate(floor):
                found.append(_prism(f"{r.name}-{kind}{k}-{n}", plan, head, top, group=kind, **more))
    return found


def _wall_plans(r: Ring, inner: Array, storey: int) -> Iterator[tuple[str, Array]]:
    """Names and plans (4, 2) [m] of the blocks of a course."""
    for e in range(len(r.outline)):
        f = (e + 1) % len(r.outline)
        length = float(np.linalg.norm(r.outline[f] - r.outline[e]))
        share = np.linspace(0.0, 1.0, int(pieces(length, r.block)) + 1)[:, None]
        outside = (1 - share) * r.outline[e] + share * r.outline[f]
        inside = (1 - share) * inner[e] + share * inner[f]
        for n in range(len(share) - 1):
            plan = np.array([outside[n], outside[n + 1], inside[n + 1], inside[n]])
            yield f"{r.name}-wall{storey}n{e}-{n}", plan


def _inner(r: Ring) -> Array:
    """Corners (k, 2) [m] of the inner side of the walls: the intersections of the lines at t inside the edges."""
    p, t = r.outline, r.thickness
    along = np.roll(p, -1, axis=0) - p
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    before = np.roll(along, 1, axis=0)
    left = np.column_stack([-along[:, 1], along[:, 0]])
    sine = before[:, 0] * along[:, 1] - before[:, 1] * along[:, 0]
    cosine = np.einsum("ij,ij->i", before, along)
    # the corner moves t to the left of both edges: t (left + along tan(half of the turn))
    inner = p + t * (left + along * (sine / np.maximum(1.0 + cosine, 1e-12))[:, None])
    edge = np.einsum("ij,ij->i", np.roll(inner, -1, axis=0) - inner, along)
    if (edge <= 0.1 * t).any():
        x, y = p[int(edge.argmin())]
        raise BlockError(
            f"building '{r.name}': no room between walls of {t:g} m at the edge from ({x:.5g}, {y:.5g}) m; take "
            "thinner walls, or a footprint without such short edges"
        )
    return inner


def convex_pieces(outline: Array, block: float, name: str) -> list[Array]:
    """A polygon (k, 2), counter-clockwise, cut into convex pieces about `block` long. Raises BlockError."""
    edges = np.roll(outline, -1, axis=0) - outline
    longest = edges[int(np.linalg.norm(edges, axis=1).argmax())]
    c, s = longest / np.linalg.norm(longest)
    turn = np.array([[c, s], [-s, c]])
    p = outline @ turn.T
    cuts = [_cuts(p[:, axis], block) for axis in (0, 1)]
    check_count(name, float(len(cuts[0]) * len(cuts[1])))
    found = []
    for i in range(len(cuts[0]) - 1):
        strip = _clipped(_clipped(p, 0, cuts[0][i], 1.0), 0, cuts[0][i + 1], -1.0)
        for j in range(len(cuts[1]) - 1):
            piece = _clean(_clipped(_clipped(strip, 1, cuts[1][j], 1.0), 1, cuts[1][j + 1], -1.0), block)
            if len(piece) < 3 or _area(piece) < SLIVER * block**2:
                continue
            if not _is_convex(piece):
                x, y = piece.mean(axis=0) @ turn
                raise BlockError(
                    f"building '{name}': its footprint is too intricate at ({x:.5g}, {y:.5g}) m to be cut into convex "
                    "pieces; simplify it, or take smaller blocks"
                )
            found.append(piece @ turn)
    return found


def _cuts(values: Array, block: float) -> Array:
    """Coordinates of the corners, and equal pieces between them."""
    ends = np.sort(values)
    ends = ends[np.concatenate([[True], np.diff(ends) > SAME * block])]
    return np.unique(np.concatenate([equal_cuts(a, b, block) for a, b in pairwise(ends)]))


def _clipped(polygon: Array, axis: int, value: float, sign: float) -> Array:
    """The part of a polygon (k, 2) with sign (x_axis - value) ≥ 0 (Sutherland and Hodgman 1974)."""
    out = []
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0)):
        da, db = sign * (a[axis] - value), sign * (b[axis] - value)
        if da >= 0.0:
            out.append(a)
        if (da > 0.0 > db) or (da < 0.0 < db):
            out.append(a + (b - a) * da / (da - db))
    return np.array(out).reshape(-1, 2)


def _clean(polygon: Array, block: float) -> Array:
    """The polygon without double points and points on straight edges."""
    for _ in range(2):
        if len(polygon) < 3:
            return polygon
        polygon = polygon[np.linalg.norm(polygon - np.roll(polygon, 1, axis=0), axis=1) > SAME * block]
        if len(polygon) < 3:
            return polygon
        polygon = polygon[np.abs(_turns(polygon)) > STRAIGHT * block**2]
    return polygon


def _turns(polygon: Array) -> Array:
    before, after = polygon - np.roll(polygon, 1, axis=0), np.roll(polygon, -1, axis=0) - polygon
    return before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]


def _is_convex(polygon: Array) -> bool:
    return bool((_turns(polygon) > 0.0).all())


def _area(polygon: Array) -> float:
    x, y = polygon.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _prism(name: str, plan: Array, low: float, high: float, **more) -> Block:
    """Block over a convex plan (k, 2) [m] between two levels."""
    corners = np.concatenate([np.column_stack([plan, np.full(len(plan), z)]) for z in (low, high)])
    return Block.standing(name, corners, **more)


def prisms(name: str, outline: Array, low: float, high: float, **more) -> list[Block]:
    """Blocks NAME-0 .. under an outline (k, 2) [m] between two levels [m], such as a footing; the blocks are as large
    as possible."""
    return [
        _prism(f"{name}-{n}", plan, low, high, **more)
        for n, plan in enumerate(convex_pieces(outline, float(np.ptp(outline, axis=0).max()), name))
    ]
