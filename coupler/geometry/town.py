"""From a file of footprints to the buildings of a town: rectangles, sizes and materials by attributes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.case.case import Case
from coupler.case.structure import Building
from coupler.case.types import Rotation
from coupler.geometry.footprints import (
    SAME,
    Footprint,
    FootprintError,
    area_of,
    best_rectangle,
    epsg_code,
    read_footprints,
)
from coupler.program.errors import did_you_mean

FILLED = 0.7
"""Least share of its rectangle that a footprint must fill to be built on it."""
RECTANGLE = 0.98
"""Share from which a footprint is a rectangle where outlines are asked for."""


MOST_VALUES = 8
"""Values of an attribute that a message lists."""
OVERLAP = 1e-5
"""Share of its width by which a house may be in another: the digits of a file."""


def houses_of(case: Case, town) -> tuple[Building, ...]:
    """The buildings of a table [[structure.town]] in the order of the file. Raises FootprintError.

    Footprints outside of the tank are left out: a file of a whole city serves a part of it."""
    path = Path(town.path)
    there = path.stat() if path.is_file() else None
    return _houses(town, case.tank, case.terrain, there and (there.st_mtime_ns, there.st_size))


@lru_cache(maxsize=8)
def _houses(town, tank, terrain, _stamp) -> tuple[Building, ...]:
    path = Path(town.path)
    if not path.is_file():
        raise FootprintError(f"{path}: no such file")
    change = None
    if town.crs is not None:
        target = terrain.reproject or terrain.crs
        if target is None:
            raise FootprintError(
                f"{path.name}: in {town.crs}; say the system of the terrain (terrain.crs) to change it"
            )
        change = (town.crs, target)
    found, names, footprints = [], set(), read_footprints(path, change)
    if change is None:
        _same_system(path.name, footprints[0].system, terrain)
    for footprint in footprints:
        corners = np.column_stack(tank.ground.in_tank(*(terrain.scale * footprint.corners).T))
        if area_of(corners) >= town.least_area and _is_here(path.name, footprint, corners, tank):
            house = _house(path.name, town, footprint, corners)
            if house.name in names:
                raise FootprintError(
                    f"{path.name}: two houses called '{house.name}'; name_from must tell them apart"
                )
            names.add(house.name)
            found.append(house)
    if not found:
        low, high = tank.lower, tank.upper
        raise FootprintError(
            f"{path.name}: none of its footprints lies in the tank (x {low[0]:g} to {high[0]:g}, y {low[1]:g} to "
            f"{high[1]:g} m); {_advice(footprints, town)}"
        )
    return tuple(found)


def _same_system(name: str, system: str, terrain) -> None:
    """Refuse footprints in a coordinate system other than that of the terrain, where both name theirs."""
    from coupler.geometry.terrain.grids import sidecar

    own, ground = epsg_code(system), terrain.reproject or terrain.crs or sidecar(Path(terrain.path))
    other = epsg_code(ground)
    if own is not None and other is not None and own != other:
        raise FootprintError(
            f"{name}: its coordinate system is EPSG:{own}, that of the terrain EPSG:{other}; write crs = "
            f'"EPSG:{own}" in [[structure.town]] (and terrain.crs = "EPSG:{other}"), which changes them'
        )


def _advice(footprints: list[Footprint], town) -> str:
    """What to do about footprints that all lie elsewhere."""
    corners = np.concatenate([footprint.corners for footprint in footprints])
    if town.crs is None and (np.abs(corners) <= (180.0, 90.0)).all():
        x, y = corners[0]
        return (
            f"their coordinates, such as ({x:.6g}, {y:.6g}), look like degrees: write "
            'crs = "EPSG:4326", and terrain.crs'
        )
    return "they are taken in coordinates of the terrain file: check terrain.origin and town.crs"


def _is_here(name: str, footprint: Footprint, corners: Array, tank) -> bool:
    """Whether a footprint lies in the tank; one across its side is refused."""
    low, high = np.array(tank.lower[:2]), np.array(tank.upper[:2])
    inside = ((corners >= low) & (corners <= high)).all(axis=1)
    if not inside.all() and _reaches_into(corners, low, high):
        x, y = corners[~inside][0]
        raise FootprintError(
            f"{name}: feature {footprint.number} lies across the side of the tank, at ({x:.5g}, {y:.5g}) m; "
            "move the side, or take the footprint out"
        )
    return bool(inside.all())


def _reaches_into(corners: Array, low: Array, high: Array) -> bool:
    """Whether a polygon (k, 2) shares an area with a rectangle low (2,) .. high (2,) that does not hold all of it: an
    edge passes through, or the whole rectangle lies within."""
    ahead = np.roll(corners, -1, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        bounds = np.stack([low - corners, high - corners]) / (ahead - corners)
    enters, leaves = bounds.min(axis=0).max(axis=1), bounds.max(axis=0).min(axis=1)
    if (np.minimum(leaves, 1.0) - np.maximum(enters, 0.0) > SAME).any():
        return True
    x, y = 0.5 * (low + high)
    passes = (corners[:, 1] > y) != (ahead[:, 1] > y)
    at = corners[passes, 0] + (y - corners[passes, 1]) * (
        (ahead[passes, 0] - corners[passes, 0]) / (ahead[passes, 1] - corners[passes, 1])
    )
    return bool(np.count_nonzero(at > x) % 2)


def _house(name: str, town, footprint: Footprint, corners: Array) -> Building:
    """One building."""
    middle, size, turn, share = best_rectangle(corners)
    if town.shape == "outline" and share < RECTANGLE:
        low = corners.min(axis=0)
        outline = tuple(map(tuple, (corners - low).tolist()))
        return _house_on(name, town, footprint, low, np.ptp(corners, axis=0), outline=outline)
    if share < FILLED:
        x, y = middle
        raise FootprintError(
            f"{name}: feature {footprint.number} at ({x:.5g}, {y:.5g}) m fills {share:.0%} of its rectangle; "
            f'only shapes that fill {FILLED:.0%} are built on it: write shape = "outline", or cut it into rectangles'
        )
    return _house_on(name, town, footprint, middle - 0.5 * size, size, turn=turn)


def _house_on(name: str, town, footprint: Footprint, lower: Array, size: Array, **more) -> Building:
    """The building of a footprint in a box, lower (2,) and size (2,) [m]; more: its turn or its outline."""
    rules = _by_rules(town, footprint.attributes)
    storeys = _storeys(name, town, footprint, rules["storeys"])
    return Building(
        name=_name(name, town, footprint),
        on="terrain",
        lower=(*lower.tolist(), town.above_ground),
        size=(*size.tolist(), storeys * rules["storey_height"]),
        pad=town.pad,
        storeys=storeys,
        wall_thickness=rules["wall_thickness"],
        floor_thickness=rules["floor_thickness"],
        block=rules["block"],
        density=rules["density"],
        material=rules["material"],
        **more,
    )


CHANGED = ("storeys", "storey_height", "wall_thickness", "floor_thickness", "block", "density", "material")
"""Names that a rule may change."""


def _by_rules(town, attributes: dict) -> dict:
    found = {name: getattr(town, name) for name in CHANGED}
    for rule in town.rule:
        if attributes.get(rule.attribute) == rule.equals:
            found |= {name: getattr(rule, name) for name in CHANGED if getattr(rule, name) is not None}
    return found


def _storeys(name: str, town, footprint: Footprint, otherwise: int) -> int:
    if town.storeys_from is None:
        return otherwise
    value = footprint.attributes.get(town.storeys_from)
    if value is None:
        return otherwise
    try:
        storeys = int(float(value))
    except (TypeError, ValueError, OverflowError):  # the last for infinity
        storeys = 0
    if not 1 <= storeys <= 100:
        raise FootprintError(
            f"{name}: feature {footprint.number}: {town.storeys_from} = {value!r} is no number of storeys"
        )
    return storeys


def _name(name: str, town, footprint: Footprint) -> str:
    """The name of a house; further polygons of one feature, which share its attributes, end in -1, -2 and so on."""
    more = f"-{footprint.part}" if footprint.part else ""
    if town.name_from is None:
        return f"{town.name}-{footprint.number}{more}"
    value = str(footprint.attributes.get(town.name_from, ""))
    word = re.sub(r"[^A-Za-z0-9_-]+", "-", value).strip("-")
    if not word:
        raise FootprintError(f"{name}: feature {footprint.number} has no {town.name_from} to be named after")
    return f"{word}{more}" if word[0].isalpha() else f"{town.name}-{word}{more}"


def town_problems(case: Case) -> Iterator[tuple[tuple, str]]:
    """Towns without terrain, unusable files, rules that match no footprint, and houses that stand in the sea."""
    for i, town in enumerate(case.structure.town if case.structure else ()):
        path = ("structure", "town", i)
        if case.terrain is None or case.tank is None or case.tank.ground is None:
            if case.terrain is None:
                yield path, "houses from footprints stand on the terrain; write a section [terrain]"
            continue
        try:
            houses_of(case, town)
        except FootprintError as error:
            yield (*path, "path"), str(error)
            continue
        yield from _idle_rules(path, town)
        yield from _overlapping(case, path, town)
        yield from _in_water(case, path, town)


def _idle_rules(path, town) -> Iterator[tuple[tuple, str]]:
    """Rules, and numbers of storeys, by an attribute that no footprint of the file has."""
    known = [footprint.attributes for footprint in _known(town)]
    asked = [((*path, "rule", k, "attribute"), rule.attribute) for k, rule in enumerate(town.rule)]
    if town.storeys_from is not None:
        asked.append(((*path, "storeys_from"), town.storeys_from))
    for key, wanted in asked:
        if not any(wanted in attributes for attributes in known):
            names = sorted({str(name) for attributes in known for name in attributes})
            hint = did_you_mean(wanted, names) or f"; there are {', '.join(names) or 'none'}"
            yield key, f"no footprint has '{wanted}'{hint}"


def town_remarks(case: Case) -> Iterator[str]:
    """Rules for a value that no footprint has: allowed, since one set of rules may serve many files, but often a
    slip; and footprints that do not say their number of storeys."""
    for i, town in enumerate(case.structure.town if case.structure else ()):
        known = _known(town)
        silent = [f for f in known if town.storeys_from and f.attributes.get(town.storeys_from) is None]
        if silent:
            yield (
                f"structure.town[{i}]: {len(silent)} of {len(known)} footprints say nothing under "
                f"'{town.storeys_from}' (the first is feature {silent[0].number}): they get storeys = {town.storeys}, "
                "or what a rule says"
            )
        for k, rule in enumerate(town.rule):
            values = {f.attributes[rule.attribute] for f in known if rule.attribute in f.attributes}
            if rule.equals not in values:
                there = ", ".join(sorted(map(repr, values))[:MOST_VALUES])
                near = did_you_mean(str(rule.equals), {str(v) for v in values} - {str(rule.equals)})
                yield (
                    f"structure.town[{i}].rule[{k}] changes nothing: no footprint has {rule.attribute} = "
                    f"{rule.equals!r}{near or f'; there are {there}'} (a text is no number: '2' is not 2)"
                )


def _known(town) -> list[Footprint]:
    """Every footprint, for its attributes; the file is not read where no rule needs them."""
    return read_footprints(Path(town.path)) if town.rule or town.storeys_from is not None else []


def _overlapping(case: Case, path, town) -> Iterator[tuple[tuple, str]]:
    """The first house whose footprint overlaps that of an earlier one; only houses whose boxes meet are compared."""
    from coupler.geometry.bodies import overlap_depth
    from yade_scripts.blocks.faces import touching_bounds

    houses = houses_of(case, town)
    bodies = [_plan_of(house) for house in houses]
    corners = [np.concatenate([body.vertices for body in own]) for own in bodies]
    low, high = (np.array([getattr(x, end)(axis=0) for x in corners]) for end in ("min", "max"))
    for i, j in sorted(touching_bounds(low, high, 0.0).tolist(), key=lambda pair: pair[::-1]):
        depth, other = max(
            ((overlap_depth(own, other, 0.0), other) for own in bodies[i] for other in bodies[j]),
            key=lambda found: found[0],
        )
        if depth > OVERLAP * min(houses[i].size[:2]):
            x, y = other.vertices.mean(axis=0)[:2]
            yield (
                path,
                f"'{houses[j].name}' at ({x:.5g}, {y:.5g}) m overlaps '{houses[i].name}' by {depth:.3g} m "
                "(rectangles around footprints, or their outlines): take one of them out, or join them",
            )
            return


def _plan_of(house: Building) -> list:
    """Tall bodies over the footprint of a house: its box, or convex pieces of its outline."""
    from coupler.geometry.bodies import Body, turned

    if house.outline is not None:
        from coupler.geometry.outlines import outline_of
        from yade_scripts.blocks.generators.ring import prisms

        return [Body.of_block(block) for block in prisms(house.name, outline_of(house), -500.0, 500.0)]
    centre = np.array([*np.add(house.lower[:2], 0.5 * np.array(house.size[:2])), 0.0])
    return [
        Body.box(centre, [*house.size[:2], 1e3], turned(Rotation(axis=(0.0, 0.0, 1.0), angle=house.turn)))
    ]


def _in_water(case: Case, path, town) -> Iterator[tuple[tuple, str]]:
    """Houses whose foot the still water would cover at the start: most likely a wrong datum or place."""
    from coupler.geometry.terrain.standing import on_ground

    for house in houses_of(case, town):
        x, y, foot = on_ground(case, house).lower
        middle = np.array([x + 0.5 * house.size[0], y + 0.5 * house.size[1]])
        for fill in case.water.fill if case.water else ():
            over = (middle >= fill.lower[:2]).all() and (middle <= fill.upper[:2]).all()
            if over and fill.lower[2] <= foot < fill.upper[2]:
                yield (
                    path,
                    f"'{house.name}' stands at z = {foot:.4g} m under {fill.upper[2] - foot:.3g} m of the water that a "
                    f"[[water.fill]] puts at ({middle[0]:.5g}, {middle[1]:.5g}) m: check the datum, or take it out",
                )
                return
