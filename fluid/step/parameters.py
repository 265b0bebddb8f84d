"""Numbers that a case may set for the water; the defaults are the measured choice."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from array_types import Array


@dataclass(frozen=True)
class WaterParameters:
    """Parameters of the water step.

    theta: weight of the new pressure in the reflected projection (1: implicit Euler, 0.5: trapezoidal) in water that
        crosses a cell in a step; calm_theta: in water that hardly moves, where it is what damps waves.
    courant: cells crossed per step by the fastest water, spray apart (`time_step.py`); 1 for loads, 2 to 4 for drafts.
    divergence_damping: weight c_L of the element grad-div term.
    correction_length: κ/h, length over which the volume correction is spread, in water that crosses a cell in a step;
        calm_correction_length: in water that hardly moves, where what is left of the correction is a lag of the
        surface behind the water, which feeds waves (`volume.py`).
    kick_limit: largest acceleration carried over to the next step in slow water, in g (`Water.kick_factor`).
    speed_limit: cap of the speed in units of sqrt(g H + v²/2), H the height of the tank, v the largest speed at the
        start; clipped nodes are counted.
    subscale_memory: keep the element-wise remainder of the velocity correction (added mass of bodies).
    advection: "semi-lagrangian", or "supg" for stabilised finite elements (the reference; slower).
    viscosity: dynamic viscosity [Pa s]; 0 leaves the term out.
    walls: what sides of the tank and solids do to the water along them: "slip", "no-slip" (needs viscosity) or
    "friction" with either roughness k_s [m] (log law) or manning n [s/m^(1/3)] (bed), numbers or functions of places
        x, y (n,) [m].
    suction: "bounded": the pressure does not fall below the air's where air can reach, nor below vapour_pressure [Pa],
        relative to the air, elsewhere (`pressure_bound.py`); "unlimited": water may pull as hard as it likes.
    """

    density: float = 1000.0
    gravity: float = 9.81
    down: tuple[float, float, float] = (0.0, 0.0, -1.0)
    """Unit vector of gravity."""
    theta: float = 0.6
    calm_theta: float = 0.51
    courant: float = 1.0
    divergence_damping: float = 0.05
    correction_length: float = 5.0
    calm_correction_length: float = 1.0
    kick_limit: float = 3.0
    speed_limit: float = 2.0 * np.sqrt(2.0)
    subscale_memory: bool = True
    advection: str = "semi-lagrangian"
    viscosity: float = 0.0
    walls: str = "slip"
    roughness: float | Callable | None = None
    manning: float | Callable | None = None
    suction: str = "bounded"
    vapour_pressure: float = -98e3
    pocket_compliance: float = 1e-8
    """Compressibility of pockets without free surface, where the pressure level floats, in dt/(ρ h²)."""

    def __post_init__(self):
        if self.advection not in ("semi-lagrangian", "supg"):
            raise ValueError(f"advection = {self.advection!r} is unknown; choose 'semi-lagrangian' or 'supg'")
        if self.suction not in ("bounded", "unlimited"):
            raise ValueError(f"suction = {self.suction!r} is unknown; choose 'bounded' or 'unlimited'")
        if not self.vapour_pressure < 0.0:
            raise ValueError(
                f"vapour_pressure = {self.vapour_pressure!r} Pa must lie below that of the air, 0"
            )

    @property
    def shear(self) -> bool:
        """Whether anything but pressure acts along walls or within the water."""
        return self.viscosity > 0.0 or self.walls != "slip"

    @property
    def weight(self) -> Array:
        """g (3,) [m/s²]."""
        return self.gravity * np.asarray(self.down)
