"""Contact of blocks with uneven ground: nodes of a block below a surface of triangles over a lattice.

    z_s(x, y) plane on each triangle,   δ = (z_s - z) n_z,   n upward normal of the triangle below the node        (1)

A node that moves from one triangle to the next keeps its depth, so that no seam between triangles can catch it; δ is
continuous except for the change of n_z.  Edges of the ground are not tested against faces of blocks: a block that lies
across a ridge rests on its nodes.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from array_types import Array
from kernels.decorators import inner, plain
from yade_scripts.blocks.faces import FixedPlane
from yade_scripts.contact.arrays import BEGINS
from yade_scripts.contact.search import ALIGNED, write_row
from yade_scripts.contact.springs import ARRIVED, release, stiffness_together, way_of


class Ground(NamedTuple):
    """The ground for the kernel: row of the body, -1 without one · x (nx,), y (ny,), z (nx, ny) [m] from its point ·
    mirrored: diagonals turn from square to square · upright: least n_z of all triangles."""

    row: int
    x: Array
    y: Array
    z: Array
    mirrored: bool
    upright: float


NO_GROUND = Ground(-1, np.zeros(2), np.zeros(2), np.zeros((2, 2)), False, 1.0)


@dataclass(frozen=True)
class GroundSurface(FixedPlane):
    """Uneven ground as a fixed body. x (nx,), y (ny,) increasing, z (nx, ny) [m]: corners of its triangles, counted
    from `point`, at or above it · mirrored: squares with i + j odd are split from (1, 0) to (0, 1), all others from
    (0, 0) to (1, 1). Beyond its edges it is level, outwards at the height of the edge."""

    _: KW_ONLY
    x: Array
    y: Array
    z: Array
    mirrored: bool = False

    @cached_property
    def upright(self) -> float:
        """Least n_z of its triangles."""
        dx, dy = np.diff(self.x), np.diff(self.y)
        along, across = np.abs(np.diff(self.z, axis=0)) / dx[:, None], np.abs(np.diff(self.z, axis=1)) / dy
        steepest = np.hypot(
            np.maximum(along[:, 1:], along[:, :-1]), np.maximum(across[1:], across[:-1])
        ).max()
        return float(1.0 / np.sqrt(1.0 + steepest**2))

    def as_row(self, row: int) -> Ground:
        """The ground as the kernel takes it, as the body with this row."""
        x, y, z = (np.ascontiguousarray(a, float) for a in (self.x, self.y, self.z))
        return Ground(row, x, y, z, self.mirrored, self.upright)

    def distance(self, points: Array) -> Array:
        """Lower bound (k,) [m] of the distance of points (k, 3) from the ground, negative below it."""
        x, y = (np.clip(points[:, k] - self.point[k], a[0], a[-1]) for k, a in enumerate((self.x, self.y)))
        i = np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, len(self.x) - 2)
        j = np.clip(np.searchsorted(self.y, y, side="right") - 1, 0, len(self.y) - 2)
        highest = np.maximum.reduce([self.z[i + p, j + q] for p in (0, 1) for q in (0, 1)])
        return self.upright * (points[:, 2] - self.point[2] - highest)

    def height(self, points: Array) -> Array:
        """z (k,) [m] of the ground at the places of points (k, 2 or 3), as `surface_at` has it for one."""
        x, y = (np.clip(points[:, k] - self.point[k], a[0], a[-1]) for k, a in enumerate((self.x, self.y)))
        i = np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, len(self.x) - 2)
        j = np.clip(np.searchsorted(self.y, y, side="right") - 1, 0, len(self.y) - 2)
        s = (x - self.x[i]) / (self.x[i + 1] - self.x[i])
        t = (y - self.y[j]) / (self.y[j + 1] - self.y[j])
        z00, z10, z01, z11 = (self.z[i + p, j + q] for q in (0, 1) for p in (0, 1))
        plain = np.where(s >= t, s * (z10 - z00) + t * (z11 - z10), t * (z01 - z00) + s * (z11 - z01))
        other = np.where(
            s + t <= 1.0,
            s * (z10 - z00) + t * (z01 - z00),
            z11 - z00 - (1.0 - s) * (z11 - z01) - (1.0 - t) * (z11 - z10),
        )
        return self.point[2] + z00 + np.where(self.mirrored & ((i + j) % 2 == 1), other, plain)


@inner
def _interval(axis, value):
    low, high = 0, axis.shape[0] - 1
    while high - low > 1:
        middle = (low + high) // 2
        if axis[middle] <= value:
            low = middle
        else:
            high = middle
    return low


@plain
def surface_at(ground, px, py, normal):
    """Height [m] of the ground at a place counted from its point, and the normal (3,) of the triangle there."""
    i, j = _interval(ground.x, px), _interval(ground.y, py)
    dx, dy = ground.x[i + 1] - ground.x[i], ground.y[j + 1] - ground.y[j]
    s = min(max((px - ground.x[i]) / dx, 0.0), 1.0)
    t = min(max((py - ground.y[j]) / dy, 0.0), 1.0)
    z00, z10, z01, z11 = ground.z[i, j], ground.z[i + 1, j], ground.z[i, j + 1], ground.z[i + 1, j + 1]
    if ground.mirrored and (i + j) % 2 == 1:
        if s + t <= 1.0:
            along, across = z10 - z00, z01 - z00
            height = z00 + s * along + t * across
        else:
            along, across = z11 - z01, z11 - z10
            height = z11 - (1.0 - s) * along - (1.0 - t) * across
    elif s >= t:
        along, across = z10 - z00, z11 - z10
        height = z00 + s * along + t * across
    else:
        along, across = z11 - z01, z01 - z00
        height = z00 + s * along + t * across
    beyond_x = px < ground.x[i] or px > ground.x[i + 1]
    beyond_y = py < ground.y[j] or py > ground.y[j + 1]
    if beyond_x:  # the ground goes on level, so that nothing slides outwards or back
        along, across = 0.0, z11 - z10 if s > 0.5 else z01 - z00
    if beyond_y:
        along, across = 0.0 if beyond_x else z11 - z01 if t > 0.5 else z10 - z00, 0.0
    normal[0], normal[1], normal[2] = -along / dx, -across / dy, 1.0
    size = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + 1.0)
    for k in range(3):
        normal[k] /= size
    return height


@inner
def scan_ground(
    shapes, bodies, shear, slots, slot, side, ground, state, rows, count, lost, scratch, plane
):  # fmt: skip
    """Contacts of the nodes of a block with the ground; → (contacts, energy lost [J], lower bound of the distance [m],
    negative where a node is below). plane (4,), scratch (8, 3): work space."""
    a, b, x, R = side.a, side.b, state.x, state.R
    begin, way, n = shapes.node_start[a], scratch[6:8], scratch[4]
    face, apart = shapes.face_number[b], np.inf
    for i in range(begin, shapes.node_end[a]):
        s = slot + i - begin
        xi0, xi1, xi2 = shapes.node[i, 0], shapes.node[i, 1], shapes.node[i, 2]
        px = x[a, 0] - x[b, 0] + R[a, 0, 0] * xi0 + R[a, 0, 1] * xi1 + R[a, 0, 2] * xi2
        py = x[a, 1] - x[b, 1] + R[a, 1, 0] * xi0 + R[a, 1, 1] * xi1 + R[a, 1, 2] * xi2
        pz = x[a, 2] - x[b, 2] + R[a, 2, 0] * xi0 + R[a, 2, 1] * xi1 + R[a, 2, 2] * xi2
        above = pz - surface_at(ground, px, py, n)
        depth = -above * n[2]
        apart = min(apart, above * ground.upright if above > 0.0 else -depth)
        known = slots.face[s] >= 0
        if not known and (depth <= 0.0 or not side.begins):
            continue
        for j in range(3):
            plane[j] = R[a, 0, j] * n[0] + R[a, 1, j] * n[1] + R[a, 2, j] * n[2]
        plane[3] = depth + plane[0] * xi0 + plane[1] * xi1 + plane[2] * xi2
        if known and side.begins:
            # on another triangle than before, a part of the spring may be normal to the ground: no friction
            across = slots.shear[s, 0] * n[0] + slots.shear[s, 1] * n[1] + slots.shear[s, 2] * n[2]
            for k in range(3):
                slots.shear[s, k] -= across * n[k]
            lost += 0.5 * across**2 / (shear * slots.k[s])
            way_of(state, a, b, xi0, xi1, xi2, plane, scratch, way)
            if depth <= 0.0:
                lost += release(slots, s, shear, depth, way, R, b)
                continue
        elif not known:
            own = _lowest_face(shapes, i, plane)
            if own < 0:
                continue
            slots.face[s] = face
            slots.k[s] = stiffness_together(bodies.stiffness[a], bodies.stiffness[b]) / shapes.face_nodes[own]
            slots.spread[s] = shapes.face_spread[own]
            slots.shear[s, 0] = slots.shear[s, 1] = slots.shear[s, 2] = 0.0
            slots.push[s], slots.speed[s] = BEGINS, 0.0
            way_of(state, a, b, xi0, xi1, xi2, plane, scratch, way)
            came = ARRIVED * max(way[1, 0], 0.0)
            slots.rest[s] = 0.0 if side.whole else max(0.0, depth - came)
        slots.rest[s] = min(slots.rest[s], depth)
        write_row(rows, count, side, s, plane, depth, xi0, xi1, xi2, state)
        rows.depth[count], rows.kn[count] = depth - slots.rest[s], slots.k[s]
        count += 1
    return count, lost, apart


@inner
def _lowest_face(shapes, i, plane):
    """Face of the block that holds node i and looks most against the normal plane[:3] of its frame; -1 if none does."""
    own, best = -1, ALIGNED
    for at in range(shapes.of_start[i], shapes.of_start[i + 1]):
        f = shapes.of[at]
        c = -(
            plane[0] * shapes.normal[f, 0] + plane[1] * shapes.normal[f, 1] + plane[2] * shapes.normal[f, 2]
        )
        if c > best:
            own, best = f, c
    return own
