"""Our other laws made like the law of a case: same strength, same G_c, and the same stiffness where the law allows.

A law gives k_0 G_c/T_max² = s(0, p) w(1, p), so the place p of its peak sets that number and δ_f = G_c/(T_max w(1, p))
the rest. Polynomial 3.80; bilinear 1/(2p), any; exponential e² to 4 %: nearly twice as stiff at the same G_c.
"""

from __future__ import annotations

from dataclasses import replace

from yade_scripts.joints.cohesion import JointParameters
from yade_scripts.joints.laws import find

CLOSE = 0.01
"""Relative difference of stiffness that is reported."""


def matched(reference: JointParameters, law: str) -> tuple[JointParameters, tuple[str, ...]]:
    """Joints under another law with strength and G_c of `reference`, its stiffness if possible; what is not matched."""
    wanted = reference.stiffness * reference.work_of_separation / reference.strength**2
    known = find(law)
    if known.lowest_peak < known.highest_peak:
        peak = _peak_for(wanted, law, known.lowest_peak, known.highest_peak)
    else:
        peak = known.peak
    unit = JointParameters(1.0, 1.0, law=law, peak=peak, damping=0.0)
    failure = reference.work_of_separation / (reference.strength * unit.work_of_separation)
    made = replace(reference, law=law, peak=peak, opening_at_failure=failure, mixed_mode="effective")
    ratio = made.stiffness / reference.stiffness
    unmatched = () if abs(ratio - 1.0) < CLOSE else (f"stiffness: {ratio:.2f} times",)
    return made, (*unmatched, "shape of the softening curve")


def _peak_for(wanted: float, law: str, low: float, high: float) -> float:
    """p with s(0, p) w(1, p) = wanted, which falls with p; the nearest end where there is none."""
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        unit = JointParameters(1.0, 1.0, law=law, peak=middle, damping=0.0)
        low, high = (middle, high) if unit.stiffness * unit.work_of_separation > wanted else (low, middle)
    return 0.5 * (low + high)
