"""Checks that a schema cannot make: sections that require each other, names that must exist, bodies that cannot be
made.

Every check yields (key path, message); none needs YADE or the flow solver.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

from coupler.case.case import Case
from coupler.case.schedule import MOST_OUTPUTS
from coupler.case.toml_lines import shown
from coupler.case.types import KeyPath, Problem
from coupler.case.verdict import Verdict
from coupler.checks.air import air_problems
from coupler.checks.gauges import gauge_problems
from coupler.checks.joints import joint_problems, pair_problems, uplift_problems
from coupler.checks.motion import motion_problems
from coupler.checks.places import frame_problems, opening_problems, place_problems
from coupler.checks.supports import ground_problems
from coupler.checks.tables import table_problems
from coupler.checks.water import water_problems
from coupler.geometry.parts import PARTS, Part, parts_of, recipes
from coupler.geometry.solids import refused_solids
from coupler.geometry.tank_mesh import is_measured
from coupler.geometry.terrain.land import land_problems
from coupler.geometry.town import town_problems
from coupler.program.errors import did_you_mean
from coupler.verdict.divisions import Divisions

SHAPES = {"size": "box", "diameter": "sphere"}
"""Shape of a block by the key that gives it, where the block needs a centre."""


def problems(case: Case) -> list[Problem]:
    """All faults of a case whose sections are valid one by one."""
    wrong_frames = [*frame_problems(case), *refused_solids(case), *town_problems(case), *land_problems(case)]
    found = [*_sections(case), *_study(case), *wrong_frames]
    if wrong_frames or (case.tank is not None and not is_measured(case.tank)):
        return found  # without a direction or a tank the rest would report nonsense
    shapes = [*_shapes(case), *opening_problems(case)]
    parts, refused = _made(case, {path[:3] for path, _ in shapes})
    found += [*shapes, *refused, *_unique_names(case, parts), *_known_names(case, parts), *_pairs(case)]
    found += [*_law(case), *place_problems(case, parts), *gauge_problems(case, parts), *table_problems(case)]
    found += pair_problems(case, parts)
    found += air_problems(case, [block.name for part in parts for block in part.blocks])
    if case.structure is not None:
        found += motion_problems(case, parts)
    return found if found else [*joint_problems(case, parts), *uplift_problems(case, parts)]


def _study(case: Case) -> Iterator[Problem]:
    if case.study is not None:
        from coupler.case.study_names import study_problems

        yield from study_problems(case.study)
    if case.sweep is not None:
        from coupler.case.sweep_names import sweep_problems

        yield from sweep_problems(case.sweep)


# ---------------------------------------------------------------- sections


def _sections(case: Case) -> Iterator[Problem]:
    if case.water is None and case.structure is None:
        yield (), "nothing to compute: write a section [water] or [structure], or both"
    if case.water is not None and case.tank is None:
        yield ("water",), "the water needs a section [tank] that says where it may be"
    if case.tank is not None and case.water is None and case.structure is None:
        yield ("tank",), "a tank without water; write a section [water] with [[water.fill]]"
    yield from _outputs(case)
    yield from water_problems(case)
    if case.structure is not None:
        yield from _structure_sections(case)
    elif case.joints is not None or case.contact is not None or case.motion:
        absent = [name for name in ("contact", "joints", "motion") if getattr(case, name)]
        yield (absent[0],), f"[{absent[0]}] is for blocks; write a section [structure] or leave this one out"
    if case.structure is None and case.verdict != Verdict():
        yield ("verdict",), "[verdict] is about blocks; write a section [structure] or leave this one out"


def _outputs(case: Case) -> Iterator[Problem]:
    """Too many outputs: a step ends at each of them, so that a run would never end and would fill the disk."""
    end, every = case.time.end, case.time.output_every
    if every is not None and end > MOST_OUTPUTS * every:
        yield (
            ("time", "output_every"),
            f"{every:g} s makes {end / every:.3g} written states until {end:g} s, at most {MOST_OUTPUTS}; write "
            f"{end / MOST_OUTPUTS:.2g} s or more (histories have a row every step anyway)",
        )


def _structure_sections(case: Case) -> Iterator[Problem]:
    if not case.structure.town and not any(
        True for _ in recipes(case)
    ):  # a town without houses says why itself
        yield (
            ("structure",),
            "no block: write [[structure.block]], .wall, .building, .column, .arch, .rubble, .file, .drawing or .town "
            "in double brackets",
        )
    yield from ground_problems(case)
    start, ramp = case.structure.start, case.structure.ramp
    if (start == "ramp") != (ramp is not None):
        yield (
            ("structure", "ramp"),
            "missing; start = 'ramp' needs the time over which the weight comes on, for instance \"2 s\""
            if ramp is None
            else f"is for start = 'ramp', not '{start}'; leave one of them out",
        )
    if case.structure.sleep is not None and case.joints is None:
        yield ("structure", "sleep"), "needs [joints]: only blocks that joints hold fall asleep; leave it out"
    if case.contact is None and case.joints is None:
        yield (
            ("structure",),
            "blocks need [joints], which hold them together, or [contact] with a stiffness, where they lie loose; "
            "write both where joints may break (with materials by name, as 'brick-masonry', both may be empty)",
        )
    elif case.contact is not None and case.contact.stiffness is None and case.joints is None:
        yield ("contact",), "stiffness: missing; without [joints] there is nothing to take it from"


def _law(case: Case) -> Iterator[Problem]:
    if case.joints is None:
        return
    from yade_scripts.joints import laws

    law = case.joints.law
    if law not in laws.names():
        yield ("joints", "law"), laws.unknown(law)
    if case.joints.mixed_mode == "needleman" and law != "polynomial":
        yield (
            ("joints", "mixed_mode"),
            f"'needleman' is a potential for the law polynomial, not {law}; use 'effective'",
        )


# ---------------------------------------------------------------- parts of the structure


def _shapes(case: Case) -> Iterator[Problem]:
    """Tables that say too little or too much about the shape of their blocks."""
    structure = case.structure
    for i, block in enumerate(structure.block if structure else ()):
        path = ("structure", "block", i)
        given = [name for name in ("size", "vertices", "diameter") if getattr(block, name) is not None]
        if not given:
            yield (
                (*path, "size"),
                "missing; give size (edges of a box), vertices (corners of a convex polyhedron) or diameter (a sphere, "
                "made as a polyhedron)",
            )
        elif len(given) > 1:
            yield (
                (*path, given[1]),
                f"{given[0]} is given as well; a block is a box, a polyhedron or a sphere",
            )
        elif given != ["vertices"] and block.centre is None:
            yield (*path, "centre"), f"missing; centre of mass of the {SHAPES[given[0]]} at the start [m]"
        if block.faces is not None and block.diameter is None:
            yield (*path, "faces"), "is for a sphere (diameter); leave it out"
    for i, column in enumerate(structure.column if structure else ()):
        path = ("structure", "column", i)
        if (column.size is None) == (column.radius is None):
            yield (
                path,
                f"'{column.name}' needs either size (drums are boxes) or radius (drums have many sides)",
            )
        elif column.size is not None and column.top_radius is not None:
            yield (*path, "top_radius"), "is for round drums; leave it out, or give radius instead of size"


def _made(case: Case, skipped: set[KeyPath]) -> tuple[list[Part], list[Problem]]:
    """The parts that can be made, and why the others cannot; those in `skipped` are known to be wrong."""
    if case.structure is None:
        return [], []
    from coupler.geometry.mesh_files import MeshFileError
    from yade_scripts.blocks.polyhedra import BlockError

    if not skipped:
        with suppress(BlockError, MeshFileError, OSError):
            return list(parts_of(case)), []
    made, refused = [], []
    for recipe in recipes(case):
        if recipe.path in skipped:
            continue
        try:
            made.append(Part(recipe.path, recipe.name, tuple(recipe.make())))
        except BlockError as error:
            refused.append((recipe.path, str(error)))
        except MeshFileError as error:
            refused.append(((*recipe.path, "path"), str(error)))
    return made, refused


# ---------------------------------------------------------------- names


def _unique_names(case: Case, parts: list[Part]) -> Iterator[Problem]:
    """Names that are used for more than one body, group of blocks, or gauge of a kind."""
    places: dict[str, KeyPath] = {}
    bodies = [(("solid", i), solid.name) for i, solid in enumerate(case.solid)]
    for path, name in [*bodies, *((r.path, r.name) for r in recipes(case))]:
        first = places.setdefault(name, path)
        if first != path:
            yield (*path, "name"), f"'{name}' is taken by {shown(first)}; give every body its own name"
    for part in parts:
        for name in (block.name for block in part.blocks if block.name != part.name):
            first = places.setdefault(name, part.path)
            if first != part.path:
                yield (
                    (*part.path, "name"),
                    f"a block of '{part.name}' would be called '{name}' as {shown(first)} is",
                )
                break
    seen: dict[tuple[str, str], int] = {}
    for i, gauge in enumerate(case.gauge):
        first = seen.setdefault((gauge.kind, gauge.name), i)
        if first != i:
            yield ("gauge", i, "name"), f"'{gauge.name}' is taken by gauge[{first}] of the same kind"


def _known_names(case: Case, parts: list[Part]) -> Iterator[Problem]:
    """Unknown names in motions and gauges; parts that could not be made are assumed to be known."""
    blocks = [block.name for part in parts for block in part.blocks]
    several = [part.name for part in parts] + [b.group for part in parts for b in part.blocks]
    moving, solids = list(dict.fromkeys([*several, *blocks])), [solid.name for solid in case.solid]
    unmade = {r.name for r in recipes(case)} - {part.name for part in parts}

    divided = Divisions.of(parts, len(blocks))
    walls = list(dict.fromkeys([*moving, *divided.members.names, *divided.storeys.names]))

    def absent(name: str, known: list[str]) -> bool:
        return name not in known and not any(name == n or name.startswith(f"{n}-") for n in unmade)

    for i, name in enumerate(case.verdict.on):
        if case.structure and absent(name, walls):
            yield ("verdict", "on", i), _no_such("block, group, wall or floor", name, walls)
    for i, motion in enumerate(case.motion):
        if case.structure and absent(motion.block, blocks):
            yield ("motion", i, "block"), _no_such("block", motion.block, blocks)
    for i, gauge in enumerate(case.gauge):
        if gauge.kind in ("force", "loads") and absent(gauge.on, moving + solids):
            yield ("gauge", i, "on"), _no_such("body", gauge.on, moving + solids)
        if gauge.kind == "reaction" and absent(gauge.on, moving + solids):
            yield ("gauge", i, "on"), _no_such("block, group or solid", gauge.on, moving + solids)
        if gauge.kind == "motion" and absent(gauge.of, blocks):
            yield ("gauge", i, "of"), _no_such("block", gauge.of, blocks)


def _pairs(case: Case) -> Iterator[Problem]:
    """Friction by pairs: materials that something has, each pair once."""
    if case.contact is None or case.structure is None:
        return
    known = list(_materials(case))
    seen: dict[frozenset[str], int] = {}
    for i, pair in enumerate(case.contact.pair):
        path = ("contact", "pair", i)
        for material in dict.fromkeys(pair.materials):
            if material not in known:
                yield (*path, "materials"), _no_such("material", material, known)
        first = seen.setdefault(frozenset(pair.materials), i)
        if first != i:
            yield (*path, "materials"), f"this pair is given by contact.pair[{first}] already; leave one out"
        elif pair.friction is None and pair.uplift is None:
            yield path, "says nothing of this pair: give friction, uplift or both, or leave it out"


def _materials(case: Case) -> dict[str, None]:
    """Materials of blocks, solids, ground and tank, each once."""
    structure = case.structure
    tables = [spec for kind in PARTS for spec in getattr(structure, kind)]
    found = [spec.material for spec in (*tables, *case.solid)]
    if structure.ground is not None:
        found.append(structure.ground.material)
    if case.tank is not None:
        found.append("tank")
    return dict.fromkeys(found)


def _no_such(kind: str, name: str, known: list[str]) -> str:
    hint = did_you_mean(name, known)
    return f"there is no {kind} '{name}'" + (hint or (f"; there are {', '.join(known[:8])}" if known else ""))
