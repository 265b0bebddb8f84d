"""A plate with a rim that falls flat on water, and the air that it traps."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import RectBivariateSpline

from coupler.commands.verify.air import GRAVITY, upwards
from coupler.commands.verify.curves import Curve, Figure, Panel
from coupler.commands.verify.registry import Finding, check
from coupler.commands.verify.scenes import DENSITY
from fluid.air.gas import Gas
from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.numerics.bounded import solve_pressure
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water

HALF, RIM, HIGH = 0.6, 0.2, 0.2
"""Half of the inner width, thickness and height of the rim [m]."""
DRAUGHT = 0.02
"""The rim is in the water by this [m] at the start."""
WIDE, DEEP = 2.4, 1.2
"""Half of the width of the basin and its depth [m]."""
SPEEDS = (0.25, 0.5, 1.0, 2.0)
"""Speeds of the plate [m/s], which stay constant as those of a heavy plate do."""
CELL, UNTIL, STEPS = 0.05, 0.056, 64


@check(
    "P67",
    "plate with a rim falls flat on water",
    "adiabatic cushion on water of its added mass (after Verhagen, J. Ship Res. 11 (1967) 211); the ODE with added "
    "masses by finite elements in the plane, not a published curve",
    "M",
)
def falling_plate():
    model, histories, peaks = CushionOnWater.of(), [], []
    for speed in SPEEDS:
        time, pressure = model.fall(speed)
        when, found = fall(speed)
        top = float(pressure.max())
        yield Finding(f"peak of the pressure [Pa], {speed:g} m/s", found.max(), top, 0.05)
        at = float(time[pressure.argmax()])
        yield Finding(f"time of the peak [s], {speed:g} m/s", when[found.argmax()], at, 0.05)
        peaks.append((speed, top, found.max()))
        histories += [
            Curve("" if histories else "ODE", "measured", 1e3 * time, 1e-3 * pressure),
            Curve("" if histories else "computed", "computed", 1e3 * when, 1e-3 * found),
        ]
    speed, exact, found = np.array(peaks).T
    curves = (
        Curve("ODE", "measured", speed, 1e-3 * exact),
        Curve("computed", "computed", speed, 1e-3 * found, points=True),
    )
    yield Figure(
        "P67_plate",
        (
            Panel("time [ms]", "pressure of the cushion [kPa]", tuple(histories)),
            Panel("speed [m/s]", "peak [kPa]", curves, log="xy"),
        ),
        columns=2,
    )


def fall(speed: float) -> tuple[np.ndarray, np.ndarray]:
    """Half of the plate and of the basin, a slice of two cells: middles (n,) of the steps [s] and the pressure (n,)
    [Pa] of the cushion in each, at a speed [m/s] of the plate."""
    level, dt, thick = DEEP + 0.013, UNTIL / STEPS, 0.2
    mesh = box_mesh(np.zeros(3), (WIDE, 2.0 * CELL, DEEP + 0.6), CELL)
    rim = level - DRAUGHT
    centre = [
        [0.5 * (HALF + RIM) - 0.5, CELL, rim + HIGH + 0.5 * thick],
        [HALF + 0.5 * RIM, CELL, rim + 0.5 * HIGH],
    ]
    size = [[HALF + RIM + 1.0, 4.0 * CELL, thick], [RIM, 4.0 * CELL, HIGH]]
    bodies = ConvexBodies.boxes(centre, size)
    domain = cut_domain(mesh, bodies, "multiple")
    water = Water(mesh, domain, lambda x: x[:, 2] - level, WaterParameters(), upwards, gas=Gas())
    velocity, start, rows = np.zeros((2, 6)), bodies.centre.copy(), []
    velocity[:, 2] = -speed
    for _ in range(STEPS):
        problem = water.predict(dt)
        found = solve_pressure(problem, 1e-9, problem.coupling @ velocity.ravel())
        water.pushed_by, water.moved_by_end = velocity, dt * velocity
        water.correct(problem, found.x, found.parting)
        rows.append((water.time - 0.5 * dt, water.air.mean_pressure[0]))
        there = bodies.moved(start - np.array([0.0, 0.0, speed * water.time]))
        again = cut_domain(mesh, there, "multiple", previous=water.domain, moved=np.ones(2, bool))
        water.move_solids(again)
    time, pressure = np.array(rows).T
    return time, pressure


@dataclass(frozen=True)
class CushionOnWater:
    """The ODE of the cushion, in the plane and a metre thick.

    Water below the plate moves by two rates: Q [m²/s], by which the surface in the plate rises, and the speed V of the
    rim, which is s deep. Its energy is T = ρ/2 ((Q - a V)²/c + l V²) with c, a, l from Laplace's equation: the flow out
    of the surface in the plate for the potential 1 on it and for V = 1, and the energy of the latter, φ = 0 on the
    surface outside. With A = ∫ Q dt, a surface in the plate that is flat and η = -A/HALF deep, G = ∂T/∂Q and P the
    pressure of the cushion of the volume v,

        dG/dt = ∂T/∂A - P - ρ g A/HALF,        dA/dt = Q = c G/ρ + a V,        dv/dt = -(HALF V + Q).

    draught (S,), depth (E,) [m]: s and η at which c, a, l are known, with splines of them."""

    splines: tuple[RectBivariateSpline, ...]

    @classmethod
    def of(cls) -> CushionOnWater:
        """Coefficients tabulated over the draughts and depths that occur in the fastest fall."""
        draught = np.linspace(0.25 * DRAUGHT, 0.145, 6)
        depth = np.array([0.0, 0.016, 0.032, 0.048])
        known = np.array([[response(s, e) for e in depth] for s in draught])
        return cls(tuple(RectBivariateSpline(draught, depth, known[:, :, k], kx=2, ky=2) for k in range(3)))

    def fall(self, speed: float) -> tuple[np.ndarray, np.ndarray]:
        """Times (n,) [s] and gauge pressures (n,) [Pa] at a speed [m/s] of the plate."""
        gas, room = Gas(), HALF * (HIGH - DRAUGHT)

        def rate(time, y):
            volume, push, raised = y
            at = DRAUGHT + speed * time, max(-raised / HALF, 0.0)
            c, a, _ = (f(*at)[0, 0] for f in self.splines)
            slope_c, slope_a, slope_l = (f(*at, dy=1)[0, 0] for f in self.splines)
            free = c * push / DENSITY
            deeper = -2.0 * free * speed * slope_a / c - (free / c) ** 2 * slope_c + slope_l * speed**2
            held = float(gas.pressure(room, volume)) + DENSITY * GRAVITY * raised / HALF
            rise = free + a * speed
            return [-(HALF * speed + rise), -0.5 * DENSITY * deeper / HALF - held, rise]

        time = np.linspace(0.0, UNTIL, 400)
        path = solve_ivp(rate, (0.0, UNTIL), [room, 0.0, 0.0], rtol=1e-7, atol=1e-9, t_eval=time).y
        return time, gas.pressure(room, path[0])


def response(draught: float, depth: float, points: int = 14) -> tuple[float, float, float]:
    """c, a and l of `CushionOnWater` for a rim and a surface in the plate at these depths [m]: quadratic elements on a
    grid that is finer at all edges, where the flow is singular."""
    import skfem
    from skfem.helpers import dot, grad

    def graded(low, high, n=points):
        return low + (high - low) * 0.5 * (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, n)))

    x = np.concatenate([graded(0.0, HALF), graded(HALF, HALF + RIM), graded(HALF + RIM, WIDE)])
    levels = sorted({0.0, -depth, -draught})
    z = [graded(-DEEP, levels[0], 2 * points)] + [graded(*pair) for pair in pairwise(levels)]
    mesh = skfem.MeshTri.init_tensor(np.unique(x.round(12)), np.unique(np.concatenate(z).round(12)))
    middle = mesh.p[:, mesh.t].mean(axis=1)
    in_plate, in_rim = middle[0] < HALF, (middle[0] > HALF) & (middle[0] < HALF + RIM)
    mesh = mesh.remove_elements(
        np.flatnonzero((in_plate & (middle[1] > -depth)) | (in_rim & (middle[1] > -draught)))
    )
    basis = skfem.Basis(mesh, skfem.ElementTriP2())
    laplace = skfem.BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(basis)
    at, near = basis.doflocs, 1e-9
    inside = np.flatnonzero((np.abs(at[1] + depth) < near) & (at[0] <= HALF + near))
    outside = np.flatnonzero((np.abs(at[1]) < near) & (at[0] >= HALF + RIM - near))
    below = mesh.facets_satisfying(
        lambda x: (np.abs(x[1] + draught) < near) & (x[0] > HALF) & (x[0] < HALF + RIM)
    )
    pushed = skfem.LinearForm(lambda v, w: -1.0 * v).assemble(basis.boundary(facets=below))

    def potential(on_inside, load):
        u = np.zeros(laplace.shape[0])
        u[inside] = on_inside
        return skfem.solve(*skfem.condense(laplace, load, x=u, D=np.concatenate([inside, outside])))

    held, moved = potential(1.0, np.zeros(laplace.shape[0])), potential(0.0, pushed)
    flow, drawn = (laplace @ held)[inside].sum(), (laplace @ moved - pushed)[inside].sum()
    return float(flow), float(drawn), float(pushed @ moved)
