"""Semi-Lagrangian transport with the MacCormack correction.

Foot of the path that ends at node x:           x_d = x - dt u_m(x_d),  u_m = u + dt/2 a       (fixed point)
Transported value:                              f1(x) = f(x_d)
Half of the error of one interpolation, estimated on the way back, is subtracted (Selle, Fedkiw, Kim, Liu, Rossignac,
J. Sci. Comput. 35 (2008) 350):                 f2(x) = f1(x) + [f(x) - f1(x + dt u_m)] / 2
f2 is rejected where it leaves the range of f in the cell of the foot, and on open sides: the path forward from there
ends at the side, so that the way back does not return f1, and only half of the change would be applied (the water of a
draining pool left with a quarter more energy than it had).

Paths are followed from cell to cell through open faces, starting in a cell of the node. This works on any mesh and
never leads through a wall, however thin, because cells at a wall have no neighbour on its other side."""

from __future__ import annotations

import numpy as np

from fluid.mesh.arrays import Paths
from fluid.numerics.fields import copied
from kernels.decorators import inlined, inner, ranged, released
from kernels.threads import over

_LONGEST_WALK = 100


@inlined
def walk(x, e, mesh, lam):
    """Cell that holds x (3,), walking from cell e; its barycentric coordinates in lam (4,).

    A point beyond a wall or an open side is moved to the nearest point of the face, in place: a clip of lam alone
    would shift it along the side, 2-5 % of the profile of a channel fed through that side."""
    nodes, cells, parent, g, neighbours = mesh.nodes, mesh.cells, mesh.parent, mesh.gradients, mesh.neighbours
    for _ in range(_LONGEST_WALK):
        p = parent[e]
        o = cells[e, 0]
        lam[0] = 1.0
        for a in range(1, 4):
            lam[a] = (
                g[p, a, 0] * (x[0] - nodes[o, 0])
                + g[p, a, 1] * (x[1] - nodes[o, 1])
                + g[p, a, 2] * (x[2] - nodes[o, 2])
            )
            lam[0] -= lam[a]
        exit_face, lowest = -1, -1e-12
        for a in range(4):
            if lam[a] < lowest and neighbours[e, a] >= 0:
                exit_face, lowest = a, lam[a]
        if exit_face < 0:
            if not _to_face(x, lam, g[p]):
                break
        else:
            e = neighbours[e, exit_face]
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
    face, lowest = -1, -1e-9
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
    _trace(first, last, listed, dt, sweeps, u_m, mesh, np.empty((3, 4)), cell, weight)


@inner
def _trace(first, last, listed, dt, sweeps, u_m, mesh, scratch, cell, weight):
    """The loop of `feet`; scratch (3, 4): work space."""
    x, lam, u = scratch[0], scratch[1], scratch[2]
    for s in range(first, last):
        i = listed[s]
        for k in range(3):
            u[k] = u_m[i, k]
        e = np.int64(mesh.node_cells[mesh.node_start[i]])
        for sweep in range(sweeps + 1):
            for k in range(3):
                x[k] = mesh.nodes[i, k] + dt * u[k]
            e = walk(x, e, mesh, lam)
            if sweep < sweeps:
                for k in range(3):
                    u[k] = 0.0
                    for a in range(4):
                        u[k] += lam[a] * u_m[mesh.cells[e, a], k]
        cell[s] = e
        for a in range(4):
            weight[s, a] = lam[a]


def interpolate(cell, weight, cells, f):
    """Σ_a weight_a f_a (n, m) at points given by cell (n,) and weights (n, 4); f (N, m)."""
    out = np.empty((len(cell), f.shape[1]))
    over(_interpolate, len(cell), cell, weight, cells, f, out)
    return out


@ranged
def _interpolate(first, last, cell, weight, cells, f, out):
    for s in range(first, last):
        for k in range(f.shape[1]):
            out[s, k] = 0.0
        for a in range(4):
            j = cells[cell[s], a]
            for k in range(f.shape[1]):
                out[s, k] += weight[s, a] * f[j, k]
    return out


@ranged
def _put(first, last, listed, values, out):
    """out (N, m) at the listed nodes takes the values (n, m), in place: a quarter of the time of indexing by a list."""
    for s in range(first, last):
        for k in range(out.shape[1]):
            out[listed[s], k] = values[s, k]


@ranged
def _limited(first, last, listed, on_open_side, foot, f, f1, f1_ahead, cells, out):
    """Set out (n, m) to f2 where this stays within the range of f over the cell of the foot, and to f1 elsewhere and on
    open sides. foot: its cell (n,) and weights (n, 4).

    Only corners with a weight count: a foot on a face must not depend on the side it was found from."""
    back_cell, back_weight = foot
    for s in range(first, last):
        e = back_cell[s]
        for k in range(f.shape[1]):
            low, high = np.inf, -np.inf
            for a in range(4):
                if back_weight[s, a] > 1e-9:
                    low, high = min(low, f[cells[e, a], k]), max(high, f[cells[e, a], k])
            f2 = f1[s, k] + 0.5 * (f[listed[s], k] - f1_ahead[s, k])
            out[s, k] = f2 if low <= f2 <= high and not on_open_side[listed[s]] else f1[s, k]


def transport(topology, listed, dt: float, u_m, f, on_open_side):
    """Values of f (N, m) after dt [s] at the listed nodes (n,), carried by u_m (N, 3) [m/s] → (n, m).

    on_open_side (N,) bool: nodes where water may leave."""
    t = topology
    cell, weight = feet(listed, -1.0, dt, 3, u_m, t.paths)
    f1 = interpolate(cell, weight, t.cells, f)
    moved = copied(f)
    over(_put, len(listed), listed, f1, moved)
    ahead, ahead_weight = feet(listed, 1.0, dt, 0, u_m, t.paths)
    f1_ahead = interpolate(ahead, ahead_weight, t.cells, moved)
    out = np.empty_like(f1)
    over(_limited, len(listed), listed, on_open_side, (cell, weight), f, f1, f1_ahead, t.cells, out)
    return out
