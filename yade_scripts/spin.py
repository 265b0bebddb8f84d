"""Free rotation of bodies with unequal inertias, to second order in the substep.

YADE turns a body by its angular momentum seen from the axes at the beginning of the step (Allen and Tildesley 1989 take
those at its middle), which makes the rotation first order: free bodies gain energy in proportion to the step. A torque

    dt τ = (exp(-dt/2 ω) - 1) L⁺,   L⁺: angular momentum half a step later, ω = R I⁻¹ Rᵀ L

turns L⁺ back by as much as the axes are late; it is taken back in the next step, so that L itself is not touched.
"""

from __future__ import annotations

import numpy as np
from numba import njit

Array = np.ndarray


class SpinCorrection:
    """inertia (n, 3, 3) [kg m²] in the block frames · free (n,) bool: motion not prescribed."""

    def __init__(self, inertia: Array, free: Array):
        self._inertia = inertia
        self._inverse = np.array([np.linalg.inv(I) for I in inertia]).reshape(-1, 3, 3)
        self._free = free
        self._lent = np.zeros((len(inertia), 3))
        """dt τ of the step before [N m s]."""

    @property
    def unequal(self) -> Array:
        """(n,) bool: free blocks with unequal inertias."""
        trace = np.trace(self._inertia, axis1=1, axis2=2)[:, None, None] / 3.0
        return self._free & (np.abs(self._inertia - trace * np.eye(3)) > 1e-9 * trace).any(axis=(1, 2))

    def add(self, rows: Array, R: Array, v: Array, dt: float, last_dt: float, F: Array) -> None:
        """Add the correcting torques of the blocks `rows` to F (n, 6), which holds all other moments on them."""
        _correct(rows, R, v, self._inertia, self._inverse, dt, last_dt, self._lent, F)

    def save(self) -> Array:
        return self._lent.copy()

    def restore(self, saved: Array) -> None:
        self._lent[:] = saved


@njit(cache=True)
def _correct(rows, R, v, inertia, inverse, dt, last_dt, lent, F):
    """See the module text. v (n, 6): velocities half a step before the places R (n, 3, 3)."""
    for r in rows:
        w = v[r, 3:]
        # YADE reports the spin in the axes of the end of the step, its body components being those of the middle.
        body = R[r].T @ w
        momentum = _turned(-0.5 * last_dt * w, R[r] @ (inertia[r] @ body))
        now = momentum + 0.5 * dt * F[r, 3:]
        later = momentum + dt * F[r, 3:]
        spin = R[r] @ (inverse[r] @ (R[r].T @ now))
        lend = _turned(-0.5 * dt * spin, later) - later
        F[r, 3:] += (lend - lent[r]) / dt
        lent[r] = lend


@njit(cache=True)
def _turned(angle, u):
    """The vector u turned by a rotation vector (Rodrigues)."""
    size = np.sqrt(angle[0] ** 2 + angle[1] ** 2 + angle[2] ** 2)
    if size == 0.0:
        return u.copy()
    n = angle / size
    return np.cos(size) * u + np.sin(size) * np.cross(n, u) + (1.0 - np.cos(size)) * (n @ u) * n
