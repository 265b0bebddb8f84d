"""Materials by name: what a table with `material = "brick-masonry"` takes where the case says nothing else.

A preset gives the density of its blocks, the joints between two blocks of it and between it and the ground, and the
friction of broken ones. What the case says of the same counts more: density in the table, [[joints.pair]] and
[[contact.pair]] with its name. Openings follow from measured energies by G = 9/16 T_max δ_f (polynomial law), and are
short: joints this stiff need short substeps.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from coupler.case.case import Case, ContactPair, JointPair


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
        1800.0, 0.25e6, 18.0, 0.75, 0.4,
        "mortar joints of clay bricks: strength, energy and friction from Lourenco, Computational strategies for "
        "masonry structures, TU Delft 1996 (walls of Raijmakers and Vermeltfoort); scatter as reported by van "
        "der Pluijm, Out-of-plane bending of masonry, TU Eindhoven 1999; density usual for solid bricks",
        "all but the density: strength 0.25 MPa, energy 18 J/m2, friction 0.75, scatter 0.4",
    ),
    "concrete": Material(
        2400.0, 2.2e6, 133.0, 0.6, 0.18,
        "plain concrete C20/25: mean tensile strength of EN 1992-1-1, table 3.1; energy 73 f_cm^0.18 N/m of fib "
        "Model Code 2010 (5.1-9) with f_cm = 28 MPa; friction of a smooth interface of EN 1992-1-1, 6.2.5; scatter "
        "from f_ctk,0.05 = 0.7 f_ctm = (1 - 1.645 V) f_ctm",
        "friction 0.6",
    ),
    "timber": Material(
        420.0, 0.4e6, 300.0, 0.4, 0.2,
        "softwood C24 across the grain: mean density and f_t,90,k of EN 338; energy of spruce in opening, 0.2 to 0.3 "
        "N/mm, as in Gustafsson in Thelandersson and Larsen, Timber Engineering, Wiley 2003; friction of EN 1995-2, "
        "table 6.1",
        "all but the density: strength 0.4 MPa, energy 300 J/m2, friction 0.4, scatter 0.2 (an assumption)",
    ),
}  # fmt: skip


def with_presets(case: Case) -> Case:
    """The case with what the presets among its materials say, before what it says itself."""
    if case.structure is None:
        return case
    used: dict[str, Material] = {}
    changes = {
        kind: tuple(_with_density(table, used) for table in getattr(case.structure, kind))
        for kind in type(case.structure).model_fields
        if isinstance(getattr(case.structure, kind), tuple)
    }
    if not used:
        return case
    update: dict[str, Any] = {"structure": case.structure.model_copy(update=changes)}
    if case.joints is not None:
        update["joints"] = case.joints.model_copy(update={"pair": (*_joints(case, used), *case.joints.pair)})
    if case.contact is not None:
        update["contact"] = case.contact.model_copy(update={"pair": _friction(case.contact.pair, used)})
    return case.model_copy(update=update)


def _with_density(table: Any, used: dict[str, Material]) -> Any:
    """A table with the density of its preset, and its rules with theirs; presets met are added to `used`."""
    change: dict[str, Any] = {}
    if hasattr(table, "rule"):
        change["rule"] = tuple(_with_density(rule, used) for rule in table.rule)
    preset = PRESETS.get(getattr(table, "material", None) or "")
    if preset is not None:
        used[table.material] = preset
        if table.density is None:
            change["density"] = preset.density
    return table.model_copy(update=change) if change else table


def _joints(case: Case, used: dict[str, Material]) -> Iterator[JointPair]:
    on_ground = case.structure is not None and case.structure.ground is not None
    with_ground = on_ground or case.terrain is not None
    for name, preset in used.items():
        for other in (name, "ground") if with_ground else (name,):
            yield JointPair(
                between=(name, other), strength=preset.strength, opening_at_failure=preset.opening
            )


def _friction(own: tuple[ContactPair, ...], used: dict[str, Material]) -> tuple[ContactPair, ...]:
    """The pairs that the case gives, and those of the presets that it does not."""
    given = {frozenset(pair.materials) for pair in own}
    wanted = [(name, other, m.friction) for name, m in used.items() for other in (name, "ground")]
    more = [ContactPair(materials=(a, b), friction=mu) for a, b, mu in wanted if {a, b} not in given]
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
