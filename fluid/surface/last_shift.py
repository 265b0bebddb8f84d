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
    that water (N,) [m³], and the volume [m³] that the shift moved.

    moved: the band (n,), c (N,) [m²] and ψ (n,) [m] of (2) · wanted: W and what is in other cells (N,) [m³], target ·
    most: limit of the shift in sizes of the cells at each node, `spacing` (N,) [m].
    Secant steps on s of (3); where they do not reach the target within the limit, on |d| alone, and in the end on one
    length for all."""
    (band, slope, psi), (carried, inner, target) = moved, wanted
    before = nodal_water(near, 0.0, phi, t.parts, len(phi))
    start = float(before.sum())
    if abs(target - start) <= tolerance or slope.sum() <= 0.0:
        return phi, before, 0.0
    shifted, held = phi, before
    uniform = np.full(len(band), abs(target - start) / slope.sum())
    label, count = pools(phi, *t.around)
    own = uniform
    if count > 1:
        own = own_shift(label, count, carried - inner - before, slope, target - start)[band]
    for way in (np.abs(psi) + EVERYWHERE * own, own, uniform)[: 3 if count > 1 else 2]:
        shifted, held = _along(t, near, (phi, before), (band, slope, way), target, tolerance, most, spacing)
        if abs(target - float(held.sum())) <= tolerance:
            break
    return shifted, held, float(held.sum()) - start


def _along(t, near, state, moved, target, tolerance, most, spacing):
    """φ (N,) and its water (N,) [m³] in the cells `near` after secant steps along a way (n,) [m] on the band, each node
    within `most` of its cells; state: both before, moved: band, c and the way."""
    (phi, held), (band, slope, way) = state, moved
    shifted, s, volume = phi, 0.0, float(held.sum())
    area = float(slope[band] @ way)
    farthest = most * float((spacing[band] / np.maximum(way, 1e-300)).max())
    for _ in range(MOST_SECANTS):
        if abs(target - volume) <= tolerance or area <= 0.0:
            break
        trial = float(np.clip(s + (target - volume) / area, -farthest, farthest))
        if trial == s:
            break
        shifted = copied(phi) if shifted is phi else shifted
        over(lower, len(band), band, phi, trial * way, most, spacing, shifted)
        held = nodal_water(near, 0.0, shifted, t.parts, len(phi))
        before, volume = volume, float(held.sum())
        area, s = (volume - before) / (trial - s), trial
    return shifted, held


@ranged
def lower(first, last, band, phi, shift, most, spacing, out):
    """φ (N,) less the shift (n,) within ± most cells, in `out` (N,) at the nodes of the band (n,)."""
    for s in range(first, last):
        i, limit = band[s], most * spacing[band[s]]
        out[i] = phi[i] - min(max(shift[s], -limit), limit)
