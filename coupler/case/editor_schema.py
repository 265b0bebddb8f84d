"""The schema of case.toml for editors: JSON Schema, made from the classes that read a case."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from coupler.case.case import Case
from coupler.program.errors import SurgebreakError


def schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12). What values mean beside one another is left to `surgebreak check`."""
    found = Case.model_json_schema()
    _put_right(found)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **found,
        "title": "surgebreak case.toml",
    }


WORDS = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}
"""Of pydantic, which leaves those of quantities as they are, and of JSON Schema."""


def _put_right(part: Any) -> None:
    """TOML has no null: optional values are those that may be left out. Limits get their names in JSON Schema."""
    if isinstance(part, list):
        for inner in part:
            _put_right(inner)
    if not isinstance(part, dict):
        return
    for ours, theirs in WORDS.items():
        if isinstance(part.get(ours), int | float):
            part[theirs] = part.pop(ours)
    if part.get("default", 0) is None:
        del part["default"]
    if "anyOf" in part:
        part["anyOf"] = [choice for choice in part["anyOf"] if choice.get("type") != "null"]
        if len(part["anyOf"]) == 1:
            part |= part.pop("anyOf")[0] | {k: part[k] for k in ("title", "description") if k in part}
    for inner in list(part.values()):
        _put_right(inner)


def write(place: Path | None) -> None:
    """Write it to a file, or print it. Raises SurgebreakError where the file cannot be written."""
    text = json.dumps(schema(), indent=1, ensure_ascii=False)
    if place is None:
        print(text)
        return
    try:
        place.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise SurgebreakError(f"{place}: cannot be written ({error.strerror})") from error
    print(f"schema: {place}")
