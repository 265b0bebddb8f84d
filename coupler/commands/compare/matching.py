"""Parameters of the other laws of this program, matched to the law of a case: strength, G_c and, where possible,
stiffness.

The shape of a law gives k_0 G_c/T_max² = s(0, p) w(1, p). This equation determines the place p of its peak, and
δ_f = G_c/(T_max w(1, p)) follows. The value is 3.80 for the polynomial law, 1/(2p), which can be any value, for the
bilinear law, and e² to within 4 % for the exponential law, which is nearly twice as stiff at the same G_c.
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
