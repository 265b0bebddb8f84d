"""What a schema cannot see: sections that need each other, names that must exist, bodies that do not fit.

Every check yields (key path, message); none needs YADE or the flow solver.
"""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np

from coupler.boxes import Box, near_pairs, overlap_depth, rotation_matrix
from coupler.case import Building, Case
from coupler.errors import did_you_mean
from coupler.toml_lines import shown

KeyPath = tuple[str | int, ...]
Problem = tuple[KeyPath, str]
Body = tuple[KeyPath, str, Box]

TOUCH = 1e-6
"""Overlap below this share of the smallest edge is contact, not overlap (rounding of decimal fractions)."""
STIFF_CLOSING = 5.0
ENOUGH_POINTS = 8
"""A joint that closes stiffly turns about its outermost points: 3 x 3 are 8 % weak in bending at ten times (P23)."""
BYTES_PER_CELL = 1800
"""Resident memory that a cell of the mesh takes in a run: topology, moments and fields of the water."""


def mesh_size(tank) -> tuple[int, int]:
    """Cells and nodes of the mesh of a tank: six tetrahedra a box of about the wanted edge."""
    edges = np.subtract(tank.upper, tank.lower)
    parts = np.maximum(1, np.rint(edges / tank.cell).astype(int))
    return 6 * int(np.prod(parts)), int(np.prod(parts + 1))


def problems(case: Case) -> list[Problem]:
    """Everything that is wrong with a case whose sections are valid one by one."""
    found = [*_sections(case), *_axes(case), *_tank(case)]
    if any(path[-1:] in (("axis",), ("upper",)) for path, _ in found):
        return found  # without a direction or a tank the rest would report nonsense
    for check in (
        _unique_names,
        _known_names,
        _fills,
        _openings,
        _overlaps,
        _bodies_outside,
        _submerged_fills,
        _gauges,
    ):
        found += check(case)
    return found


def remarks(case: Case) -> list[str]:
    """What is allowed but worth knowing before the run."""
    found = []
    if case.tank and case.water and case.water.covers == "single":
        thin = [
            (name, box.size.min())
            for _, name, box in [*_solids(case), *_structure(case)]
            if box.size.min() < case.tank.cell
        ]
        if thin:
            name, size = min(thin, key=lambda item: item[1])
            found.append(
                f"{name} is {size:g} m thick, thinner than a cell ({case.tank.cell:g} m): with single covers "
                "the water on its two sides is one field there and the load comes out too small"
            )
    j = case.joints
    if j and j.closing_ratio >= STIFF_CLOSING and j.points < ENOUGH_POINTS:
        found.append(
            f"joints.closing_ratio = {j.closing_ratio:g} with joints.points = {j.points}: these joints come out weak "
            f"in bending (by 8 % at 10, 18 % at 100 with 3 points); use {ENOUGH_POINTS} or more"
        )
    return found


# ---------------------------------------------------------------- bodies as boxes


def _solids(case: Case) -> list[Body]:
    return [(("solid", i), solid.name, _box(solid)) for i, solid in enumerate(case.solid)]


def _structure(case: Case) -> list[Body]:
    """Blocks, walls, and the walls, floors and roof of buildings."""
    if case.structure is None:
        return []
    parts = case.structure
    bodies = [(("structure", "block", i), b.name, _box(b)) for i, b in enumerate(parts.block)]
    for i, wall in enumerate(parts.wall):
        box = Box.between(wall.lower, np.add(wall.lower, wall.size))
        bodies.append((("structure", "wall", i), wall.name, box))
    for i, building in enumerate(parts.building):
        bodies += [(("structure", "building", i), building.name, box) for box in _slabs(building)]
    return bodies


def _box(block) -> Box:
    turn = block.rotation
    rotation = np.eye(3) if turn is None else rotation_matrix(turn.axis, turn.angle)
    return Box(np.array(block.centre), np.array(block.size), rotation)


def _slabs(building: Building) -> list[Box]:
    """The walls, floors and roof of a building as boxes that overlap at the corners."""
    lower, size = np.array(building.lower), np.array(building.size)
    upper, thick = lower + size, building.wall_thickness
    boxes = []
    for axis in (0, 1):
        inner_upper, inner_lower = upper.copy(), lower.copy()
        inner_upper[axis] = lower[axis] + thick
        inner_lower[axis] = upper[axis] - thick
        boxes += [Box.between(lower, inner_upper), Box.between(inner_lower, upper)]
    floor = building.floor_thickness or thick
    for storey in range(1, building.storeys + building.roof):
        top = lower[2] + size[2] * storey / building.storeys
        boxes.append(Box.between([*lower[:2], top - floor], [*upper[:2], top]))
    return boxes


# ---------------------------------------------------------------- sections and names


def _sections(case: Case) -> Iterator[Problem]:
    if case.water is None and case.structure is None:
        yield (), "nothing to compute: write a section [water] or [structure], or both"
    if case.water is not None and case.tank is None:
        yield ("water",), "the water needs a section [tank] that says where it may be"
    if case.tank is not None and case.water is None and case.structure is None:
        yield ("tank",), "a tank without water; write a section [water] with [[water.fill]]"
    if case.water is not None and not case.water.fill:
        yield ("water",), "no water: write at least one [[water.fill]] with lower and upper"
    if case.structure is not None:
        yield from _structure_sections(case)
    elif case.joints is not None or case.contact is not None or case.motion:
        absent = [name for name in ("contact", "joints", "motion") if getattr(case, name)]
        yield (absent[0],), f"[{absent[0]}] is for blocks; write a section [structure] or leave this one out"


def _structure_sections(case: Case) -> Iterator[Problem]:
    structure = case.structure
    if not (structure.block or structure.wall or structure.building):
        yield (
            ("structure",),
            "no block: write [[structure.block]], .wall or .building in double brackets",
        )
    if case.contact is None:
        yield ("structure",), "blocks need a section [contact] with stiffness, restitution and friction"
    elif case.contact.stiffness is None and case.joints is None:
        yield ("contact",), "stiffness: missing; without [joints] there is nothing to take it from"
    if case.joints is None and (structure.building or structure.wall):
        which = "building" if structure.building else "wall"
        yield (
            ("structure", which),
            f"the blocks of a {which} need a section [joints] that glues them; single blocks may lie loose",
        )


def _names(case: Case) -> dict[str, list[KeyPath]]:
    """Name of every body and group -> where it is given."""
    found: dict[str, list[KeyPath]] = {}
    for path, name, _ in [*_solids(case), *_structure(case)]:
        places = found.setdefault(name, [])
        if path not in places:
            places.append(path)
    return found


def _unique_names(case: Case) -> Iterator[Problem]:
    for name, places in _names(case).items():
        for path in places[1:]:
            yield (*path, "name"), f"'{name}' is taken by {shown(places[0])}; give every body its own name"
    seen: dict[tuple[str, str], int] = {}
    for i, gauge in enumerate(case.gauge):
        first = seen.setdefault((gauge.kind, gauge.name), i)
        if first != i:
            yield ("gauge", i, "name"), f"'{gauge.name}' is taken by gauge[{first}] of the same kind"


def _known_names(case: Case) -> Iterator[Problem]:
    blocks = [block.name for block in case.structure.block] if case.structure else []
    groups = [block.group for block in case.structure.block if block.group] if case.structure else []
    moving = list(dict.fromkeys([name for _, name, _ in _structure(case)] + groups))
    solids = [name for _, name, _ in _solids(case)]
    for i, motion in enumerate(case.motion):
        if case.structure and motion.block not in blocks:
            yield ("motion", i, "block"), _no_such("block", motion.block, blocks)
    for i, gauge in enumerate(case.gauge):
        if gauge.kind == "force" and gauge.on not in moving + solids:
            yield ("gauge", i, "on"), _no_such("body", gauge.on, moving + solids)
        if gauge.kind == "reaction" and gauge.on not in moving:
            yield ("gauge", i, "on"), _no_such("block or group", gauge.on, moving)
        if gauge.kind == "motion" and gauge.of not in blocks:
            yield ("gauge", i, "of"), _no_such("block", gauge.of, blocks)


def _no_such(kind: str, name: str, known: list[str]) -> str:
    hint = did_you_mean(name, known)
    return f"there is no {kind} '{name}'" + (hint or (f"; there are {', '.join(known[:8])}" if known else ""))


# ---------------------------------------------------------------- geometry


def _axes(case: Case) -> Iterator[Problem]:
    turned = [(("solid", i), solid) for i, solid in enumerate(case.solid)]
    turned += [
        (("structure", "block", i), b) for i, b in enumerate(case.structure.block if case.structure else ())
    ]
    for path, body in turned:
        if body.rotation is not None and not np.any(body.rotation.axis):
            yield (*path, "rotation", "axis"), "[0, 0, 0] is no direction; write for instance [0, 0, 1]"


def _corners_in_order(path: KeyPath, box) -> Iterator[Problem]:
    for axis, low, high in zip("xyz", box.lower, box.upper):
        if low >= high:
            yield (*path, "upper"), f"{axis}: upper ({high:g} m) must be greater than lower ({low:g} m)"


def _tank(case: Case) -> Iterator[Problem]:
    if case.tank is None:
        return
    yield from _corners_in_order(("tank",), case.tank)
    smallest = min(np.subtract(case.tank.upper, case.tank.lower))
    if 0 < smallest < case.tank.cell:
        yield (
            ("tank", "cell"),
            f"{case.tank.cell:g} m is larger than the smallest side of the tank ({smallest:g} m)",
        )
    elif smallest > 0 and case.water:
        yield from _memory(case)


def _memory(case: Case) -> Iterator[Problem]:
    """A mesh that this machine cannot hold: the system would kill the run without a word."""
    cells, _ = mesh_size(case.tank)
    needed, there = BYTES_PER_CELL * cells, os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if needed > there:
        fits = case.tank.cell * (needed / there) ** (1.0 / 3.0)
        yield (
            ("tank", "cell"),
            f"{cells:.3g} cells of {case.tank.cell:g} m need about {needed / 1e9:.0f} GB, this machine has "
            f"{there / 1e9:.0f} GB; use cells of {1.1 * fits:.2g} m or more",
        )


def _fills(case: Case) -> Iterator[Problem]:
    for i, fill in enumerate(case.water.fill if case.water else ()):
        path = ("water", "fill", i)
        yield from _corners_in_order(path, fill)
        if case.tank is not None:
            yield from _beyond_tank(case, path, f"water fill {i}", Box.between(fill.lower, fill.upper))


def _beyond_tank(case: Case, path: KeyPath, name: str, box: Box) -> Iterator[Problem]:
    lower, upper = box.bounds()
    slack = TOUCH * box.size.min()
    for axis, letter in enumerate("xyz"):
        for side, excess, limit in (
            ("-", case.tank.lower[axis] - lower[axis], case.tank.lower[axis]),
            ("+", upper[axis] - case.tank.upper[axis], case.tank.upper[axis]),
        ):
            if excess > slack:
                yield (
                    path,
                    (
                        f"{name} reaches {excess:.4g} m beyond the side {letter}{side} of the tank "
                        f"({letter} = {limit:g} m); move it or enlarge the tank"
                    ),
                )


def _bodies_outside(case: Case) -> Iterator[Problem]:
    """Blocks must lie inside the tank; fixed solids may stick out of it, but not be wholly outside."""
    bodies = _outlines(_structure(case))
    if case.tank is not None:
        tank = Box.between(case.tank.lower, case.tank.upper)
        for path, name, box in bodies:
            yield from _beyond_tank(case, path, f"'{name}'", box)
        for path, name, box in _solids(case):
            if overlap_depth(tank, box) <= 0:
                yield (
                    path,
                    f"'{name}' lies outside the tank, where there is no water; move it or leave it out",
                )
    ground = case.structure.ground if case.structure else None
    for path, name, box in bodies if ground else ():
        depth = ground.level - box.bounds()[0][2]
        if depth > TOUCH * box.size.min():
            yield path, f"'{name}' reaches {depth:.4g} m below the ground (z = {ground.level:g} m); raise it"


def _outlines(bodies: list[Body]) -> list[Body]:
    """One box along the axes around all parts of each body, so that a building is told once."""
    parts: dict[tuple[KeyPath, str], list[np.ndarray]] = {}
    for path, name, box in bodies:
        parts.setdefault((path, name), []).append(np.array(box.bounds()))
    outlines = []
    for (path, name), bounds in parts.items():
        lower, upper = np.min(bounds, axis=0)[0], np.max(bounds, axis=0)[1]
        outlines.append((path, name, Box.between(lower, upper)))
    return outlines


def _overlaps(case: Case) -> Iterator[Problem]:
    bodies = [*_solids(case), *_structure(case)]
    told = set()
    for i, j in near_pairs([box for _, _, box in bodies]):
        (path, name, a), (other_path, other, b) = bodies[i], bodies[j]
        if path == other_path or path[0] == other_path[0] == "solid" or (path, other_path) in told:
            continue
        depth = overlap_depth(a, b)
        if depth > TOUCH * min(a.size.min(), b.size.min()):
            told.add((path, other_path))
            yield other_path, f"'{other}' overlaps '{name}' by {depth:.4g} m; move one of them by that much"


def _submerged_fills(case: Case) -> Iterator[Problem]:
    """A body in the water displaces it; a fill that one body swallows whole is a mistake."""
    for i, fill in enumerate(case.water.fill if case.water else ()):
        corners = Box.between(fill.lower, fill.upper).corners()
        for _, name, box in [*_solids(case), *_structure(case)]:
            if box.holds(corners, TOUCH).all():
                yield ("water", "fill", i), f"this water lies wholly inside '{name}', so there is none"
                break


def _openings(case: Case) -> Iterator[Problem]:
    for i, building in enumerate(case.structure.building if case.structure else ()):
        path = ("structure", "building", i)
        yield from _hollow(path, building)
        for j, opening in enumerate(building.opening):
            width = building.size[1] if opening.wall[0] == "x" else building.size[0]
            limits = (("along the wall", width), ("in height", building.size[2]))
            for (direction, limit), start, length in zip(limits, opening.lower, opening.size):
                if start < -TOUCH or start + length > limit + TOUCH:
                    yield (
                        (*path, "opening", j),
                        f"reaches from {start:g} to {start + length:g} m {direction}, outside the wall "
                        f"{opening.wall} of '{building.name}' (0 to {limit:g} m)",
                    )


def _hollow(path: KeyPath, building: Building) -> Iterator[Problem]:
    inside = min(building.size[:2]) - 2 * building.wall_thickness
    if inside <= 0:
        yield (
            (*path, "wall_thickness"),
            f"two walls of {building.wall_thickness:g} m leave no room in '{building.name}' "
            f"({min(building.size[:2]):g} m); use [[structure.wall]] for a solid body",
        )
    floor = building.floor_thickness or building.wall_thickness
    if building.size[2] / building.storeys <= floor:
        yield (
            (*path, "storeys"),
            f"storeys of {building.size[2] / building.storeys:.4g} m have no room above floors of {floor:g} m",
        )


def _gauges(case: Case) -> Iterator[Problem]:
    for i, gauge in enumerate(case.gauge):
        path = ("gauge", i)
        if gauge.kind not in ("motion", "reaction") and case.water is None:
            yield (*path, "kind"), f"a {gauge.kind} gauge measures water; write a section [water]"
        elif gauge.kind == "volume":
            yield from _corners_in_order(path, gauge)
        elif gauge.kind in ("level", "pressure", "velocity") and case.tank is not None:
            yield from _gauge_place(case, path, gauge)


def _gauge_place(case: Case, path: KeyPath, gauge) -> Iterator[Problem]:
    for axis, value in enumerate(gauge.at):
        low, high = case.tank.lower[axis], case.tank.upper[axis]
        if not low <= value <= high:
            yield (
                (*path, "at"),
                f"'{gauge.name}' is outside the tank: {'xyz'[axis]} = {value:g} m, not in {low:g} to {high:g} m",
            )
    if len(gauge.at) == 3:
        for _, name, box in _solids(case):
            depth = (box.size / 2 - np.abs((np.array(gauge.at) - box.centre) @ box.rotation)).min()
            if depth > TOUCH * box.size.min():
                yield (
                    (*path, "at"),
                    f"'{gauge.name}' lies {depth:.3g} m inside the solid '{name}'; put it on the face",
                )
