"""The coupling matrix G: the loads of pressure on bodies, and the flux that the motion of bodies gives the water."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from fluid.domain.hats import POLYGON, hats_at
from fluid.numerics.fields import accumulate
from kernels.decorators import kernel, ranged, released
from kernels.threads import over


def wetted_coupling(domain, polygons=slice(None), weight=1.0) -> sp.csr_matrix:
    """G (N, 6 n_bodies): G[i, 6b:6b+3] = ∫ N_i n dA [m2], G[i, 6b+3:6b+6] = ∫ N_i (x - x_b) x n dA [m3].

    n points out of body b, so a pressure field p loads it by force and torque -G^T p, and G V is the flux
    that the body's motion V = (v, omega) pushes into the test functions. Exact: the integrands are of
    degree 2. domain: PhysicalDomain; polygons: rows of its wetted polygons to sum over, each with its weight."""
    shape = (len(domain.nodes), 6 * domain.n_bodies)
    wetted = domain.polygons(polygons)
    wetted = wetted._replace(area=weight * wetted.area)
    if len(wetted.cell) == 0:
        return sp.csr_matrix(shape)
    n, bodies = len(domain.nodes), (wetted.body, domain.n_bodies)
    block, row = np.empty((len(wetted.cell), 4, 6)), np.zeros(n + 1, np.int64)
    over(_blocks, len(block), wetted, domain.body_centre, domain.nodes, domain.hats, block, weight=POLYGON)
    start, members = polygons_of_nodes(wetted.cell, domain.cells, n)
    over(_distinct, n, start, members, *bodies, row[1:])
    np.cumsum(row, out=row)
    values, columns = np.empty((row[-1], 6)), np.empty((row[-1], 6), np.int64)
    over(_summed, n, start, members, wetted.body, block, row, domain.n_bodies, values, columns, weight=3)
    return sp.csr_matrix((values.ravel(), columns.ravel(), 6 * row), shape=shape)


def rows_of(coupling, rows) -> sp.csr_matrix:
    """The listed rows (n,) of a csr matrix, in their order."""
    start = np.zeros(len(rows) + 1, coupling.indptr.dtype)
    over(_lengths, len(rows), rows, coupling.indptr, start[1:])
    accumulate(start)
    column, entry = np.empty(start[-1], coupling.indices.dtype), np.empty(start[-1])
    given = (coupling.indptr, coupling.indices, coupling.data)
    over(_copy_rows, len(rows), rows, given, (start, column, entry))
    return sp.csr_matrix((entry, column, start), shape=(len(rows), coupling.shape[1]))


@ranged
def _lengths(first, last, rows, start, length):
    for r in range(first, last):
        length[r] = start[rows[r] + 1] - start[rows[r]]


@ranged
def _copy_rows(first, last, rows, given, made):
    """given, made: start, column and entry of each row of a csr matrix."""
    start, column, entry = given
    to, column_there, entry_there = made
    for r in range(first, last):
        at = start[rows[r]]
        for k in range(to[r + 1] - to[r]):
            column_there[to[r] + k], entry_there[to[r] + k] = column[at + k], entry[at + k]


@released
def _blocks(first, last, polygons, centre, nodes, hats, block):
    """block (S, 4, 6) ← ∫ N_a (n, (x - x_b) x n) dA over every polygon, a the corners of its cell."""
    x, hat, turning = np.empty(3), np.empty(4), np.empty(3)
    for row in range(first, last):
        s = np.uint64(row)
        e, b = polygons.cell[s], np.uint64(polygons.body[s])
        n0, n1, n2 = polygons.normal[s, 0], polygons.normal[s, 1], polygons.normal[s, 2]
        for a in range(4):
            for c in range(6):
                block[s, a, c] = 0.0
        for q in range(3):
            hats_at(e, polygons.points[s, q], hats, nodes, hat)
            for c in range(3):
                x[c] = polygons.points[s, q, c] - centre[b, c]
            turning[0], turning[1], turning[2] = (
                x[1] * n2 - x[2] * n1,
                x[2] * n0 - x[0] * n2,
                x[0] * n1 - x[1] * n0,
            )
            for a in range(4):
                w = hat[a] * polygons.area[s] / 3.0
                block[s, a, 0] += w * n0
                block[s, a, 1] += w * n1
                block[s, a, 2] += w * n2
                for c in range(3):
                    block[s, a, 3 + c] += w * turning[c]


@kernel
def polygons_of_nodes(face_cell, cells, n_nodes):
    """4 s + a of every polygon s at every node (its cell's corner a): start (N + 1,), members."""
    start = np.zeros(n_nodes + 1, np.int64)
    for s in range(len(face_cell)):
        for a in range(4):
            start[cells[face_cell[s], a] + 1] += 1
    for i in range(n_nodes):
        start[i + 1] += start[i]
    filled, members = start[:-1].copy(), np.empty(4 * len(face_cell), np.int64)
    for s in range(len(face_cell)):
        for a in range(4):
            i = cells[face_cell[s], a]
            members[filled[i]] = 4 * s + a
            filled[i] += 1
    return start, members


@released
def _distinct(first, last, start, members, body, n_bodies, count):
    """count (N,) ← how many bodies each node has polygons of."""
    seen = np.full(n_bodies, -1, np.int64)
    for i in range(first, last):
        count[i] = 0
        for t in range(start[i], start[i + 1]):
            b = body[members[t] // 4]
            if seen[b] != i:
                seen[b] = i
                count[i] += 1


@released
def _summed(first, last, start, members, body, block, row, n_bodies, values, columns):
    """values and columns (pairs, 6) of the rows, bodies in ascending order; row (N + 1,): start of each node's
    pairs."""
    place = np.full(n_bodies, -1, np.int64)
    for i in range(first, last):
        n = 0
        around = columns[row[i] : row[i + 1], 0]
        for t in range(start[i], start[i + 1]):
            b = body[members[t] // 4]
            if place[b] < row[i]:
                place[b] = row[i]
                k = n
                while k > 0 and around[k - 1] > b:
                    around[k] = around[k - 1]
                    k -= 1
                around[k] = b
                n += 1
        for k in range(n):
            place[around[k]] = row[i] + k
            for c in range(6):
                values[row[i] + k, c] = 0.0
        for t in range(start[i], start[i + 1]):
            s, a = members[t] // 4, members[t] % 4
            at = place[body[s]]
            for c in range(6):
                values[at, c] += block[s, a, c]
        for k in range(n):
            column = 6 * around[k]
            for c in range(6):
                columns[row[i] + k, c] = column + c
