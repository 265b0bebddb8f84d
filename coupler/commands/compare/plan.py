"""The laws that are compared on a case, and the cases that cannot be compared."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from coupler.checks.read_case import CaseFile, load
from coupler.commands.compare.matching import matched
from coupler.program.errors import BadCall, BadCase, did_you_mean
from yade_scripts.joints import laws as own_laws
from yade_scripts.joints.cohesion import JointParameters
from yade_scripts.stock.script import StockLaw, stock_law, stock_names

USUAL_STOCK = ("cohfrict", "jcfpm", "mortar", "cpm")
"""Stock laws compared unless others are named."""


@dataclass(frozen=True)
class OwnLaw:
    """One of our cohesive laws on the case, with the overrides that set it."""

    name: str
    overrides: tuple[str, ...]
    not_matched: tuple[str, ...]

    @property
    def title(self) -> str:
        """Name in tables and figures."""
        return self.name

    @property
    def stem(self) -> str:
        """Name of its files, without an ending."""
        return self.name


@dataclass(frozen=True)
class Plan:
    """file: the case as written; laws: the first is the reference, the law of the case; substeps: multiples."""

    file: CaseFile
    laws: tuple[OwnLaw | StockLaw, ...]
    substeps: tuple[int, ...]
    records: int


def make_plan(
    place: Path, overrides: Iterable[str], names: Iterable[str], substeps: Iterable[int], records: int
) -> Plan:
    """Laws by name, the law of the case first; no names: all of ours and the usual ones of YADE.

    Raises BadCase for a case with water or without joints, and for unknown laws.
    """
    overrides = tuple(overrides)
    file = load(place, overrides)
    refuse(file)
    reference = file.case.joints.law
    wanted = list(names) or [*own_laws.names(), *USUAL_STOCK]
    wrong = [n for n in wanted if n not in (*own_laws.names(), *stock_names())]
    if wrong:
        raise BadCall(_unknown(name) for name in wrong)
    others = list(dict.fromkeys(n for n in wanted if n != reference))
    found = tuple(_law(name, file, overrides) for name in [reference, *others])
    return Plan(file, found, tuple(sorted(set(substeps))), records)


def _law(name: str, file: CaseFile, overrides: tuple[str, ...]) -> OwnLaw | StockLaw:
    if name not in own_laws.names():
        return stock_law(name)
    joints = file.case.joints
    if name == joints.law:
        return OwnLaw(name, overrides, ())
    made, not_matched = matched(_parameters(joints), name)
    changes = (
        f"joints.law={name}",
        f"joints.opening_at_failure={made.opening_at_failure!r}",
        f"joints.peak={made.peak!r}",
        "joints.mixed_mode=effective",
    )
    return OwnLaw(name, (*overrides, *changes), not_matched)


def _parameters(joints) -> JointParameters:
    """What `matched` needs of the joints of a case."""
    return JointParameters(
        joints.strength, joints.opening_at_failure, law=joints.law, peak=joints.peak, damping=0.0
    )


def _unknown(name: str) -> str:
    known = [*own_laws.names(), *stock_names()]
    return f"--laws {name}: no such law{did_you_mean(name, known)}; there are {', '.join(known)}"


def refuse(file: CaseFile) -> None:
    """Raise BadCase where a comparison would not compare laws."""
    case, lines = file.case, []
    if case.water is not None:
        lines.append(
            f"{file.path}: water: `compare` works on cases without water only: the scenes of YADE's own laws know "
            "none, and without it the load would be missing. Take a dry case (cases/bonded_wall_pulled), or compare "
            "our own laws by `run --set joints.law=NAME`, or by `sweep --vary joints.law=polynomial,bilinear`"
        )
    if case.structure is None or case.joints is None:
        lines.append(f"{file.path}: joints: there are no joints, so there are no laws to compare")
    elif case.joints.pair or case.joints.distribution:
        lines.append(
            f"{file.path}: joints: `compare` gives all joints one law, and the stock laws know neither joints.pair nor "
            "joints.distribution nor materials with joints of their own (presets). Leave these out and give "
            "joints.strength and joints.opening_at_failure, or compare our own laws by `run --set joints.law=NAME`"
        )
    if any(motion.velocity is None for motion in case.motion):
        lines.append(
            f"{file.path}: motion: `compare` drives blocks at one velocity; write motion.velocity in place of a motion "
            "over time, or compare our own laws by `run --set joints.law=NAME`"
        )
    if lines:
        raise BadCase(lines)


def general_limits(file: CaseFile) -> list[str]:
    """Properties of this case that YADE's own laws cannot reproduce."""
    case, found = file.case, []
    if case.joints.damping > 0.0:
        found.append("dashpot of the joints (joints.damping): stock bonds have none")
    if case.joints.closing_ratio != 1.0:
        found.append(f"stiffness in closing is that of opening, not {case.joints.closing_ratio:g} times it")
    if case.contact is not None:
        found.append(
            "contact of broken joints: the spheres at the bonds meet, not the faces of the blocks; no dashpot"
        )
    if case.structure.ground is not None:
        found.append("the ground holds what is glued to it and nothing else")
    if case.case.gravity > 0.0 and case.structure.start == "settled":
        found.append("stock scenes get their weight at once; ours start in equilibrium")
    found.append("the normal of a bond is the line of centres of its spheres: it turns with sliding")
    return found
