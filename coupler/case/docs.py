"""Texts made from the schema: `surgebreak explain`, the page docs/case_file.md, and the first case of `init`.

`python -m coupler.case.docs` writes the page anew; a test compares it with the schema.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

from pydantic import BaseModel

from coupler.case.keys import Key, find, keys
from coupler.case.materials import PRESETS, described
from coupler.program.errors import SurgebreakError, UnknownName, did_you_mean
from coupler.program.provenance import ROOT

PAGE = ROOT / "docs" / "case_file.md"


def explanation(name: str | None) -> str:
    """What a name of the case file means; without a name, the sections.

    Raises UnknownName when the schema has no such name, with the nearest one.
    """
    if not name:
        return "\n".join(_entry(key) for key in keys() if "." not in key.path)
    if name in PRESETS:
        return described(name)
    plain = name.strip("[]").replace("[]", "")
    key = find(tuple(plain.split(".")))
    if key is None:
        raise UnknownName(f"{name}: no such name in a case file{_near(plain)}")
    told = [_entry(key)]
    for section in key.sections:
        told += ["", inspect.getdoc(section) or ""]
        told += [f"  {_entry(inner)}" for inner in keys(section, f"{key.path}.") if _depth(inner, key) == 1]
    return "\n".join(told)


def _near(name: str) -> str:
    known = [key.path for key in keys()]
    ends = [path for path in known if path.rsplit(".", 1)[-1] == name]
    return f"; did you mean '{ends[0]}'?" if ends else did_you_mean(name, known)


def _depth(key: Key, above: Key) -> int:
    return key.path.count(".") - above.path.count(".")


def _entry(key: Key) -> str:
    """joints.strength [Pa] (> 0; required; for instance "0.5 MPa"): what it is."""
    unit = f" [{key.unit}]" if key.unit else ""
    facts = [key.limits, _default(key), f"for instance {key.example}" if key.example else ""]
    told = "; ".join(fact for fact in facts if fact)
    return f"{_header(key)}{unit}" + (f" ({told})" if told else "") + f": {key.description}"


def _header(key: Key) -> str:
    if key.sections:
        return f"[[{key.path}]]" if key.several else f"[{key.path}]"
    return key.path


def _default(key: Key) -> str:
    if key.required:
        return "required"
    return f"default {key.default}" if key.default not in ("", '""') else ""


# ---------------------------------------------------------------- the page


def page() -> str:
    """docs/case_file.md."""
    return "\n".join([*_opening(), *_tables()]).rstrip() + "\n"


def _opening() -> Iterator[str]:
    yield "# The case file"
    yield ""
    yield "<!-- Made from coupler/case by `python -m coupler.case.docs`; changes here are lost. -->"
    yield ""
    yield "A case is a directory with a `case.toml` ([TOML](https://toml.io)). Plain numbers are SI; text may carry"
    yield 'any unit of the right kind (`"5 MN/mm"`, `"2.4 t/m3"`, `"30 deg"`). z points up. A section that is absent'
    yield "switches its part of the program off. Unknown names are refused, and all mistakes are told at once."
    yield ""
    yield "`surgebreak check CASE` checks a case, `surgebreak explain NAME` tells what is below for one name, and"
    yield "`--set NAME=VALUE` changes a value for one run (`--set structure.block[0].density=600`); `--set NAME=absent`"
    yield "leaves the name out (`--set joints=absent`)."
    yield ""
    yield "| name | unit | values | default | meaning |"
    yield "|---|---|---|---|---|"
    for key in keys():
        if "." not in key.path:
            yield f"| [`{_header(key)}`](#{key.path}) | | | {_shown_default(key)} | {key.description} |"
    yield ""


def _tables() -> Iterator[str]:
    for key in keys():
        if not key.sections:
            continue
        yield f"## {key.path}"
        yield ""
        for section in key.sections:
            yield from _table(section, key)


def _table(section: type[BaseModel], key: Key) -> Iterator[str]:
    title = inspect.getdoc(section) or ""
    kind = section.model_fields.get("kind")
    if kind is not None:
        yield f'`kind = "{get_args(kind.annotation)[0]}"`: {title}'
    else:
        yield f"`{_header(key)}`: {title}"
    yield ""
    yield "| name | unit | values | default | meaning |"
    yield "|---|---|---|---|---|"
    for inner in keys(section, f"{key.path}."):
        if _depth(inner, key) == 1:
            yield _row(inner)
    yield ""


def _row(key: Key) -> str:
    name = key.path.rsplit(".", 1)[-1]
    shown = f"[`{name}`](#{key.path.replace('.', '')})" if key.sections else f"`{name}`"
    meaning = key.description + (f"; for instance `{key.example}`" if key.example else "")
    limits = key.limits.replace(" | ", ", ")
    return f"| {shown} | {key.unit} | {limits} | {_shown_default(key)} | {meaning} |"


def _shown_default(key: Key) -> str:
    if key.required:
        return "required"
    return f"`{key.default}`" if key.default else ""


# ---------------------------------------------------------------- the first case

FIRST_CASE = """\
# A column of water falls against a light box.
# surgebreak explain          lists the sections;   surgebreak explain water.fill   says what is in one
# Plain numbers are SI (m, s, kg, Pa); text may carry any unit of the right kind.

[case]
title = "Water against a light box"

[time]
end = "1.5 s"
output_every = "50 ms"

[tank]                      # the water's fixed mesh; closed but for the top
lower = [0, 0, 0]
upper = [4, 1, 2]
cell = "20 cm"

[[water.fill]]              # full of water at the start
lower = [0, 0, 0]
upper = [1, 1, 1]

[structure]                 # leave this section and [contact] out for water alone
density = "600 kg/m3"

[[structure.block]]
name = "box"
size = ["40 cm", "40 cm", "40 cm"]
centre = [2.5, 0.5, 0.2]

[contact]
stiffness = "1 MN/m"
restitution = 0.3
friction = 0.4

# [joints]                  # glue between touching faces, which may break
# strength = "0.5 MPa"
# opening_at_failure = "1 mm"

[[gauge]]
kind = "level"
name = "in_front"
at = [2.2, 0.5]

[[gauge]]
kind = "force"
name = "box"
on = "box"
"""


def write_first_case(directory: Path) -> Path:
    """Write a small case into a new or empty directory; raises SurgebreakError when there is one already."""
    path = directory / "case.toml"
    if path.exists():
        raise SurgebreakError(f"{path}: exists and is left as it is; name another directory")
    try:
        directory.mkdir(parents=True, exist_ok=True)
        path.write_text(FIRST_CASE, encoding="utf-8")
    except OSError as error:
        raise SurgebreakError(f"{path}: cannot be written ({error.strerror})") from error
    return path


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"wrote {PAGE}")
