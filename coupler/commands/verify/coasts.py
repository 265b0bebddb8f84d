"""Tsunamis on coasts that were built in laboratories: Monai valley, the conical island."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupler.case.records import SHIPPED
from coupler.commands.verify.curves import Curve, Figure, Panel
from coupler.commands.verify.figures import columns
from coupler.commands.verify.losses import Losses
from coupler.commands.verify.registry import TOLD, Finding, check
from coupler.commands.verify.scenes import DENSITY, G
from coupler.run.clock import Clock
from coupler.step.coupled_step import CoupledStepper
from coupler.step.immersion import Immersion
from fluid.domain.point_location import Places
from fluid.mesh.fitted_mesh import fitted_mesh
from fluid.mesh.refinement import OnBed, refined_mesh
from fluid.readings.gauges import levels
from fluid.sides.absorbing import Absorber
from fluid.sides.inflow import Flow, Side, Sides
from fluid.sides.waves import SolitaryWave, tide
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water

FILM = 0.1
"""Height over the bed at which it counts as wet, in layers: the experiments saw the tip of the water."""


@dataclass(frozen=True)
class Coast:
    """A run: times (n,) [s] · gauges (n, k) [m], levels at k places · wet (p,): whether each of the observed places
    was wet at any time · losses of the run"""

    time: np.ndarray
    gauges: np.ndarray
    wet: np.ndarray
    losses: Losses


# ---------------------------------------------------------------- P60


MONAI = {"lower": (0.0, 0.0, -0.14), "upper": (5.488, 3.402, 0.12), "cell": (0.12, 0.12, 0.024)}
START, END = 6.0, 22.5
"""Begin and end [s] of the simulated part of the record; it begins in the trough of 3 mm, a fifth of the crest."""
DEPTH = 0.13535
"""Depth [m] at the inlet."""
GAUGES = ((4.521, 1.196), (4.521, 2.196))
ARRIVED = 0.01
"""[m] Level over the still water that counts as the arrival of the wave."""
VALLEY = (4.95, 5.35, 1.7, 2.1)
"""[m] x and y of the valley in which the run-up was measured."""
MEASURED_RUN_UP = 0.0896
"""[m] mean of six runs, 0.080 to 0.100."""


@check(
    "P60",
    "tsunami on the terrain of Monai valley, 1:400",
    "Matsuyama, Tanaka 2001; Liu, Yeh, Synolakis 2008; NTHMP laboratory benchmark 7",
    "M",
)
def monai_valley():
    run, ground = _monai(MONAI["cell"])
    lab = columns("monai_gauges_ch5_ch9")
    panels = []
    for k, (name, place) in enumerate(zip(("ch5", "ch9"), GAUGES)):
        measured = lab[name] - lab[name][lab["time"] < 5.0].mean()
        number, crest, lab_crest = name[2:], int(run.gauges[:, k].argmax()), int(measured.argmax())
        yield Finding(
            f"gauge {number}: largest level [m] {TOLD}",
            float(run.gauges[crest, k]),
            float(measured[lab_crest]),
            np.inf,
        )
        # not the time of the largest level: gauge 5 has four crests within a tenth of it in two seconds
        times = [
            float(t[np.argmax(z > ARRIVED)])
            for t, z in ((run.time, run.gauges[:, k]), (lab["time"], measured))
        ]
        yield Finding(f"gauge {number}: arrival of {100 * ARRIVED:g} cm [s] {TOLD}", *times, np.inf, False)
        curves = (
            Curve(f"measured, gauge {number}", "measured", lab["time"], 100 * measured),
            Curve("computed", "computed", run.time, 100 * run.gauges[:, k]),
        )
        panels.append(Panel("time [s]", f"level at {place} m [cm]", curves, (10.0, END), (-3.0, 6.0)))
    yield Finding("run-up in the valley [m]", float(ground[run.wet].max(initial=0.0)), MEASURED_RUN_UP, 0.20)
    yield from run.losses.findings()
    # the tongue is one or two cells thick at its tip: which cell it ends in hangs on less than the wave is known to
    for share in (0.9999, 1.0001):
        other, ground = _monai(MONAI["cell"], share)
        what = f"run-up in the valley with the incident wave times {share:g} [m] {TOLD}"
        yield Finding(what, float(ground[other.wet].max(initial=0.0)), MEASURED_RUN_UP, np.inf)
    yield Figure("P60_monai", tuple(panels), columns=2)


def _monai(cell, share: float = 1.0) -> tuple[Coast, np.ndarray]:
    """The run, and the bed height (p,) [m] at places throughout the valley. share: of the level of the incident
    wave."""
    from pathlib import Path

    from coupler.geometry.terrain.grids import read_grid
    from coupler.geometry.terrain.height_map import HeightMap

    grid = read_grid(Path(SHIPPED / "monai_bathymetry.asc"))
    bed = HeightMap(grid.x, grid.y, grid.z)
    wave = columns("monai_incident_wave")

    def level(time: float) -> float:
        return share * float(np.interp(time + START, wave["time"], wave["level"]))

    fitted = fitted_mesh(MONAI["lower"], MONAI["upper"], cell, bed)
    x0, x1, y0, y1 = VALLEY
    x, y = (a.ravel() for a in np.meshgrid(np.arange(x0, x1, 0.01), np.arange(y0, y1, 0.01), indexing="ij"))
    ground = _bed_at(fitted, np.column_stack([x, y]))
    known = np.isfinite(ground)
    places, ground = np.column_stack([x, y])[known], ground[known]
    return _run(fitted, (GAUGES, START), _long_wave(level, DEPTH), END - START, places), ground


# ---------------------------------------------------------------- P61


ISLAND = {"lower": (7.04, 13.8, -0.32), "upper": (18.56, 19.24, 0.296), "cell": (0.32, 0.32, 0.088)}
"""Half of a part of the basin: its wall y- is the plane of symmetry, through the middle of the island, and x+, which is
6 m before the end of the basin, lets waves out. The lid lies so high that no column within reach of the water ends
below it: their beds would be lowered, a moat at 6 cm."""
MIDDLE, TOE, SLOPE, HEIGHT = (12.96, 13.80), 3.6, 0.25, 0.625
"""[m] Middle of the island, radius of its toe, its slope and height."""
STILL_DEPTH, WAVE = 0.32, 0.096 * 0.32
"""[m] Depth and height of the solitary wave, case B."""
ISLAND_GAUGES = {"g6": (9.36, 13.801), "g9": (10.36, 13.801), "g22": (15.56, 13.801)}
ISLAND_END = 9.5
"""[s] from the time when a twentieth of the wave is at the inflow."""


@check(
    "P61",
    "solitary wave on a conical island, H/d = 0.096",
    "Briggs, Synolakis, Harkins, Green, Pure Appl. Geophys. 144 (1995) 569; NTHMP laboratory benchmark 6",
    "M",
)
def conical_island():
    run, ground, angle = _island(ISLAND["cell"])
    lab, runup = columns("conical_island_gauges_b"), columns("conical_island_runup_b")
    height = {a: float(ground[(angle == a) & run.wet].max(initial=-STILL_DEPTH)) for a in np.unique(angle)}
    for name, a in (("facing the wave", 270.0), ("in the lee", 90.0)):
        near = [b for b in height if abs(b - a) <= 5.0]
        measured = float(runup["runup_m"][np.abs(runup["angle_deg"] - a) <= 5.0].max())
        yield Finding(f"run-up {name} [m]", max(height[b] for b in near), measured, 0.20)
    panels = []
    for k, (name, place) in enumerate(ISLAND_GAUGES.items()):
        level = lab[name] - lab[name][:25].mean()
        yield Finding(
            f"crest at {name} [m] {TOLD}", float(run.gauges[:, k].max()), float(level.max()), np.inf
        )
        # the experiment's clock is that of the wave maker, so the crests in front of the island are aligned
        shift = lab["time"][(lab["g6"]).argmax()] - run.time[run.gauges[:, 0].argmax()]
        curves = (
            Curve(f"measured, {name}", "measured", lab["time"] - shift, 100 * level),
            Curve("computed", "computed", run.time, 100 * run.gauges[:, k]),
        )
        panels.append(Panel("time [s]", f"level at {place} m [cm]", curves, (0.0, ISLAND_END), (-2.5, 5.0)))
    around = np.array(sorted(height))
    curves = (
        Curve("measured", "measured", runup["angle_deg"], 100 * runup["runup_m"], points=True),
        Curve("computed", "computed", around, 100 * np.array([height[a] for a in around])),
    )
    panels.append(
        Panel("angle [degrees], lee 90, front 270", "run-up [cm]", curves, (90.0, 270.0), (0.0, 10.0))
    )
    yield from run.losses.findings()
    yield Figure("P61_island", tuple(panels), columns=2)


def _island(cell) -> tuple[Coast, np.ndarray, np.ndarray]:
    """The run, the height of the bed (p,) [m] at places around the island, and their angles (p,) [degrees]."""
    fitted = fitted_mesh(ISLAND["lower"], ISLAND["upper"], cell, _cone)
    shore = [OnBed(_cone, -0.2, 0.12, 0.26, 1), OnBed(_cone, -0.06, 0.11, 0.10, 2)]
    mesh = refined_mesh(fitted.mesh, shore, fitted.lattice)
    wave = SolitaryWave(STILL_DEPTH, WAVE, G, 0.0)
    crest = np.arccosh(np.sqrt(20.0)) / (wave.rate * wave.speed)
    flow = SolitaryWave(STILL_DEPTH, WAVE, G, crest).flow((1.0, 0.0, 0.0), -STILL_DEPTH)
    end = _absorbing_end(mesh, -STILL_DEPTH, fitted.column_y[1:-1], ISLAND["cell"][0])
    angle, radius = (
        a.ravel() for a in np.meshgrid(np.arange(90.0, 271.0, 2.5), np.arange(1.5, 2.6, 0.005), indexing="ij")
    )
    x = MIDDLE[0] + radius * np.sin(np.radians(angle))
    y = np.maximum(MIDDLE[1] - radius * np.cos(np.radians(angle)), MIDDLE[1] + 1e-6)
    places = np.column_stack([x, y])
    run = _run(fitted, (tuple(ISLAND_GAUGES.values()), 0.0), flow, ISLAND_END, places, mesh=mesh, end=end)
    return run, _bed_at(fitted, places), angle


def _cone(x, y):
    """The bed: a level floor and half of the island."""
    over = SLOPE * (TOE - np.hypot(x - MIDDLE[0], y - MIDDLE[1]))
    return -STILL_DEPTH + np.clip(over, 0.0, HEIGHT)


def _long_wave(level, depth: float) -> Flow:
    """Water that comes in with a level and the velocity of a long wave into still water: u = 2 (sqrt(g h) - sqrt(g d))
    (Stoker 1957, 10.4)."""

    def velocity(points, time):
        u = 2.0 * (np.sqrt(G * max(depth + level(time), 0.0)) - np.sqrt(G * depth))
        return np.tile([u, 0.0, 0.0], (len(points), 1))

    return Flow(level, velocity)


def _absorbing_end(mesh, bed: float, along, cell: float) -> Side:
    """The side x+ of a mesh with a level bed at a height [m] there and still water at z = 0 outside, which lets waves
    out; the water is read at y of `along` (k,) [m], a cell [m] inside."""
    inward, right = np.array([-1.0, 0.0, 0.0]), mesh.bounds[1, 0]
    places = np.column_stack([np.full(len(along), right - cell), along])
    still = tide(inward, lambda time: 0.0)
    flow = Absorber(still, inward, places, np.full(len(along), bed), G).as_flow()
    return Side.of(mesh, lambda n, c: (n[:, 0] > 0.5) & (c[:, 0] > right - 1e-6), flow)


def _run(
    fitted, gauges, flow: Flow, until: float, looked_at, still: float = 0.0, mesh=None, end=None
) -> Coast:
    """A run over a bed with the flow through x-; the level of still water [m]; gauges: (places, shift of time [s]) ·
    looked_at (p, 2) [m]: places at which it is noted whether the bed gets wet · mesh: with finer parts, None: the
    fitted one · end: another `Side`, None: all others are walls."""
    (places, shift), mesh = gauges, fitted.mesh if mesh is None else mesh
    layer = fitted.layer * mesh.finest / fitted.mesh.finest
    places = np.array(places)
    immersion = Immersion(mesh, None, [], "single")
    left = mesh.bounds[0, 0]
    side = Side.of(mesh, lambda n, c: (n[:, 0] < -0.5) & (c[:, 0] < left + 1e-6), flow)
    sides = [side] if end is None else [side, end]
    settings = WaterParameters(density=DENSITY, gravity=G)
    water = Water(mesh, immersion.domain, lambda x: x[:, 2] - still, settings, None, None, Sides(sides))
    coupling = CoupledStepper(water, None, immersion, rtol=1e-7, step_max=1.0, clock=Clock())
    bed_there = _bed_at(fitted, looked_at) + FILM * layer
    there = np.isfinite(bed_there)
    above, wet = np.column_stack([looked_at, bed_there])[there], np.zeros(len(looked_at), bool)
    bed = _bed_at(fitted, places)
    time, read, losses = [shift], [np.full(len(places), 0.0)], Losses(water)
    while coupling.time < until:
        coupling.step(water.stable_step())
        losses.add()
        wet[there] |= Places.of(water, above, beyond=True).read(water.level_set) < 0.0
        time.append(coupling.time + shift)
        read.append(bed + levels(water, places) - still)
    return Coast(np.array(time), np.array(read), wet, losses)


def _bed_at(fitted, places) -> np.ndarray:
    """z (k,) [m] of the bed of the mesh under places (k, 2) [m], on its triangles; NaN where land has no cells."""
    at, share = [], []
    for k, axis in enumerate((fitted.column_x, fitted.column_y)):
        n = np.clip(np.searchsorted(axis, places[:, k], side="right") - 1, 0, len(axis) - 2)
        at.append(n)
        share.append((places[:, k] - axis[n]) / (axis[n + 1] - axis[n]))
    (i, j), (s, t), z = at, share, fitted.bed
    z00, z10, z01, z11 = z[i, j], z[i + 1, j], z[i, j + 1], z[i + 1, j + 1]
    return np.where(s >= t, z00 + s * (z10 - z00) + t * (z11 - z10), z00 + t * (z01 - z00) + s * (z11 - z01))
