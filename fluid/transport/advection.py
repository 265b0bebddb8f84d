"""Semi-Lagrangian transport with the MacCormack correction.

Foot of the path that ends at node x:           x_d = x - dt u_m(x_d),  u_m = u + dt/2 a       (fixed point)
Transported value:                              f1(x) = f(x_d)
Half of the error of one interpolation, estimated on the way back, is subtracted (Selle, Fedkiw, Kim, Liu, Rossignac,
J. Sci. Comput. 35 (2008) 350):                 f2(x) = f1(x) + [f(x) - f1(x + dt u_m)] / 2
The correction c = f2 - f1 may lead to the end of the range of f in the cell of the foot; what it would leave the range
by, x, is taken back from it:                   f(x) = f1(x) + sign(c) max(|c| - TAKEN_BACK x, 0)
A corner of the cell with the weight λ belongs to the range up to
                                                f1 + min(λ / COUNTED_IN_FULL, 1) (f_corner - f1)
so that the range does not jump as a foot passes from cell to cell. The result depends continuously on f and on the
paths; if corrections were rejected as a whole, a difference in the last digit became one of the velocity. It lies
within the values at the corners of the cell. In smooth flow it is f2: near a node both c and the range shrink with the
distance of the foot from it.

On open sides c = 0. The path forward from there ends at the side, so that the way back does not return f1, and only
half of the change would be applied (the water of a draining pool left with a quarter more energy than it had).

Paths are followed from cell to cell through open faces, starting in a cell of the node. This works on any mesh and
never leads through a wall, however thin, because cells at a wall have no neighbour on its other side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Floats
from fluid.mesh.arrays import Paths
from kernels.decorators import inlined, inner, ranged, released
from kernels.threads import over

_LONGEST_WALK = 100
SWEEPS = 3
"""Sweeps of the fixed point."""
OUTSIDE = -1e-9
"""Barycentric coordinate below which a point lies beyond a face."""
COUNTED_IN_FULL = 0.25
"""Weight of a corner from which on its value belongs to the range upstream in full: all four do in the middle of a
cell. The smaller it is, the more steeply the range changes near faces."""
TAKEN_BACK = 2.0
"""Multiple of what would leave the range by which a correction is reduced. With 2 a correction twice as large as the
range allows is left out, as untrustworthy, and a difference of corrections never grows."""


@inlined
def walk(x, e, mesh, lam):
    """Cell that holds x (3,), walking from cell e, both np.uint64; its barycentric coordinates in lam (4,).

    A point beyond a wall or an open side is moved to the nearest point of the face, in place: a clip of lam alone
    would shift it along the side, 2-5 % of the profile of a channel fed through that side."""
    nodes, cells, parent, g, neighbours = mesh.nodes, mesh.cells, mesh.parent, mesh.gradients, mesh.neighbours
    for _ in range(_LONGEST_WALK):
        p, o = parent[e], cells[e, 0]
        dx, dy, dz = x[0] - nodes[o, 0], x[1] - nodes[o, 1], x[2] - nodes[o, 2]
        one = g[p, 1, 0] * dx + g[p, 1, 1] * dy + g[p, 1, 2] * dz
        two = g[p, 2, 0] * dx + g[p, 2, 1] * dy + g[p, 2, 2] * dz
        three = g[p, 3, 0] * dx + g[p, 3, 1] * dy + g[p, 3, 2] * dz
        lam[0], lam[1], lam[2], lam[3] = 1.0 - one - two - three, one, two, three
        least = min(min(lam[0], one), min(two, three))
        exit_face, lowest = -1, -1e-12
        if least < lowest:
            for a in range(4):
                if lam[a] < lowest and neighbours[e, a] >= 0:
                    exit_face, lowest = a, lam[a]
        if exit_face >= 0:
            e = np.uint64(neighbours[e, np.uint64(exit_face)])
        elif not (least < OUTSIDE and _to_face(x, lam, g[p])):
            break
    total = 0.0
    for a in range(4):
        lam[a] = max(lam[a], 0.0)
        total += lam[a]
    for a in range(4):
        lam[a] /= total
    return e


@inner
def _to_face(x, lam, g):
    """Move x (3,) straight back to the face of the cell that it is farthest beyond, in place; False if it is inside."""
    face, lowest = -1, OUTSIDE
    for a in range(4):
        if lam[a] < lowest:
            face, lowest = a, lam[a]
    if face < 0:
        return False
    square = g[face, 0] ** 2 + g[face, 1] ** 2 + g[face, 2] ** 2
    for k in range(3):
        x[k] -= lowest / square * g[face, k]
    return True


def feet(listed, sense, dt, sweeps, u_m, mesh: Paths):
    """Where the paths through the listed nodes begin (sense -1) or end (sense +1): cell (n,), weights (n, 4).

    dt [s], u_m (N, 3) [m/s]. sweeps: fixed-point sweeps with u_m at the foot; 0 takes u_m at the node."""
    n = listed.shape[0]
    cell, weight = np.empty(n, np.int64), np.empty((n, 4))
    over(_feet, n, listed, sense * dt, sweeps, u_m, mesh, cell, weight)
    return cell, weight


@released
def _feet(first, last, listed, dt, sweeps, u_m, mesh, cell, weight):
    _all_feet(first, last, listed, dt, sweeps, u_m, mesh, np.empty((2, 4)), cell, weight)


@inner
def _all_feet(first, last, listed, dt, sweeps, u_m, mesh, scratch, cell, weight):
    """The loop of `feet`; scratch (2, 4): work space."""
    x, lam = scratch[0], scratch[1]
    for s in range(first, last):
        cell[s] = _foot(np.uint64(listed[s]), dt, sweeps, u_m, mesh, x, lam)
        for a in range(4):
            weight[s, a] = lam[a]


@inlined
def _foot(i, dt, sweeps, u_m, mesh, x, lam):
    """The other end of the path from node i (np.uint64) over dt [s], negative backwards: its cell, and its barycentric
    coordinates in lam (4,); x (4,): work space."""
    nodes, cells = mesh.nodes, mesh.cells
    ux, uy, uz = u_m[i, 0], u_m[i, 1], u_m[i, 2]
    e = np.uint64(mesh.node_cells[mesh.node_start[i]])
    for sweep in range(sweeps + 1):
        x[0], x[1], x[2] = nodes[i, 0] + dt * ux, nodes[i, 1] + dt * uy, nodes[i, 2] + dt * uz
        e = walk(x, e, mesh, lam)
        if sweep < sweeps:
            ux, uy, uz = 0.0, 0.0, 0.0
            for a in range(4):
                j = cells[e, a]
                ux += lam[a] * u_m[j, 0]
                uy += lam[a] * u_m[j, 1]
                uz += lam[a] * u_m[j, 2]
    return e


@released
def _brought(first, last, listed, dt, u_m, f, mesh, origin, f1):
    _bring(first, last, listed, dt, u_m, f, mesh, np.empty((2, 4)), origin, f1)


@inner
def _bring(first, last, listed, dt, u_m, f, mesh, scratch, origin, f1):
    """f1 (N, 4) at the listed nodes, and the origin of each: cell of its foot (n,) and weights of its corners (n, 4);
    scratch (2, 4): work space."""
    x, lam = scratch[0], scratch[1]
    cells, (cell, weight) = mesh.cells, origin
    for s in range(first, last):
        i = np.uint64(listed[s])
        e = _foot(i, -dt, SWEEPS, u_m, mesh, x, lam)
        f1[i, 0], f1[i, 1], f1[i, 2], f1[i, 3] = _interpolated(e, lam, cells, f)
        cell[s] = e
        for a in range(4):
            weight[s, a] = lam[a]


@inlined
def _interpolated(e, lam, cells, f):
    """f (N, 4) at the point of cell e with the barycentric coordinates lam (4,)."""
    v0, v1, v2, v3 = 0.0, 0.0, 0.0, 0.0
    for a in range(4):
        j = cells[e, a]
        v0 += lam[a] * f[j, 0]
        v1 += lam[a] * f[j, 1]
        v2 += lam[a] * f[j, 2]
        v3 += lam[a] * f[j, 3]
    return v0, v1, v2, v3


@released
def _limited(first, last, listed, dt, u_m, on_open_side, f, mesh, origin, f1, out):
    _limit(first, last, listed, dt, u_m, on_open_side, f, mesh, origin, f1, np.empty((3, 4)), out)


@inner
def _limit(first, last, listed, dt, u_m, on_open_side, f, mesh, origin, f1, scratch, out):
    """Set out (n, 4) to f1 with its limited correction, and to f1 alone on open sides. origin: as in `_bring` ·
    scratch (3, 4): work space."""
    x, lam, ahead = scratch[0], scratch[1], scratch[2]
    cells, (cell, weight) = mesh.cells, origin
    for s in range(first, last):
        i = np.uint64(listed[s])
        if on_open_side[i]:
            for k in range(4):
                out[s, k] = f1[i, k]
            continue
        e = _foot(i, dt, 0, u_m, mesh, x, lam)
        ahead[0], ahead[1], ahead[2], ahead[3] = _interpolated(e, lam, cells, f1)
        e = np.uint64(cell[s])
        for k in range(4):
            own = f1[i, k]
            low, high = own, own
            for a in range(4):
                reach = own + min(weight[s, a] / COUNTED_IN_FULL, 1.0) * (f[cells[e, a], k] - own)
                low, high = min(low, reach), max(high, reach)
            change = 0.5 * (f[i, k] - ahead[k])
            beyond = max(own + change - high, low - own - change, 0.0)
            left = max(abs(change) - TAKEN_BACK * beyond, 0.0)
            out[s, k] = own + np.copysign(left, change)


class Fields(NamedTuple):
    """u [m/s] and φ [m] of all nodes in one array (N, 4) · brought (N, 4): the same until `carried` sets it to what the
    first path brings to the nodes that it lists."""

    given: Floats
    brought: Floats

    @classmethod
    def of(cls, u, phi) -> Fields:
        """u (N, 3) [m/s] and φ (N,) [m]."""
        made = cls(*(np.empty((len(phi), 4)) for _ in range(2)))
        over(_stacked, len(phi), u, phi, *made)
        return made

    def renew(self, listed) -> None:
        """Have them carried once more after nodes (n,) have been listed."""
        over(_renewed, len(listed), listed, *self)


def carried(topology, listed, dt: float, u_m, fields: Fields, on_open_side):
    """u [m/s] and φ [m] after dt [s] at the listed nodes (n,), carried by u_m (N, 3) [m/s] → (n, 4); sets
    `fields.brought` at these nodes.

    on_open_side (N,) bool: nodes where water may leave."""
    n, (f, f1) = len(listed), fields
    out, origin = np.empty((n, 4)), (np.empty(n, np.uint32), np.empty((n, 4)))
    over(_brought, n, listed, dt, u_m, f, topology.paths, origin, f1)
    over(_limited, n, listed, dt, u_m, on_open_side, f, topology.paths, origin, f1, out)
    return out


@ranged
def _stacked(first, last, u, phi, f, copy):
    """u (N, 3) and φ (N,) in one array (N, 4), twice."""
    for j in range(first, last):
        i = np.uint64(j)
        for k in range(3):
            f[i, k] = copy[i, k] = u[i, k]
        f[i, 3] = copy[i, 3] = phi[i]


@ranged
def _renewed(first, last, listed, f, copy):
    """The copy (N, 4) of f (N, 4) at the listed nodes."""
    for s in range(first, last):
        i = np.uint64(listed[np.uint64(s)])
        copy[i, 0], copy[i, 1], copy[i, 2], copy[i, 3] = f[i, 0], f[i, 1], f[i, 2], f[i, 3]
