"""Remarks on bodies that are too thin for single covers, which let water act on both of their sides as one field."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.case.case import Case, Tank
from coupler.checks.places import solid_bodies
from coupler.geometry.bodies import Body
from coupler.geometry.cell_sizes import has_equal_cells, places_in, widest_cell
from coupler.geometry.parts import parts_of


def thin_remarks(case: Case) -> Iterator[str]:
    """Bodies too thin for single covers, reported once for the thinnest.

    On fixed walls 1, 1.2, 1.4 and 1.6 cells thick, whose middle stood 0.05 of a cell off a plane of the mesh, 0.6 m of
    still water on cells of 0.1 m exerted 0.55, 0.62, 0.84 and 0.91 of its force after 0.2 s, and passed through; other
    places gave up to 0.15 more. On a wall of 1.9 cells it exerted all of it."""
    if case.tank is None or case.water is None or case.water.covers != "single":
        return
    thin: dict[str, tuple[float, float, float]] = {}
    for name, width, cell, divides in _widths(case):
        if width < (2.0 * (1.0 - 1e-9) if divides else 1.0) * cell:
            thin[name] = min(thin.get(name, (np.inf, 0.0, 0.0)), (width / cell, width, cell))
    if thin:
        name, (_, width, cell) = min(thin.items(), key=lambda item: item[1])
        below, lost = "a cell", "most of the load can be missing"
        if width >= cell:
            below, lost = "two cells", "nearly half of the load can be missing, and water pass through"
        more = sum(share < (1.0 if width < cell else 2.0) for share, *_ in thin.values()) - 1
        others = f" (and {more} more are thinner than {below})" if more else ""
        yield (
            f"{name} is {width:g} m thick, thinner than {below} ({cell:.3g} m){others}: with single covers the water "
            f"on its two sides is one field there, and {lost}; write "
            'water.covers = "multiple" for the whole load'
        )


def _widths(case: Case) -> Iterator[tuple[str, float, float, bool]]:
    """Name, smallest width [m] and largest size [m] of the cells across it, of solids, walls and floors as wholes,
    which may have water on one side alone (True), and of all other blocks (False)."""
    for _, name, body in solid_bodies(case):
        for width, way in _across(case.tank, body):
            yield name, width, widest_cell(case.tank, places_in(body), way), True
    equal = has_equal_cells(case.tank)
    for part in parts_of(case):
        spec = getattr(case.structure, str(part.path[1]))[part.path[2]]
        if part.path[1] in ("wall", "building"):
            bodies = [] if equal else [Body.of_block(block) for block in part.blocks]
            places = [place for body in bodies for place in (*body.vertices, body.vertices.mean(axis=0))]
            for width, way in _thin_ways(case.tank, part.path[1], spec):
                yield part.name, width, widest_cell(case.tank, np.array(places), way), True
        else:
            for body in map(Body.of_block, part.blocks):
                middle = body.vertices.mean(axis=0, keepdims=True)
                for width, way in _across(case.tank, body):
                    yield part.name, width, widest_cell(case.tank, middle, way), False


def _across(tank: Tank, body: Body) -> Iterator[tuple[float, np.ndarray]]:
    """The smallest width [m] of a body and the unit direction (3,) of it, if any, among those in which water can be on
    its two sides: not from side to side of the tank, as across a slice that it fills."""
    low, high = body.bounds()
    slack = 1e-6 * np.subtract(tank.upper, tank.lower)
    spanned = (low <= np.add(tank.lower, slack)) & (high >= np.subtract(tank.upper, slack))
    ways = body.normals[(np.abs(body.normals)[:, spanned] < 1.0 - 1e-9).all(axis=1)]
    if len(ways):
        widths = np.ptp(body.vertices @ ways.T, axis=0)
        yield float(widths.min()), ways[widths.argmin()]


def _thin_ways(tank: Tank, kind, spec) -> Iterator[tuple[float, np.ndarray]]:
    """Widths [m] of a wall, or of the walls and floors of a building, and the unit directions (3,) across them."""
    c, s = np.cos(spec.turn), np.sin(spec.turn)
    ways = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    if kind == "wall":
        centre = np.add(spec.lower, np.multiply(spec.size, 0.5))
        yield from _across(tank, Body.box(centre, spec.size, ways.T))
    else:
        yield spec.wall_thickness, ways[0]
        yield spec.wall_thickness, ways[1]
        yield spec.floor_thickness or spec.wall_thickness, ways[2]
