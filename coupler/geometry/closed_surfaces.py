"""Closed surfaces in an unordered set of polygons, and whether each bounds a convex body.

Polygons join along edges. Where blocks stand edge to edge or face to face, four and more polygons share an edge: each
block then lies between a polygon that runs along the edge forwards and the next one around it that runs backwards.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, QhullError

from array_types import Array
from yade_scripts.blocks.polyhedra import fans, polygon_area_vector, shown

SAME_ANGLE = 1e-4
"""Polygons at an edge within this angle [rad] of each other lie on one another."""
DOUBLE_COVER = 1e-3
"""Share by which the area of a surface may differ from that of its convex hull: a second layer doubles it."""


class SurfaceError(ValueError):
    """A surface that is open, dented or folded; the message follows "surface k" and names the place."""


@dataclass(frozen=True)
class Surface:
    """points (n, 3) [m] of the whole file · loops: polygons of one closed surface, rows of points."""

    points: Array
    loops: list[Array]


def closed_surfaces(points: Array, loops: list[Array]) -> list[Surface]:
    """The closed surfaces that the polygons make, in the order of their first polygon.

    points (n, 3) [m], welded · loops: rows of points. Raises SurfaceError where an edge belongs to one polygon only,
    and where welding has left nothing of a body.
    """
    unique, rows = np.unique(points, axis=0, return_inverse=True)
    drawn = [rows.ravel()[loop] for loop in loops]
    loops = [_without_repeats(loop) for loop in drawn]
    loops = [loop for loop in loops if len(set(loop.tolist())) >= 3]
    if not loops:
        raise SurfaceError("no polygon has an area")
    lost = np.setdiff1d(np.concatenate(drawn), np.concatenate(loops))
    if len(lost):
        raise SurfaceError(
            f"the body at {shown(unique[lost[0]])} is so small that its corners became one; leave it out or weld less"
        )
    if _volume(unique, loops) < 0.0:  # all seen from inside
        loops = [loop[::-1] for loop in loops]
    middles = np.array([unique[loop].mean(axis=0) for loop in loops])
    pairs = np.array(
        [pair for edge in _edges(loops).items() for pair in _joined(unique, middles, *edge)], int
    )
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(loops),) * 2)
    _, label = connected_components(graph, directed=False)
    first = [int(np.argmax(label == k)) for k in range(label.max() + 1)]
    return [Surface(unique, [loops[i] for i in np.flatnonzero(label == label[f])]) for f in sorted(first)]


def _volume(points: Array, loops: list[Array]) -> float:
    """Six times the signed volume [m³] within the polygons."""
    p = (points - points.mean(axis=0))[fans(loops)[0]]
    return float(np.einsum("ij,ij->", p[:, 0], np.cross(p[:, 1], p[:, 2])))


def _without_repeats(loop: Array) -> Array:
    """A polygon without corners that welding merged with the one before."""
    return loop[loop != np.roll(loop, 1)]


def _edges(loops: list[Array]) -> dict[tuple[int, int], list[tuple[int, bool]]]:
    """Edge (a < b) → polygons on it, and whether each runs from a to b."""
    found: dict[tuple[int, int], list[tuple[int, bool]]] = {}
    for number, loop in enumerate(loops):
        for a, b in zip(loop.tolist(), np.roll(loop, -1).tolist()):
            found.setdefault((min(a, b), max(a, b)), []).append((number, a < b))
    return found


def _joined(points: Array, middles: Array, edge: tuple[int, int], users: list) -> list[tuple[int, int]]:
    """Pairs of polygons that bound the same body along an edge; middles (·, 3) [m]: a point of each polygon."""
    if len(users) == 2:
        return [(users[0][0], users[1][0])]
    a, b = points[edge[0]], points[edge[1]]
    forward, backward = ([n for n, ahead in users if ahead is way] for way in (True, False))
    if len(users) == 1 or len(forward) != len(backward):
        raise SurfaceError(
            f"open surface: the edge from {shown(a)} to {shown(b)} belongs to {len(users)} polygon"
            f"{'s that do not face outwards in pairs' if len(users) > 1 else ' only'}; close the surface"
        )
    numbers = [n for n, _ in users]
    angle = dict(zip(numbers, _angles(middles[numbers], a, b).tolist()))
    pairs = []
    for n in forward:
        turn = [(angle[n] - angle[m]) % (2.0 * np.pi) for m in backward]
        turn = [t if t > SAME_ANGLE else t + 2.0 * np.pi for t in turn]
        pairs.append((n, backward[int(np.argmin(turn))]))
    return pairs


def _angles(middles: Array, a: Array, b: Array) -> Array:
    """Angles (k,) [rad] about the edge a → b of polygons with points (k, 3); the body of a forward one is at less."""
    axis = (b - a) / np.linalg.norm(b - a)
    e1 = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    e1 /= np.linalg.norm(e1)
    arms = middles - a
    return np.arctan2(arms @ np.cross(axis, e1), arms @ e1)


def convex_corners(surface: Surface, tolerance: float) -> Array:
    """Points (k, 3) [m] of a closed surface that bounds a convex body to the tolerance [m].

    Every polygon must have all points on one side, and the area must be that of the convex hull: a closed surface
    made of pieces of the hull covers it once. Raises SurfaceError with the place otherwise.
    """
    used = np.unique(np.concatenate(surface.loops))
    x = surface.points[used]
    middle = x.mean(axis=0)
    try:
        hull = ConvexHull(x - middle)
    except (QhullError, ValueError) as error:
        raise SurfaceError(f"at {shown(middle)} encloses no volume; leave it out") from error
    area = 0.0
    for loop in surface.loops:
        corners = surface.points[loop] - middle
        vector = polygon_area_vector(corners)
        size = np.linalg.norm(vector)
        area += size
        if size < tolerance * np.ptp(corners, axis=0).max():
            continue
        height = (x - middle - corners.mean(axis=0)) @ (vector / size)
        if min(height.max(), -height.min()) > tolerance:
            raise SurfaceError(
                f"is not convex: at {shown(middle + corners.mean(axis=0))} the body reaches {height.max():.3g} m to "
                f"one side of its face and {-height.min():.3g} m to the other; split it into convex parts, or fill it "
                "with tetrahedra"
            )
    if abs(area - hull.area) > DOUBLE_COVER * hull.area:
        raise SurfaceError(
            f"at {shown(middle)} is folded: its faces have {area:.5g} m2, its convex hull {hull.area:.5g} m2; draw "
            "each face once"
        )
    return x
