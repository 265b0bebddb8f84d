"""Materials by name: what a table with `material = "brick-masonry"` takes where the case says nothing else.

A preset gives the density of its blocks, the joints between two blocks of it and between it and what does not move (the
ground, the floor of the tank, solids, held blocks), and the friction of broken ones. Between two presets the weaker
counts. Where all blocks that can move are of presets, an empty section [joints] will do. What the case says of the same
counts more: density in the table, [[joints.pair]] and [[contact.pair]] with its name. Openings follow from measured
energies by G = 9/16 T_max δ_f (polynomial law), and are short: joints this stiff need short substeps.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from coupler.case.case import Case, ContactPair, JointPair, Joints
from coupler.case.types import KeyPath
from coupler.program.errors import did_you_mean


@dataclass(frozen=True)
class Material:
    """density [kg/m³] · strength [Pa], tensile · energy [J/m²] of separation · friction · scatter: standard deviation
    of strengths over their mean, for joints.variation · source: where each comes from · unchecked: which of them
    were not compared with their source, "" for none."""

    density: float
    strength: float
    energy: float
    friction: float
    scatter: float
    source: str
    unchecked: str

    @property
    def opening(self) -> float:
        """δ_f [m] with which the polynomial law takes the energy."""
        return self.energy / (9.0 / 16.0 * self.strength)


PRESETS = {
    "brick-masonry": Material(
        1800.0, 0.28e6, 18.0, 0.8, 0.4,
        "mortar joints of clay bricks: strength, friction and scatter from the JCSS Probabilistic Model Code, part 3.2 "
        "(masonry, jcss-pmc.github.io/PMC): mean cohesion 0.28 MPa in general purpose mortar of 5 to 9 MPa, from EN "
        "1996-1-1, and mean flexural strength across the bed joints of perforated clay bricks 0.28 MPa (0.26 to "
        "0.30), mean friction 0.8 (coefficient of variation 0.19), coefficient of variation of the cohesion of clay "
        "bricks 0.4 (of flexural strengths 0.3 to 0.35); energy from Lourenco, Computational strategies for masonry "
        "structures, TU Delft 1996 (walls of Raijmakers and Vermeltfoort); density usual for solid bricks",
        "energy 18 J/m2; the density is of no single source",
    ),
    "concrete": Material(
        2400.0, 2.2e6, 133.0, 0.6, 0.18,
        "plain concrete C20/25: mean tensile strength of EN 1992-1-1, table 3.1; energy 73 f_cm^0.18 N/m of fib "
        "Model Code 2010 (5.1-9) with f_cm = 28 MPa; friction of a smooth interface of EN 1992-1-1, 6.2.5; scatter "
        "from f_ctk,0.05 = 0.7 f_ctm = (1 - 1.645 V) f_ctm",
        "friction 0.6",
    ),
    "timber": Material(
        420.0, 0.4e6, 300.0, 0.4, 0.25,
        "softwood C24 across the grain: mean density and f_t,90,k of EN 338:2016, table 1; energy of spruce in "
        "opening, 0.2 to 0.3 N/mm, as in Gustafsson in Thelandersson and Larsen, Timber Engineering, Wiley 2003; "
        "friction of EN 1995-2, table 6.1; scatter from the JCSS Probabilistic Model Code, part 3.5 (timber, "
        "jcss-pmc.github.io/PMC): 2.5 times the coefficient of variation of the density, 0.1",
        "energy 300 J/m2, friction 0.4",
    ),
}  # fmt: skip


class PresetPair(ContactPair):
    """A pair of materials whose friction a preset gives; those of the case itself are plain `ContactPair`."""


def with_presets(case: Case) -> Case:
    """The case with what the presets among its materials say, before what it says itself."""
    if case.structure is None:
        return case
    used = presets_of(case)
    if not used:
        return case
    changes = {
        kind: tuple(_with_density(table) for table in getattr(case.structure, kind))
        for kind in type(case.structure).model_fields
        if isinstance(getattr(case.structure, kind), tuple)
    }
    update: dict[str, Any] = {
        "structure": case.structure.model_copy(update=changes),
        "solid": tuple(map(_with_density, case.solid)),
    }
    if case.joints is not None:
        update["joints"] = case.joints.model_copy(update={"pair": (*_joints(case, used), *case.joints.pair)})
    if case.contact is not None:
        update["contact"] = case.contact.model_copy(update={"pair": _friction(case, used)})
    return case.model_copy(update=update)


def with_strength(case: Case) -> tuple[Case, list[tuple[KeyPath, str]]]:
    """The case with strength and opening of all joints, and what is missing for that.

    Where every block that can move is of a preset, or of a material whose joints [[joints.pair]] describes or leaves
    out, [joints] need not say them; the weakest of the presets stands for them then. Missing values are filled in, so
    that the rest can be checked too."""
    j = case.joints
    if j is None or (j.strength is not None and j.opening_at_failure is not None):
        return case, []
    movable, used = _materials(case, held=False), presets_of(case)
    mistakes: list[tuple[KeyPath, str]] = []
    for name, example in (("strength", "0.5 MPa"), ("opening_at_failure", "5 mm")):
        others = _lacking(case, j, name)
        if getattr(j, name) is None and (others or not movable):
            mistakes.append((("joints", name), f'missing; for instance "{example}"{_why(others)}'))
    weakest = _weakest(used.values()) if used else PRESETS["brick-masonry"]
    given = {
        "strength": weakest.strength if j.strength is None else j.strength,
        "opening_at_failure": weakest.opening if j.opening_at_failure is None else j.opening_at_failure,
    }
    return case.model_copy(update={"joints": j.model_copy(update=given)}), mistakes


def _lacking(case: Case, joints: Joints, value: str) -> list[tuple[str, str]]:
    """Pairs (material, name) of blocks that can move without a preset and of what may touch them, for which no
    [[joints.pair]] says that there is no joint, or this value of it."""
    if case.structure is None:
        return []
    tables = [({material, getattr(table, "name", None), getattr(table, "group", None)}, material, held)
              for table, material, held in _tables(case) if material]  # fmt: skip
    touched = [(names, material) for names, material, _ in tables]
    touched += [({name}, name) for name in sorted(_planes(case)) if joints.ground]
    return list(
        dict.fromkeys(
            (material, other)
            for names, material, held in tables
            if not held and material not in PRESETS
            for others, other in touched
            if not _says(joints.pair, names, others, value)
        )
    )


def _says(pairs: Iterable[JointPair], names: set[str | None], others: set[str | None], value: str) -> bool:
    """Whether the last pair between two tables, known by these names, leaves their joints out or gives the value."""
    fits = [
        pair
        for pair in pairs
        if (pair.between[0] in names and pair.between[1] in others)
        or (pair.between[1] in names and pair.between[0] in others)
    ]
    return bool(fits) and (not fits[-1].joined or getattr(fits[-1], value) is not None)


def _why(lacking: list[tuple[str, str]]) -> str:
    """The end of a message that names a material without a preset, and what its joints are with where other joints of
    it are described; empty without one."""
    if not lacking:
        return ""
    name, other = lacking[0]
    hint = did_you_mean(name, list(PRESETS))
    known = " or ".join(f'"{preset}"' for preset in PRESETS)
    return (
        f": material '{name}' has no preset{hint or f'; those of material = {known} follow from it'}. Joints of single "
        f'pairs are given, or left out, by [[joints.pair]], here between = ["{name}", "{other}"]'
    )


def material_remarks(case: Case) -> Iterator[str]:
    """Materials that are nearly called like a preset, and a strength or a friction that presets replace."""
    if case.structure is None:
        return
    movable = _materials(case, held=False)
    named = {name for pair in (case.joints.pair if case.joints else ()) for name in pair.between}
    named |= {name for pair in (case.contact.pair if case.contact else ()) for name in pair.materials}
    for name in movable:
        hint = "" if name in PRESETS or name in named else did_you_mean(name, list(PRESETS))
        if hint:
            yield (
                f"material '{name}' is no preset{hint} As it is, it brings neither a density nor joints of its own: "
                "these are what the case gives"
            )
    used = presets_of(case)
    given = None if case.joints is None else case.joints.strength
    of_presets = bool(movable) and all(name in PRESETS for name in movable)
    if given is not None and of_presets and given != _weakest(used.values()).strength:
        yield (
            f"joints.strength counts nowhere: every joint follows from a preset ({', '.join(movable)}). For another "
            f'strength write [[joints.pair]] between = ["{movable[0]}", "{movable[0]}"]'
        )
    yield from _friction_remarks(case)


def _friction_remarks(case: Case) -> Iterator[str]:
    """A friction of [contact] that counts nowhere, since all blocks that can move are of presets with their own."""
    if case.contact is None or "friction" not in case.contact.model_fields_set:
        return
    if any(name not in PRESETS for name in _materials(case, held=False)):
        return  # it counts where one of the others meets something
    found = [pair for pair in case.contact.pair if isinstance(pair, PresetPair)]
    found = [pair for pair in found if pair.friction != case.contact.friction]
    if found:
        listed = ", ".join(f"{pair.friction:g} between {' and '.join(pair.materials)}" for pair in found)
        first = ", ".join(f'"{name}"' for name in found[0].materials)
        yield (
            f"contact.friction = {case.contact.friction:g} does not apply where the friction of presets does: "
            f"{listed}. For another one write [[contact.pair]] materials = [{first}], friction = "
            f"{case.contact.friction:g}"
        )


def presets_of(case: Case) -> dict[str, Material]:
    """The presets among the materials of blocks and solids, by name."""
    found = [*_materials(case, held=False), *_materials(case, held=True)] if case.structure else []
    return {name: PRESETS[name] for name in found if name in PRESETS}


def _tables(case: Case) -> Iterator[tuple[Any, str | None, bool]]:
    """The tables that name a material: table, material and whether its blocks are held."""
    assert case.structure is not None
    for kind in type(case.structure).model_fields:
        tables = getattr(case.structure, kind)
        for table in tables if isinstance(tables, tuple) else ():
            held = bool(getattr(table, "fixed", False))
            yield table, table.material, held
            for part in (*getattr(table, "rule", ()), *getattr(table, "layer", ())):
                if not getattr(part, "leave_out", False):
                    yield part, part.material, held or bool(getattr(part, "fixed", False))
    for solid in case.solid:
        yield solid, solid.material, True


def _materials(case: Case, held: bool) -> list[str]:
    """Materials of the blocks that are held, or of those that can move, each once."""
    if case.structure is None:
        return []
    return list(dict.fromkeys(name for _, name, fixed in _tables(case) if name and fixed == held))


def _held(case: Case) -> list[str]:
    """Names by which joints know what does not move: materials, or names where blocks that move are of the same."""
    movable = _materials(case, held=False)
    found = [
        table.name if name in movable else name
        for table, name, held in _tables(case)
        if held and name and name not in PRESETS
    ]
    return list(dict.fromkeys(found))


def _with_density(table: Any) -> Any:
    """A table with the density of its preset, and its rules and layers with theirs."""
    change: dict[str, Any] = {}
    for parts in ("rule", "layer"):
        if hasattr(table, parts):
            change[parts] = tuple(_with_density(part) for part in getattr(table, parts))
    preset = PRESETS.get(getattr(table, "material", None) or "")
    if preset is not None and table.density is None:
        change["density"] = preset.density
    return table.model_copy(update=change) if change else table


def _joints(case: Case, used: dict[str, Material]) -> Iterator[JointPair]:
    """Of each preset with itself, with all that is held, and with the other presets: there the weaker counts."""
    assert case.joints is not None
    held = [*_held(case), *(("ground", "tank") if case.joints.ground else ())]
    known = _planes(case)
    for name, preset in used.items():
        for other in held:
            if other not in ("ground", "tank") or other in known:
                yield _pair(name, other, preset)
    for i, (name, preset) in enumerate(used.items()):
        for other, also in list(used.items())[i:]:
            yield _pair(name, other, _weakest((preset, also)))


def _pair(name: str, other: str, law: Material) -> JointPair:
    return JointPair(between=(name, other), strength=law.strength, opening_at_failure=law.opening)


def _planes(case: Case) -> set[str]:
    """Which of ground and tank (its floor) blocks may stand on."""
    assert case.structure is not None
    ground = case.structure.ground is not None or case.terrain is not None
    floor = case.tank is not None and not ground and "z-" not in case.tank.open
    return {name for name, there in (("ground", ground), ("tank", floor)) if there}


def _weakest(materials: Iterable[Material]) -> Material:
    return min(materials, key=lambda material: material.strength)


def _friction(case: Case, used: dict[str, Material]) -> tuple[ContactPair, ...]:
    """The pairs that the case gives, and those of the presets that it does not: of two presets the smoother counts."""
    assert case.contact is not None
    own = case.contact.pair
    given = {frozenset(pair.materials) for pair in own}
    assert case.structure is not None
    ground = "ground" if case.structure.ground is None else case.structure.ground.material
    below = [
        ground,
        *(("tank",) if "tank" in _planes(case) else ()),
        *(solid.material for solid in case.solid),
    ]
    wanted = {
        frozenset((name, other)): used[name].friction for name in used for other in below if other not in used
    }
    for name, one in used.items():
        wanted |= {frozenset((name, other)): min(one.friction, also.friction) for other, also in used.items()}
    more = [
        PresetPair(materials=(min(names), max(names)), friction=friction)
        for names, friction in wanted.items()
        if names not in given
    ]
    return (*own, *more)


def described(name: str) -> str:
    """A preset in words, with its sources."""
    m = PRESETS[name]
    return (
        f'material = "{name}": density {m.density:g} kg/m3, joints of {m.strength / 1e6:g} MPa that open by '
        f"{1e3 * m.opening:.3g} mm ({m.energy:g} J/m2), friction {m.friction:g}, scatter of strengths {m.scatter:g} "
        f"(write it as joints.variation)\n{m.source}\n"
        + (
            f"Not compared with these sources yet, check before you rely on them: {m.unchecked}"
            if m.unchecked
            else ""
        )
    )
