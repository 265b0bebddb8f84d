"""Reading the water at places: level, pressure, velocity, flux through a plane, volume in a box."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from array_types import Array, Floats
from fluid.cut.fans import tetrahedra_of
from fluid.domain.moments import wet_fraction
from fluid.domain.point_location import NEAR, Places
from fluid.numerics.fields import nothing
from fluid.readings.at_surface import pressure_below_surface
from fluid.readings.clip import clipped, clipped_triangles, sections, volumes
from fluid.readings.solid_spans import Spans, solid_spans

if TYPE_CHECKING:
    from fluid.domain.physical_domain import PhysicalDomain

SAMPLES_PER_CELL = 4
CORNERS_AND_MIDDLE = ((0.0, 0.0), (-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5))
"""Shares of its edges that lead from the middle of a parallelogram there and to its corners."""
HALVINGS = 10
"""Halvings of the distance between two samples to find where the bed begins."""
HAIR = 1e-6
"""Share of that distance by which a point lies before what may be the bed, so that round-off does not put it beyond."""


def level(water, xy) -> float:
    """Depth [m] of water over xy (2,) [m]: the wet length of a vertical line, as a wire gauge measures it.

    φ is sampled on the line, SAMPLES_PER_CELL times in a cell and where the line enters and leaves solids, and taken as
    linear between samples; the inside of solids counts as dry. Spray and the space under an overturning crest do not
    count; over a solid on the floor the depth is that above it. Raises Outside for a place outside the mesh."""
    return float(levels(water, [xy])[0])


def levels(water, places, foot=None) -> Array:
    """Depths (m,) [m] of water over places (m, 2) [m], each as of `level`; foot (m,) [m]: heights z from which on water
    counts there, where they are known: in the seam of two solids a line may run beside both. None: from the lowest."""
    return Lines.of(water, places, foot).depths(water)


@dataclass(frozen=True)
class Lines:
    """Upright lines through places (m, 2) [m] of a domain, with what stays as long as it does: foot (m,) [m] as in
    `levels` · z (count,) [m] heights of the samples on each · solid: what solids take of them · at: the samples, and
    the lower and the upper ends of what solids take."""

    domain: PhysicalDomain
    places: Floats
    foot: Floats
    z: Floats
    solid: Spans
    at: Places

    @classmethod
    def of(cls, water, places, foot=None) -> Lines:
        """Look the samples up. Raises Outside if all of them lie outside the mesh."""
        places = np.asarray(places, float)
        foot = np.full(len(places), -np.inf) if foot is None else foot
        low, high = water.mesh.bounds[:, 2]
        count = int(np.ceil(SAMPLES_PER_CELL * (high - low) / water.mesh.finest)) + 1
        z = np.linspace(low, high, count)
        solid = _with_feet(solid_spans(water, places), foot, low)
        samples = np.column_stack([np.repeat(places, count, axis=0), np.tile(z, len(places))])
        ends = np.column_stack([np.tile(places[solid.line], (2, 1)), np.concatenate([solid.low, solid.high])])
        at = Places.of(water, np.concatenate([samples, ends]), beyond=True)
        return cls(water.domain, places, foot, z, solid, at)

    def depths(self, water) -> Array:
        """Depths (m,) [m] of the present water."""
        places, foot, z, solid = self.places, self.foot, self.z, self.solid
        n_samples = len(places) * len(z)
        through = np.unique(solid.line)
        phi = self.at.read(water.level_set)
        phi, at_ends = phi[:n_samples].reshape(-1, len(z)), phi[n_samples:]
        phi[z < foot[:, None]] = np.nan
        clear = np.ones(len(places), bool)
        clear[through] = False
        depth = np.zeros(len(places))
        depth[clear] = _in_the_open(water, places[clear], foot[clear], z, phi[clear])
        if len(through):
            there = solid._replace(line=np.searchsorted(through, solid.line))
            depth[through] = _between_solids(
                water, places[through], foot[through], z, phi[through], there, at_ends
            )
        return depth


def _with_feet(solid: Spans, foot, low: float) -> Spans:
    """The spans of solids, and on the lines that have some all that lies under their foot (m,) [m]."""
    below = np.unique(solid.line)
    below = below[foot[below] > low]
    added = (below, np.full(len(below), low), foot[below])
    return Spans(*(np.concatenate(both) for both in zip(solid, added)))


def _in_the_open(water, places, foot, z, phi) -> Array:
    """Wet length (m,) [m] of lines that pass through no solid, with φ (m, count) at the heights z (count,) [m]."""
    is_open = np.isfinite(phi)
    open_water = is_open[:, 1:] & is_open[:, :-1]
    share = _wet_share(phi[:, :-1], phi[:, 1:])
    depth = np.array([(z[1] - z[0]) * row[here].sum() for row, here in zip(share, open_water)])
    row, k = np.nonzero(is_open[:, 1:] != is_open[:, :-1])
    inner = np.where(is_open[row, k], k, k + 1)
    wet = phi[row, inner] < 0.0
    row, k, inner = row[wet], k[wet], inner[wet]
    outer = np.where(inner == k, k + 1, k)
    below = np.zeros(len(places))
    np.add.at(below, row, _up_to_the_bed(water, places[row], foot[row], z[inner], z[outer]))
    return depth + below


def _between_solids(water, places, foot, z, phi, solid: Spans, at_ends) -> Array:
    """The same of lines that pass through solids, whose ends on the lines are samples as well, with φ at_ends (2 k,):
    first at the lower ends, then at the upper ones."""
    line = np.concatenate([np.repeat(np.arange(len(places)), len(z)), solid.line, solid.line])
    height = np.concatenate([np.tile(z, len(places)), solid.low, solid.high])
    phi = np.concatenate([phi.ravel(), at_ends])
    entered = np.zeros(len(line), np.int64)
    entered[-2 * len(solid.line) : -len(solid.line)] = 1
    entered[-len(solid.line) :] = -1
    order = np.lexsort((height, line))
    free = (np.cumsum(entered[order]) == 0)[:-1] & (line[order[1:]] == line[order[:-1]])
    low, high = order[:-1][free], order[1:][free]
    is_open = np.isfinite(phi)
    both, one = is_open[low] & is_open[high], is_open[low] != is_open[high]
    wet = np.where(both, _wet_share(phi[low], phi[high]), 0.0) * (height[high] - height[low])
    depth = np.bincount(line[low], wet, minlength=len(places))
    inner = np.where(is_open[low], low, high)[one]
    outer = np.where(is_open[low], high, low)[one]
    inner, outer = inner[phi[inner] < 0.0], outer[phi[inner] < 0.0]
    row = line[inner]
    np.add.at(depth, row, _up_to_the_bed(water, places[row], foot[row], height[inner], height[outer]))
    return depth


def _wet_share(one, other) -> Array:
    """Share of the way between two samples in the water, where φ is linear between its values one and other (...)."""
    wet, wet_other = (
        np.fmax(-one, 0.0),
        np.fmax(-other, 0.0),
    )  # NaN outside a mesh of another shape than a box
    length = np.abs(other - one)
    share = np.divide(np.abs(wet_other - wet), length, out=(wet_other > 0.0) * 1.0, where=length > 0.0)
    return np.where((other < 0.0) & (one < 0.0), 1.0, share)


def _up_to_the_bed(water, places, foot, inside, outside) -> Array:
    """Wet length (n,) [m] from the last samples in the open, at the heights inside (n,) [m], towards those beyond the
    bed or in the seam of solids, at outside (n,) [m]. A foot or the end of a solid, up to which all is open, is where
    it ends; otherwise that is found by halving."""
    if len(places) == 0:
        return np.zeros(0)
    first, outside = inside, np.where(outside < inside, np.maximum(outside, foot), outside)

    def in_the_open(heights) -> Array:
        # together with the samples in the open: points that all lie outside the mesh would not be looked up
        points = np.column_stack([np.tile(places, (2, 1)), np.concatenate([heights, first])])
        free = np.isfinite(Places.of(water, points, beyond=True).read(water.level_set)[: len(places)])
        return free & (heights >= foot)

    ended = in_the_open(outside + HAIR * (inside - outside))
    inside = np.where(ended, outside, inside)
    for _ in range(0 if ended.all() else HALVINGS):
        middle = 0.5 * (inside + outside)
        free = ended | in_the_open(middle)
        inside, outside = np.where(free, middle, inside), np.where(free, outside, middle)
    return np.abs(0.5 * (inside + outside) - first)


def pressure(water, points):
    """Pressure [Pa] at points (m, 3) or (3,) [m] → (m,) or a number; 0 in the open air, that of the pocket in trapped
    air, NaN inside a solid. Raises Outside for a point outside the mesh."""
    p = pressure_at(water, Places.of(water, points))
    return p if np.ndim(points) == 2 else float(p[0])


def pressure_at(water, places: Places) -> Array:
    """`pressure` (m,) [Pa] at places that were looked up on the present domain, and stay while it does."""
    in_air = places.read(water.level_set) >= 0.0
    of_air = nothing(len(water.level_set)) if water.air is None else water.air.nodal(water.air.mean_pressure)
    p = np.where(places.inside, np.nan, pressure_below_surface(water, places, of_air))
    there = of_air[places.corners]
    return np.where(in_air, there[np.arange(len(p)), np.abs(there).argmax(axis=1)], p)


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

    Exact for surface and velocity as the cells have them, and for solids with plane faces: the plane cuts the
    tetrahedra that fill the fluid parts of the cells. On a face of a solid it is the flux of the water before it.
    Raises Outside for a parallelogram outside the mesh."""
    at, edges = np.asarray(at, float), np.asarray(edges, float)
    normal = np.cross(*edges)
    Places.of(water, at + np.array(CORNERS_AND_MIDDLE) @ edges, beyond=True)
    t = water.topology
    near = NEAR * water.mesh.finest
    height = (t.nodes - at) @ (normal / np.linalg.norm(normal))
    wet = t.cells_around(water.level_set < 0.0)
    crossed = wet[(height[t.cells[wet]] < near).any(axis=1) & (height[t.cells[wet]] > -near).any(axis=1)]
    hats, nodes = _fluid_parts(t, crossed)
    shares = (t.nodes - at) @ np.linalg.inv(np.array([*edges, normal]))[:, :2]
    values = np.column_stack([shares, height, water.level_set, water.velocity @ normal])
    parts = np.einsum("tqa,tak->tqk", hats, values[nodes])
    (area, through), (area_behind, behind) = (_through(parts, place) for place in (-near, near))
    return behind if area_behind > (1.0 + 1e-6) * area else through


def _through(parts, place: float) -> tuple[float, float]:
    """Wet share of a parallelogram that is moved by `place` [m] along its normal, and ∫ u·n dA over it [m³/s]; parts
    (n, 4, 5): corners of tetrahedra, by the shares of its edges that lead there from its middle and the height [m] over
    it, with φ [m] and the product of u·n and its area [m³/s]."""
    flat = sections(parts, parts[:, :, 2] - place)
    for edge in (0, 1):
        flat = clipped_triangles(flat, -0.5 - flat[:, :, edge])
        flat = clipped_triangles(flat, flat[:, :, edge] - 0.5)
    flat = clipped_triangles(flat, flat[:, :, 3])
    one, other = flat[:, 1, :2] - flat[:, 0, :2], flat[:, 2, :2] - flat[:, 0, :2]
    share = 0.5 * np.abs(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
    return float(share.sum()), float(share @ flat[:, :, 4].mean(axis=1))


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
    hats, nodes = _fluid_parts(t, cut)
    phi = np.einsum("tqa,ta->tq", hats, water.level_set[nodes])
    return np.einsum("tqa,tak->tqk", hats, t.nodes[nodes]), phi


def _fluid_parts(t, cells) -> tuple[Array, Array]:
    """Tetrahedra that fill the fluid parts of cells (n,) of a topology: hat functions (T, 4, 4) of the nodes (T, 4) of
    their cells at their corners; a cell that nothing cuts is one of its own."""
    is_cut = t.parts.start[cells] < t.parts.start[cells + 1]
    which, number = tetrahedra_of(t.parts.start, cells[is_cut])
    whole = t.cells[cells[~is_cut]]
    hats = np.concatenate([np.broadcast_to(np.eye(4), (len(whole), 4, 4)), t.parts.corners[number]])
    return hats, np.concatenate([whole, t.cells[cells[is_cut][which]]])


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
