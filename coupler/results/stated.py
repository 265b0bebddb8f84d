"""Comparison of the figures that the README of a case states with a run of that case.

An entry of `expected.toml` names the place of a figure and how it is taken from the run; the figure itself stands in
the README alone.

[[stated]]
text = "period of the heave {} s"   words of the README with {} in place of the figure; they occur there once. {...}
                                    stands for a figure that another entry compares
table, column, take, ...            as in [[expect]] (`expected.py`)
scale = 0.001                       what the value of the run is multiplied with; absent: 1
tolerance = 2                       in the unit of the README; absent: one unit of the last digit that it states
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path

from coupler.case.promises import FIGURE, FILE_NAME
from coupler.program.errors import BadCase
from coupler.results.expected import taken

OTHER = "{...}"
NUMBER = r"-?\d+(?:\.\d+)?"


@dataclass(frozen=True)
class Stated:
    """One figure: what the README states, and the value of the run in the README's unit."""

    text: str
    stated: str
    now: float
    tolerance: float
    place: tuple[int, int]
    """Begin and end of the figure in the README."""
    reason: str = ""
    """Why there is nothing to compare."""

    @property
    def kept(self) -> bool:
        """Whether the run gives the figure within its tolerance."""
        return abs(self.now - float(self.stated)) <= self.tolerance * (1.0 + 1e-9)

    @property
    def renewed(self) -> str:
        """The value of the run with as many decimals as the README states."""
        return f"{self.now:.{_decimals(self.stated)}f}"


def stated(case: Path, run: Path) -> list[Stated]:
    """The figures of a case directory, whose expected.toml is sound (`promises.py`), against a run directory.

    Raises BadCase where the README lacks a text, or has it twice."""
    readme = (case / "README.md").read_text(encoding="utf-8")
    return [_compare(entry, place, run) for entry, place in places(case, readme)]


def places(case: Path, readme: str) -> list[tuple[dict, re.Match]]:
    """The entries [[stated]] of a case with their places in its README. Raises BadCase."""
    path = case / FILE_NAME
    entries = tomllib.loads(path.read_text(encoding="utf-8")).get("stated", []) if path.exists() else []
    found = [(entry, list(_pattern(entry["text"]).finditer(readme))) for entry in entries]
    wrong = [
        f"{path}: stated[{i}].text: README.md has '{entry['text']}' {len(matches)} times; it must have it once"
        for i, (entry, matches) in enumerate(found)
        if len(matches) != 1
    ]
    if wrong:
        raise BadCase(wrong)
    return [(entry, matches[0]) for entry, matches in found]


def _pattern(text: str) -> re.Pattern:
    """The text of an entry with a group for its figure; a line may end at any of its spaces."""
    words = re.escape(" ".join(text.split())).replace(r"\ ", r"\s+")
    words = words.replace(re.escape(OTHER), NUMBER)
    return re.compile(words.replace(re.escape(FIGURE), f"(?<![\\d.])({NUMBER})(?!\\.?\\d)"))


def _compare(entry: dict, place: re.Match, run: Path) -> Stated:
    value, reason = taken(entry, run)
    figure = place[1]
    tolerance = entry.get("tolerance", 10.0 ** -_decimals(figure))
    return Stated(entry["text"], figure, entry.get("scale", 1.0) * value, tolerance, place.span(1), reason)


def _decimals(figure: str) -> int:
    return len(figure.partition(".")[2])


def renew(readme: str, found: list[Stated]) -> str:
    """The README with the figures of the run where they are beyond their tolerance."""
    for one in sorted(found, key=lambda one: one.place, reverse=True):
        if not one.kept and not one.reason:
            start, end = one.place
            readme = readme[:start] + one.renewed + readme[end:]
    return readme
