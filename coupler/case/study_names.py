"""Checks of names in [study] that the schema cannot make: names that must exist, and names that are already used."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from coupler.case.keys import keys
from coupler.case.study import Ladder, Study
from coupler.case.types import KeyPath
from coupler.program.errors import did_you_mean


def without_places(name: str) -> tuple[str, ...]:
    """Names of a key of the case without the places in lists: structure.block[0].size gives three."""
    return tuple(part.partition("[")[0] for part in name.split("."))


def limit_problem(name: str, section: str) -> str:
    """Why a run of a study or a sweep (section) cannot have a limit of processor time of its own; empty for any other
    name of the case."""
    if name.strip() != "limits.cpu_seconds":
        return ""
    return (
        f"'limits.cpu_seconds': {section}.cpu_seconds takes its place in every run of a {section}; write that"
    )


def limit_in_overrides(
    overrides: Iterable[str], path: KeyPath, section: str
) -> Iterator[tuple[KeyPath, str]]:
    """The same of changes KEY=VALUE at a key path of the case."""
    for override in overrides:
        wrong = limit_problem(override.partition("=")[0], section)
        if wrong:
            yield path, wrong


def study_problems(study: Study) -> Iterator[tuple[KeyPath, str]]:
    """(key path, message) of names in [study] that do not exist."""
    yield from _taken("quantity", study.quantity)
    yield from _taken("ladder", study.ladder)
    yield from _taken("off", study.off)
    yield from limit_in_overrides(study.set, ("study", "set"), "study")
    for kind in ("ladder", "off"):
        for i, one in enumerate(getattr(study, kind)):
            yield from limit_in_overrides(one.set, ("study", kind, i, "set"), "study")
    ladders = [ladder.name for ladder in study.ladder]
    for i, ladder in enumerate(study.ladder):
        yield from _ladder_names(ladder, ("study", "ladder", i), study)
    for i, q in enumerate(study.quantity):
        path = ("study", "quantity", i)
        with_key = [ladder.name for ladder in study.ladder if ladder.key]
        if q.ladder is not None and q.ladder not in ladders:
            yield (*path, "ladder"), f"there is no ladder '{q.ladder}'{did_you_mean(q.ladder, ladders)}"
        if q.against == "finest" and q.ladder is None and len(with_key) != 1:
            yield (
                (*path, "ladder"),
                f"missing; say which ladder ends with the finest run: {', '.join(with_key)}",
            )


def _taken(kind: str, tables: Iterable[Any]) -> Iterator[tuple[KeyPath, str]]:
    seen: dict[str, int] = {}
    for i, table in enumerate(tables):
        first = seen.setdefault(table.name, i)
        if first != i:
            yield ("study", kind, i, "name"), f"'{table.name}' is taken by study.{kind}[{first}]"


def _ladder_names(ladder: Ladder, path: tuple, study: Study) -> Iterator[tuple[KeyPath, str]]:
    known = [key.path for key in keys()]
    for name in (ladder.key,) if isinstance(ladder.key, str) else ladder.key or ():
        plain = ".".join(without_places(name))
        if plain not in known:
            yield (
                (*path, "key"),
                f"'{name}': no such name in a case file{did_you_mean(plain, known)}",
            )
        wrong = limit_problem(plain, "study")
        if wrong:
            yield (*path, "key"), wrong
    across = {other.name for other in study.ladder if other.key} - {ladder.name}
    if ladder.across is not None and ladder.across not in across:
        yield (
            (*path, "across"),
            f"there is no ladder '{ladder.across}' with a key{did_you_mean(ladder.across, across)}",
        )
