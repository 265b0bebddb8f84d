"""The list of cases: the subject of each case, its reference, and the results that its function yields.

A case is a generator of `Finding`s: a value of a run, its reference value, and the permitted error. The processor time
between two findings is assigned to the second.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from typing import Literal

MODULES = (
    "contact", "joints", "bending", "stock", "coupled", "wall", "spheres", "cubes", "stability",
    "rest", "water", "collapse", "viscous", "dam_breaks", "jets", "air", "plates", "bores", "run_up", "coasts",
    "isolated_building",
)  # fmt: skip
"""Files of this package that hold cases; their names are the groups."""

NOT_COVERED: dict[str, str] = {}
"""Reference cases without a check, and why."""

Cost = Literal["S", "M", "L"]


@dataclass(frozen=True)
class Finding:
    """A value of a run and its reference value. `relative`: the tolerance is a share of `expected`; otherwise it has
    the unit of the value."""

    quantity: str
    value: float
    expected: float
    tolerance: float
    relative: bool = True

    @property
    def error(self) -> float:
        """|value - expected|, over |expected| where the tolerance is relative."""
        return abs(self.value - self.expected) / (abs(self.expected) if self.relative else 1.0)


@dataclass(frozen=True)
class Check:
    """One reference case.

    cost on two cores: S for the quick set, three minutes of processor time in all; M below 15 minutes, L longer."""

    id: str
    group: str
    title: str
    source: str
    cost: Cost
    run: Callable[[], Iterator[Finding]]


TOLD = "(reported, not judged)"
"""Suffix of the name of a quantity that is reported beside those that are judged."""


@dataclass(frozen=True)
class Result:
    """One quantity of a case, or the `reason` why the case gave none; value and error are then None."""

    id: str
    quantity: str
    value: float | None
    expected: float | None
    error: float | None
    tolerance: float | None
    relative: bool
    passed: bool
    cpu_s: float
    reason: str = ""

    @property
    def judged(self) -> bool:
        """Whether the result is judged: one that is only reported neither passes nor fails."""
        return TOLD not in self.quantity

    @property
    def missed(self) -> bool:
        """Whether the result is judged and not within its limit."""
        return self.judged and not self.passed

    @classmethod
    def of(cls, id: str, found: Finding, cpu_s: float) -> Result:
        """The result of comparing a finding with its tolerance; NaN does not pass."""
        passed = bool(found.error <= found.tolerance)
        numbers = (float(found.value), float(found.expected), float(found.error), float(found.tolerance))
        return cls(id, found.quantity, *numbers, found.relative, passed, cpu_s)

    @classmethod
    def failed(cls, id: str, reason: str, cpu_s: float) -> Result:
        """Result of a case that ended prematurely."""
        return cls(id, "ends", None, None, None, None, False, False, cpu_s, reason)


_registered: dict[str, Check] = {}


def check(id: str, title: str, source: str, cost: Cost = "S"):
    """Register the decorated generator as a case; its group is the name of its file."""

    def keep(run):
        _registered[id] = Check(id, run.__module__.rpartition(".")[2], title, source, cost, run)
        return run

    return keep


def checks() -> dict[str, Check]:
    """All cases by id, in order."""
    for name in MODULES:
        import_module(f"coupler.commands.verify.{name}")
    return dict(sorted(_registered.items()))
