"""Water through cracks too narrow for the mesh: closed in the geometry, open by a lumped conductance.

An opening in a wall thinner than a cell acts like one about a cell wide, however narrow it is, because the elements at
its edge only register that it exists. Openings narrower than about a cell are therefore closed, and the flow through
them is lumped. Water in a slit of opening g [m], length L [m] and depth th [m] through the wall, and in front of its
mouths up to the distance h where the mesh takes over, has the inertia of a stream with the *conductance*

    κ = L / (th / g + (2/π) ln(2 h / g))        [m]                                                          (1)

(th / g: parallel flow in the slit; the logarithm: two half-plane sinks of half width g/4 resolved by hats of width h).
With d = mean of N over the patch at one mouth minus that at the other, so that d·p is the difference of pressure,
the flow Q [m³/s] of the slit obeys

    (ρ/κ) dQ/dt = d·p - ρ g·Δx - ρ/2 (Q/A) |Q/A|,       A = C_d g L,  C_d = 0.6                               (2)

Δx between the middles of the mouths; the last term is the loss of an orifice, so that steady flow has Torricelli's
rate. Over a step, linear in the new Q,

    (1 + β) Q' = Q + dt κ/ρ (d·p - ρ g·Δx),             β = dt κ |Q| / (2 A²),                                (3)

which adds (dt/ρ) κ/(1+β) d dᵀ, positive semidefinite, to the pressure matrix: the flow leaves the mass balance at one
mouth and enters it at the other. The pressure within the crack does not load its faces.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from array_types import Array
from kernels.decorators import kernel

DISCHARGE = 0.6
"""C_d of a sharp opening."""
FACING = 0.7
"""Least n·m of a wetted polygon with normal n at an edge of the crack that looks along m."""
NEAREST = 0.6
"""Largest distance in cells of a wetted polygon from the plane of the mouth."""


@dataclass(frozen=True)
class Cracks:
    """c plane gaps between two bodies each, closed in the geometry of the water.

    corners (k, 3) [m] of the faces, those of crack i from start[i], start (c+1,) · opening (c,) [m] ·
    bodies (c, 2), -1 = none · name (c,) number by which the flow of a crack is known from step to step."""

    corners: Array
    start: Array
    opening: Array
    bodies: Array
    name: Array

    def __len__(self) -> int:
        return len(self.opening)

    def middle(self) -> Array:
        """Mean of the corners of each crack (c, 3) [m]."""
        return np.array([self.corners[a:b].mean(axis=0) for a, b in pairwise(self.start)]).reshape(-1, 3)


@dataclass(frozen=True, kw_only=True)
class Slits:
    """s slits, each between two mouths: a piece of a crack about a cell long.

    difference csr (N, s): d of every slit · conductance (s,) κ [m] · area (s,) C_d g L [m²] ·
    rise (s, 3) Δx [m] from the second mouth to the first · flow (s,) Q [m³/s] from the first to the second ·
    name (s, 4): crack, the two edges, piece."""

    difference: sp.csr_array
    conductance: Array
    area: Array
    rise: Array
    flow: Array
    name: Array

    def __len__(self) -> int:
        return len(self.conductance)

    @classmethod
    def of(cls, domain, cracks: Cracks, spacing, before: Slits | None = None) -> Slits:
        """The slits of the cracks that have water at two opposite edges; flows are taken over from `before`.

        spacing [m]: size of the cells at each crack, or one for all."""
        spacing = np.broadcast_to(np.asarray(spacing, float), len(cracks))
        mouths = _Mouths.of(cracks, spacing)
        node, mouth, weight, centre = _patches(domain, cracks, mouths, spacing)
        n_mouths = len(mouths.crack)
        total = np.bincount(mouth, weight, minlength=n_mouths)
        open_ = (total[0::2] > 0.0) & (total[1::2] > 0.0)
        sign = np.where(mouth % 2 == 0, 1.0, -1.0)
        column = np.cumsum(open_) - 1
        kept = open_[mouth // 2]
        difference = sp.csr_array(
            ((sign * weight / total[mouth])[kept], (node[kept], column[mouth[kept] // 2])),
            shape=(len(domain.nodes), int(open_.sum())),
        )
        centre = centre / np.maximum(total, 1e-300)[:, None]
        first = np.flatnonzero(open_) * 2
        g, length, depth = cracks.opening[mouths.crack[first]], mouths.length[first], mouths.depth[first]
        name = mouths.name[first]
        return cls(
            difference=difference,
            conductance=conductance(g, length, depth, spacing[mouths.crack[first]]),
            area=DISCHARGE * g * length,
            rise=centre[first] - centre[first + 1],
            flow=np.zeros(len(first)) if before is None else before.flow_by_name(name),
            name=name,
        )

    @classmethod
    def remembered(cls, name, flow) -> Slits:
        """Slits with only their flows (s,) [m³/s] and names (s, 4), from which `of` takes the flows over."""
        s = len(flow)
        return cls(
            difference=sp.csr_array((0, s)),
            conductance=np.zeros(s),
            area=np.zeros(s),
            rise=np.zeros((s, 3)),
            flow=flow,
            name=name,
        )

    def flow_by_name(self, name) -> Array:
        """Flows (n,) of the slits with these names (n, 4), zero where there is none."""
        known = {tuple(row): q for row, q in zip(self.name.tolist(), self.flow)}
        return np.array([known.get(tuple(row), 0.0) for row in name.tolist()])

    def pressure_terms(self, dofs, known, weight, dt: float, density: float):
        """Equation (3) in the pressure system: matrix (n, n) [m³/(s Pa)] to add and right hand side (n,) [m³/s].

        dofs (n,) node of each unknown · known (n,) [Pa] part of the pressure that is not unknown · weight (3,) g."""
        d, damping = self.difference[dofs], 1.0 + self._loss(dt)
        gain = dt / density * self.conductance / damping
        start = self.flow / damping + gain * (d.T @ known - density * (self.rise @ weight))
        return sp.csr_array(d @ sp.diags_array(gain) @ d.T), -(d @ start)

    def advanced(self, dofs, pressure, weight, dt: float, density: float) -> Slits:
        """The slits after a step under the pressure (n,) [Pa] at the nodes dofs (n,), all others being dry; no water
        enters a dry mouth."""
        d = self.difference[dofs]
        drive = d.T @ pressure - density * (self.rise @ weight)
        flow = (self.flow + dt / density * self.conductance * drive) / (1.0 + self._loss(dt))
        giving = np.where(flow > 0.0, d.maximum(0.0).sum(axis=0), -d.minimum(0.0).sum(axis=0))
        return replace(self, flow=np.where(giving > 0.0, flow, 0.0))

    def _loss(self, dt):
        """β (s,) of equation (3)."""
        return dt * self.conductance * np.abs(self.flow) / (2.0 * self.area**2)

    def carried(self, dt: float) -> Array:
        """(N,) [m³] that the slits bring to the nodes in dt [s]; sums to zero."""
        return -dt * (self.difference @ self.flow)


def conductance(opening, length, depth, spacing):
    """Equation (1) [m]; opening, length, depth [m], spacing h [m]."""
    return length / (depth / opening + 2.0 / np.pi * np.log(np.maximum(2.0 * spacing / opening, 1.0)))


class _Mouths(NamedTuple):
    """Mouths 2k and 2k+1 of slit k: crack (m,), name (m, 4), length and depth (m,) [m], from (m, 3) and along (m, 3)
    unit: the piece of the edge, outward (m, 3), across (m, 3) unit normal of the crack."""

    crack: Array
    name: Array
    length: Array
    depth: Array
    origin: Array
    along: Array
    outward: Array
    across: Array

    @classmethod
    def of(cls, cracks: Cracks, spacing) -> _Mouths:
        rows = []
        for i in range(len(cracks)):
            rows += _mouths_of(
                i, int(cracks.name[i]), cracks.corners[cracks.start[i] : cracks.start[i + 1]], spacing[i]
            )
        columns = list(zip(*rows)) if rows else [()] * 8
        shapes = ((), (4,), (), (), (3,), (3,), (3,), (3,))
        kinds = (np.int64, np.int64, *[np.float64] * 6)
        return cls(*(np.array(c, dtype=k).reshape(-1, *s) for c, k, s in zip(columns, kinds, shapes)))


def _mouths_of(crack: int, name: int, corners, spacing: float) -> list:
    """Pairs of facing edges of a convex polygon (k, 3), cut into pieces about as long as the spacing."""
    ahead = np.roll(corners, -1, axis=0) - corners
    normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    normal = normal / np.linalg.norm(normal)
    length = np.linalg.norm(ahead, axis=1)
    along = ahead / length[:, None]
    outward = np.cross(along, normal)
    rows = []
    for e in range(len(corners)):
        for f in range(e + 1, len(corners)):
            if outward[e] @ outward[f] > -FACING:
                continue
            s = np.sort((corners[[f, (f + 1) % len(corners)]] - corners[e]) @ along[e])
            low, high = max(s[0], 0.0), min(s[1], length[e])
            if high - low <= 1e-6 * length[e]:
                continue
            pieces = max(1, int(np.ceil((high - low) / spacing - 0.1)))
            step = (high - low) / pieces
            for k in range(pieces):
                begin = low + k * step
                middle = corners[e] + (begin + step / 2) * along[e]
                depth = (corners[f] - middle) @ outward[f] / (-outward[e] @ outward[f])
                here = corners[e] + begin * along[e]
                there = here - depth * outward[e]
                for origin, out in ((here, outward[e]), (there, outward[f])):
                    rows.append((crack, (name, e, f, k), step, depth, origin, along[e], out, normal))
    return rows


def _patches(domain, cracks, mouths, spacing):
    """Hats in the mouths: node (w,), mouth (w,), weight (w,) [m²], and Σ weight x (m, 3) of every mouth."""
    order = np.argsort(domain.face_body, kind="stable")
    start = np.searchsorted(domain.face_body[order], np.arange(domain.n_bodies + 1))
    beside = (cracks.bodies, order, start)
    return _hats(mouths, beside, domain.polygons(), domain.nodes, domain.hats, spacing)


@kernel
def _hats(mouths, beside, polygons, nodes, hats, size):
    """Σ over the points of the wetted polygons at every mouth of weight N_a; weight: hats across and along the slit.

    beside: bodies (c, 2) of the cracks, and polygons order[start[b]:start[b + 1]] of body b."""
    crack, length, origin = mouths.crack, mouths.length, mouths.origin
    along, outward, across = mouths.along, mouths.outward, mouths.across
    bodies, order, start = beside
    face_cell, area, normal, points = polygons.cell, polygons.area, polygons.normal, polygons.points
    cells, parent, g = hats
    capacity, n = 256, 0
    node, mouth, weight = np.empty(capacity, np.int64), np.empty(capacity, np.int64), np.empty(capacity)
    centre = np.zeros((len(crack), 3))
    r = np.empty(3)
    for m in range(len(crack)):
        h = size[crack[m]]
        for side in range(2):
            body = bodies[crack[m], side]
            if body < 0:
                continue
            for at in range(start[body], start[body + 1]):
                s = order[at]
                if (
                    normal[s, 0] * outward[m, 0] + normal[s, 1] * outward[m, 1] + normal[s, 2] * outward[m, 2]
                    < FACING
                ):
                    continue
                e = face_cell[s]
                p, o = parent[e], cells[e, 0]
                for q in range(3):
                    t, c, d = 0.0, 0.0, 0.0
                    for k in range(3):
                        r[k] = points[s, q, k] - origin[m, k]
                        t += r[k] * along[m, k]
                        c += r[k] * across[m, k]
                        d += r[k] * outward[m, k]
                    beyond = max(-t, t - length[m], 0.0)
                    w = area[s] / 3.0 * (1.0 - abs(c) / h) * (1.0 - 2.0 * beyond / h)
                    if abs(c) >= h or 2.0 * beyond >= h or abs(d) > NEAREST * h:
                        continue
                    if n + 4 > capacity:
                        capacity *= 2
                        node = np.concatenate((node, np.empty_like(node)))
                        mouth = np.concatenate((mouth, np.empty_like(mouth)))
                        weight = np.concatenate((weight, np.empty_like(weight)))
                    rest = 1.0
                    for a in range(3, -1, -1):
                        hat = rest
                        if a > 0:
                            hat = 0.0
                            for k in range(3):
                                hat += g[p, a, k] * (points[s, q, k] - nodes[o, k])
                            rest -= hat
                        node[n], mouth[n], weight[n] = cells[e, a], m, w * hat
                        n += 1
                    for k in range(3):
                        centre[m, k] += w * points[s, q, k]
    return node[:n].copy(), mouth[:n].copy(), weight[:n].copy(), centre
