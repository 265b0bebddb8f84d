"""Sums over a field; momentum, kinetic energy and loads of many points, summed about one point."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from array_types import Array
from fluid.numerics.fields import is_nothing
from kernels.decorators import plain, ranged
from kernels.threads import CHUNK, over, summed

LEAF = 128
"""Most numbers that np.sum adds up in one go; it halves longer fields until they are as short."""


def total(field) -> float:
    """Σ of a field (N,), to the bit of np.sum, by all threads."""
    if is_nothing(field):
        return 0.0
    if len(field) <= LEAF:
        return float(field.sum())
    ends, joins = _halves(len(field))
    found = np.empty(len(ends) - 1)
    over(_leaves, len(found), field, ends, found, weight=LEAF // 10)
    _join(joins, found)
    return float(found[0])


@lru_cache(maxsize=4)
def _halves(n: int) -> tuple[Array, Array]:
    """Ends (k + 1,) of the parts of n > LEAF numbers that np.sum adds up in one go, and in what order it joins the sums
    of two neighbours (k - 1, 2): the first becomes that of both."""
    ends, joins = [0], []

    def parted(count: int) -> int:
        if count <= LEAF:
            ends.append(ends[-1] + count)
            return len(ends) - 2
        half = count // 2 - count // 2 % 8
        left, right = parted(half), parted(count - half)
        joins.append((left, right))
        return left

    parted(n)
    return np.array(ends), np.array(joins)


@ranged
def _leaves(first, last, field, ends, found):
    """Sums of the parts (k,): eight at a time, which are added by pairs, and then what is left."""
    for part in range(first, last):
        i, end = np.uint64(ends[part]), np.uint64(ends[part + 1])
        a, b, c, d, e, f, g, h = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        while i + np.uint64(8) <= end:
            a += field[i]
            b += field[i + np.uint64(1)]
            c += field[i + np.uint64(2)]
            d += field[i + np.uint64(3)]
            e += field[i + np.uint64(4)]
            f += field[i + np.uint64(5)]
            g += field[i + np.uint64(6)]
            h += field[i + np.uint64(7)]
            i += np.uint64(8)
        found[part] = ((a + b) + (c + d)) + ((e + f) + (g + h))
        while i < end:
            found[part] += field[i]
            i += np.uint64(1)


@plain
def _join(joins, found):
    for k in range(joins.shape[0]):
        found[joins[k, 0]] += found[joins[k, 1]]


def momentum_of(weight, u, place) -> Array:
    """Σ m_i [u_i; r_i × u_i] (6,); weight m (n,), u (n, 3), place r (n, 3)."""
    return momentum_of_rows(np.arange(len(weight)), 1.0, weight, u, place, np.zeros(3))


def momentum_of_rows(rows, density, volume, u, nodes, reference) -> Array:
    """ρ Σ W_i [u_i; (x_i - x_0) × u_i] (6,) over `rows`; volume W (n,) [m³], nodes x (n, 3), reference x_0 (3,)."""
    return momenta_of_rows(rows, density, [(volume, u)], nodes, reference)[0]


def momenta_of_rows(rows, density, fields, nodes, reference) -> Array:
    """`momentum_of_rows` (k, 6) of each of k pairs (W (n,) [m³], u (n, 3) [m/s])."""
    volumes, velocities = (tuple(np.ascontiguousarray(f) for f in each) for each in zip(*fields))
    return summed(_momenta, len(rows), (len(fields), 6), rows, density, volumes, velocities, nodes, reference)


@ranged
def _momenta(first, last, rows, density, volumes, velocities, nodes, reference, partial):
    x0, y0, z0 = reference[0], reference[1], reference[2]
    for c in range(first, last):
        for field in range(len(volumes)):
            volume, u = volumes[field], velocities[field]
            x, y, z, turn_x, turn_y, turn_z = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for s in range(c * CHUNK, min((c + 1) * CHUNK, rows.shape[0])):
                i = np.uint64(rows[s])
                m = density * volume[i]
                r0, r1, r2 = nodes[i, 0] - x0, nodes[i, 1] - y0, nodes[i, 2] - z0
                p0, p1, p2 = m * u[i, 0], m * u[i, 1], m * u[i, 2]
                x += p0
                y += p1
                z += p2
                turn_x += r1 * p2 - r2 * p1
                turn_y += r2 * p0 - r0 * p2
                turn_z += r0 * p1 - r1 * p0
            out = partial[c, field]
            out[0], out[1], out[2], out[3], out[4], out[5] = x, y, z, turn_x, turn_y, turn_z


def about(point, load, centre) -> Array:
    """Loads (n, 6) about their centres (n, 3) → their sum (6,) about a point (3,)."""
    total = np.zeros(6)
    load, centre = np.ascontiguousarray(load, float), np.ascontiguousarray(centre, float)
    _add_about(np.asarray(point, float), load.reshape(-1, 6), centre.reshape(-1, 3), total)
    return total


@plain
def _add_about(point, load, centre, total):
    for b in range(load.shape[0]):
        x, y, z = centre[b, 0] - point[0], centre[b, 1] - point[1], centre[b, 2] - point[2]
        total[0] += load[b, 0]
        total[1] += load[b, 1]
        total[2] += load[b, 2]
        total[3] += load[b, 3] + (y * load[b, 2] - z * load[b, 1])
        total[4] += load[b, 4] + (z * load[b, 0] - x * load[b, 2])
        total[5] += load[b, 5] + (x * load[b, 1] - y * load[b, 0])


def kinetic_energy(density, nodal_water, velocity) -> float:
    """½ ρ Σ W_i |u_i|² [J]; nodal_water (N,) [m³], velocity (N, 3) [m/s]."""
    return kinetic_energies(density, [(nodal_water, velocity)])[0]


def kinetic_energies(density, states) -> list[float]:
    """`kinetic_energy` of each of several pairs (nodal_water (N,), velocity (N, 3)) of equal length, in one loop."""
    volumes, velocities = (tuple(np.ascontiguousarray(f) for f in each) for each in zip(*states))
    total = summed(_squares_of, len(volumes[0]), (len(states),), volumes, velocities)
    return [0.5 * density * float(square) for square in total]


def dots(volumes, weight) -> Array:
    """Σ_i V_i w_i of each of several V (N,), and Σ_i V_i, (m, 2), in one loop; weight (N,)."""
    return summed(_dots, len(weight), (len(volumes), 2), tuple(volumes), weight)


@ranged
def _dots(first, last, volumes, weight, partial):
    for c in range(first, last):
        for field in range(len(volumes)):
            volume, total, plain = volumes[field], 0.0, 0.0
            for k in range(c * CHUNK, min((c + 1) * CHUNK, volume.shape[0])):
                i = np.uint64(k)
                total += volume[i] * weight[i]
                plain += volume[i]
            partial[c, field, 0], partial[c, field, 1] = total, plain


@ranged
def _squares_of(first, last, volumes, velocities, partial):
    for c in range(first, last):
        for field in range(len(volumes)):
            volume, velocity, total = volumes[field], velocities[field], 0.0
            for k in range(c * CHUNK, min((c + 1) * CHUNK, volume.shape[0])):
                i = np.uint64(k)
                if volume[i] != 0.0:  # most of a tank is dry: its velocities are not even read
                    x, y, z = velocity[i, 0], velocity[i, 1], velocity[i, 2]
                    total += volume[i] * (x * x + y * y + z * z)
            partial[c, field] = total
