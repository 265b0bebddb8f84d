"""The plan of a study: every setting with its overrides, checked and named before the first run is made.

Two rungs with the same effective case share one run; the unchanged case belongs to most ladders.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from coupler.case.case import effective
from coupler.case.keys import find
from coupler.case.study import Ladder, Study
from coupler.case.study_names import without_places
from coupler.case.toml_text import inline
from coupler.case.units import to_si
from coupler.checks.read_case import CaseFile, load
from coupler.program.errors import BadCall, BadCase, UnitError
from coupler.run.fingerprint import run_inputs


@dataclass(frozen=True)
class Setting:
    """One run: the overrides that make it, and the effective case that they give."""

    id: str
    overrides: tuple[str, ...]
    case: dict


@dataclass(frozen=True)
class Rung:
    """A place on a ladder. curve: the value of the ladder across which it is run, or empty; size: for the order."""

    ladder: str
    curve: str
    label: str
    size: float | None
    setting: str


@dataclass(frozen=True)
class Plan:
    """settings: by id, in the order in which they are run; off: the variants by name; laws: ladders of laws."""

    file: CaseFile
    study: Study
    settings: dict[str, Setting]
    rungs: tuple[Rung, ...]
    base: str
    off: dict[str, str]
    laws: tuple[Ladder, ...]

    @property
    def needed(self) -> set[str]:
        """Settings that are run: those of rungs and variants, and with variants the case as it stands."""
        variants = {self.base, *self.off.values()} if self.off else set()
        return {rung.setting for rung in self.rungs} | variants


def make_plan(place: Path, chosen: Iterable[str] = (), larger: bool = False) -> Plan:
    """The plan of the case's [study]; chosen: ladders by name, all without; larger: with the larger rungs.

    A ladder that another one is run across has no curve of its own unless it is chosen by name.

    Raises BadCase with every mistake: no [study], unknown ladders, settings that are no case.
    """
    file = load(place)
    study = file.case.study
    if study is None:
        raise BadCase(
            [
                f"{file.path}: no [study]: write what is measured ([[study.quantity]]) and what is varied "
                "([[study.ladder]]); `surgebreak explain study` says how"
            ]
        )
    ladders = {ladder.name: ladder for ladder in study.ladder}
    chosen = list(chosen)
    wanted = chosen or list(ladders)
    wrong = [
        f"--ladder {n}: no such ladder; there are {', '.join(ladders)}" for n in wanted if n not in ladders
    ]
    if wrong:
        raise BadCall(wrong)
    made = _Settings(file, study)
    base = made.add(())
    taken = [ladders[n] for n in ladders if n in wanted]
    crossed = set() if chosen else {ladder.across for ladder in taken}
    own = [ladder for ladder in taken if ladder.key and ladder.name not in crossed]
    rungs = tuple(chain(*(_rungs(ladder, ladders, made, larger) for ladder in own)))
    off = {} if chosen else {variant.name: made.add(variant.set) for variant in study.off}
    if made.wrong:
        raise BadCase(dict.fromkeys(made.wrong))
    return Plan(file, study, made.settings, rungs, base, off, tuple(la for la in taken if la.laws))


class _Settings:
    """Collects settings and the mistakes in them."""

    def __init__(self, file: CaseFile, study: Study):
        self.file, self.study = file, study
        self.settings: dict[str, Setting] = {}
        self.wrong: list[str] = []

    def add(self, overrides: Iterable[str]) -> str:
        """The id of the case with these overrides; empty where they are no case."""
        whole = (
            *self.study.set,
            *overrides,
            f"limits.cpu_seconds={self.study.cpu_seconds!r}",
        )
        try:
            content = effective(load(self.file.path, whole).case)
        except BadCase as error:
            self.wrong += error.lines
            return ""
        id = identity(content)
        self.settings.setdefault(id, Setting(id, whole, content))
        return id


def fingerprint(case: dict) -> str:
    """Ten digits that tell one effective case from another."""
    text = json.dumps(case, sort_keys=True).encode()
    return hashlib.blake2b(text, digest_size=5).hexdigest()


def identity(case: dict) -> str:
    """Ten digits that tell one run from another: those of its effective case, and of what the files that it names and
    its own joint laws contain, where it has any."""
    inputs = run_inputs(case)
    return fingerprint({"case": case, **inputs} if inputs else case)


def _rungs(ladder: Ladder, ladders: dict[str, Ladder], made: _Settings, larger: bool):
    across = ladders.get(ladder.across) if ladder.across else None
    curves = [("", ())] if across is None else [(label, o) for label, o, _ in steps(across, larger=False)]
    for curve, before in curves:
        for label, overrides, size in steps(ladder, larger):
            setting = made.add((*before, *ladder.set, *overrides))
            yield Rung(ladder.name, curve, label, size, setting)


def steps(ladder: Ladder, larger: bool) -> list[tuple[str, tuple[str, ...], float | None]]:
    """(label, overrides, size) of every rung of a ladder with a key."""
    values = [*ladder.values, *(ladder.larger if larger else ())]
    names = (ladder.key,) if isinstance(ladder.key, str) else ladder.key
    found = []
    for number, value in enumerate(values):
        parts = value if isinstance(ladder.key, tuple) else (value,)
        label = ladder.labels[number] if ladder.labels else ", ".join(str(part) for part in parts)
        size = ladder.sizes[number] if ladder.sizes else _size(names[0], parts[0])
        overrides = tuple(f"{name}={inline(part)}" for name, part in zip(names, parts))
        found.append((label, overrides, size))
    return found


def _size(name: str, value) -> float | None:
    """The value in SI where it is a length, a time or has another unit; None for plain numbers and names."""
    key = find(without_places(name))
    if key is None or not key.unit or isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    try:
        size = to_si(value, key.unit)
    except UnitError:
        return None
    return size if size > 0.0 else None
