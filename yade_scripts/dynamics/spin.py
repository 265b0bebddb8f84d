"""Free rotation of bodies with unequal inertias, to second order in the substep.

YADE turns a body by its angular momentum seen from the axes at the beginning of the step (Allen and Tildesley 1989 take
those at its middle), which makes the rotation first order: free bodies gain energy in proportion to the step. A torque

    dt τ = (exp(-dt/2 ω) - 1) L⁺,   L⁺: angular momentum half a step later, ω = R I⁻¹ Rᵀ L

turns L⁺ back by the angle by which the axes lag behind; it is removed again in the next step, so that L itself is not
changed.
"""

from __future__ import annotations

import numpy as np

from array_types import Array
from kernels.decorators import inner, kernel, plain

STILL = 1e-7
"""Turn in a substep [rad] below which nothing is corrected."""


class SpinCorrection:
    """inertia (n, 3, 3) [kg m²] in the block frames · free (n,) bool: motion not prescribed."""

    def __init__(self, inertia: Array, free: Array):
        self._inertia = inertia
        self._inverse = np.array([np.linalg.inv(I) for I in inertia]).reshape(-1, 3, 3)
        self._lent = np.zeros((len(inertia), 3))
        """dt τ of the step before [N m s]."""
        trace = np.trace(inertia, axis1=1, axis2=2)[:, None, None] / 3.0
        self.unequal = free & (np.abs(inertia - trace * np.eye(3)) > 1e-9 * trace).any(axis=(1, 2))
        """(n,) bool: free blocks with unequal inertias."""

    def add(self, rows: Array, R: Array, v: Array, dt: float, last_dt: float, F: Array) -> None:
        """Add the correcting torques of the blocks `rows` to F (n, 6), which holds all other moments on them."""
        _correct(rows, R, v, self._inertia, self._inverse, dt, last_dt, self._lent, F)

    def forget(self, rows: Array) -> None:
        """Discard the corrections of blocks at rest."""
        self._lent[rows] = 0.0

    def save(self) -> Array:
        """The corrections (n, 3) [N m s] added in the last substep."""
        return self._lent.copy()

    def restore(self, saved: Array) -> None:
        """Return to what `save` gave."""
        self._lent[:] = saved


@kernel
def _correct(rows, R, v, inertia, inverse, dt, last_dt, lent, F):
    """See the module text. v (n, 6): velocities half a step before the places R (n, 3, 3)."""
    body, momentum, spin, lend = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for r in rows:
        w0, w1, w2 = v[r, 3], v[r, 4], v[r, 5]
        lend[:] = 0.0
        if (w0 * w0 + w1 * w1 + w2 * w2) * dt * dt > STILL**2:
            # YADE reports the spin in the axes of the end of the step, its body components being those of the middle.
            _to_body(R[r], v[r, 3:], body)
            _product(inertia[r], body, momentum)
            _to_world(R[r], momentum, body)
            _turn(-0.5 * last_dt, v[r, 3:], body, momentum)
            for k in range(3):
                body[k] = momentum[k] + 0.5 * dt * F[r, 3 + k]
                momentum[k] += dt * F[r, 3 + k]
            _to_body(R[r], body, spin)
            _product(inverse[r], spin, body)
            _to_world(R[r], body, spin)
            _turn(-0.5 * dt, spin, momentum, lend)
            for k in range(3):
                lend[k] -= momentum[k]
        for k in range(3):
            F[r, 3 + k] += (lend[k] - lent[r, k]) / dt
            lent[r, k] = lend[k]


@inner
def _to_body(R, u, out):
    for k in range(3):
        out[k] = R[0, k] * u[0] + R[1, k] * u[1] + R[2, k] * u[2]


@plain
def _to_world(R, u, out):
    for k in range(3):
        out[k] = R[k, 0] * u[0] + R[k, 1] * u[1] + R[k, 2] * u[2]


_product = _to_world
"""Matrix times vector."""


@inner
def _turn(time, spin, u, out):
    """The vector u turned by the rotation vector time * spin (Rodrigues)."""
    speed = np.sqrt(spin[0] ** 2 + spin[1] ** 2 + spin[2] ** 2)
    if speed == 0.0:
        for k in range(3):
            out[k] = u[k]
        return
    n0, n1, n2 = spin[0] / speed, spin[1] / speed, spin[2] / speed
    c, s = np.cos(time * speed), np.sin(time * speed)
    along = (1.0 - c) * (n0 * u[0] + n1 * u[1] + n2 * u[2])
    out[0] = c * u[0] + s * (n1 * u[2] - n2 * u[1]) + along * n0
    out[1] = c * u[1] + s * (n2 * u[0] - n0 * u[2]) + along * n1
    out[2] = c * u[2] + s * (n0 * u[1] - n1 * u[0]) + along * n2
