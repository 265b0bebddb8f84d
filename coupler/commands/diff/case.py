"""The keys of the case whose values differ between runs."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from coupler.case.keys import find
from coupler.program.quantities import as_said
from coupler.run.fingerprint import ALL_FILE_KEYS

GIVEN, ABSENT = "given", "absent"
LONGEST = 40
"""Letters of a value that a table shows."""


@dataclass(frozen=True)
class Change:
    """A key of the case, its unit, and its values in SI by run, None where a case does not have it."""

    key: str
    unit: str
    values: tuple[Any, ...]

    def words(self) -> list[str]:
        """The values as a table shows them."""
        return [_words(value, self.unit) for value in self.values]


def changes(cases: Sequence[dict], files: Sequence[dict[str, str]] = ()) -> list[Change]:
    """The differences between effective cases, in the order of the schema. Tables with names are paired by their names,
    others by their places; a table that only some cases have is a single line.

    files: digests of the files that each case names, by their paths; with those of all cases files are compared by
    their contents, whatever folder they are in, else by their paths."""
    if compares_contents(cases, files):
        cases = [_with_contents(case, digests) for case, digests in zip(cases, files)]
    return [Change(key, _unit_of(key), values) for key, values in _differing(tuple(cases), "")]


def compares_contents(cases: Sequence[dict], files: Sequence[dict[str, str]]) -> bool:
    """Whether every case that names files has their digests: runs of earlier versions kept none."""
    return len(files) == len(cases) and all(
        digests or not names_files(case) for case, digests in zip(cases, files)
    )


def names_files(value: object) -> bool:
    """Whether a case names a file."""
    if isinstance(value, dict):
        return any(
            (key in ALL_FILE_KEYS and isinstance(v, str)) or names_files(v) for key, v in value.items()
        )
    return isinstance(value, list) and any(map(names_files, value))


def _with_contents(value: Any, digests: dict[str, str]) -> Any:
    """A value of a case in which the paths of files are replaced by their digests and names."""
    if isinstance(value, dict):
        return {
            key: f"contents {digests[v]} of {Path(v).name}"
            if key in ALL_FILE_KEYS and isinstance(v, str) and v in digests
            else _with_contents(v, digests)
            for key, v in value.items()
        }
    return [_with_contents(v, digests) for v in value] if isinstance(value, list) else value


def _differing(values: tuple[Any, ...], key: str) -> Iterator[tuple[str, tuple[Any, ...]]]:
    if all(value == values[0] for value in values):
        return
    tables = [_as_table(value) for value in values]
    if any(table is None and value is not None for table, value in zip(tables, values)):
        yield key, values
    elif any(table is None for table in tables):
        yield key, tuple(None if table is None else GIVEN for table in tables)
    else:
        names = dict.fromkeys(name for table in tables for name in table or {})
        for name in names:
            below = f"{key}.{name}" if key and not name.startswith("[") else f"{key}{name}"
            yield from _differing(tuple((table or {}).get(name) for table in tables), below)


def _as_table(value: Any) -> dict[str, Any] | None:
    """A table, or a list of tables by their names or places; None for any other value."""
    if isinstance(value, dict):
        return value
    if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
        return None
    names = [str(entry.get("name", k)) for k, entry in enumerate(value)]
    if len(set(names)) < len(names):
        names = [str(k) for k in range(len(value))]
    return {f"[{name}]": entry for name, entry in zip(names, value)}


def _unit_of(key: str) -> str:
    found = find(tuple(re.sub(r"\[[^]]*\]", "", key).split(".")))
    return "" if found is None else found.unit


def _words(value: Any, unit: str) -> str:
    if value is None:
        return ABSENT
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float) and unit:
        return as_said(float(value), unit)
    if isinstance(value, list) and unit and all(isinstance(x, int | float) for x in value):
        return f"[{', '.join(f'{x:g}' for x in value)}] {unit}"
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."
