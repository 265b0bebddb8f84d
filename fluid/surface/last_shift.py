"""The last shift of the surface: what the total volume is off by once each node has been corrected (`volume.py`).

c of the correction belongs to the surface before, which in a sheet of a cell or two moves by much of its thickness.
What is left is made up for by a shift

    s (|ψ| + ε |d|),        d = Σ_pool (W - ∫_{φ<ψ} N dV) / Σ_pool c,                                      (3)

which is counted and reported, with one s for all nodes: along the surface as far as ψ has moved it, and alike in a pool
where it has not. In pools that are off in the other way than the whole, d is zero: with one d for all, a still basin
behind a wall lost a three-hundredth of its water while a column collapsed before the wall. By one length d everywhere,
the water of a weir 0.6 m high on cells of 0.1 m came to its nappe by sinking surfaces: of the discharge only 0.82 went
through the middle of the basin (now 0.99).
"""

from __future__ import annotations

import numpy as np

from fluid.domain.moments import nodal_water
from fluid.numerics.fields import copied
from fluid.numerics.sums import total
from fluid.surface.pools import own_shift, pools
from kernels.decorators import ranged
from kernels.threads import over

LAST_SHIFTS = (0.1, 0.3)
EVERYWHERE = 0.1
MOST_SECANTS = 4
"""Limits of the shift in cell sizes, the second for steps in which the first does not reach the total volume; ε of (3);
secant steps."""


def met_total(t, near, phi, moved, wanted, tolerance: float, most: float, spacing):
    """φ after the last shift (3), which brings the water in the cells `near` to a target [m³] within a tolerance [m³],
    that water (N,) [m³], the sum of it [m³], and the volume [m³] that the shift moved.

    moved: the band (n,), c (N,) [m²] and ψ (n,) [m] of (2) · wanted: W and what is in other cells (N,) [m³], target ·
    most: limit of the shift in sizes of the cells at each node, `spacing` (N,) [m].
    Secant steps on s of (3); where they do not reach the target within the limit, on |d| alone, and in the end on one
    length for all."""
    (band, slope, psi), (carried, inner, target) = moved, wanted
    before = nodal_water(near, 0.0, phi, t.parts, len(phi))
    start = volume = total(before)
    shifted, held = phi, before
    area = total(slope) if abs(target - start) > tolerance else 0.0
    if area > 0.0:
        uniform = np.full(len(band), abs(target - start) / area)
        label, count = pools(phi, *t.around)
        own = uniform
        if count > 1:
            own = own_shift(label, count, band, (carried, inner, before), slope, target - start)
        for way in (np.abs(psi) + EVERYWHERE * own, own, uniform)[: 3 if count > 1 else 2]:
            state, moved = (phi, before, start), (band, slope, way)
            shifted, held, volume = _along(t, near, state, moved, target, tolerance, most, spacing)
            if abs(target - volume) <= tolerance:
                break
    return shifted, held, volume, volume - start


def _along(t, near, state, moved, target, tolerance, most, spacing):
    """φ (N,), its water (N,) [m³] in the cells `near` and the sum of it [m³] after secant steps along a way (n,) [m] on
    the band, each node within `most` of its cells; state: these before, moved: band, c and the way."""
    (phi, held, volume), (band, slope, way) = state, moved
    shifted, s = phi, 0.0
    area = float(slope[band] @ way)
    farthest = most * max(over(_longest_way, len(band), band, way, spacing))
    for _ in range(MOST_SECANTS):
        if abs(target - volume) <= tolerance or area <= 0.0:
            break
        trial = float(np.clip(s + (target - volume) / area, -farthest, farthest))
        if trial == s:
            break
        shifted = copied(phi) if shifted is phi else shifted
        over(lower, len(band), band, phi, trial * way, most, spacing, shifted)
        held = nodal_water(near, 0.0, shifted, t.parts, len(phi))
        before, volume = volume, total(held)
        area, s = (volume - before) / (trial - s), trial
    return shifted, held, volume


@ranged
def _longest_way(first, last, band, way, spacing):
    """Largest spacing of the band over its way (n,) [m]."""
    longest = 0.0
    for s in range(first, last):
        longest = max(longest, spacing[band[s]] / max(way[s], 1e-300))
    return longest


@ranged
def lower(first, last, band, phi, shift, most, spacing, out):
    """φ (N,) less the shift (n,) within ± most cells, in `out` (N,) at the nodes of the band (n,)."""
    for s in range(first, last):
        i = np.uint64(band[s])
        limit = most * spacing[i]
        out[i] = phi[i] - min(max(shift[s], -limit), limit)
