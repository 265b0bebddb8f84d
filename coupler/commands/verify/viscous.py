"""Viscous water: decaying vortices, flow between plates and in a duct, and a cylinder cut out of a fixed mesh."""

from __future__ import annotations

import numpy as np

from coupler.commands.verify.curves import Curve, Figure, Panel
from coupler.commands.verify.figures import columns
from coupler.commands.verify.registry import TOLD, Finding, check
from coupler.commands.verify.scenes import graded
from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.numerics.bounded import solve_pressure
from fluid.readings import gauges
from fluid.sides.inflow import Flow, Side, Sides
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water

DENSITY = 1000.0


def full(x):
    """Fill: water everywhere."""
    return x[:, 2] - 100.0


def across(axis: int):
    """A function that selects the sides of the tank normal to an axis."""
    return lambda normal, centre: np.abs(normal[:, axis]) > 0.5


def step(water: Water, dt: float, rtol: float = 1e-8):
    """One step; the force and moment on the bodies (n_bodies, 6)."""
    problem = water.predict(dt)
    found = solve_pressure(problem, rtol)
    problem = problem.with_waterline_of(found.x)
    water.correct(problem, found.x, found.parting)
    return problem.load(found.x)


@check("P31", "decay of Taylor-Green vortices", "exp(-4 nu k² t), exact", "M")
def vortices():
    nu, k = 0.05, np.pi
    errors, curves = {}, []
    exact = columns("taylor_green_2d")
    for n in (8, 16, 32):
        errors[n], times, energies = _vortex(n, nu, k)
        curves.append(Curve(f"{n} cells", "computed", times, energies))
    left = exact["E_over_E0"][exact["nu_k2_t"] == 0.25][0]
    yield Finding("energy left at nu k² t = 0.25, 32 cells", float(energies[-1]), left, 0.02)
    for coarse, fine in ((8, 16), (16, 32)):
        order = min(np.log2(errors[coarse] / errors[fine]), 2.0)
        yield Finding(f"order of the L2 error, 2 at most, {coarse} to {fine} cells", order, 2.0, 0.2, False)
    yield Finding("L2 error of the velocity, 32 cells", errors[32], 0.0, 0.02, False)
    yield _vortex_figure(errors, curves)


def _vortex_figure(errors, curves) -> Figure:
    t = np.linspace(0.0, 0.25, 100)
    curves.append(Curve("exact", "exact", t, np.exp(-4.0 * t)))
    cells = np.array(list(errors), float)
    found = np.array(list(errors.values()))
    order = (
        Curve("computed", "computed", cells, found),
        Curve("second order", "exact", cells, found[0] * (cells[0] / cells) ** 2),
    )
    panels = (
        Panel("time $\\nu k^2 t$ [–]", "energy left [–]", tuple(curves)),
        Panel("cells an edge", "$L_2$ error of the velocity [–]", order, log="xy"),
    )
    return Figure("P31_vortices", panels, columns=2)


def _vortex(n: int, nu: float, k: float):
    """(relative L2 error at ν k² t = 0.25, times ν k² t, energy left) between smooth walls; dt falls with the cells."""
    mesh = box_mesh(np.zeros(3), [1, 1 / n, 1], 1 / n)
    domain = cut_domain(mesh, ConvexBodies.empty())
    water = Water(mesh, domain, full, WaterParameters(viscosity=DENSITY * nu))
    x, end = k * water.topology.nodes, 0.25 / (nu * k**2)
    water.velocity[:, 0] = 0.2 * np.sin(x[:, 0]) * np.cos(x[:, 2])
    water.velocity[:, 2] = -0.2 * np.cos(x[:, 0]) * np.sin(x[:, 2])
    water.set_cell_velocity(water.velocity[water.topology.cells].mean(axis=1))
    start, steps = water.velocity.copy(), 3 * n // 8

    def square(u):
        return float(water.nodal_water @ (u**2).sum(axis=1))

    energies = [1.0]
    for _ in range(steps):
        step(water, end / steps)
        energies.append(square(water.velocity) / square(start))
    exact = start * np.exp(-2 * nu * k**2 * end)
    error = np.sqrt(square(water.velocity - exact) / square(exact))
    return error, np.linspace(0.0, 0.25, steps + 1), np.array(energies)


@check("P32", "start of flow between plates that cut the cells; square duct", "series, exact")
def plates_and_duct():
    table, panels = columns("startup_couette_poiseuille"), []
    for flow, gravity, speed in (("Couette", 1e-9, 1.0), ("Poiseuille", 1.0, 0.0)):
        worst, force, curves = _plates(16, gravity, speed, table, f"u_{flow.lower()}")
        axes = (f"velocity, {flow} flow [–]", "height between the plates [–]")
        panels.append(Panel(*axes, tuple(curves), None, (0.0, 1.0)))
        yield Finding(
            f"{flow}: largest error / largest speed from t = 0.05 H²/nu on", worst, 0.0, 0.02, False
        )
        exact = NU * speed + 0.5 * gravity
        yield Finding(f"{flow}: force on the lower plate / (rho area) [m²/s²]", force, exact, 0.02)
    fastest, rate = _duct(16)
    duct = columns("square_duct_poiseuille")
    yield Finding("square duct, 16 cells: largest speed mu/(G a²)", fastest, duct["u"].max(), 0.02)
    yield Finding("square duct, 16 cells: flow rate mu/(G a⁴)", rate, 0.0351443, 0.02)
    yield Figure("P32_plates", tuple(panels), columns=2)


NU = 0.1
"""Kinematic viscosity of the channels [m²/s]."""


def _channel(size, n: int, bodies: ConvexBodies, gravity: float, smooth=None) -> Water:
    """A piece of a channel along x, one cell long, open at both ends and driven along x by `gravity`."""
    mesh = box_mesh(np.zeros(3), size, 1 / n)
    settings = WaterParameters(
        viscosity=DENSITY * NU, walls="no-slip", gravity=gravity, down=(1, 0, 0), speed_limit=1e9
    )
    return Water(mesh, cut_domain(mesh, bodies), full, settings, across(0), smooth)


def _plates(n: int, gravity: float, speed: float, table, name: str):
    """(largest error over the largest speed, last stress on the lower plate over ρ, profiles); the upper one moves.

    Gap 1 m; the plates are bodies that cut their cells at 0.37."""
    foot = 1.37 / n
    plates = ConvexBodies.boxes([[0.0, 0.0, foot + 2.0], [0.0, 0.0, foot - 1.0]], [[4.0, 4.0, 2.0]] * 2)
    water = _channel([1 / n, 1 / n, 1 + 4 / n], n, plates, gravity, across(1))
    water.body_velocity[0, 0] = speed
    worst, scale, curves = 0.0, speed or gravity / NU, []
    for t in np.unique(table["t"]):
        steps = np.ceil((t / NU - water.time) / 0.025 - 1e-9)
        dt = (t / NU - water.time) / steps
        for _ in range(int(steps)):
            load = step(water, dt)
        at = table["t"] == t
        y = np.clip(table["y"][at], 1e-6, 1 - 1e-6)
        place = np.column_stack([np.full_like(y, 0.5 / n), np.full_like(y, 0.5 / n), foot + y])
        u = gauges.velocity(water, place)[:, 0] / scale
        curves.append(Curve("" if curves else "series", "measured", table[name][at], y))
        curves.append(Curve(f"$\\nu t/H^2$ = {t:g}", "computed", u, y))
        if t >= 0.05:
            worst = max(worst, np.abs(u - table[name][at]).max() / table[name][at].max())
    return worst, load[1, 0] * n**2 / DENSITY, curves


def _duct(n: int) -> tuple[float, float]:
    """(largest speed, flow rate) of the steady flow in a duct of side 1, scaled with μ/G."""
    water = _channel([1 / n, 1, 1], n, ConvexBodies.empty(), 1.0)
    while water.time < 1.0 / NU:
        step(water, 0.05)
    return NU * water.velocity[:, 0].max(), NU * float(water.nodal_water @ water.velocity[:, 0]) * n


@check(
    "P35", "steady flow past a cylinder (DFG 2D-1), cut out of a fixed mesh", "Schäfer and Turek 1996", "M"
)
def cylinder():
    drag, lift, difference = _cylinder(0.005, 3.0)
    yield Finding("drag coefficient, D/20", drag, 5.57953523384, 0.05)
    yield Finding("pressure difference [Pa]", difference, 0.11752016697, 0.05)
    yield Finding(f"lift coefficient {TOLD}", lift, 0.010618948146, np.inf, False)


def _cylinder(h: float, end: float) -> tuple[float, float, float]:
    """(drag, lift, pressure difference) at time `end` [s] with cells of h [m] around the cylinder.

    ρ = 1, ν = 1e-3, D = 0.1, channel 2.2 × 0.41 with no-slip walls, parabola of 0.3 m/s at its inflow. Gravity of
    1 m/s² gives the outflow its pressure; its contribution to the lift is subtracted."""
    thickness, far = 2 * h, 0.04
    axes = [
        graded(0.0, 2.2, (0.12, 0.32), h, far, 1.1),
        np.array([0.0, thickness]),
        graded(0.0, 0.41, (0.12, 0.28), h, 0.3 * far, 1.1),
    ]
    mesh = box_mesh(None, None, axes=axes)
    inflow = Flow(lambda time: 1.0, _parabola)
    sides = [Side.of(mesh, lambda n, _: n[:, 0] < -0.5, inflow)]
    sides.append(Side.of(mesh, lambda n, _: n[:, 0] > 0.5, level=lambda time: 0.41))
    settings = WaterParameters(density=1.0, gravity=1.0, viscosity=1e-3, walls="no-slip")
    body = ConvexBodies.from_polyhedra([(_prism(0.2, 0.2, 0.05), None)])
    water = Water(mesh, cut_domain(mesh, body), full, settings, None, across(1), Sides(sides))
    water.velocity[:] = _parabola(water.topology.nodes, 0.0)
    water.set_cell_velocity(water.velocity[water.topology.cells].mean(axis=1))
    while water.time < end:
        load = step(water, h / 0.45, 1e-7)
    drag, lift = 2.0 * load[0, [0, 2]] / (0.2**2 * 0.1 * thickness)
    weight = 2.0 * np.pi * 0.05**2 / (0.2**2 * 0.1)
    y = 0.5 * thickness
    front, back = gauges.pressure(water, np.array([[0.1499, y, 0.2], [0.2501, y, 0.2]]))
    return drag, lift - weight, front - back


def _parabola(points, time: float):
    """Velocity at the inflow of the channel (n, 3) [m/s]."""
    u = np.zeros((len(points), 3))
    u[:, 0] = 4 * 0.3 * points[:, 2] * (0.41 - points[:, 2]) / 0.41**2
    return u


def _prism(x: float, z: float, radius: float, corners: int = 48):
    """Corners of a prism along y with the area of the circle."""
    angle = 2 * np.pi * (np.arange(corners) + 0.5) / corners
    radius *= np.sqrt(2 * np.pi / corners / np.sin(2 * np.pi / corners))
    ring = np.column_stack([x + radius * np.cos(angle), np.zeros(corners), z + radius * np.sin(angle)])
    ahead = np.array([0.0, 1.0, 0.0])
    return np.concatenate([ring - ahead, ring + ahead])
