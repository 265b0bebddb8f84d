"""Scenes with water at rest, which must stay at rest for any cut of its cells and any direction of gravity."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from coupler.case.case import Case
from coupler.checks.case import problems
from coupler.commands.stress.flow import Flow
from coupler.commands.stress.registry import Measure, scene
from coupler.commands.verify.scenes import DENSITY, G, box, level_at, tank
from coupler.program.errors import BadCase


def wave_speed(depth: float) -> float:
    """sqrt(g h) [m/s]: the scale for speeds in still water."""
    return float(np.sqrt(G * depth))


def dry(x):
    """Fill: no water anywhere."""
    return np.full(len(x), 10.0)


def full(x):
    """Fill: water up to the lid."""
    return np.full(len(x), -10.0)


@scene("W01", "everything dry")
def everything_dry() -> Iterator[Measure]:
    c = tank((1, 1, 1), (8, 8, 8), dry, solids=[box((0.5, 0.5, 0.2), (0.3, 0.3, 0.4))])
    flow = Flow(c).run(0.2)
    yield Measure("volume", c.water.volume(), 0.0, "m3")
    yield Measure("pressure unknowns", float(flow.record.unknowns), 0.0)
    yield Measure("force on the solid", float(np.abs(flow.record.load).max()), 0.0, "N")


@scene("W02", "closed tank full to the lid, with a solid in it")
def full_to_the_lid() -> Iterator[Measure]:
    """No free surface: the pressure has no level of its own. Archimedes' principle must hold all the same."""
    c = tank((1, 1, 1), (8, 8, 8), full, solids=[box((0.47, 0.52, 0.51), (0.3, 0.3, 0.3))])
    flow = Flow(c).run(0.5)
    lift = DENSITY * G * 0.3**3
    yield Measure("lift, off the weight of the water displaced", flow.record.load[0, 2] / lift - 1.0, 1e-5)
    yield from flow.at_rest(wave_speed(1.0))


@scene("W03", "slivers: a solid 1e-12 to 1e-2 cells off the nodes")
def slivers() -> Iterator[Measure]:
    """The faces of the solid lie beside mesh faces; cut parts down to 1e-12 of their cell."""
    for off in (1e-12, 1e-9, 1e-6, 1e-4, 1e-2):
        shift = off / 8.0 * np.array([1.0, -0.7, 0.4])
        solid = box(np.array([0.5, 0.5, 0.5]) + shift, (0.25, 0.25, 0.25))
        c = tank((1, 1, 1), (8, 8, 8), level_at(0.9), solids=[solid])
        flow = Flow(c).run(0.1)
        lift = DENSITY * G * 0.25**3
        yield Measure(f"lift, off Archimedes, {off:g} cells", flow.record.load[0, 2] / lift - 1.0, 1e-5)
        yield from flow.at_rest(wave_speed(0.9), f"{off:g} cells")


@scene("W04", "water shut in by solids, beside open water")
def closed_cavity() -> Iterator[Measure]:
    """Four walls and a lid around a full chamber; outside a level of its own."""
    walls = [box((0.5, y, 0.25), (0.6, 0.06, 0.5)) for y in (0.23, 0.77)] + [
        box((x, 0.5, 0.25), (0.06, 0.6, 0.5)) for x in (0.23, 0.77)
    ]
    lid = box((0.5, 0.5, 0.53), (0.6, 0.6, 0.06))
    c = tank((1, 1, 1), (10, 10, 10), level_at(0.8), solids=[*walls, lid], covers="multiple")
    flow = Flow(c).run(0.3)
    yield Measure("lift of walls and lid", float(flow.record.load[:, 2].sum()), None, "N")
    yield from flow.at_rest(wave_speed(0.8))


@scene("W05", "water in the corner under a slope of 45 degrees, and one of 1:5")
def corner_wedge() -> Iterator[Measure]:
    """A solid slope that cuts the cells: the water line meets it somewhere in a cell."""
    for angle in (45.0, np.degrees(np.arctan(0.2))):
        turn = Rotation.from_euler("y", -angle, degrees=True).as_matrix()
        # the upper face of a large box runs from the foot of the slope at x = 0.6 upwards
        centre = np.array([0.6, 0.1, 0.0]) + turn @ np.array([1.0, 0.0, -0.5])
        c = tank((2, 0.2, 1), (30, 3, 15), level_at(0.33), solids=[box(centre, (4.0, 1.0, 1.0), turn)])
        flow = Flow(c).run(3.0)
        yield from flow.at_rest(wave_speed(0.33), f"{angle:.3g} degrees", 1e-2)


@scene("W06", "wall of 0.05 cells between two levels")
def thin_wall() -> Iterator[Measure]:
    """Each side has its own unknowns: nothing leaks, and the force is that of both levels to round-off."""
    h = 0.1
    wall = box((0.53, 0.15, 0.6), (0.05 * h, 1.0, 1.4))
    fill = [((0.0, 0.0, 0.0), (0.53, 0.3, 0.83)), ((0.53, 0.0, 0.0), (1.0, 0.3, 0.31))]
    c = tank((1, 0.3, 1), (10, 3, 10), fill, solids=[wall], covers="multiple")
    flow = Flow(c).run(0.5)
    exact = 0.5 * DENSITY * G * 0.3 * (0.83**2 - 0.31**2)
    yield Measure("force, off that of both levels", flow.record.load[0, 0] / exact - 1.0, 1e-5)
    yield from flow.at_rest(wave_speed(0.83), limit=1e-5)


@scene("W07", "at rest for a minute")
def long_rest() -> Iterator[Measure]:
    """A solid cuts the cells and the surface passes through it; 1500 steps."""
    c = tank((1, 0.2, 0.8), (10, 2, 8), level_at(0.52), solids=[box((0.43, 0.1, 0.5), (0.33, 0.4, 0.31))])
    flow = Flow(c).run(60.0, 0.04)
    yield Measure("steps", float(flow.steps), None)
    yield from flow.at_rest(wave_speed(0.52), limit=1e-4)


def _beyond(down):
    """Fill: all that is more than 5 cm beyond the middle of the tank along `down`."""
    return lambda x: 0.05 - (x - 0.5) @ down


@scene("W08", "gravity sideways, oblique, and 1e-6 of that of the earth")
def other_gravity() -> Iterator[Measure]:
    for name, down, g in (
        ("sideways", (1.0, 0.0, 0.0), G),
        ("oblique", (0.6, 0.0, -0.8), G),
        ("hardly any", (0.0, 0.0, -1.0), 1e-6 * G),
    ):
        c = tank((1, 1, 1), (8, 8, 8), _beyond(np.asarray(down)), gravity=g, down=down)
        flow = Flow(c).run(1.0, 0.01)
        yield from flow.at_rest(float(np.sqrt(g)), name, 1e-5)


@scene("W09", "a case with water and without gravity", refusal="must")
def weightless() -> Iterator[Measure]:
    """Water without weight has neither a step nor a speed to measure by: the case must be refused, and say so."""
    table = {
        "case": {"title": "weightless", "gravity": 0.0},
        "time": {"end": 1.0},
        "tank": {"lower": [0, 0, 0], "upper": [1, 1, 1], "cell": 0.125},
        "water": {"fill": [{"lower": [0, 0, 0], "upper": [1, 1, 0.5]}]},
    }
    found = [text for path, text in problems(Case.model_validate(table)) if path == ("case", "gravity")]
    if found:
        raise BadCase(found)
    yield Measure("problems found in the case", float(len(found)), None)
