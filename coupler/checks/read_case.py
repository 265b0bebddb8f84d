"""Reading a case directory: TOML, `--set`, schema, geometry. All errors are reported together.

A message has the form `PLACE: KEY: error; remedy`, where PLACE is `path/case.toml:LINE` or `--set KEY=VALUE`.
"""

from __future__ import annotations

import copy
import difflib
import os
import re
import sys
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from pydantic import ValidationError

from coupler.case.case import Case
from coupler.case.keys import find, keys
from coupler.case.materials import with_presets, with_strength
from coupler.case.messages import explain_error
from coupler.case.paths import BadPath, place_of, read_text
from coupler.case.promises import mistakes_in
from coupler.case.records import find_record
from coupler.case.toml_lines import key_lines, line_of, shown
from coupler.case.types import KeyPath
from coupler.checks.case import problems
from coupler.geometry.tank_mesh import measured
from coupler.program.errors import BadCase, briefly, did_you_mean

DEEPEST = 20
"""Largest depth of nested tables and lists; the schema has six."""
MOST_BITS = 10_000
"""Largest number of bits of a whole number; longer ones cannot be written in decimals."""
LONGEST_SHOWN = 200
"""Largest number of characters of an override in a message."""
_TOO_DEEP = f"more than {DEEPEST} lists or sections inside of one another; no case is so deep"
NEW = -1
"""Place in a list, written [+]: behind its last item."""
ABSENT = "absent"
"""Value of an override that leaves the name out, as if it had not been written."""


@dataclass(frozen=True)
class CaseFile:
    """A case that passed every check, with where it came from."""

    case: Case
    path: Path
    """Path of the file; for a case made by a script, a name in the directory from which its paths are resolved."""
    overrides: tuple[str, ...]
    text: str
    """The TOML text without the overrides."""

    @property
    def directory(self) -> Path:
        """Directory of the case file, to which its paths are relative."""
        return self.path.parent


def load(
    place: Path | str, overrides: Iterable[str] = (), files: Path | None = None, text: str | None = None
) -> CaseFile:
    """Read `place` (a case.toml or the directory that holds one) and the `key=value` overrides.

    files: directory that paths in the case are meant from, by default its own · text: what was read there before.
    Raises BadCase with one line for each mistake.
    """
    path = _find(Path(place)) if text is None else Path(place)
    text = _read(path) if text is None else text
    table = table_of(text, _shown(path))
    overrides = tuple(overrides)
    places = _Places(_shown(path), key_lines(text))
    case, lines = _checked(table, overrides, places, files or path.parent)
    lines += mistakes_in(files or path.parent)
    if lines or case is None:
        raise BadCase(lines)
    return CaseFile(case, path, overrides, text)


def from_text(text: str, name: str, directory: Path, overrides: Iterable[str] = ()) -> CaseFile:
    """A case that is not a file, from its TOML text and the overrides. It is checked like a file, without
    `expected.toml`.

    name: what messages call it · directory: from which paths in the case are meant.
    Raises BadCase with one line for each mistake.
    """
    overrides = tuple(overrides)
    case, lines = _checked(table_of(text, name), overrides, _Places(name, {}), directory)
    if lines or case is None:
        raise BadCase(lines)
    return CaseFile(case, directory / name, overrides, text)


def changed(table: dict, override: str) -> dict:
    """The table of a case with one more override; the given one stays as it is.

    Raises BadCase where the name is unknown or the value is not allowed for it. Checks against the rest of the case
    are left to `load` and `from_text`.
    """
    found, places = copy.deepcopy(table), _Places("", {})
    path = _apply(found, override)
    places.override(path, override)
    try:
        Case.model_validate(found)
    except ValidationError as error:
        mistakes = [(item["type"], *explain_error(item)) for item in error.errors()]
        lines = [
            _line(place, text, places)
            for kind, place, text in mistakes
            if place[: len(path)] == path or (kind == "extra_forbidden" and path[: len(place)] == place)
        ]
        if lines:
            raise BadCase(lines) from None
    return found


def _checked(
    table: dict, overrides: tuple[str, ...], places: _Places, directory: Path
) -> tuple[Case | None, list[str]]:
    """The case with its overrides, None where it has mistakes, and a line for each of these."""
    for override in overrides:
        places.override(_apply(table, override), override)
    return _validate(table, places, _place_files(table, directory))


def _place_files(table: dict, directory: Path) -> list[tuple[KeyPath, str]]:
    """Resolve the paths in a case from its directory; return those that lead nowhere, with the reason. Values that are
    no paths are refused later."""
    found = [((*path, "path"), entry, "path") for path, entry in _named_files(table)]
    found += [((*path, "tide", "path"), tide, "path") for path, tide in _tides(table)]
    found += [((*path, "surface"), fill, "surface") for path, fill in _tables_of_water(table, "fill")]
    if isinstance(table.get("tank"), dict):
        found.append((("tank", "mesh"), table["tank"], "mesh"))
    if isinstance(table.get("terrain"), dict):
        found.append((("terrain", "path"), table["terrain"], "path"))
        if isinstance(table["terrain"].get("land"), dict):
            found.append((("terrain", "land", "path"), table["terrain"]["land"], "path"))
    nowhere = []
    for path, entry, key in found:
        if isinstance(entry.get(key), str) and entry[key]:
            find = find_record if path[1:2] == ("quantity",) else place_of
            try:
                entry[key] = str(find(entry[key], directory))
            except BadPath as error:
                nowhere.append((path, str(error)))
    return nowhere


def _named_files(table: dict) -> Iterator[tuple[KeyPath, dict]]:
    """The tables of a case that may name a file under `path`, with their places."""
    of_structure = (("structure", name) for name in ("file", "drawing", "town"))
    for above, name in (
        *of_structure,
        ("water", "inflow"),
        ("study", "quantity"),
        (None, "solid"),
        (None, "motion"),
    ):
        section = table if above is None else table.get(above)
        entries = section.get(name) if isinstance(section, dict) else None
        for i, entry in enumerate(entries if isinstance(entries, list) else ()):
            if isinstance(entry, dict):
                yield (name, i) if above is None else (above, name, i), entry


def _tides(table: dict) -> Iterator[tuple[KeyPath, dict]]:
    """The tides of seas, with the places of the seas."""
    for path, sea in _tables_of_water(table, "sea"):
        if isinstance(sea.get("tide"), dict):
            yield path, sea["tide"]


def _tables_of_water(table: dict, name: str) -> Iterator[tuple[KeyPath, dict]]:
    """The tables [[water.NAME]] with their places."""
    entries = table["water"].get(name) if isinstance(table.get("water"), dict) else None
    for i, entry in enumerate(entries if isinstance(entries, list) else ()):
        if isinstance(entry, dict):
            yield ("water", name, i), entry


class _Places:
    """Tells where a key path of the case was written: a line of the file or an override."""

    def __init__(self, name: str, lines: dict[KeyPath, int]):
        self.name, self.lines = name, lines
        self.overrides: dict[KeyPath, str] = {}

    def override(self, path: KeyPath, text: str) -> None:
        """Note that a value at this path comes from `text` of the command line."""
        self.overrides[path] = text

    def line(self, path: KeyPath) -> int:
        """Line in the file, 0 for what is not there; overrides come last."""
        if self._override(path):
            return sys.maxsize
        return line_of(path, self.lines) or 0

    def _override(self, path: KeyPath) -> str | None:
        return next((text for given, text in self.overrides.items() if path[: len(given)] == given), None)

    def __call__(self, path: KeyPath) -> str:
        line, override = self.line(path), self._override(path)
        if path and not line:  # a section that is not in the file, and in which an override gives a value
            override = next(
                (text for given, text in self.overrides.items() if given[: len(path)] == path), None
            )
        if override:
            return f"--set {_cut(override)}"
        return f"{self.name}:{line}" if line else self.name


def _find(place: Path) -> Path:
    if not _is_utf_8(str(place)):
        raise BadCase([f"{os.fsencode(place)!r}: no path in UTF-8, as results hold it; rename it"])
    try:
        path = place / "case.toml" if place.is_dir() else place
        if path.is_file():
            return path
    except (OSError, ValueError) as error:
        raise BadCase(
            [f"{briefly(str(place))}: no such case: {getattr(error, 'strerror', error)}"]
        ) from error
    if place.is_dir():
        cases = sorted(child.parent.name for child in place.glob("*/case.toml"))
        hint = f"below it are {', '.join(cases)}" if cases else f"`surgebreak init {place}` writes one"
        raise BadCase([f"{place}: no case.toml in this directory; {hint}"])
    if place.exists():
        raise BadCase([f"{place}: not a regular file; give a case directory or a case.toml"])
    around = place.parent if place.parent.is_dir() else Path(".")
    near = difflib.get_close_matches(place.name, [child.name for child in around.iterdir()], n=1)
    hint = f"; did you mean '{around / near[0]}'?" if near else "; give a case directory or a case.toml"
    raise BadCase([f"{place}: no such case{hint}"])


def _is_utf_8(text: str) -> bool:
    """Whether a word of the command line was one in UTF-8; Python marks the bytes that were not."""
    return not any("\ud800" <= letter <= "\udfff" for letter in text)


def _shown(path: Path) -> str:
    """The path as the user is likely to write it: relative to the working directory if it lies below."""
    try:
        here = Path.cwd()
    except FileNotFoundError:  # the working directory was removed
        return str(path)
    return str(path.relative_to(here) if path.is_absolute() and path.is_relative_to(here) else path)


def _read(path: Path) -> str:
    try:
        return read_text(path)
    except BadPath as error:
        raise BadCase([f"{_shown(path)}: {error}"]) from error


def table_of(text: str, name: str) -> dict:
    """The table of a TOML text. Raises BadCase."""
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        what, line = str(error), ""
        at = re.search(r" \(at line (\d+), column \d+\)", what)
        if at:
            what, line = what.replace(at[0], ""), f":{at[1]}"
        raise BadCase([f"{name}{line}: not valid TOML: {what}"]) from error
    except ValueError as error:  # a whole number of thousands of digits
        raise BadCase([f"{name}: not valid TOML: {error}"]) from error
    except RecursionError as error:
        raise BadCase([f"{name}: {_TOO_DEEP}"]) from error
    _check_readable(table, name)
    return table


def _check_readable(table: object, place: str) -> None:
    """Refuse what no message could show: tables nested deeper than in any case, numbers of thousands of digits."""
    level = [table]
    for _ in range(DEEPEST):
        inner = [item.values() if isinstance(item, dict) else item for item in level]
        values = [value for items in inner for value in items]
        if any(isinstance(value, int) and value.bit_length() > MOST_BITS for value in values):
            raise BadCase([f"{place}: a whole number of thousands of digits; no value of a case is so large"])
        level = [value for value in values if isinstance(value, dict | list)]
        if not level:
            return
    raise BadCase([f"{place}: {_TOO_DEEP}"])


# ---------------------------------------------------------------- overrides


def _apply(table: dict, override: str) -> KeyPath:
    """Write one `a.b=value` or `a.b[1].c=value` into the table; returns its path.

    `value` is TOML; what is no TOML is taken as text, so that units need no quotes. `a.b=absent` leaves a.b out, and
    `a[+]=value` adds an item to a list, which need not be there yet.
    """
    if not _is_utf_8(override):
        raise BadCase([f"--set {os.fsencode(override)!r}: no text in UTF-8"])
    name, sign, value = override.partition("=")
    path = parse_path(name.strip())
    if not sign or not path:
        raise BadCase(
            [f"--set {_cut(override)}: write KEY=VALUE, for instance time.end=2 or joints.strength='1 MPa'"]
        )
    if value.strip() == ABSENT:
        _leave_out(table, path, override)
        return path
    holder = table
    for part, following in pairwise(path):
        holder = _step_into(holder, part, [] if isinstance(following, int) else {}, override)
    if path[-1] == NEW and isinstance(holder, list):
        path = (*path[:-1], len(holder))
        holder.append(None)
    _step_into(holder, path[-1], None, override)
    holder[path[-1]] = _value(value.strip(), override)
    _check_readable(table, f"--set {_cut(override)}")
    return path


def _leave_out(table: dict, path: KeyPath, override: str) -> None:
    """Remove a name of the schema from the table, if it is there."""
    if find(path) is None:
        name = shown(path)
        raise BadCase(
            [
                f"--set {_cut(override)}: {name}: unknown name{did_you_mean(name, [key.path for key in keys()])}"
            ]
        )
    holder = table
    for part in path[:-1]:
        if isinstance(holder, dict) and part not in holder:
            return
        holder = _step_into(holder, part, None, override)
    _step_into(holder, path[-1], None, override)
    if not isinstance(holder, dict) or path[-1] in holder:
        del holder[path[-1]]


def parse_path(name: str) -> KeyPath:
    """Names and positions of `water.fill[0].upper`, `[+]` as NEW; empty for a text that is no path."""
    if not re.fullmatch(r"[A-Za-z0-9_-]+(\[\d+\]|\.[A-Za-z0-9_-]+)*(\[\+\])?", name):
        return ()
    parts = re.findall(r"\[(\d+|\+)\]|([A-Za-z0-9_-]+)", name)
    return tuple(word or (NEW if place == "+" else int(place)) for place, word in parts)


def _step_into(holder: dict | list, part: str | int, new: dict | list | None, override: str):
    """The value under `part`, which is created for a new name; list places that do not exist are refused."""
    if part == NEW:
        raise BadCase([f"--set {_cut(override)}: [+] adds to a list, and this is none"])
    if isinstance(part, int):
        if not isinstance(holder, list) or part >= len(holder):
            size = len(holder) if isinstance(holder, list) else 0
            raise BadCase(
                [f"--set {_cut(override)}: there is no item [{part}]; the list has {size}, counted from [0]"]
            )
        return holder[part]
    if isinstance(holder, list):
        raise BadCase(
            [f"--set {_cut(override)}: '{part}' is inside a list; say which item, for instance [0].{part}"]
        )
    if not isinstance(holder, dict):
        raise BadCase([f"--set {_cut(override)}: '{part}' is below a value, not below a section"])
    return holder.setdefault(part, new) if new is not None else holder.get(part)


def _cut(override: str) -> str:
    """An override as messages name it."""
    return override if len(override) <= LONGEST_SHOWN else f"{override[:LONGEST_SHOWN]}..."


def _value(text: str, override: str) -> object:
    try:
        return tomllib.loads(f"x = {text}")["x"]
    except ValueError:  # no TOML, or a whole number of thousands of digits
        return text
    except RecursionError as error:
        raise BadCase([f"--set {_cut(override)}: {_TOO_DEEP}"]) from error


# ---------------------------------------------------------------- checks


def _validate(table: dict, places: _Places, nowhere: list) -> tuple[Case | None, list[str]]:
    """The case and the messages, those of paths that lead nowhere with them. Unknown names do not hide what is wrong
    with the geometry."""
    try:
        case, found = Case.model_validate(table), []
    except ValidationError as error:
        found = error.errors()
        case = _without_unknown(table, found)
    mistakes = [*nowhere, *(explain_error(item) for item in found)]
    if case is not None and not nowhere:
        case, refused = measured(case)
        case, missing = with_strength(case)
        mistakes += [*refused, *missing, *problems(case)]
    mistakes.sort(key=lambda mistake: places.line(mistake[0]))
    lines = [_line(path, text, places) for path, text in mistakes]
    return (None if mistakes or case is None else with_presets(case)), list(dict.fromkeys(lines))


def _without_unknown(table: dict, found: list) -> Case | None:
    if any(item["type"] != "extra_forbidden" for item in found):
        return None
    rest = copy.deepcopy(table)
    for item in found:
        path, _ = explain_error(item)
        holder = rest
        for part in path[:-1]:
            holder = holder[part]
        del holder[path[-1]]
    try:
        return Case.model_validate(rest)
    except ValidationError:  # the unknown name was probably meant for a required one of its section
        return None


def _line(path: KeyPath, text: str, places: _Places) -> str:
    return f"{places(path)}: {shown(path)}: {text}" if path else f"{places(path)}: {text}"
