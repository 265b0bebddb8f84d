"""Results of a law on a case, and their errors relative to the exact solution."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass

import numpy as np

from array_types import Array
from coupler.checks.read_case import CaseFile
from coupler.commands.compare.plan import OwnLaw
from yade_scripts.stock.script import StockLaw

KINDS = ("peak_force", "dissipated")
"""What `compare = ...` in expected.toml may say: the largest force on the driven blocks until a joint
fails [N], the energy that the
joints took for good [J]."""


@dataclass(frozen=True)
class Outcome:
    """One law at one substep (`multiple` of the case's own): table by column and figures (see `own`)."""

    law: OwnLaw | StockLaw
    multiple: int
    table: dict[str, Array]
    figures: dict

    @property
    def peak_force(self) -> float:
        """Largest force [N] until the first joint has failed; later forces are due to vibration."""
        whole = self.table["joints_broken"] == 0
        return float(self.table["force"][whole].max())

    @property
    def dissipated(self) -> float:
        """Energy [J] dissipated by the joints until the end."""
        return float(self.table["dissipated"][-1])

    @property
    def broken(self) -> int:
        """Number of joints that are broken at the end."""
        return int(self.table["joints_broken"][-1])

    @property
    def cpu_seconds(self) -> float:
        """Processor time of time stepping [s]."""
        return float(self.figures["cpu_seconds"])

    @property
    def us_per_substep(self) -> float:
        """Processor time of a substep [µs]."""
        return 1e6 * self.cpu_seconds / self.figures["substeps"]

    @property
    def us_per_joint(self) -> float:
        """Processor time [µs] per substep and joint."""
        return self.us_per_substep / self.figures["joints"]


@dataclass(frozen=True)
class Exact:
    """An exact result that the case states for its own law: value and source."""

    value: float
    source: str


def exact_answers(file: CaseFile) -> dict[str, Exact]:
    """Entries of expected.toml with `compare`, by kind; empty without any, and for a case with changed values, of which
    they say nothing."""
    path = file.directory / "expected.toml"
    if file.overrides or not path.exists():
        return {}
    entries = tomllib.loads(path.read_text(encoding="utf-8"))["expect"]
    return {e["compare"]: Exact(e["value"], e["source"]) for e in entries if e.get("compare") in KINDS}


def error(found: float, exact: float) -> float:
    """|found - exact| / |exact|"""
    return abs(found - exact) / abs(exact)


def curve_error(found: Outcome, reference: Outcome) -> float:
    """‖F - F_ref‖ / ‖F_ref‖ of the force over the displacement (L2); over time where nothing is driven."""
    axis = "displacement" if reference.table["displacement"][-1] > 0.0 else "time"
    column = "force" if axis == "displacement" else "kinetic"
    s = reference.table[axis]
    F, G = reference.table[column], np.interp(s, found.table[axis], found.table[column])
    norm = np.trapezoid(F**2, s)
    return float(np.sqrt(np.trapezoid((G - F) ** 2, s) / norm)) if norm > 0.0 else float("nan")


def errors(found: Outcome, reference: Outcome, exact: dict[str, Exact]) -> dict[str, float]:
    """Errors by kind against the exact answer, or the reference where there is none; `curve`; `largest` of the exact
    kinds, or of the curve."""
    against = {kind: exact[kind].value if kind in exact else getattr(reference, kind) for kind in KINDS}
    misses = {
        kind: error(getattr(found, kind), value) if value else float("nan") for kind, value in against.items()
    }
    misses["curve"] = curve_error(found, reference)
    misses["largest"] = max((misses[kind] for kind in exact), default=misses["curve"])
    return misses
