"""Checks of gauges: where they are, what they need, and what they would read. Every check yields (key path, message),
remarks a message."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.case.case import Case
from coupler.case.types import KeyPath, Problem
from coupler.checks.places import TOUCH, Placed, corners_in_order, solid_bodies
from coupler.geometry.bodies import Body
from coupler.geometry.parts import Part, parts_of
from coupler.geometry.tank_mesh import beside_mesh, mesh_of, what_of
from coupler.results.gauges import parallelogram, patch_points

SAMPLES, MUCH_OUTSIDE = 64, 0.4
"""Points along an edge of a patch at which its place is looked up, and the share of it outside the tank from which on
this is said: a patch that is larger than the opening it measures is common, one that is half outside is not."""


def gauge_problems(case: Case, parts: list[Part]) -> Iterator[Problem]:
    """All faults of gauges but unknown names; parts: those of the structure that could be made."""
    held = [(part.path, b.name, Body.of_block(b)) for part in parts for b in part.blocks if b.fixed]
    held += solid_bodies(case) if case.gauge else []
    for i, gauge in enumerate(case.gauge):
        path = ("gauge", i)
        window = getattr(gauge, "impulse", None)
        if window is not None and window[0] >= window[1]:
            yield (
                (*path, "impulse"),
                f"from {window[0]:g} s to {window[1]:g} s: the end must come after the start",
            )
        if gauge.kind == "loads" and gauge.every is not None and not gauge.each_block:
            yield (*path, "every"), "is for the rows of each block; add each_block = true"
        if gauge.kind not in ("motion", "reaction", "loads") and case.water is None:
            yield (*path, "kind"), f"a {gauge.kind} gauge measures water; write a section [water]"
        elif gauge.kind == "reaction" and case.structure is None:
            yield (
                (*path, "kind"),
                f"'{gauge.name}' measures what holds blocks, and there is no section [structure]; of a fixed solid "
                "take a gauge of kind force or loads",
            )
        elif gauge.kind == "volume":
            yield from _volume(case, path, gauge)
        elif (
            gauge.kind in ("level", "pressure", "patch", "air", "velocity", "flux") and case.tank is not None
        ):
            placed = list(_gauge_place(case, path, gauge, held))
            shapeless = list(_patch(path, gauge))
            yield from placed
            yield from shapeless
            if gauge.kind == "patch" and not placed and not shapeless:
                yield from _patch_in_tank(case, path, gauge)


def _patch(path: KeyPath, gauge) -> Iterator[Problem]:
    """Patches without a shape or an area, and windows without a length."""
    if gauge.kind == "patch" and (gauge.edges is None) == (gauge.radius is None):
        yield path, f"'{gauge.name}' needs either edges (a parallelogram) or radius and normal (a disc)"
    elif gauge.kind == "patch" and gauge.radius is not None and not np.any(gauge.normal or 0.0):
        yield (*path, "normal"), f"'{gauge.name}' is a disc and needs a normal, for instance [-1, 0, 0]"
    edges = getattr(gauge, "edges", None)
    if edges is not None and not np.any(np.cross(*edges)):
        yield (*path, "edges"), f"the edges of '{gauge.name}' are parallel: the patch has no area"


def _patch_in_tank(case: Case, path: KeyPath, gauge) -> Iterator[Problem]:
    """Patches that reach out of the tank, where no water can be asked for its pressure."""
    points = patch_points(gauge)
    if case.tank.is_box:
        slack = 1e-10 * case.tank.cell  # as far as cells are found
        outside = (points < np.subtract(case.tank.lower, slack)) | (points > np.add(case.tank.upper, slack))
        beyond = outside.any(axis=1)
    else:
        beyond = mesh_of(case.tank).locate(points) < 0
    if beyond.any():
        x, y, z = points[np.argmax(beyond)]
        yield (
            path,
            f"'{gauge.name}' reaches out of the tank: no cell is at ({x:.4g}, {y:.4g}, {z:.4g}) m; make the patch "
            "smaller, or move it inside",
        )


def _volume(case: Case, path: KeyPath, gauge) -> Iterator[Problem]:
    """Boxes of volume gauges with corners in the wrong order, or wholly beside the tank."""
    disorder = list(corners_in_order(path, gauge))
    yield from disorder
    for axis, low, high in (
        zip("xyz", gauge.lower, gauge.upper) if case.tank is not None and not disorder else ()
    ):
        low_end, high_end = case.tank.lower["xyz".index(axis)], case.tank.upper["xyz".index(axis)]
        if high <= low_end or low >= high_end:
            yield (
                path,
                f"'{gauge.name}' lies beside the tank: {axis} from {low:g} to {high:g} m, the tank from {low_end:g} to "
                f"{high_end:g} m",
            )
            return


def _gauge_place(case: Case, path: KeyPath, gauge, held: list[Placed]) -> Iterator[Problem]:
    for axis, value in enumerate(gauge.at):
        low, high = case.tank.lower[axis], case.tank.upper[axis]
        if not low <= value <= high:
            yield (
                (*path, "at"),
                f"'{gauge.name}' is outside the tank: {'xyz'[axis]} = {value:g} m, not in {low:g} to {high:g} m",
            )
            return
    if not case.tank.is_box and gauge.kind != "flux" and beside_mesh(case.tank, gauge.at):
        yield (
            (*path, "at"),
            f"'{gauge.name}' is outside {what_of(case.tank)}: no cell is there; move it inside",
        )
    if len(gauge.at) == 3 and gauge.kind != "flux":
        for _, name, body in held:
            (depth,) = body.depth(np.array([gauge.at]))
            if depth > TOUCH * body.thickness():
                yield (
                    (*path, "at"),
                    f"'{gauge.name}' lies {depth:.3g} m inside '{name}'; put it on the face",
                )


def gauge_remarks(case: Case) -> Iterator[str]:
    """What gauges would read that nobody wants."""
    yield from _window_remarks(case)
    yield from _patch_remarks(case)
    yield from _reaction_remarks(case)


def _window_remarks(case: Case) -> Iterator[str]:
    """Windows of impulses that begin after the end of the run."""
    for gauge in case.gauge:
        window = getattr(gauge, "impulse", None)
        if window is not None and window[0] >= case.time.end:
            yield f"gauge '{gauge.name}' begins to add up at {window[0]:g} s, after the end ({case.time.end:g} s)"


def _patch_remarks(case: Case) -> Iterator[str]:
    """Patches for a flow of which a large part lies outside the tank, as if `at` were a corner."""
    if case.tank is None:
        return
    for gauge in case.gauge:
        if gauge.kind != "flux":
            continue
        points = parallelogram(gauge.at, gauge.edges, SAMPLES)
        outside = ((points < case.tank.lower) | (points > case.tank.upper)).any(axis=1).mean()
        if outside > MUCH_OUTSIDE:
            yield (
                f"{100.0 * outside:.0f} % of the patch of gauge '{gauge.name}' lies outside the tank, where nothing "
                f"flows; its key at is the centre of the patch, not a corner"
            )


def _reaction_remarks(case: Case) -> Iterator[str]:
    """Gauges of what holds blocks of which none is held."""
    gauges = [gauge for gauge in case.gauge if gauge.kind == "reaction"]
    if not gauges or case.structure is None:
        return
    driven = {motion.block for motion in case.motion}
    blocks = [(part.name, block) for part in parts_of(case) for block in part.blocks]
    for gauge in gauges:
        named = [block for part, block in blocks if gauge.on in (part, block.group, block.name)]
        if named and not any(block.fixed or block.name in driven for block in named):
            yield (
                f"gauge '{gauge.name}' measures what holds '{gauge.on}', and nothing does, so that it reads 0: give it "
                "fixed = true or a [[motion]], or take a gauge of kind force for the force of the water"
            )
