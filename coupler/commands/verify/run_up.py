"""Run-up of a solitary wave on a plane beach that cuts the cells, or on which the mesh ends (Synolakis)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupler.commands.verify.curves import Curve, Figure, Panel
from coupler.commands.verify.figures import columns, named_values
from coupler.commands.verify.losses import Losses
from coupler.commands.verify.registry import TOLD, Finding, check
from coupler.commands.verify.scenes import DENSITY, G
from coupler.run.clock import Clock
from coupler.step.coupled_step import CoupledStepper
from coupler.step.immersion import Immersion
from fluid.mesh.background import box_mesh
from fluid.mesh.fitted_mesh import fitted_mesh
from fluid.mesh.refinement import InBox, refined_mesh
from fluid.readings import gauges
from fluid.sides.inflow import Side, Sides
from fluid.sides.waves import SolitaryWave
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water

HEIGHT, SLOPE = 0.0185, 19.85
"""H/d of the wave; cot β of the beach."""
FLAT, ABOVE = 2.0, 0.2
"""Flat bed before the toe of the beach and tank above the still water, in depths."""
AHEAD = 18.4
"""Way of the crest to the inflow in depths, arccosh(sqrt 20)/sqrt(3H/4d): at the start 5 % of its height is there."""
CELLS, STRETCH = 24, 2
"""Cells over the depth, and length of a cell over its height."""
BEACH = InBox((FLAT + 0.9 * SLOPE, -1.0, 0.85), (FLAT + 2.0 * SLOPE, 1.0, 1.15), 2)
"""Where cells may be a quarter as large: the beach from a tenth of the depth under still water up."""
FILM = 0.1
"""Height over the beach at which it counts as wet, in cells: the experiment saw the tip of the water."""
LAYERS, THINNEST, FLATTEST, LONGEST = 8, 0.2, 4.0, 0.25
"""Of the mesh that fits the bed: layers between bed and lid, least height of one over that in deep water, length of a
cell over its height, and its largest length in depths."""
MOVED = 1e-6
"""Distance in depths by which the beach is moved on the mesh that fits it, to see how far round-off changes R/d."""
REST = 2.0
"""Duration [s] for which still water is observed."""


@dataclass(frozen=True)
class RunUp:
    """Times t sqrt(g/d) (n,) and height R/d (n,) of the water line, for a wave or still water; largest speed [m/s]."""

    t: np.ndarray
    R: np.ndarray
    fastest: float
    losses: Losses


@check(
    "P42", "run-up of a solitary wave on a beach of 1:19.85", "Synolakis, J. Fluid Mech. 185 (1987) 523", "L"
)
def run_up():
    """Judged on cells that resolve the tongue on the beach, and on a mesh that fits the bed."""
    exact = named_values("wave_closed_forms")["runup_R_over_d_cot=19.85_H/d=0.0185"]
    still = _beach(REST, waves=False)
    yield Finding("still water on the beach: fastest after 2 s [m/s]", still.fastest, 0.0, 1e-3, False)
    what = f"largest run-up R/d at H/d = {HEIGHT}"
    coarse = _beach(_end())
    yield Finding(f"{what}, cells d/{CELLS} {TOLD}", float(coarse.R.max()), exact, np.inf)
    yield from coarse.losses.findings(f"cells d/{CELLS}: ")
    fine = CELLS * 2**BEACH.levels
    run = _beach(_end(), finer=(BEACH,))
    yield Finding(f"{what}, cells d/{fine} on the beach", float(run.R.max()), exact, 0.10)
    yield from run.losses.findings(f"cells d/{fine} on the beach: ")
    on_bed = _on_bed(_end())
    yield Finding(
        f"the same on a mesh that fits the bed, {LAYERS} layers", float(on_bed.R.max()), exact, 0.10
    )
    moved = _on_bed(_end(), by=MOVED)
    change = abs(float(moved.R.max() - on_bed.R.max()))
    yield Finding(f"change of it with the beach moved by {MOVED:g} d {TOLD}", change, 0.0, np.inf, False)
    lab = columns("synolakis_runup_lab")
    heights = np.geomspace(0.005, 0.05, 40)
    law = 2.831 * np.sqrt(SLOPE) * heights**1.25
    against = (
        Curve("laboratory, Synolakis 1987", "measured", lab["H_over_d"], lab["R_over_d"], points=True),
        Curve("law of waves that do not break", "exact", heights, law),
        Curve("computed", "computed", np.array([HEIGHT]), run.R.max(keepdims=True), points=True),
    )
    line = (
        Curve("largest of the law", "exact", run.t[[0, -1]], np.full(2, exact)),
        Curve(f"computed, cells d/{fine} on the beach", "computed", run.t, run.R),
        Curve(f"cells d/{CELLS}", "computed", coarse.t, coarse.R),
        Curve("fitted bed", "other", on_bed.t, on_bed.R),
    )
    panels = (
        Panel("time $t\\sqrt{g/d}$ [–]", "height of the water line $R/d$ [–]", line),
        Panel("height of the wave $H/d$ [–]", "largest run-up $R/d$ [–]", against, (0.0, 0.05), (0.0, 0.35)),
    )
    yield Figure("P42_run_up", panels, columns=2)


def _end() -> float:
    """Time [s] by which the run-up is over: the crest enters, crosses the flat and climbs the beach; plus 20 %."""
    c = np.sqrt(G * (1.0 + HEIGHT))
    return (AHEAD + FLAT) / c + 2.0 * SLOPE / np.sqrt(G) + 5.0


def _beach(until: float, waves: bool = True, finer: tuple = ()) -> RunUp:
    """A slice two cells wide with d = 1 m; the beach is a fixed body. finer: regions of `refined_mesh`."""
    dx = STRETCH / CELLS
    length = np.round((FLAT + SLOPE * (1.0 + 0.8 * ABOVE)) / dx) * dx
    mesh = refined_mesh(box_mesh(np.zeros(3), [length, 2 * dx, 1.0 + ABOVE], [dx, dx, 1.0 / CELLS]), finer)
    immersion = Immersion(mesh, None, [_ramp(length + 1.0, 2 * dx)], "single")
    levels = max((region.levels for region in finer), default=0)
    return _run(until, waves, mesh, immersion, FILM / (CELLS * 2**levels))


def _on_bed(until: float, by: float = 0.0) -> RunUp:
    """The same slice on columns of LAYERS cells from the bed to the lid, shorter and flatter towards the shore,
    with the beach moved by a distance [m] away from the inflow."""
    lid = 1.0 + ABOVE
    layer = lid / LAYERS
    x = _columns(FLAT + SLOPE * (1.0 + 0.8 * ABOVE), lid, layer)
    width = layer * THINNEST * FLATTEST
    upper, across = [x[-1], 2 * width, lid], np.array([0.0, width, 2 * width])
    fitted = fitted_mesh(
        np.zeros(3), upper, layer, lambda x, y: _bed(x - by, y), axes=(x, across), thinnest=THINNEST
    )
    immersion = Immersion(fitted.mesh, None, [], "single")
    return _run(until, True, fitted.mesh, immersion, FILM * THINNEST * layer, by)


def _bed(x, _):
    return np.maximum(0.0, (x - FLAT) / SLOPE)


def _columns(length: float, lid: float, layer: float):
    """Coordinates of columns as far from each other as FLATTEST times the height of their cells, LONGEST at most."""
    at = np.linspace(0.0, length, 20001)
    size = np.minimum(FLATTEST * np.clip((lid - _bed(at, 0.0)) / LAYERS, THINNEST * layer, layer), LONGEST)
    passed = np.concatenate([[0.0], np.cumsum(np.diff(at) / (0.5 * (size[1:] + size[:-1])))])
    x = np.interp(np.linspace(0.0, passed[-1], int(np.rint(passed[-1])) + 1), passed, at)
    x[-1] = length
    return x


def _run(until: float, waves: bool, mesh, immersion, film: float, by: float = 0.0) -> RunUp:
    """Water of the depth 1 m in a slice, with or without the wave; film [m]: depth from which the beach is wet ·
    by [m]: how far the beach is moved."""
    sides = Sides([Side.of(mesh, lambda normal, _: normal[:, 0] < -0.5, _wave())]) if waves else None
    settings = WaterParameters(density=DENSITY, gravity=G)
    water = Water(mesh, immersion.domain, lambda x: x[:, 2] - 1.0, settings, None, None, sides)
    c = CoupledStepper(water, None, immersion, rtol=1e-7, step_max=1.0, clock=Clock())
    x = np.linspace(FLAT + 0.8 * SLOPE, mesh.bounds[1, 0] - 1e-6, 2000)
    bed = (x - FLAT - by) / SLOPE
    line = np.column_stack([x, np.full_like(x, 0.5 * mesh.bounds[1, 1]), bed + film])
    t, R, losses = [0.0], [0.0], Losses(water)
    while c.time < until:
        c.step(water.stable_step())
        losses.add()
        t.append(c.time * np.sqrt(G))
        R.append(_water_line(water, line, bed) - 1.0)
    return RunUp(np.array(t), np.array(R), _fastest(water), losses)


def _wave():
    """The solitary wave through the side x = 0."""
    speed = SolitaryWave(1.0, HEIGHT, G, 0.0).speed
    return SolitaryWave(1.0, HEIGHT, G, AHEAD / speed).flow((1.0, 0.0, 0.0), 0.0)


def _ramp(end: float, width: float):
    """A wedge under the beach from its toe to x = end, wider than the slice: corners (6, 3) and faces."""
    top = (end - FLAT) / SLOPE
    corners = [(x, y, z) for y in (-1.0, width + 1.0) for x, z in ((FLAT, 0.0), (end, 0.0), (end, top))]
    faces = ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0))
    return np.array(corners), faces


def _water_line(water, line, bed) -> float:
    """Height z [m] of the beach where its line of points first falls dry."""
    wet = gauges.level_set_at(water, line) < 0.0
    return bed[-1] if wet.all() else bed[int(np.argmin(wet))]


def _fastest(water) -> float:
    wet = (water.level_set < 0.0) & water.topology.active
    return float(np.abs(water.velocity[wet]).max())
