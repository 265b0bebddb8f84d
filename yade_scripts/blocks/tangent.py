"""Secant stiffness and damping of joints and contacts about the block centres, as sparse matrices.

Every joint point and every contact is a spring between two points of two bodies: normal n, stiffnesses k_n and k_t.
With the relative velocity w = B [v_a ω_a v_b ω_b] it adds Bᵀ (k_n nnᵀ + k_t (I - nnᵀ)) B; the same with the dashpots.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from array_types import Array, Floats, Ints
from kernels.decorators import kernel, plain
from kernels.fused import fused


@dataclass(frozen=True, kw_only=True)
class Springs:
    """s springs: a, b (s,) rows, -1 for the fixed world · arm_a, arm_b (s, 3) [m] from the centres, world axes

    normal (s, 3) · kn, kt (s,) [N/m] · cn, ct (s,) [N s/m].
    """

    a: Ints
    b: Ints
    arm_a: Floats
    arm_b: Floats
    normal: Floats
    kn: Floats
    kt: Floats
    cn: Floats
    ct: Floats

    @classmethod
    def none(cls) -> Springs:
        """No springs."""
        rows, vectors, scalars = np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0)
        return cls(
            a=rows,
            b=rows,
            arm_a=vectors,
            arm_b=vectors,
            normal=vectors,
            kn=scalars,
            kt=scalars,
            cn=scalars,
            ct=scalars,
        )

    def and_(self, other: Springs) -> Springs:
        """The springs of both, concatenated."""
        return Springs(
            **{
                field.name: np.concatenate([getattr(s, field.name) for s in (self, other)])
                for field in fields(self)
            }
        )


def assemble(springs: Springs, n: int) -> tuple[sp.csr_array, sp.csr_array]:
    """Stiffness and damping, each (6n, 6n), symmetric and positive semi-definite."""
    layout = _Layout.of(springs, n)
    K = _assembled(springs, _across(springs.normal, springs.kn, springs.kt), layout)
    return K, _assembled(springs, _across(springs.normal, springs.cn, springs.ct), layout)


def _across(normal: Array, kn: Array, kt: Array) -> Array:
    """k_n nnᵀ + k_t (I - nnᵀ) of each spring, (s, 3, 3)."""
    D = (kn - kt)[:, None, None] * normal[:, :, None] * normal[:, None, :]
    D[:, range(3), range(3)] += kt[:, None]
    return D


class _Layout(NamedTuple):
    """Where springs stand in a matrix: pair (s,) of bodies of each, of `pairs` · indptr (6n + 1,), indices (m,): the
    entries of the matrix · start (m + 1,), source (e,): the numbers of the pairs' (12, 12) blocks that add up to each
    entry, in their order."""

    pair: Ints
    pairs: int
    indptr: Ints
    indices: Ints
    start: Ints
    source: Ints

    @classmethod
    def of(cls, springs: Springs, n: int) -> _Layout:
        """That of the springs between n bodies."""
        first = np.maximum(springs.a, springs.b)
        second = np.minimum(springs.a, springs.b)
        keys, pair = np.unique(first * (n + 1) + second + 1, return_inverse=True)
        row_a, row_b = keys // (n + 1), keys % (n + 1) - 1
        both = np.flatnonzero(row_b >= 0)  # the pair has a second body that is not the fixed world
        rows = np.concatenate([row_a, row_b[both], row_a[both], row_b[both]])
        columns = np.concatenate([row_a, row_b[both], row_b[both], row_a[both]])
        corner = 144 * np.concatenate(
            [np.arange(len(keys)), both, both, both]
        )  # of each block in those of the pairs
        corner += np.repeat([0, 6 * 12 + 6, 6, 6 * 12], [len(keys), *[len(both)] * 3])
        listed = sp.csr_array(_entries(rows, columns, corner, n), shape=(6 * n, 6 * n))
        listed.sort_indices()
        indptr, indices, start = _distinct(listed.indptr, listed.indices)
        return cls(pair, len(keys), indptr, indices, start, listed.data.astype(np.int64))


def _assembled(springs: Springs, D: Array, layout: _Layout) -> sp.csr_array:
    """Sum of Bᵀ D B over the springs, (6n, 6n)."""
    blocks, size = np.zeros((layout.pairs, 12, 12)), len(layout.indptr) - 1
    _accumulate(
        layout.pair, springs.a < springs.b, springs.arm_a, springs.arm_b, D, blocks, np.empty((3, 12))
    )
    values = np.empty(len(layout.indices))
    _add_up(layout.start, layout.source, blocks.reshape(-1), values)
    found = sp.csr_array((values, layout.indices.copy(), layout.indptr.copy()), shape=(size, size))
    found.has_canonical_format = True
    return found


@kernel
def _entries(rows, columns, corner, n):
    """Blocks (6, 6) at rows and columns (k,) of bodies as a csr matrix of 6n rows, an entry for each of their numbers:
    its place in the blocks of the pairs, where a block begins at its corner (k,) · column · indptr."""
    indptr = np.zeros(6 * n + 1, np.int32)
    for k in range(len(rows)):
        for i in range(6):
            indptr[6 * rows[k] + i + 1] += 6
    for r in range(6 * n):
        indptr[r + 1] += indptr[r]
    filled = indptr[:-1].copy()
    indices, place = np.empty(indptr[-1], np.int32), np.empty(indptr[-1])
    for k in range(len(rows)):
        for i in range(6):
            at = filled[6 * rows[k] + i]
            for j in range(6):
                indices[at + j], place[at + j] = 6 * columns[k] + j, corner[k] + 12 * i + j
            filled[6 * rows[k] + i] += 6
    return place, indices, indptr


@kernel
def _distinct(indptr, indices):
    """indptr and indices (m,) of a csr matrix with sorted rows without repeated entries, and where each of its entries
    begins among the given ones (m + 1,)."""
    row_start, column, start = (
        np.zeros_like(indptr),
        np.empty_like(indices),
        np.empty(len(indices) + 1, np.int64),
    )
    n = 0
    for r in range(len(indptr) - 1):
        for s in range(indptr[r], indptr[r + 1]):
            if s == indptr[r] or indices[s] != indices[s - 1]:
                column[n], start[n] = indices[s], s
                n += 1
        row_start[r + 1] = n
    start[n] = len(indices)
    return row_start, column[:n].copy(), start[: n + 1].copy()


@plain
def _add_up(start, source, numbers, values):
    """values (m,) ← the sums of numbers[source[start[k]:start[k + 1]]], in that order."""
    for k in range(len(values)):
        total = numbers[source[start[k]]]
        for s in range(start[k] + 1, start[k + 1]):
            total += numbers[source[s]]
        values[k] = total


@plain
def _accumulate(pair, swap, arm_a, arm_b, D, out, X):
    """Sum Bᵀ D B of each spring into its pair's (12, 12) block; its first body has the larger row. B = [I, -r×, -I, r×]
    with the arms r; X (3, 12), work space, holds D B.

    Written out with fused products: the bits of a product of matrices by BLAS, in a quarter of its time."""
    for s in range(len(pair)):
        d, k = D[s], pair[s]
        some = False
        for i in range(3):
            for j in range(3):
                some = some or d[i, j] != 0.0
        if not some:
            continue
        for half in range(2):
            sign, c = 1.0 - 2.0 * half, 6 * half
            r = arm_b[s] if swap[s] == (half == 0) else arm_a[s]
            x, y, z = sign * r[0], sign * r[1], sign * r[2]
            for i in range(3):
                for j in range(3):
                    X[i, c + j] = sign * d[i, j]
                X[i, c + 3] = fused(d[i, 2], y, d[i, 1] * -z)
                X[i, c + 4] = fused(d[i, 2], -x, d[i, 0] * z)
                X[i, c + 5] = fused(d[i, 1], x, d[i, 0] * -y)
        for half in range(2):
            sign, c = 1.0 - 2.0 * half, 6 * half
            r = arm_b[s] if swap[s] == (half == 0) else arm_a[s]
            x, y, z = sign * r[0], sign * r[1], sign * r[2]
            for j in range(12):
                for i in range(3):
                    out[k, c + i, j] += sign * X[i, j]
                out[k, c + 3, j] += fused(y, X[2, j], -z * X[1, j])
                out[k, c + 4, j] += fused(-x, X[2, j], z * X[0, j])
                out[k, c + 5, j] += fused(x, X[1, j], -y * X[0, j])


def joint_springs(joints, x: Array, R: Array, index: Array | None = None) -> Springs:
    """Springs of the points `index` of joints, by default of all that are alive and do not rest, at places x (n, 3),
    R (n, 3, 3): secant k_s where open, k_c where closed."""
    index = joints.visited_points() if index is None else index
    arm, normal, k = np.zeros((2, len(index), 3)), np.zeros((len(index), 3)), np.zeros((2, len(index)))
    for kernels, own, arrays in joints.of_points(index):
        arms, normals, stiffness = arm[:, own], normal[own], k[:, own]  # copies
        kernels.point_springs(*arrays, (x, R), (arms, normals, stiffness))
        arm[:, own], normal[own], k[:, own] = arms, normals, stiffness
    j = joints.joint_of[index]
    kn, kt = k * joints.weight[index]
    return Springs(
        a=joints.a[j],
        b=joints.b[j],
        arm_a=arm[0],
        arm_b=arm[1],
        normal=normal,
        kn=kn,
        kt=kt,
        cn=joints.eta * kn,
        ct=joints.eta * kt,
    )


def joint_tangent(joints, x: Array, R: Array, n: int, index: Array | None = None) -> sp.csr_array:
    """Tangent stiffness (6n, 6n) of the points `index` of joints, by default of all that are alive and do not rest,
    on further opening; softening makes it indefinite.

    The rotation of the normals with the blocks is neglected: it is of the order of the tractions times the openings."""
    index = joints.visited_points() if index is None else index
    springs = joint_springs(joints, x, R, index)
    D = np.zeros((len(index), 3, 3))
    for kernels, own, arrays in joints.of_points(index):
        found = D[own]  # a copy
        kernels.point_tangents(*arrays, (x, R), found)
        D[own] = found
    D = 0.5 * (D + D.transpose(0, 2, 1)) * joints.weight[index][:, None, None]
    return _assembled(springs, D, _Layout.of(springs, n))
