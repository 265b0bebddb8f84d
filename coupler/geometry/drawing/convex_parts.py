"""Cuts a body with plane faces along planes into convex parts that fill it exactly.

A body is convex where it has no reflex edge, one whose faces turn outwards. A plane through such an edge, along one of
its two faces, ends it there; the body falls apart where the plane cuts it through. Of all these planes, the one that
ends the greatest length of reflex edges per area cut is taken. It runs across walls rather than along them, and through
the foot of a wall rather than through the slab below. Unnecessary cuts are closed again afterwards where two parts form
a convex one (`merged`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from array_types import Array

MOST_TRIED = 12
"""Planes whose cut is measured; those that end most of reflex edges."""
MOST_PARTS = 20_000
ROUND_OFF = 1e-9
"""Share of the size of a body within which lengths are the same, and of its volume within which volumes are."""
ALONG_AN_AXIS = 1e-9
"""Component of a unit normal below which it counts as zero."""
ALIKE = 1e-6
"""Share by which a plane must be better than one before it: what is alike but for round-off goes by place."""
GAP = 1e-10
"""Of its size: what is left out on either side of a cut, so that no face that lies in its plane to round-off is met.
Corners go back into their planes afterwards, and with them the volume."""
CROSSED = 0.5
"""What cutting through another reflex edge counts for, in its own length: it must be ended on both sides."""


class CannotCut(ValueError):
    """A body that cannot be cut into convex parts, at the place (3,) [m]."""

    def __init__(self, text: str, place: Array):
        super().__init__(text)
        self.place = np.asarray(place, float)


@dataclass(frozen=True)
class Part:
    """A convex part: corners (k, 3) [m] and its volume [m³]."""

    corners: Array
    volume: float

    @property
    def middle(self) -> Array:
        """(3,) [m]"""
        return self.corners.mean(axis=0)


def convex_parts(body, tolerance: float) -> list[Part]:
    """The convex parts of a manifold3d.Manifold; dents less deep than `tolerance` [m] are ignored.  Raises
    CannotCut."""
    planes = face_planes(*mesh_of(body), tolerance)
    gap = GAP * float(np.ptp(mesh_of(body)[0], axis=0).max())
    waiting, found = connected_parts(body), []
    while waiting:
        piece = waiting.pop()
        if piece.is_empty() or piece.volume() <= tolerance * piece.surface_area():
            continue  # a film between two cuts that are one
        vertices, triangles = mesh_of(piece)
        edges = reflex_edges(vertices, triangles, tolerance)
        if not len(edges.ends):
            found.append(_part(vertices, piece.volume(), planes, tolerance, gap))
        else:
            waiting += _cut(piece, vertices, edges, planes, tolerance, gap)
        if len(found) + len(waiting) > MOST_PARTS:
            raise CannotCut(
                f"falls into more than {MOST_PARTS} convex parts, as it is curved or uneven; draw it with plane faces",
                vertices.mean(axis=0),
            )
    return found


def mesh_of(body) -> tuple[Array, Array]:
    """Vertices (n, 3) [m] and triangles (m, 3), seen from outside, of a Manifold."""
    mesh = body.to_mesh64()
    return np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, dtype=np.int64)


@dataclass(frozen=True)
class ReflexEdges:
    """ends (e, 2) rows of vertices · normals (e, 2, 3) outward unit, of the two faces."""

    ends: Array
    normals: Array


def reflex_edges(vertices: Array, triangles: Array, tolerance: float) -> ReflexEdges:
    """Edges at which the body is dented by more than the tolerance [m]."""
    p = vertices[triangles]
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    size = np.linalg.norm(normal, axis=1)
    normal /= np.maximum(size, 1e-300)[:, None]
    count = len(triangles)
    ends = np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    apex = np.concatenate([triangles[:, (i + 2) % 3] for i in range(3)])
    face = np.tile(np.arange(count), 3)
    order = np.lexsort((ends.max(axis=1), ends.min(axis=1)))
    first, second = order[::2], order[1::2]
    flat = (size[face[first]] < tolerance**2) | (size[face[second]] < tolerance**2)
    depth_1 = np.einsum("ei,ei->e", vertices[apex[second]] - vertices[ends[first, 0]], normal[face[first]])
    depth_2 = np.einsum("ei,ei->e", vertices[apex[first]] - vertices[ends[first, 0]], normal[face[second]])
    reflex = np.flatnonzero((np.minimum(depth_1, depth_2) > tolerance) & ~flat)
    normals = np.stack([normal[face[first[reflex]]], normal[face[second[reflex]]]], axis=1)
    return ReflexEdges(ends[first[reflex]], normals)


def _cut(
    piece, vertices: Array, edges: ReflexEdges, planes: tuple[Array, Array], tolerance: float, gap: float
) -> list:
    """The pieces on both sides of the best plane."""
    normals, offsets = planes
    a, b = vertices[edges.ends[:, 0]], vertices[edges.ends[:, 1]]
    length = np.linalg.norm(b - a, axis=1)
    da, db = a @ normals.T - offsets, b @ normals.T - offsets  # (e, p)
    ended = (np.abs(da) <= tolerance) & (np.abs(db) <= tolerance)
    useful = np.flatnonzero(ended.any(axis=0))
    normals, offsets, da, db, ended = (
        normals[useful],
        offsets[useful],
        da[:, useful],
        db[:, useful],
        ended[:, useful],
    )
    if not len(useful):
        raise CannotCut("has a dent that no plane of its faces ends", 0.5 * (a[0] + b[0]))
    crossed = (np.minimum(da, db) < -tolerance) & (np.maximum(da, db) > tolerance)
    gain = length @ ended - CROSSED * (length @ crossed)
    tried = np.argsort(-np.round(gain / max(float(gain.max()), 1e-300), 6), kind="stable")[:MOST_TRIED]
    whole = piece.surface_area()
    least = 1e-3 * float(length.max())
    best, chosen = np.inf, None
    for k in tried:
        halves = _halves(piece, normals[k], float(offsets[k]), gap)
        if any(half.is_empty() for half in halves):
            continue
        area = 0.5 * (halves[0].surface_area() + halves[1].surface_area() - whole)
        cost = max(area, 0.0) / max(float(gain[k]), least)
        if cost < best * (1.0 - ALIKE):
            best, chosen = cost, halves
    if chosen is None:
        raise CannotCut("has a dent that no plane along its faces ends", 0.5 * (a[0] + b[0]))
    return [piece for half in chosen for piece in connected_parts(half)]


def connected_parts(body) -> list:
    """The connected pieces of a body; a piece with a cavity is kept as it is until a cut opens the cavity."""
    pieces = body.decompose()
    return [body] if any(piece.volume() < 0.0 for piece in pieces) else pieces


def face_planes(vertices: Array, triangles: Array, tolerance: float) -> tuple[Array, Array]:
    """Unit normals (p, 3) and offsets (p,) [m] of the planes of all faces, each once, of its largest triangle.

    Cuts go along these and nothing else, so that every face of every piece lies in one of them."""
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1)
    order = np.argsort(-size, kind="stable")
    order = order[size[order] > tolerance * tolerance]
    normal = normal[order] / size[order, None]
    normal[np.abs(normal) < ALONG_AN_AXIS] = 0.0
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    normal *= np.sign(normal[np.arange(len(normal)), np.argmax(np.abs(normal) > 0.1, axis=1)])[:, None]
    offset = np.einsum("mi,mi->m", normal, corners[order, 0])
    extent = float(np.ptp(vertices, axis=0).max())
    found: list[int] = []
    for k in range(len(order)):
        known = np.array(found, int)
        same = np.abs(offset[known] - offset[k]) <= tolerance
        same &= np.linalg.norm(normal[known] - normal[k], axis=1) * extent <= tolerance
        if not same.any():
            found.append(k)
    found = sorted(found, key=lambda k: (*np.round(normal[k], 9), offset[k]))
    return normal[found], offset[found]


def _halves(piece, normal: Array, offset: float, gap: float) -> list:
    """The parts of a piece on either side of a plane, `gap` [m] away from it."""
    return [
        piece.trim_by_plane(normal.tolist(), offset + gap),
        piece.trim_by_plane((-normal).tolist(), -offset + gap),
    ]


def _part(vertices: Array, volume: float, planes: tuple[Array, Array], tolerance: float, gap: float) -> Part:
    """A piece without dents, its corners back in their planes; it must be as large as its hull."""
    hull = ConvexHull(vertices - vertices.mean(axis=0))
    if hull.volume - volume > 4.0 * tolerance * hull.area + ROUND_OFF * volume:
        raise CannotCut(
            f"has a part of {volume:.4g} m3 that is folded (its hull has {hull.volume:.4g} m3)",
            vertices.mean(axis=0),
        )
    corners = back_in_planes(vertices[np.sort(hull.vertices)], planes, 8.0 * gap)
    return Part(corners, float(ConvexHull(corners - corners.mean(axis=0)).volume))


def back_in_planes(corners: Array, planes: tuple[Array, Array], near: float) -> Array:
    """Corners (k, 3) [m] moved by the least way into all planes that they are within `near` [m] of."""
    normals, offsets = planes
    found = corners.copy()
    for k, x in enumerate(corners):
        miss = offsets - normals @ x
        own = np.abs(miss) <= near
        if own.any():
            found[k] = x + np.linalg.lstsq(normals[own], miss[own], rcond=1e-6)[0]
    return found


# ---------------------------------------------------------------- merging


def merged(parts: list[Part], tolerance: float, largest: float, least: float) -> list[Part]:
    """Parts joined with neighbours wherever both make a convex one: slivers first, then the smallest.

    tolerance [m] · largest [m]: no wall or slab grows thicker, and none beyond this across its length, unless one of
    the two is narrower than `least` [m], a sliver.
    """
    alive = dict(enumerate(parts))
    near = _neighbours(parts, tolerance)
    ways = {
        (k, j): way for k, others in near.items() for j in others if k < j
        for way in [_merger(alive[k], alive[j], tolerance, largest, least)] if way is not None
    }  # fmt: skip
    number = len(parts)
    while ways:
        k, j = min(ways, key=lambda pair: (ways[pair][0], pair))
        alive[number] = ways[k, j][1]
        around = (near.pop(k) | near.pop(j)) - {k, j}
        del alive[k], alive[j]
        ways = {pair: way for pair, way in ways.items() if k not in pair and j not in pair}
        near[number] = around
        for other in around:
            near[other] = (near[other] - {k, j}) | {number}
            way = _merger(alive[other], alive[number], tolerance, largest, least)
            if way is not None:
                ways[other, number] = way
        number += 1
    return [alive[k] for k in sorted(alive)]


def _merger(a: Part, b: Part, tolerance: float, largest: float, least: float) -> tuple[tuple, Part] | None:
    """The union of both parts, and its rank among all possible ones; None where they are not to be joined."""
    joined = _together(a, b, tolerance)
    if joined is None:
        return None
    thinner, thicker = sorted((smallest_width(a.corners), smallest_width(b.corners)))
    sliver = thinner < least
    if not sliver and (
        smallest_width(joined.corners) > 1.001 * thicker or np.sort(extents(joined.corners))[1] > largest
    ):
        return None
    return (not sliver, joined.volume), joined


def _together(a: Part, b: Part, tolerance: float) -> Part | None:
    """The union of both parts; None where it is not convex."""
    corners = np.concatenate([a.corners, b.corners])
    try:
        hull = ConvexHull(corners - corners.mean(axis=0))
    except (QhullError, ValueError):
        return None
    volume = a.volume + b.volume
    if hull.volume - volume > tolerance * hull.area * 1e-3 + ROUND_OFF * volume:
        return None
    return Part(corners[np.sort(hull.vertices)], volume)


def _neighbours(parts: list[Part], tolerance: float) -> dict[int, set[int]]:
    """Parts whose boxes touch."""
    low = np.array([p.corners.min(axis=0) for p in parts]).reshape(-1, 3) - tolerance
    high = np.array([p.corners.max(axis=0) for p in parts]).reshape(-1, 3) + tolerance
    found: dict[int, set[int]] = {k: set() for k in range(len(parts))}
    for k in range(len(parts)):
        near = np.flatnonzero((low[k] <= high).all(axis=1) & (low <= high[k]).all(axis=1))
        found[k] = set(near.tolist()) - {k}
    return found


def smallest_width(corners: Array) -> float:
    """Of a convex body: the least distance [m] of two planes that hold it, one of them along a face."""
    normals = face_normals(corners)
    return float(np.ptp(corners @ normals.T, axis=0).min()) if len(normals) else 0.0


def face_normals(corners: Array) -> Array:
    """Unit normals (f, 3) of the faces of the hull of corners (k, 3)."""
    try:
        return ConvexHull(corners - corners.mean(axis=0)).equations[:, :3]
    except (QhullError, ValueError):
        return np.zeros((0, 3))


def extents(corners: Array) -> Array:
    """Widths (3,) [m] of a convex body along its own directions, the smallest first."""
    return np.ptp(corners @ directions(corners).T, axis=0)


def directions(corners: Array) -> Array:
    """Own directions (3, 3) of a convex body, unit rows: across its smallest width, and two along it.

    Of a wall: across, level along, upwards; of a slab: upwards, along its longest edge, and across that; of a slope:
    its normal, level, and up the slope.
    """
    normals = face_normals(corners)
    widths = np.ptp(corners @ normals.T, axis=0)
    close = np.flatnonzero(widths <= widths.min() * (1.0 + 1e-6))
    across = normals[
        close[np.argmax(np.abs(normals[close]) @ np.array([1.0, 1.1, 1.2]))]
    ]  # of a cube one, always
    across = across * (np.sign(across[np.argmax(np.abs(across))]) or 1.0)
    if abs(across[2]) > 1.0 - 1e-9:
        across = np.array([0.0, 0.0, 1.0])
        along = _longest_level_edge(corners)
    else:
        along = np.array([-across[1], across[0], 0.0])
        along /= np.linalg.norm(along)
    along = along * (np.sign(along[np.argmax(np.abs(along))]) or 1.0)
    third = np.cross(across, along)
    return np.array([across, along, third * (np.sign(third[np.argmax(np.abs(third))]) or 1.0)])


def _longest_level_edge(corners: Array) -> Array:
    """Direction (3,) of the longest edge of a flat body seen from above."""
    flat = ConvexHull(corners[:, :2] - corners[:, :2].mean(axis=0))
    ring = corners[flat.vertices, :2]
    edges = np.roll(ring, -1, axis=0) - ring
    length = np.linalg.norm(edges, axis=1)
    k = int(np.flatnonzero(length >= length.max() * (1.0 - 1e-9))[0])
    return np.array([*(edges[k] / length[k]), 0.0])
