"""Convex polyhedra: plane faces from vertices, exact moments, and errors that name the place where one is not convex.

A polyhedron is vertices (k, 3) and faces, lists of rows of vertices seen from outside.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from array_types import Array

Faces = tuple[tuple[int, ...], ...]

FLAT = 1e-9
"""Height of a vertex over a face, as a share of the polyhedron's extent, that counts as rounding."""
ROUNDING = 8.0 * np.finfo(float).eps
"""The same height as a share of the largest coordinate: the rounding of double precision far from the origin."""
THICK = 10.0
"""Least thickness of a block over the tolerance of its corners."""
PLANE = 1e-12
"""Distance from its plane, as a share of the extent, to which a face is made plane."""


class BlockError(ValueError):
    """A block that cannot be built; the message names the block, the quantity, its value and the remedy."""


def polygon_area_vector(corners: Array) -> Array:
    """Area times unit normal of a planar polygon (k, 3) [m²]."""
    arm = corners - corners[0]
    return 0.5 * cross_products(arm[1:-1], arm[2:]).sum(axis=0)


def cross_products(a: Array, b: Array) -> Array:
    """a × b of vectors (k, 3); numpy.cross takes ten times as long for few of them."""
    ax, ay, az, bx, by, bz = *a.T, *b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def fans(faces) -> tuple[Array, Array]:
    """Triangles (t, 3), rows of vertices, that fan out over the faces, and the face (t,) of each."""
    triangles = [(f[0], f[i], f[i + 1]) for f in faces for i in range(1, len(f) - 1)]
    owner = np.repeat(np.arange(len(faces)), [len(f) - 2 for f in faces])
    return np.array(triangles, int).reshape(-1, 3), owner


def face_areas(vertices: Array, faces) -> Array:
    """Area times outward unit normal (f, 3) [m²] of each face."""
    triangles, owner = fans(faces)
    p = vertices[triangles]
    areas = np.zeros((len(faces), 3))
    np.add.at(areas, owner, 0.5 * np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]))
    return areas


def face_planes(vertices: Array, faces) -> tuple[Array, Array]:
    """Outward unit normals (f, 3) and offsets (f,) [m]: n @ x = o on a face, in the mean over its corners."""
    areas = face_areas(vertices, faces)
    normals = areas / np.linalg.norm(areas, axis=1)[:, None]
    middles = np.array([vertices[list(f)].mean(axis=0) for f in faces])
    return normals, np.einsum("fi,fi->f", normals, middles)


def polyhedron_moments(vertices: Array, faces) -> tuple[float, Array, Array]:
    """Volume [m³], centroid (3,) [m] and central second moments ∫ ξξᵀ dV (3, 3) [m⁵] of a closed polyhedron.

    Exact: sum over tetrahedra spanned by an inner point and the triangles of the faces;
    over one with corners p₀..p₃, ∫ xxᵀ dV = V/20 (Σ pᵢpᵢᵀ + (Σpᵢ)(Σpᵢ)ᵀ).
    """
    origin = vertices.mean(axis=0)
    p = (vertices - origin)[fans(faces)[0]]
    volume = np.einsum("ij,ij->i", p[:, 0], np.cross(p[:, 1], p[:, 2])) / 6.0
    total = p.sum(axis=1)
    V = volume.sum()
    centroid = (volume[:, None] * total).sum(axis=0) / (4.0 * V)
    second = np.einsum("t,tia,tib->ab", volume, p, p) + np.einsum("t,ta,tb->ab", volume, total, total)
    return float(V), origin + centroid, second / 20.0 - V * np.outer(centroid, centroid)


def rounding(vertices: Array) -> float:
    """Distance [m] below which coordinates like these mean the same point."""
    return max(FLAT * np.ptp(vertices, axis=0).max(), ROUNDING * np.abs(vertices).max())


def convex_polyhedron(
    name: str, vertices: Array, faces: Faces | None = None, tolerance: float | None = None
) -> tuple[Array, Faces]:
    """The polyhedron without superfluous vertices, with faces plane to rounding.

    faces None: those of the convex hull, coplanar triangles merged. tolerance [m]: largest distance of vertices from
    the planes of their faces (None: the rounding of their coordinates); they are moved by less than that on average.
    Raises BlockError where vertices span no volume or lie inside the hull, or faces are open, bent or dented.
    """
    vertices = np.asarray(vertices, float)
    if vertices.ndim != 2 or vertices.shape[1:] != (3,) or not np.isfinite(vertices).all():
        raise BlockError(
            f"block '{name}': vertices of shape {vertices.shape}; give rows of three finite numbers"
        )
    tolerance = rounding(vertices) if tolerance is None else tolerance
    origin = vertices.mean(axis=0)
    x = vertices - origin
    if faces is None:
        faces = hull_faces(name, x, tolerance)
    check_convex(name, x, faces, tolerance, origin)
    _check_thick(name, x, faces, tolerance)
    x, faces = _used(x, faces)
    extent = np.ptp(x, axis=0).max()
    if _bend(x, faces) > PLANE * extent:
        x = flattened(x, faces)
    if _bend(x, faces) > FLAT * extent:
        raise BlockError(
            f"block '{name}': its faces cannot be made plane; {_bend(x, faces):.3g} m remain. Give its corners "
            "with more digits"
        )
    return origin + x, faces


def _used(vertices: Array, faces) -> tuple[Array, Faces]:
    """The same polyhedron without vertices that belong to no face."""
    kept = np.unique(np.concatenate([np.asarray(f, int) for f in faces]))
    row = np.full(len(vertices), -1)
    row[kept] = np.arange(len(kept))
    return vertices[kept], tuple(tuple(row[list(f)].tolist()) for f in faces)


def _bend(vertices: Array, faces) -> float:
    """Largest distance [m] of a corner from the plane of its face."""
    normals, offsets = face_planes(vertices, faces)
    return max(float(np.abs(vertices[list(f)] @ n - o).max()) for f, n, o in zip(faces, normals, offsets))


def flattened(vertices: Array, faces, rounds: int = 4) -> Array:
    """Vertices (k, 3) of the nearest polyhedron of the same topology whose faces are plane.

    Newton's method on n_f·x_v = d_f for every corner v of every face f, in the unknowns x, n (unit) and d, with the
    smallest change in the mean square. A solution is near, since a polyhedron has more degrees of freedom than
    conditions at corners (Steinitz).
    """
    origin, extent = vertices.mean(axis=0), np.ptp(vertices, axis=0).max()
    x = (vertices - origin) / extent
    n, d = face_planes(x, faces)
    f = np.repeat(np.arange(len(faces)), [len(c) for c in faces])
    v = np.concatenate([np.asarray(c, int) for c in faces])
    k, m, rows = len(x), len(faces), np.arange(len(f))
    for _ in range(rounds):
        A = np.zeros((len(f) + m, 3 * k + 4 * m))
        for axis in range(3):
            A[rows, 3 * v + axis] = n[f, axis]
            A[rows, 3 * k + 3 * f + axis] = x[v, axis]
            A[len(f) + np.arange(m), 3 * k + 3 * np.arange(m) + axis] = n[:, axis]
        A[rows, 3 * k + 3 * m + f] = -1.0
        left = d[f] - np.einsum("ci,ci->c", n[f], x[v])
        change = np.linalg.lstsq(A, np.concatenate([left, np.zeros(m)]), rcond=None)[0]
        x = x + change[: 3 * k].reshape(-1, 3)
        n = n + change[3 * k : 3 * k + 3 * m].reshape(-1, 3)
        d = d + change[3 * k + 3 * m :]
        length = np.linalg.norm(n, axis=1)
        n, d = n / length[:, None], d / length
    return origin + extent * x


def hull_faces(name: str, vertices: Array, tolerance: float) -> Faces:
    """Faces of the convex hull of vertices (k, 3), corners seen from outside; triangles within tolerance [m] of one
    plane are one face. Raises BlockError for no volume, or for a vertex deeper inside than the tolerance."""
    try:
        hull = ConvexHull(vertices)
    except (QhullError, ValueError) as error:
        raise BlockError(f"block '{name}': its {len(vertices)} vertices span no volume") from error
    merged = _merged(vertices, hull, tolerance)
    _check_all_outside(name, vertices, hull, tolerance)
    shared = np.zeros(len(vertices), int)
    for _, corners in merged:
        shared[list(corners)] += 1
    # A vertex of fewer than three faces lies within an edge or a face and is no corner of the body.
    rings = [(n, np.array([c for c in sorted(corners) if shared[c] >= 3])) for n, corners in merged]
    rings = [(n, ring) for n, ring in rings if len(ring) >= 3]
    return tuple(_ordered(vertices, ring, n) for n, ring in rings)


def _merged(vertices: Array, hull: ConvexHull, tolerance: float) -> list[tuple[Array, set]]:
    """Normal and corners of each face; the largest triangles come first, and small ones join the plane that they lie
    in."""
    p = vertices[hull.simplices]
    normals, offsets = hull.equations[:, :3], hull.equations[:, 3]
    size = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    left = np.argsort(-size, kind="stable")
    found = []
    while len(left):
        n, o = normals[left[0]], offsets[left[0]]
        within = (normals[left] @ n > 0.0) & (np.abs(p[left] @ n + o).max(axis=1) <= tolerance)
        within[0] = True
        found.append((n, set(hull.simplices[left[within]].ravel().tolist())))
        left = left[~within]
    return found


def _check_all_outside(name: str, vertices: Array, hull: ConvexHull, tolerance: float) -> None:
    depth = -(vertices @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
    if depth.max() > tolerance:
        raise BlockError(
            f"block '{name}': vertex {depth.argmax()} lies {depth.max():.3g} m inside the convex hull of the others, "
            "so they are not the corners of a convex block; leave it out, or split the block into convex ones"
        )


def _ordered(vertices: Array, corners: Array, normal: Array) -> tuple[int, ...]:
    e1 = vertices[corners[1]] - vertices[corners[0]]
    e1 = e1 / np.linalg.norm(e1)
    e2 = np.cross(normal, e1)
    arm = vertices[corners] - vertices[corners].mean(axis=0)
    return tuple(corners[np.argsort(np.arctan2(arm @ e2, arm @ e1))].tolist())


def check_convex(name: str, vertices: Array, faces, tolerance: float, origin=(0.0, 0.0, 0.0)) -> None:
    """Raise BlockError where faces do not close, have no area, or a vertex lies more than tolerance [m] outside one.

    origin (3,) [m] is added to the places that messages name."""
    if not faces:
        raise BlockError(
            f"block '{name}': its corners span no volume at {shown(origin + vertices.mean(axis=0))}"
        )
    _check_closed(name, vertices, faces, origin)
    areas = face_areas(vertices, faces)
    size = np.linalg.norm(areas, axis=1)
    if size.min() <= tolerance**2:
        raise BlockError(f"block '{name}': face {size.argmin()} has no area; leave it out")
    normals = areas / size[:, None]
    for index, face in enumerate(faces):
        height = (vertices - vertices[list(face)].mean(axis=0)) @ normals[index]
        if height.max() > tolerance:
            place = origin + vertices[list(face)].mean(axis=0)
            raise BlockError(
                f"block '{name}' is not convex (or face {index} is bent or seen from inside): vertex {height.argmax()} "
                f"lies {height.max():.3g} m outside face {index} at {shown(place)}; split it into convex blocks"
            )


def _check_thick(name: str, vertices: Array, faces, tolerance: float) -> None:
    normals = face_planes(vertices, faces)[0]
    thickness = np.ptp(vertices @ normals.T, axis=0).min()
    if thickness < THICK * tolerance:
        raise BlockError(
            f"block '{name}': its vertices span no volume: it is {thickness:.2g} m thick, and they are known to "
            f"{tolerance:.2g} m only"
        )


def _check_closed(name: str, vertices: Array, faces, origin) -> None:
    """Every edge joins two faces, which run along it in opposite directions."""
    edges = [(a, b) for f in faces for a, b in zip(f, (*f[1:], f[0]))]
    there = set(edges)
    for a, b in edges:
        if (b, a) not in there or len(there) < len(edges):
            raise BlockError(
                f"block '{name}' is not closed: the edge from {shown(origin + vertices[a])} to "
                f"{shown(origin + vertices[b])} does not join two faces that are both seen from outside"
            )


def shown(point: Array) -> str:
    """Text of a place for messages: (x, y, z) m."""
    return "(" + ", ".join(f"{c:.7g}" for c in point) + ") m"
