"""Jets on plates, practically without gravity: force and pressure against free-streamline theory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupler.commands.verify.curves import Curve, Figure, Panel
from coupler.commands.verify.figures import columns
from coupler.commands.verify.registry import TOLD, Finding, check
from coupler.commands.verify.scenes import DENSITY, box
from fluid.cut.bodies import ConvexBodies
from fluid.domain.covers import OPENINGS
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.mesh.refinement import InBox, refined_mesh
from fluid.numerics.bounded import solve_pressure
from fluid.readings.gauges import pressure
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water

SLUG = 8.0
"""Length of the water in widths D of the jet; D = 1 m, U = 1 m/s."""
STEADY = (2.5, 6.0)
"""Window in D/U for the means: the jet has spread over the plate, and its end has not come yet."""
LONG_SLUG, LONG = 24.0, (6.0, 18.0)
"""The same for sheets on endless plates. Theory is that of an endless jet. On one cell over the jet the plate is pushed
too little for 3 D/U and too much for another 3, and on two cells sheets at 30 degrees push in turn more and less over
some 6 D/U. The end of a jet of one cell comes after 20."""
GRAVITY = 1e-4
"""Gravity [m/s²], so small that the jet is a hundred times as fast as waves on it, and that the weight of the water
adds 0.1 % to the force on a plate at 30 degrees, 0.2 % with the long jet."""
THICK = 0.5
"""Thickness of the plate in D."""
PLACES = (0.0, 0.25, 0.5, 0.75, 0.9)
"""Where the pressure is read, in half widths of the plate."""
LIMITS = {8: 0.05, 4: 0.10, 2: 0.15, 1: 0.20}
"""Relative error of the force allowed, by cells over D."""
SHEET_LIMITS = {8: 0.05, 4: 0.05, 2: 0.05, 1: 0.10}
BEYOND = 0.3
"""How far beyond a node the front of a plate lies, in cells there."""
SHEET_PLACES = {
    2: [{"aside": k / 8} for k in range(8)],
    1: [{"beyond": (BEYOND + k / 8) % 1.0} for k in range(8)],
}
"""Places between the nodes over which forces of sheets are averaged, by cells over D. A jet of one cell has its volume
only around a layer of nodes: there the plate alone is moved, along the jet, elsewhere plate and jet along the plate."""
ANY = 10.0
"""Tolerance of values that are reported, not judged."""


@dataclass(frozen=True)
class Jet:
    """Means over the steady part: force along the normal of the plate over ρ U² D (a length of the slice), pressure at
    PLACES over ρ U²/2; lowest pressure of the whole run over ρ U²/2."""

    force: float
    pressure: np.ndarray
    lowest: float


@check("P62", "jet on a finite plate", "free-streamline theory (Kirchhoff), exact", "M")
def finite_plates():
    table = columns("jet_on_plate")
    runs = {}
    for n, limit in LIMITS.items():
        for row, width in enumerate(table["L_over_D"]):
            run = runs[n, width] = jet(width, n)
            exact = float(table["F"][row])
            yield Finding(f"force/(ρU²D), L/D = {width:g}, {n} cells over D", run.force, exact, limit)
    halved = {}
    for row, width in enumerate(table["L_over_D"][:3]):
        halved[width], exact = jet(width, 4, finer=1.0).force, float(table["F"][row])
        what = f"force/(ρU²D), L/D = {width:g}, 4 cells over D, 8 up to D around the plate"
        yield Finding(what, halved[width], exact, LIMITS[8])
    for row, width in enumerate(table["L_over_D"][:3]):
        moved = [jet(width, 4, finer=1.0, aside=aside).force for aside in (0.25, 0.5, 0.75)]
        what = f"the same, edges 0, 1/2, 1 and 3/2 of a small cell from a node: mean force, L/D = {width:g} {TOLD}"
        yield Finding(what, float(np.mean([halved[width], *moved])), float(table["F"][row]), ANY)
    for row, width in enumerate(table["L_over_D"][:3]):
        for at, column in ((0.75, "p_075"), (0.9, "p_09")):
            found, exact = float(runs[8, width].pressure[PLACES.index(at)]), float(table[column][row])
            what = f"pressure/(ρU²/2) at {at:g} of the half width, L/D = {width:g}, 8 cells"
            yield Finding(what, found, exact, 0.10, False)
    for courant in (0.25, 2.0):
        for width in (1.0, 2.0):
            ratio = jet(width, 8, courant=courant).force / runs[8, width].force
            yield Finding(
                f"force with Courant number {courant:g} over that with 1, L/D = {width:g}, 8 cells",
                ratio,
                1.0,
                0.05,
            )
    for openings in ("all", "wide"):
        for row, width in enumerate(table["L_over_D"][:3]):
            found, exact = jet(width, 8, aside=0.5, openings=openings).force, float(table["F"][row])
            what = (
                f"edges half a cell from nodes, openings {openings}: force, L/D = {width:g}, 8 cells {TOLD}"
            )
            yield Finding(what, found, exact, ANY)
    open_air = jet(1.0, 8, suction="unlimited")
    exact = float(table["F"][1])
    yield Finding(f"suction unlimited: force, L/D = 1, 8 cells {TOLD}", open_air.force, exact, ANY)
    yield Finding(f"suction unlimited: lowest pressure/(ρU²/2) {TOLD}", open_air.lowest, 0.0, ANY, False)
    yield _figure(runs, table)


@check("P63", "sheet of water on an endless plate, straight and inclined", "momentum, exact", "M")
def endless_plates():
    runs = {}
    for angle in (90.0, 60.0, 30.0):
        for n, limit in SHEET_LIMITS.items():
            what = f"normal force/(ρU²D sin a), a = {angle:g}°, {n} cells over D"
            runs[angle, n] = _sheet(n, angle)
            yield Finding(what, runs[angle, n], 1.0, limit)
    for (angle, n), first in runs.items():
        if n not in SHEET_PLACES:
            continue
        force = np.array([first] + [_sheet(n, angle, **place) for place in SHEET_PLACES[n][1:]])
        where = f"a = {angle:g}°, {n} cells over D {TOLD}"
        yield Finding(f"mean over eight places between the nodes, {where}", float(force.mean()), 1.0, ANY)
        yield Finding(f"standard deviation over them, {where}", float(force.std()), 0.0, ANY, False)
        yield Finding(f"farthest off of them, {where}", float(force[np.abs(force - 1.0).argmax()]), 1.0, ANY)


def _sheet(n: int, angle: float, **place) -> float:
    """Normal force over ρ U² D sin a on an endless plate; place: `aside` or `beyond` of `jet`."""
    return jet(12.0, n, angle=angle, long=True, **place).force / float(np.sin(np.radians(angle)))


def jet(
    width: float,
    n: int,
    angle: float = 90.0,
    courant: float = 1.0,
    suction: str = "bounded",
    finer: float = 0.0,
    aside: float = 0.0,
    openings: str = "",
    long: bool = False,
    beyond: float = BEYOND,
) -> Jet:
    """A slug of water against a plate of the given width [D], n cells over D, in a slice of one cell.

    angle [degrees] between jet and plate · courant: of the step · finer [D]: how far around the plate cells are
    halved · aside: how far plate and jet are moved along the plate, in cells · openings: as in a case; by default
    "wide" where the plate is thinner than two cells and "all" elsewhere, as docs/water.md advises · long: LONG_SLUG and
    its window · beyond: a node, how far the front of the plate lies, in cells there."""
    openings = openings or ("wide" if THICK * n < 2.0 else "all")
    slug, (begin, end) = (LONG_SLUG, LONG) if long else (SLUG, STEADY)
    water, front, along = _start(width, n, angle, courant, suction, finer, aside, openings, slug, beyond)
    normal = np.array([np.sin(np.radians(angle)), 0.0, -np.cos(np.radians(angle))])
    places = np.array([front + s * f * 0.5 * width * along for f in PLACES for s in (1.0, -1.0)])
    depth, total, forces, pressures, lowest = 1.0 / n, 0.0, 0.0, np.zeros(len(PLACES)), 0.0
    while water.time < end:
        problem = water.predict(min(water.stable_step(), courant * water.mesh.finest))
        found = solve_pressure(problem, 1e-9)
        problem = problem.with_waterline_of(found.x)
        water.correct(problem, found.x, found.parting)
        load = problem.load(found.x)
        lowest = min(lowest, water.report.bound.lowest)
        if water.time > begin:
            total += problem.dt
            forces += problem.dt * float(load[0, :3] @ normal)
            pressures += problem.dt * pressure(water, places).reshape(-1, 2).mean(axis=1)
    head = 0.5 * DENSITY
    return Jet(forces / (total * DENSITY * depth), pressures / (total * head), lowest / head)


def _start(
    width: float,
    n: int,
    angle: float,
    courant: float,
    suction: str,
    finer: float,
    aside: float,
    openings: str,
    slug: float = SLUG,
    beyond: float = BEYOND,
):
    """The water, the middle (3,) of the front of the plate, and the direction (3,) along the plate."""
    cell, turn = 1.0 / n, np.radians(90.0 - angle)
    reach = np.array([0.5 * width * np.sin(turn), 0.5 * width * np.cos(turn)])
    front = np.array([beyond * cell / (2.0 if finer else 1.0), 0.5 * cell, aside * cell])
    margin = 2.5 if width < 8.0 else 1.0
    low = [-(slug + 1.5 + reach[0]), 0.0, -(reach[1] + margin)]
    high = [reach[0] + 3.0, cell, reach[1] + margin]
    low, high = (
        np.sign(e) * np.ceil(np.abs(e) / cell - 1e-9) * cell for e in (np.array(low), np.array(high))
    )
    mesh = box_mesh(low, high, cell)
    if finer:
        beside = np.array([finer, cell, 0.5 * width + finer])
        mesh = refined_mesh(mesh, [InBox(tuple(front - beside), tuple(front + beside), 1)])
    rotation = np.array(
        [[np.cos(turn), 0.0, np.sin(turn)], [0.0, 1.0, 0.0], [-np.sin(turn), 0.0, np.cos(turn)]]
    )
    along = rotation @ [0.0, 0.0, 1.0]
    middle = front + 0.5 * THICK * rotation @ [1.0, 0.0, 0.0]
    plate = ConvexBodies.from_polyhedra([box(middle, (THICK, 4.0 * cell, width), rotation)])
    domain = cut_domain(mesh, plate, "multiple", connection=OPENINGS[openings])
    nose = -0.5 - 0.5 / np.tan(np.radians(angle)) if angle < 90.0 else front[0] - 0.5

    def fill(x):
        ends = np.maximum(nose - slug - x[:, 0], x[:, 0] - nose)
        return np.maximum(ends, np.abs(x[:, 2] - front[2]) - 0.5)

    def is_open(side, centre):
        return np.abs(side[:, 1]) < 0.5

    speed = np.zeros((len(domain.nodes), 3))
    speed[:, 0] = 1.0
    parameters = WaterParameters(density=DENSITY, gravity=GRAVITY, courant=courant, suction=suction)
    return Water(mesh, domain, fill, parameters, is_open, velocity=speed), front, along


def _figure(runs, table) -> Figure:
    """Pressure along the plates, eight cells over the jet."""
    y, panels = np.array(PLACES), []
    names = ("p_0", "p_025", "p_05", "p_075", "p_09")
    for row, width in enumerate(table["L_over_D"][:3]):
        exact = np.array([table[name][row] for name in names])
        curves = (
            Curve("free-streamline theory", "measured", y, exact),
            Curve("computed, D/8", "computed", y, runs[8, width].pressure),
            Curve("computed, D/4", "computed", y, runs[4, width].pressure),
        )
        panels.append(
            Panel("place over the half width [–]", f"pressure $p/(\\rho U^2/2)$ [–], L/D = {width:g}", curves)
        )
    return Figure("P62_jets", tuple(panels), columns=3)
