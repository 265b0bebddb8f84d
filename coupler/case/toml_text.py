"""Plain data as TOML text: numbers, text, booleans, lists, tables and lists of tables. (tomllib can only read.)"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping


def document(table: Mapping) -> str:
    """A whole file; tables get headers of their own. Raises TypeError for a value that TOML cannot express."""
    return "\n".join(_lines(table, ())).lstrip("\n") + "\n"


def inline(value: object) -> str:
    """A value on one line, as it stands after a `=`; numpy numbers and arrays as numbers and lists.

    Raises TypeError for a value that TOML cannot express, such as None.
    """
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else "nan" if math.isnan(value) else f"{value:+}"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(name)} = {inline(inner)}" for name, inner in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(inline, value)) + "]"
    raise TypeError(
        f"{value!r}: a case holds numbers, texts, booleans, lists and tables, no {type(value).__name__}"
    )


def _key(name: str) -> str:
    bare = name.replace("_", "a").replace("-", "a")
    return name if bare.isascii() and bare.isalnum() else inline(name)


def _lines(table: Mapping, path: tuple[str, ...]) -> list[str]:
    own = [f"{_key(name)} = {inline(value)}" for name, value in table.items() if not _is_table(value)]
    for name, value in table.items():
        below = (*path, _key(name))
        if isinstance(value, Mapping):
            own += ["", f"[{'.'.join(below)}]", *_lines(value, below)]
        elif _is_table(value):
            for row in value:
                own += ["", f"[[{'.'.join(below)}]]", *_lines(row, below)]
    return own


def _is_table(value: object) -> bool:
    """Whether it gets a header: a table, or a list of nothing but tables."""
    return isinstance(value, Mapping) or (
        isinstance(value, list | tuple) and bool(value) and all(isinstance(row, Mapping) for row in value)
    )
