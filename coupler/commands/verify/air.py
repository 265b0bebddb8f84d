"""Trapped air: a bell under water, columns that bounce on cushions, floats that leak, impacts with air in between."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass

import numpy as np
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

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

GRAVITY = 9.81
INNER, WALL, HEIGHT = 0.64, 0.12, 0.64
"""Bell: inner width, thickness of its walls and inner height [m]."""
WIDE = INNER + 2.0 * WALL


def upwards(normal, centre):
    """Open top of a tank."""
    return normal[:, 2] > 0.5


def plates(middle: float, top: float, bell=(INNER, WALL, HEIGHT)) -> tuple[list, list]:
    """Centres and sizes of the five plates of a bell around (middle, middle) whose ceiling is at z = top [m].

    bell: inner width, thickness of its walls and inner height [m]."""
    inner, wall, height = bell
    wide = inner + 2.0 * wall
    centre, size = [[middle, middle, top + 0.5 * wall]], [[wide, wide, wall]]
    for sign in (-1.0, 1.0):
        off = middle + sign * 0.5 * (inner + wall)
        centre += [[off, middle, top - 0.5 * height], [middle, off, top - 0.5 * height]]
        size += [[wall, wide, height], [inner, wall, height]]
    return centre, size


# ---- P64: a bell lowered into water


TANK, CELL, LEVEL = 1.6, 0.1, 0.9
DEEP, TIME = 0.5, 2.0
"""Distance [m] by which the bell is lowered, and the time [s] that this takes."""


@check(
    "P64",
    "diving bell lowered into water",
    "Boyle's law for air without exchange of heat, hydrostatics, exact",
    "M",
)
def lowered_bell():
    found, exact = _lowered(), _bell_exact()
    yield Finding("pressure of its air [Pa]", found["pressure"], exact["pressure"], 0.02)
    yield Finding("volume of its air [m³]", found["volume"], exact["volume"], 0.002)
    yield Finding("level of the water in it [m]", found["inside"], exact["inside"], 0.01, False)
    yield Finding("force that holds it down [N]", found["force"], exact["force"], 0.02)
    yield Finding("volume of the water [m³]", found["water"], exact["water"], 1e-4)


def _lowered() -> dict[str, float]:
    """Means over the last half second at rest after the bell was lowered with a smooth start and end."""
    rim = LEVEL - 0.05
    centre, size = plates(0.5 * TANK + 0.013, rim + HEIGHT)
    mesh = box_mesh(np.zeros(3), (TANK, TANK, 1.8), CELL)
    bodies = ConvexBodies.boxes(centre, size)
    domain = cut_domain(mesh, bodies, "multiple")
    water = Water(mesh, domain, lambda x: x[:, 2] - LEVEL, WaterParameters(), upwards, gas=Gas())
    start, rows = bodies.centre.copy(), []
    while water.time < TIME + 1.5:
        dt = 0.01
        here, there = (_way(min(t, TIME)) for t in (water.time, water.time + dt))
        speed = np.zeros((5, 6))
        speed[:, 2] = -(there - here) / dt
        problem = water.predict(dt)
        result = solve_pressure(problem, 1e-9, problem.coupling @ speed.ravel())
        water.pushed_by, water.moved_by_end = speed, dt * speed
        water.correct(problem, result.x, result.parting)
        load = problem.load(result.x)
        if water.time > TIME + 1.0:
            volumes = water.pocket_volumes()
            k = int(volumes.argmax())
            volume = volumes[k]
            top = rim + HEIGHT - DEEP
            rows.append(
                (
                    water.air.mean_pressure[k],
                    volume,
                    top - volume / INNER**2,
                    load[:, 2].sum(),
                    water.volume(),
                )
            )
        if there > here:
            moved = bodies.moved(start - np.array([0.0, 0.0, there]))
            again = cut_domain(mesh, moved, "multiple", previous=water.domain, moved=np.ones(5, bool))
            water.move_solids(again)
            water.pushed_by = np.zeros((5, 6))
    return dict(zip(("pressure", "volume", "inside", "force", "water"), np.mean(rows, axis=0)))


def _way(t: float) -> float:
    """Distance [m] by which the bell has been lowered at time t [s]."""
    return DEEP * 0.5 * (1.0 - np.cos(np.pi * t / TIME))


def _bell_exact() -> dict[str, float]:
    """State at rest: the difference of the levels compresses the air, and walls and air displace water."""
    gas, rim = Gas(), LEVEL - 0.05 - DEEP
    top, area = rim + HEIGHT, INNER**2
    reference = area * (HEIGHT - 0.05)
    held = TANK**2 * LEVEL - (WIDE**2 - area) * 0.05

    def outside(inside: float) -> float:
        """Level [m] outside the bell that conserves the volume of water, for a level inside it [m]."""
        walls = WIDE**2 - area

        def missing(level):
            below_top = min(level, top) - rim
            ceiling = WIDE**2 * min(max(level - top, 0.0), WALL)
            return TANK**2 * level - walls * below_top - area * (min(level, top) - inside) - ceiling - held

        return brentq(missing, rim, 1.8)

    def unbalanced(inside: float) -> float:
        return float(gas.pressure(reference, area * (top - inside))) - DENSITY * GRAVITY * (
            outside(inside) - inside
        )

    inside = brentq(unbalanced, rim - 0.01, rim + 0.3)
    level, pressure = outside(inside), float(gas.pressure(reference, area * (top - inside)))
    covered = max(level - top - WALL, 0.0)
    down = DENSITY * GRAVITY * WIDE**2 * covered
    walls = DENSITY * GRAVITY * (level - rim) * (WIDE**2 - area)
    return {
        "pressure": pressure,
        "volume": area * (top - inside),
        "inside": inside,
        "force": pressure * area + walls - down,
        "water": held,
    }


# ---- P65: a column of water bouncing on a cushion


@dataclass(frozen=True)
class Bounce:
    """time (n,) [s] · thickness (n,) [m] of the cushion · pressure (n,) [Pa] · energy (n,) over its initial value."""

    time: np.ndarray
    thickness: np.ndarray
    pressure: np.ndarray
    energy: np.ndarray


def bounce(
    thickness: float, length: float, speed: float, cells: int, dt: float, until: float, across: int
) -> Bounce:
    """Weightless column of water of a length [m] that moves along a tube onto an air cushion of a thickness [m]."""
    h = thickness / cells
    size = (across * h, across * h, thickness + length + 3.0 * h)
    mesh = box_mesh(np.zeros(3), size, h)
    domain = cut_domain(mesh, ConvexBodies.empty(), "single")
    velocity = np.zeros((len(domain.nodes), 3))
    velocity[:, 2] = -speed

    def fill(x):
        return np.maximum(thickness - x[:, 2], x[:, 2] - thickness - length)

    # what is carried over of an acceleration is limited by g, which is next to nothing here
    parameters = WaterParameters(gravity=1e-6, kick_limit=1e12)
    water = Water(mesh, domain, fill, parameters, upwards, velocity=velocity, gas=Gas())
    energy = water.kinetic_energy() + water.air_energy()
    rows = []
    while water.time < until:
        problem = water.predict(dt)
        found = solve_pressure(problem, 1e-10)
        water.correct(problem, found.x, found.parting)
        now = (water.kinetic_energy() + water.air_energy()) / energy
        rows.append(
            (water.time, water.pocket_volumes()[0] / (size[0] * size[1]), water.air.mean_pressure[0], now)
        )
    return Bounce(*np.array(rows).T)


def piston(thickness: float, length: float, speed: float, times) -> np.ndarray:
    """Thickness (n,) [m] of the cushion at times (n,) [s]: ρ L x'' = p_a ((d/x)^γ - 1)."""

    def rate(_, y):
        return [y[1], float(Gas().pressure(thickness, y[0])) / (DENSITY * length)]

    return solve_ivp(rate, (0.0, times[-1]), [thickness, -speed], rtol=1e-10, atol=1e-12, t_eval=times).y[0]


def period(thickness: float, length: float, speed: float) -> float:
    """Period [s] of the bounce: twice the time between the turning points, by quadrature (no closed form exists)."""
    gas = Gas()
    energy = 0.5 * DENSITY * length * speed**2

    def left(x):
        return energy - float(gas.energy(thickness, x))

    low = brentq(left, 1e-3 * thickness, thickness)
    high = brentq(left, thickness, 100.0 * thickness)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)

    def slowness(phase):
        x = middle - half * np.cos(phase)
        return half * np.sin(phase) / np.sqrt(max(2.0 * left(x) / (DENSITY * length), 1e-300))

    return 2.0 * quad(slowness, 1e-6, np.pi - 1e-6, limit=200)[0]


AMPLITUDES = {"small": (0.05, 1e-2, 2), "large": (0.5, 1e-2, 2)}
"""Name: speed [m/s] at the start · tolerance of the period · cells across."""


@check("P65", "column of water on an adiabatic cushion", "p V^γ = const and Newton, exact", "M")
def bouncing_column():
    thickness, length, panels = 1.0, 2.0, []
    for name, (speed, tolerance, across) in AMPLITUDES.items():
        exact = period(thickness, length, speed)
        run = bounce(thickness, length, speed, 4, exact / 160.0, 10.0 * exact, across)
        yield Finding(f"period [s], {name} swing", _period_of(run), exact, tolerance)
        swing = np.ptp(piston(thickness, length, speed, run.time[:160]))
        yield Finding(f"swing of the first period [m], {name}", np.ptp(run.thickness[:160]), swing, 0.01)
        yield Finding(f"energy after ten periods, {name} swing", run.energy[-1], 1.0, 0.01)
        path = piston(thickness, length, speed, run.time)
        curves = (
            Curve("exact", "measured", run.time, 100 * (path - thickness)),
            Curve("computed", "computed", run.time, 100 * (run.thickness - thickness)),
        )
        panels.append(Panel("time [s]", f"way of the column [cm], {name}", curves, (0.0, run.time[-1])))
    yield Figure("P65_cushion", tuple(panels), columns=1)


def _period_of(run: Bounce) -> float:
    """Mean time [s] between successive outward passages through the initial thickness."""
    off = run.thickness - run.thickness[0]
    k = np.flatnonzero((off[:-1] < 0.0) & (off[1:] >= 0.0))
    passages = run.time[k] - off[k] * (run.time[k + 1] - run.time[k]) / (off[k + 1] - off[k])
    return float(np.mean(np.diff(passages)))


# ---- P66: floats on its air, and sinks as it leaks


BELL = 1.0, 0.12, 0.4
"""Inner width, thickness of its walls and inner height [m]: flat enough not to capsize (metacentre 0.1 m above the
centre of mass; a bell as high as wide turns over, here too)."""
HEAVY = 1150.0
"""Density of the plates [kg/m³]: without air they sink."""
ABOVE = 0.36
"""Height of the ceiling above the water at the start [m], when the air has the pressure of the atmosphere."""
RAMP, SETTLED, END = 2.5, 4.0, 6.0
"""Time [s] until which the weight of the plates grows, and begin and end [s] of the means."""
HEAVE = 1.7
"""Period [s] of its heave, which persists a little while it sinks; heights are means over this period."""
LEAK, HIGH, LOW = 5e-4, 0.035, 0.0
"""Area of the leak [m²], and the heights [m] of the ceiling above the water between which its sinking is timed."""


@check(
    "P66", "bell that floats on its air, and sinks through a leak", "Archimedes, Boyle, orifice; exact", "M"
)
def floating_bell():
    exact = _afloat(BELL[0] ** 2 * ABOVE)
    time, top, pressure = _float(END, None)
    rest = time > SETTLED
    yield Finding("height of its ceiling over the water [m]", top[rest].mean(), exact["top"], 0.01, False)
    yield Finding("pressure of its air [Pa]", pressure[rest].mean(), exact["pressure"], 0.01)
    expected = _sinking()
    time, top, _ = _float(RAMP + 3.0 * expected, LEAK)
    even = np.arange(time[0], time[-1], 0.01)
    width = int(HEAVE / 0.01)
    mean = np.convolve(np.interp(even, time, top), np.full(width, 1.0 / width), mode="valid")
    middle = even[: len(mean)] + 0.5 * HEAVE
    passes = [float(np.interp(-height, -mean, middle)) for height in (HIGH, LOW)]
    yield Finding("time to sink by 35 mm through a leak of 5 cm² [s]", passes[1] - passes[0], expected, 0.05)


def _afloat(reference: float) -> dict[str, float]:
    """State at rest: height [m] of the ceiling above the water outside, and the pressure [Pa]."""
    inner, wall, height = BELL
    wide = inner + 2.0 * wall
    mass = HEAVY * (wide**2 * wall + (wide**2 - inner**2) * height)
    gas, area = Gas(), inner**2

    def pressure(top: float) -> float:
        return (mass - DENSITY * (wide**2 - area) * (height - top)) * GRAVITY / area

    def unbalanced(top: float) -> float:
        p = pressure(top)
        return float(gas.pressure(reference, area * (top + p / (DENSITY * GRAVITY)))) - p

    top = brentq(unbalanced, -0.2, height)
    return {"top": top, "pressure": pressure(top)}


def _sinking() -> float:
    """Time [s] in which the ceiling sinks from HIGH to LOW while the bell's weight drives air out of the orifice."""
    gas = Gas()
    references = [brentq(lambda r, top=top: _afloat(r)["top"] - top, 0.1, 0.6) for top in (HIGH, LOW)]

    def slowness(reference):
        here = _afloat(reference)
        return 1.0 / float(gas.flow(here["pressure"], 0.0, 0.6 * LEAK))

    return quad(slowness, references[1], references[0])[0]


def _float(end: float, leak: float | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The coupled case, a bell of five plates: time [s], height of its ceiling over the water [m], pressure [Pa]."""
    from coupler.api.case import Case

    wide, level = 2.4, 1.0
    middle = 0.5 * wide
    centre, size = plates(middle, level + ABOVE, BELL)
    air = {"model": "trapped"}
    if leak is not None:
        air["vent"] = [{"at": [middle, middle, level + ABOVE - 0.13], "area": leak, "block": "plate0"}]
    blocks = [
        {"name": f"plate{k}", "centre": c, "size": s, "density": HEAVY}
        for k, (c, s) in enumerate(zip(centre, size))
    ]
    case = Case(
        {
            "case": {"title": "a bell afloat"},
            "time": {"end": end, "step_max": 0.01},
            "tank": {"lower": [0, 0, 0], "upper": [wide, wide, 1.8], "cell": 0.12},
            "water": {
                "covers": "multiple",
                "air": air,
                "fill": [{"lower": [0, 0, 0], "upper": [wide, wide, level]}],
            },
            "structure": {"start": "ramp", "ramp": RAMP, "block": blocks},
            "contact": {"stiffness": "1 MN/m"},
            "joints": {"strength": "500 kPa", "opening_at_failure": "10 mm"},
            "gauge": [
                {"kind": "air", "name": "air", "at": [middle, middle, level + 0.2]},
                {"kind": "motion", "name": "top", "of": "plate0"},
                {"kind": "level", "name": "beside", "at": [0.2, 0.2]},
            ],
        }
    )
    with tempfile.TemporaryDirectory() as place:
        read = case.run(place + "/run").history("gauges").values
    top = read["top_centre_z"] - 0.5 * BELL[1] - read["beside_level"]
    return read["time"], top, read["air_pressure"]


# ---- P68: impacts with air in between, at three sizes


SCALES = (0.1, 1.0, 10.0)


@check(
    "P68",
    "impact on trapped air at three sizes",
    "piston model of Bagnold (Interim report on wave-pressure research, 1939), exact",
    "S",
)
def bagnold():
    panels = []
    for scale in SCALES:
        thickness, length, speed = 0.2 * scale, 1.0 * scale, 2.0 * np.sqrt(scale)
        run = bounce(thickness, length, speed, 4, 0.02 * thickness / speed, 2.2 * thickness / speed, 2)
        x = piston(thickness, length, speed, run.time)
        peak = float(Gas().pressure(thickness, x.min()))
        head = DENSITY * speed**2
        yield Finding(
            f"peak pressure over ρu², lengths times {scale:g}", run.pressure.max() / head, peak / head, 0.05
        )
        when = run.time * speed / thickness
        exact = Gas().pressure(thickness, x) / head
        curves = (
            Curve("piston model", "measured", when, exact),
            Curve("computed", "computed", when, run.pressure / head),
        )
        panels.append(Panel("time u/d [-]", f"pressure $p/(\\rho u^2)$ [-], size {scale:g}", curves))
    yield Figure("P68_bagnold", tuple(panels), columns=3)
