"""Secant stiffness and damping of joints and contacts about the block centres, as sparse matrices.

Every joint point and every contact is a spring between two points of two bodies: normal n, stiffnesses k_n and k_t.
With the relative velocity w = B [v_a ω_a v_b ω_b] it adds Bᵀ (k_n nnᵀ + k_t (I - nnᵀ)) B; the same with the dashpots.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numba import njit

from yade_scripts.joint_kernel import place

Array = np.ndarray


@dataclass(frozen=True)
class Springs:
    """s springs: a, b (s,) rows, -1 for the fixed world · arm_a, arm_b (s, 3) [m] from the centres, world axes

    normal (s, 3) · kn, kt (s,) [N/m] · cn, ct (s,) [N s/m].
    """

    a: Array
    b: Array
    arm_a: Array
    arm_b: Array
    normal: Array
    kn: Array
    kt: Array
    cn: Array
    ct: Array

    @classmethod
    def none(cls) -> Springs:
        rows, vectors, scalars = np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0)
        return cls(rows, rows, vectors, vectors, vectors, scalars, scalars, scalars, scalars)

    def and_(self, other: Springs) -> Springs:
        """Both together."""
        return Springs(*(np.concatenate([mine, theirs]) for mine, theirs in zip(self._all(), other._all())))

    def _all(self) -> tuple[Array, ...]:
        return (self.a, self.b, self.arm_a, self.arm_b, self.normal, self.kn, self.kt, self.cn, self.ct)


def assemble(springs: Springs, n: int) -> tuple[sp.csr_array, sp.csr_array]:
    """Stiffness and damping, each (6n, 6n), symmetric and positive semi-definite."""
    first = np.maximum(springs.a, springs.b)
    second = np.minimum(springs.a, springs.b)
    keys, pair = np.unique(first * (n + 1) + second + 1, return_inverse=True)
    row_a, row_b = keys // (n + 1), keys % (n + 1) - 1
    blocks = np.zeros((2, len(keys), 12, 12))
    swap = springs.a < springs.b
    _accumulate(pair, swap, springs.arm_a, springs.arm_b, springs.normal, springs.kn, springs.kt, blocks[0])
    _accumulate(pair, swap, springs.arm_a, springs.arm_b, springs.normal, springs.cn, springs.ct, blocks[1])
    return _sparse(blocks[0], row_a, row_b, n), _sparse(blocks[1], row_a, row_b, n)


@njit(cache=True)
def _accumulate(pair, swap, arm_a, arm_b, normal, kn, kt, out):
    """Sum Bᵀ D B of each spring into its pair's (12, 12) block; its first body has the larger row."""
    B = np.zeros((3, 12))
    D = np.empty((3, 3))
    for s in range(len(pair)):
        if kn[s] == 0.0 and kt[s] == 0.0:
            continue
        first, second = (arm_b[s], arm_a[s]) if swap[s] else (arm_a[s], arm_b[s])
        _relative(B, 0, 1.0, first)
        _relative(B, 6, -1.0, second)
        for i in range(3):
            for j in range(3):
                D[i, j] = (kn[s] - kt[s]) * normal[s, i] * normal[s, j]
            D[i, i] += kt[s]
        out[pair[s]] += B.T @ (D @ B)


@njit(cache=True)
def _relative(B, column, sign, r):
    """Velocity of the point at arm r: v + ω x r, written into six columns of B."""
    for k in range(3):
        B[k, column + k] = sign
    B[0, column + 4], B[0, column + 5] = sign * r[2], -sign * r[1]
    B[1, column + 3], B[1, column + 5] = -sign * r[2], sign * r[0]
    B[2, column + 3], B[2, column + 4] = sign * r[1], -sign * r[0]


def _sparse(blocks: Array, row_a: Array, row_b: Array, n: int) -> sp.csr_array:
    two = row_b >= 0
    values = [blocks[:, :6, :6], blocks[two][:, 6:, 6:], blocks[two][:, :6, 6:], blocks[two][:, 6:, :6]]
    rows = np.concatenate([row_a, row_b[two], row_a[two], row_b[two]])
    columns = np.concatenate([row_a, row_b[two], row_b[two], row_a[two]])
    values = np.concatenate(values)
    six = np.arange(6)
    i = np.broadcast_to(6 * rows[:, None, None] + six[None, :, None], values.shape)
    j = np.broadcast_to(6 * columns[:, None, None] + six[None, None, :], values.shape)
    return sp.csr_array((values.ravel(), (i.ravel(), j.ravel())), shape=(6 * n, 6 * n))


def joint_springs(joints, x: Array, R: Array) -> Springs:
    """Springs of the live joints at places x (n, 3), R (n, 3, 3): secant k_s where open, k_c where closed."""
    alive = joints.alive[joints.joint_of]
    index = np.flatnonzero(alive)
    out = np.zeros((5, len(index), 3))
    stiffness = np.zeros((2, len(index)))
    _joint_springs(
        index, joints.joint_of, joints.a, joints.b, joints.xi_a, joints.xi_b, joints.weight, joints.normal, joints.k0,
        joints.df, joints.beta, joints.kc, joints.closing, joints.largest, x, R, out, stiffness,
    )  # fmt: skip
    j = joints.joint_of[index]
    kn, kt = stiffness
    return Springs(joints.a[j], joints.b[j], out[0], out[1], out[2], kn, kt, joints.eta * kn, joints.eta * kt)


@njit(cache=True)
def _joint_springs(
    index, joint_of, a, b, xi_a, xi_b, weight, normal, k0, df, beta, kc, closing, largest, x, R, out, k
):
    pa, pb = np.empty(3), np.empty(3)
    for i in range(len(index)):
        p = index[i]
        j = joint_of[p]
        place(a[j], R, x, xi_a[p], pa)
        place(b[j], R, x, xi_b[p], pb)
        n = R[a[j]] @ normal[j]
        mid = 0.5 * (pa + pb)
        out[0, i] = mid - x[a[j]]
        if b[j] >= 0:
            out[1, i] = mid - x[b[j]]
        out[2, i] = n
        r = largest[p] / df[j]
        ks = k0[j] * (1.0 - r) ** 2 if r < 1.0 else 0.0
        closed = np.dot(pb - pa, n) <= 0.0
        # An unopened point under a tiny gap is stiff either way; the closing stiffness is taken where it is closed.
        k[0, i] = weight[p] * ((kc[j] if closing[j] else 0.0) if closed else ks)
        k[1, i] = weight[p] * beta[j] ** 2 * ks
