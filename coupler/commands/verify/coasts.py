"""Tsunamis on coasts that were built in laboratories: Monai valley."""

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
from fluid.readings.gauges import levels
from fluid.sides.inflow import Flow, Side, Sides
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water

FILM = 0.1
"""Height over the bed at which it counts as wet, in layers: the experiments saw the tip of the water."""


@dataclass(frozen=True)
class Coast:
    """A run: times (n,) [s] · gauges (n, k) [m], levels at k places · wet (p,): which of the places looked at were wet
    at any time · losses"""

    time: np.ndarray
    gauges: np.ndarray
    wet: np.ndarray
    losses: Losses


# ---------------------------------------------------------------- P60


MONAI = {"lower": (0.0, 0.0, -0.14), "upper": (5.488, 3.402, 0.12), "cell": (0.12, 0.12, 0.024)}
START, END = 6.0, 22.5
"""[s] of the record that is run: the wave begins in its trough of 3 mm, a fifth of its crest; its end."""
DEPTH = 0.13535
"""[m] at the inlet."""
GAUGES = ((4.521, 1.196), (4.521, 2.196))
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
        yield Finding(
            f"gauge {number}: time of it [s] {TOLD}",
            float(run.time[crest]),
            float(lab["time"][lab_crest]),
            np.inf,
            False,
        )
        curves = (
            Curve(f"measured, gauge {number}", "measured", lab["time"], 100 * measured),
            Curve("computed", "computed", run.time, 100 * run.gauges[:, k]),
        )
        panels.append(Panel("time [s]", f"level at {place} m [cm]", curves, (10.0, END), (-3.0, 6.0)))
    yield Finding("run-up in the valley [m]", float(ground[run.wet].max(initial=0.0)), MEASURED_RUN_UP, 0.20)
    yield from run.losses.findings()
    yield Figure("P60_monai", tuple(panels), columns=2)


def _monai(cell) -> tuple[Coast, np.ndarray]:
    """The run, and the height of the bed (p,) [m] at places all over the valley."""
    from pathlib import Path

    from coupler.geometry.terrain.grids import read_grid
    from coupler.geometry.terrain.height_map import HeightMap

    grid = read_grid(Path(SHIPPED / "monai_bathymetry.asc"))
    bed = HeightMap(grid.x, grid.y, grid.z)
    wave = columns("monai_incident_wave")

    def level(time: float) -> float:
        return float(np.interp(time + START, wave["time"], wave["level"]))

    fitted = fitted_mesh(MONAI["lower"], MONAI["upper"], cell, bed)
    x0, x1, y0, y1 = VALLEY
    x, y = (a.ravel() for a in np.meshgrid(np.arange(x0, x1, 0.01), np.arange(y0, y1, 0.01), indexing="ij"))
    ground = _bed_at(fitted, np.column_stack([x, y]))
    known = np.isfinite(ground)
    places, ground = np.column_stack([x, y])[known], ground[known]
    return _run(fitted, [(GAUGES, START)], _long_wave(level, DEPTH), END - START, places), ground


def _long_wave(level, depth: float) -> Flow:
    """Water that comes in with a level and the velocity of a long wave into still water: u = 2 (sqrt(g h) - sqrt(g d))
    (Stoker 1957, 10.4)."""

    def velocity(points, time):
        u = 2.0 * (np.sqrt(G * max(depth + level(time), 0.0)) - np.sqrt(G * depth))
        return np.tile([u, 0.0, 0.0], (len(points), 1))

    return Flow(level, velocity)


def _run(fitted, gauges, flow: Flow, until: float, looked_at, still: float = 0.0) -> Coast:
    """A run over a bed with the flow through x-; the level of still water [m]; gauges [(places, shift of time [s])] ·
    looked_at (p, 2) [m]: places at which it is noted whether the bed gets wet."""
    (places, shift), mesh = gauges[0], fitted.mesh
    places = np.array(places)
    immersion = Immersion(mesh, None, [], "single")
    left = mesh.bounds[0, 0]
    side = Side.of(mesh, lambda n, c: (n[:, 0] < -0.5) & (c[:, 0] < left + 1e-6), flow)
    settings = WaterParameters(density=DENSITY, gravity=G)
    water = Water(mesh, immersion.domain, lambda x: x[:, 2] - still, settings, None, None, Sides([side]))
    coupling = CoupledStepper(water, None, immersion, rtol=1e-7, step_max=1.0, clock=Clock())
    bed_there = _bed_at(fitted, looked_at) + FILM * fitted.layer
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
