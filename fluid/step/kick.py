"""Acceleration of the last step that counts in the next one."""

from __future__ import annotations

import numpy as np

from kernels.decorators import ranged
from kernels.threads import over


def kick_factor(acceleration, calm: float, fast: float, size):
    """f = min(1, a_max / |a|) (N,) with a_max = max(calm [m/s²], fast [m²/s²] / size (N,) [m]): see
    `Water.kick_factor`."""
    out = np.empty(len(acceleration))
    over(_factor, len(out), acceleration, calm, fast, size, out)
    return out


@ranged
def _factor(first, last, a, calm, fast, size, out):
    for i in range(first, last):
        square, out[i] = a[i, 0] * a[i, 0] + a[i, 1] * a[i, 1] + a[i, 2] * a[i, 2], 1.0
        if square > 0.0:  # most of a tank is air at rest
            out[i] = min(1.0, max(calm, fast / size[i]) / max(np.sqrt(square), 1e-300))


def kicked(velocity, acceleration, kick, dt: float, whole: float, middle: float):
    """Velocity (N, 3) [m/s] after the shares `whole` and `middle` of a time dt [s] at the acceleration (N, 3) [m/s²]
    times kick (N,)."""
    u_hat, u_m = np.empty_like(velocity), np.empty_like(velocity)
    over(_kicked, len(velocity), velocity, acceleration, kick, dt, whole, middle, u_hat, u_m)
    return u_hat, u_m


@ranged
def _kicked(first, last, velocity, acceleration, kick, dt, whole, middle, u_hat, u_m):
    for j in range(first, last):
        i = np.uint64(j)
        factor = dt * kick[i]
        for k in range(3):
            a = factor * acceleration[i, k]
            u_hat[i, k] = velocity[i, k] + whole * a
            u_m[i, k] = velocity[i, k] + middle * a
