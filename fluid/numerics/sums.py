"""Momentum, kinetic energy and loads of many points, summed about one point."""

from __future__ import annotations

import numpy as np

from array_types import Array
from fluid.numerics.threads import CHUNK, summed
from kernel_decorators import ranged


def momentum_of(weight, u, place) -> Array:
    """Σ m_i [u_i; r_i × u_i] (6,); weight m (n,), u (n, 3), place r (n, 3)."""
    return momentum_of_rows(np.arange(len(weight)), 1.0, weight, u, place, np.zeros(3))


def momentum_of_rows(rows, density, volume, u, nodes, reference):
    """ρ Σ W_i [u_i; (x_i - x_0) × u_i] (6,) over `rows`; volume W (n,) [m³], nodes x (n, 3), reference x_0 (3,)."""
    return summed(_momentum, len(rows), (6,), rows, density, volume, u, nodes, reference)


@ranged
def _momentum(first, last, rows, density, volume, u, nodes, reference, partial):
    for c in range(first, last):
        out = partial[c]
        for s in range(c * CHUNK, min((c + 1) * CHUNK, rows.shape[0])):
            i = rows[s]
            m = density * volume[i]
            r0, r1, r2 = nodes[i, 0] - reference[0], nodes[i, 1] - reference[1], nodes[i, 2] - reference[2]
            p0, p1, p2 = m * u[i, 0], m * u[i, 1], m * u[i, 2]
            out[0] += p0
            out[1] += p1
            out[2] += p2
            out[3] += r1 * p2 - r2 * p1
            out[4] += r2 * p0 - r0 * p2
            out[5] += r0 * p1 - r1 * p0


def about(point, load, centre) -> Array:
    """Loads (n, 6) about their centres (n, 3) → their sum (6,) about a point (3,)."""
    load, arm = np.reshape(load, (-1, 6)), np.reshape(centre, (-1, 3)) - point
    return np.concatenate([load[:, :3].sum(axis=0), (load[:, 3:] + np.cross(arm, load[:, :3])).sum(axis=0)])


def kinetic_energy(density, nodal_water, velocity) -> float:
    """½ ρ Σ W_i |u_i|² [J]; nodal_water (N,) [m³], velocity (N, 3) [m/s]."""
    return 0.5 * density * float(summed(_square_of, len(nodal_water), (1,), nodal_water, velocity)[0])


@ranged
def _square_of(first, last, nodal_water, velocity, partial):
    for c in range(first, last):
        total = 0.0
        for i in range(c * CHUNK, min((c + 1) * CHUNK, nodal_water.shape[0])):
            if nodal_water[i] != 0.0:  # most of a tank is dry: its velocities are not even read
                u = velocity[i]
                total += nodal_water[i] * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
        partial[c, 0] = total
