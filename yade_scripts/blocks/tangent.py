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
from kernels.decorators import inner, kernel


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
    """Where springs stand in a matrix: pair (s,) of bodies of each · two (p,) bool: the pair has a second body that is
    not the fixed world · rows, columns (e,) of the entries · n bodies."""

    pair: Ints
    two: Array
    rows: Ints
    columns: Ints
    n: int

    @classmethod
    def of(cls, springs: Springs, n: int) -> _Layout:
        """That of the springs between n bodies."""
        first = np.maximum(springs.a, springs.b)
        second = np.minimum(springs.a, springs.b)
        keys, pair = np.unique(first * (n + 1) + second + 1, return_inverse=True)
        row_a, row_b = keys // (n + 1), keys % (n + 1) - 1
        two = row_b >= 0
        rows = np.concatenate([row_a, row_b[two], row_a[two], row_b[two]])
        columns = np.concatenate([row_a, row_b[two], row_b[two], row_a[two]])
        six, shape = np.arange(6), (len(rows), 6, 6)
        i = np.broadcast_to(6 * rows[:, None, None] + six[None, :, None], shape)
        j = np.broadcast_to(6 * columns[:, None, None] + six[None, None, :], shape)
        return cls(pair, two, i.ravel(), j.ravel(), n)


def _assembled(springs: Springs, D: Array, layout: _Layout) -> sp.csr_array:
    """Sum of Bᵀ D B over the springs, (6n, 6n)."""
    two, size = layout.two, 6 * layout.n
    blocks = np.zeros((len(two), 12, 12))
    _accumulate(layout.pair, springs.a < springs.b, springs.arm_a, springs.arm_b, D, blocks)
    parts = [blocks[:, :6, :6], blocks[two][:, 6:, 6:], blocks[two][:, :6, 6:], blocks[two][:, 6:, :6]]
    values = np.concatenate(parts).ravel()
    return sp.csr_array((values, (layout.rows, layout.columns)), shape=(size, size))


@kernel
def _accumulate(pair, swap, arm_a, arm_b, D, out):
    """Sum Bᵀ D B of each spring into its pair's (12, 12) block; its first body has the larger row."""
    B = np.zeros((3, 12))
    for s in range(len(pair)):
        if not D[s].any():
            continue
        first, second = (arm_b[s], arm_a[s]) if swap[s] else (arm_a[s], arm_b[s])
        _relative(B, 0, 1.0, first)
        _relative(B, 6, -1.0, second)
        product, k = B.T @ (D[s] @ B), pair[s]
        # entry by entry: numba takes three seconds to compile the messages on shapes of arrays that might not fit
        for i in range(12):
            for j in range(12):
                out[k, i, j] += product[i, j]


@inner
def _relative(B, column, sign, r):
    """Write the velocity of the point at arm r, v + ω x r, into six columns of B."""
    for k in range(3):
        B[k, column + k] = sign
    B[0, column + 4], B[0, column + 5] = sign * r[2], -sign * r[1]
    B[1, column + 3], B[1, column + 5] = -sign * r[2], sign * r[0]
    B[2, column + 3], B[2, column + 4] = sign * r[1], -sign * r[0]


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
