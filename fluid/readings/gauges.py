"""Reading the water at places: level, pressure, velocity, flux through a plane, volume in a box."""

from __future__ import annotations

import numpy as np

from array_types import Array
from fluid.cut.fans import tetrahedra_of
from fluid.domain.moments import wet_fraction
from fluid.domain.point_location import Places
from fluid.readings.clip import clipped, volumes
from fluid.sides.inflow import wet_shares

SAMPLES_PER_CELL = 4
HALVINGS = 10
"""Halvings of the distance between two samples to find where a solid or the bed begins."""


def level(water, xy) -> float:
    """Depth [m] of water over xy (2,) [m]: the wet length of a vertical line, as a wire gauge measures it.

    φ is sampled on the line, SAMPLES_PER_CELL times in a cell, and taken as linear between samples; the inside of
    solids counts as dry. Spray and the space under an overturning crest do not count; over a solid on the
    floor the depth is that above it. Raises Outside for a place outside the mesh."""
    return float(levels(water, [xy])[0])


def levels(water, places, foot=None) -> Array:
    """Depths (m,) [m] of water over places (m, 2) [m], each as of `level`; foot (m,) [m]: heights z from which on water
    counts there, where they are known: in the seam of two solids a line may run beside both. None: from the lowest."""
    places = np.asarray(places, float)
    foot = np.full(len(places), -np.inf) if foot is None else foot
    low, high = water.mesh.bounds[:, 2]
    count = int(np.ceil(SAMPLES_PER_CELL * (high - low) / water.mesh.finest)) + 1
    z = np.linspace(low, high, count)
    lines = np.column_stack([np.repeat(places, count, axis=0), np.tile(z, len(places))])
    phi = Places.of(water, lines, beyond=True).read(water.level_set).reshape(-1, count)
    phi[z < foot[:, None]] = np.nan
    wet = np.fmax(-phi, 0.0)  # NaN inside solids and outside a mesh of another shape than a box
    length = np.abs(np.diff(phi, axis=1))
    share = np.divide(np.abs(np.diff(wet, axis=1)), length, out=(wet[:, 1:] > 0.0) * 1.0, where=length > 0.0)
    both = (phi[:, 1:] < 0.0) & (phi[:, :-1] < 0.0)
    is_open = np.isfinite(phi)
    open_water = is_open[:, 1:] & is_open[:, :-1]
    depth = np.array(
        [(z[1] - z[0]) * row[here].sum() for row, here in zip(np.where(both, 1.0, share), open_water)]
    )
    return depth + _beside_solids(water, places, foot, z, phi, is_open)


def _beside_solids(water, places, foot, z, phi, is_open) -> Array:
    """Wet length (m,) [m] between the last sample in a solid, or below the bed, and the first in the open; where the
    solid ends is found by halving."""
    found = np.zeros(len(places))
    row, k = np.nonzero(is_open[:, 1:] != is_open[:, :-1])
    inner = np.where(is_open[row, k], k, k + 1)
    wet = phi[row, inner] < 0.0
    row, k, inner = row[wet], k[wet], inner[wet]
    if len(row) == 0:
        return found
    inside, outside = z[inner], z[np.where(inner == k, k + 1, k)]
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        # together with the samples in the open: points that all lie outside the mesh would not be looked up
        points = np.column_stack([np.tile(places[row], (2, 1)), np.concatenate([middle, z[inner]])])
        free = np.isfinite(Places.of(water, points, beyond=True).read(water.level_set)[: len(row)])
        free &= middle >= foot[row]
        inside, outside = np.where(free, middle, inside), np.where(free, outside, middle)
    np.add.at(found, row, np.abs(0.5 * (inside + outside) - z[inner]))
    return found


def pressure(water, points):
    """Pressure [Pa] at points (m, 3) or (3,) [m] → (m,) or a number; 0 in the open air, that of the pocket in trapped
    air, NaN inside a solid. Raises Outside for a point outside the mesh."""
    places = Places.of(water, points)
    in_air = places.read(water.level_set) >= 0.0
    p = np.where(in_air, 0.0, places.read(water.pressure))
    if water.air is not None:
        of_air = water.air.nodal(water.air.mean_pressure)[places.corners]
        p = np.where(in_air, of_air[np.arange(len(p)), np.abs(of_air).argmax(axis=1)], p)
    return p if np.ndim(points) == 2 else float(p[0])


def pocket_at(water, point) -> int | None:
    """The pocket of trapped air, 0 ... K-1, at a point (3,) [m]; None where there is none."""
    from fluid.air.leaks import pockets_at

    k = int(pockets_at(water, np.atleast_2d(point))[0]) - 1
    return None if k < 0 else k


def velocity(water, points):
    """Velocity [m/s] at points (m, 3) or (3,) [m] → the same shape; 0 in the air, NaN inside a solid. Raises Outside
    for a point outside the mesh."""
    places = Places.of(water, points)
    u = np.where(places.read(water.level_set)[:, None] >= 0.0, 0.0, places.read(water.velocity))
    return u if np.ndim(points) == 2 else u[0]


def level_set_at(water, points) -> Array:
    """φ [m] at points (m, 3) [m] → (m,), negative in the water, NaN inside a solid. Raises Outside for a point outside
    the mesh."""
    return Places.of(water, points).read(water.level_set)


def flux(water, at, edges) -> float:
    """Water [m³/s] through the parallelogram with the centre `at` (3,) and edges (2, 3) [m], positive along the cross
    product of the edges: ∫_{φ<0} u·n dA.

    φ and u are read on a lattice of triangles no longer than half a cell and taken as linear in each; a triangle whose
    middle is inside a solid counts as dry. Raises Outside for a parallelogram outside the mesh."""
    edges = np.asarray(edges, float)
    m, n = (int(np.ceil(2.0 * np.linalg.norm(e) / water.mesh.finest)) for e in edges)
    i, j = np.meshgrid(np.arange(m + 1), np.arange(n + 1), indexing="ij")
    place = np.column_stack([i.ravel() / m - 0.5, j.ravel() / n - 0.5])
    points = np.asarray(at, float) + place @ edges
    places = Places.of(water, points, beyond=True)
    phi = places.read(water.level_set, inside=True)
    through = places.read(water.velocity, inside=True) @ np.cross(*edges) / (2.0 * m * n)
    corner = np.arange((m + 1) * (n + 1)).reshape(m + 1, n + 1)
    low, right, up, top = (
        c.ravel() for c in (corner[:-1, :-1], corner[1:, :-1], corner[:-1, 1:], corner[1:, 1:])
    )
    triangles = np.concatenate([np.column_stack([low, right, top]), np.column_stack([low, top, up])])
    free = ~Places.of(water, points[triangles].mean(axis=1), beyond=True).inside & np.isfinite(
        phi[triangles]
    ).all(axis=1)
    triangles = triangles[free]
    return float((wet_shares(phi[triangles]) * through[triangles]).sum())


def volume_in_box(water, lower, upper) -> float:
    """Water [m³] in the box from lower to upper (3,) [m]: exact for the surface φ = 0 as the cells have it, and for
    solids with plane faces: of a cell that a solid and the border of the box cut at once, the tetrahedra that fill its
    fluid part are clipped."""
    t = water.topology
    wet = t.cells_around(water.level_set < 0.0)
    x = t.nodes[t.cells[wet]]
    inside = ((x >= lower) & (x <= upper)).all(axis=(1, 2))
    beyond = ((x <= lower).all(axis=1) | (x >= upper).all(axis=1)).any(axis=1)
    whole, border = wet[inside], wet[~inside & ~beyond]
    total = float(wet_fraction(whole, water.level_set, t.parts) @ t.volume[whole])
    is_cut = t.parts.start[border] < t.parts.start[border + 1]
    plain, cut = border[~is_cut], border[is_cut]
    tets, phi = t.nodes[t.cells[plain]], water.level_set[t.cells[plain]]
    total += float(_in_box(tets, phi, lower, upper) @ t.fraction[plain])
    return total + float(_in_box(*_fans(water, cut), lower, upper).sum()) if len(cut) else total


def _fans(water, cut) -> tuple[Array, Array]:
    """Corners (T, 4, 3) [m] of the tetrahedra that fill the fluid parts of cut cells (n,), and φ (T, 4) there."""
    t = water.topology
    which, number = tetrahedra_of(t.parts.start, cut)
    hats, nodes = t.parts.corners[number], t.cells[cut[which]]
    phi = np.einsum("tqa,ta->tq", hats, water.level_set[nodes])
    return np.einsum("tqa,tak->tqk", hats, t.nodes[nodes]), phi


def _in_box(tets, phi, lower, upper):
    """Volume (n,) [m³] of the part inside the box of tetrahedra (n, 4, 3) [m] in which φ, with the corner values
    (n, 4), is negative."""
    number = np.broadcast_to(np.arange(len(tets))[:, None, None], (len(tets), 4, 1))
    parts = np.concatenate([tets, phi[..., None], number], axis=2)
    for axis in range(3):
        parts = clipped(parts, lower[axis] - parts[:, :, axis])
        parts = clipped(parts, parts[:, :, axis] - upper[axis])
    parts = clipped(parts, parts[:, :, 3])
    of_tet = np.rint(parts[:, 0, 4]).astype(np.int64)
    return np.bincount(of_tet, volumes(parts), minlength=len(tets))
