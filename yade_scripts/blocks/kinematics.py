"""Rigid blocks in motion: points and directions of a block in the world, velocities of points, forces about its centre.

x (n, 3) [m] centres · R (n, 3, 3) body frame → world · v (n, 6) [v, ω] · F (n, 6) [N, N m] about the centres.
"""

from __future__ import annotations

import numpy as np

from kernels.decorators import inner, kernel, plain
from kernels.lanes import for_both


@inner
def rotation_matrix(q, R):
    """Write the rotation R (3, 3) of the unit quaternion q = (x, y, z, w)."""
    x, y, z, w = q[0], q[1], q[2], q[3]
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)


@for_both
def place(row, R, x, local):
    """World position of a body point local (3,), as a tuple; row < 0 stands for the fixed world."""
    if row < 0:
        return local[0], local[1], local[2]
    r0, r1, r2 = turned(row, R, local)
    return x[row, 0] + r0, x[row, 1] + r1, x[row, 2] + r2


@for_both
def turned(row, R, local):
    """A direction of the body frame in world axes, as a tuple."""
    return (
        R[row, 0, 0] * local[0] + R[row, 0, 1] * local[1] + R[row, 0, 2] * local[2],
        R[row, 1, 0] * local[0] + R[row, 1, 1] * local[1] + R[row, 1, 2] * local[2],
        R[row, 2, 0] * local[0] + R[row, 2, 1] * local[1] + R[row, 2, 2] * local[2],
    )


@for_both
def dot(a, b):
    """a·b of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@for_both
def cross(a, b):
    """a × b of two vectors, as a tuple."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@for_both
def arm(row, x, at):
    """Lever of the world point `at` about the centre of a block, as a tuple; zero for the fixed world."""
    if row < 0:
        return 0.0, 0.0, 0.0
    return at[0] - x[row, 0], at[1] - x[row, 1], at[2] - x[row, 2]


@for_both
def parting(ra, rb, x, v, at):
    """Relative velocity of b against a, both taken at the world point `at`, as a tuple; v (n, 6) [v, ω]."""
    a0, a1, a2 = point_velocity(ra, x, v, at)
    b0, b1, b2 = point_velocity(rb, x, v, at)
    return b0 - a0, b1 - a1, b2 - a2


@for_both
def point_velocity(row, x, v, at):
    """Velocity of the body point now at `at`, as a tuple; v (n, 6) [v, ω]."""
    if row < 0:
        return 0.0, 0.0, 0.0
    c0, c1, c2 = cross((v[row, 3], v[row, 4], v[row, 5]), arm(row, x, at))
    return v[row, 0] + c0, v[row, 1] + c1, v[row, 2] + c2


@plain
def add_forces(ra, rb, x, force, moment, F):
    """Add a force and its moment about the centre of block a to F (n, 6) of a, and the opposite to block b."""
    if rb >= 0:
        apart = (x[ra, 0] - x[rb, 0], x[ra, 1] - x[rb, 1], x[ra, 2] - x[rb, 2])
        more = cross(apart, force)
        for k in range(3):
            F[rb, k] -= force[k]
            F[rb, 3 + k] -= moment[k] + more[k]
    for k in range(3):
        F[ra, k] += force[k]
        F[ra, 3 + k] += moment[k]


@kernel
def scatter(states, rows, frame, x, v, R):
    """YADE states (k, 13) of the blocks `rows` (k,) → x (n, 3), v (n, 6), R (n, 3, 3) in the block frames."""
    T = np.empty((3, 3))
    for i in range(len(rows)):
        r = rows[i]
        for k in range(3):
            x[r, k] = states[i, k]
        for k in range(6):
            v[r, k] = states[i, 3 + k]
        rotation_matrix(states[i, 9:13], T)
        for k in range(3):
            for c in range(3):
                R[r, k, c] = T[k, 0] * frame[r, 0, c] + T[k, 1] * frame[r, 1, c] + T[k, 2] * frame[r, 2, c]


@plain
def work_of(F, v_before, v_after, dt):
    """Work [J] of forces F (n, 6) over a leapfrog substep: F·(v⁻ + v⁺)/2 dt, the exact change of kinetic energy."""
    total = 0.0
    for i in range(len(F)):
        for k in range(6):
            total += F[i, k] * (v_before[i, k] + v_after[i, k])
    return 0.5 * total * dt


@plain
def work_on_rows(F, v_before, v_after, rows, free, dt):
    """`work_of` the forces on the blocks `rows`, and the part of it on those that are not free (n,) bool, [J]."""
    total = driven = 0.0
    for i in range(len(rows)):
        r = rows[i]
        for k in range(6):
            work = F[r, k] * (v_before[r, k] + v_after[r, k])
            total += work
            if not free[r]:
                driven += work
    return 0.5 * total * dt, 0.5 * driven * dt
