"""The option --vary KEY=... of the command line as a table of [[sweep.vary]].

tank.cell=0.5,0.25                                   a list
water.fill[0].upper[2]='0.6 m:1.2 m:7'               a grid: from, to, number of values
joints.strength='lognormal(median=0.1 MPa, dispersion=0.3)'
"""

from __future__ import annotations

import re
import tomllib

from pydantic import ValidationError

from coupler.case.sweep import NEEDS, Varied
from coupler.program.errors import BadCall, did_you_mean

FORMS = "KEY=A,B,...  KEY=FROM:TO:STEPS  or  KEY=lognormal(median=..., dispersion=...)"

NUMBER = re.compile(r"[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*[A-Za-z%°]*\d?")
WITH_UNIT = re.compile(r"[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*[A-Za-z%°]")


def varied(text: str) -> Varied:
    """The table that one --vary stands for. Raises BadCall."""
    key, sign, value = (part.strip() for part in text.partition("="))
    if not sign or not key or not value:
        raise BadCall([f"--vary {text}: write {FORMS}"])
    content = _content(value, text)
    _refuse_mixed_units(content, text)
    try:
        return Varied.model_validate({"key": key, **content})
    except ValidationError as error:
        raise BadCall([f"--vary {text}: {_said(item)}" for item in error.errors()]) from error


def _refuse_mixed_units(content: dict, text: str) -> None:
    """Refuse `0.1,0.2 MPa`, which hardly means 0.1 Pa and 0.2 MPa. Raises BadCall."""
    given = content.get("values", tuple(content[name] for name in ("low", "high") if name in content))
    plain_numbers = [v for v in given if isinstance(v, int | float) and not isinstance(v, bool) and v]
    with_unit = [v for v in given if isinstance(v, str) and WITH_UNIT.match(v)]
    if plain_numbers and with_unit:
        raise BadCall(
            [
                f"--vary {text}: {plain_numbers[0]:g} has no unit, which means SI, but '{with_unit[0]}' has one; "
                "write the unit at every value"
            ]
        )


def _said(item: dict) -> str:
    place = ".".join(map(str, item["loc"]))
    return f"{place}: {item['msg']}" if place else item["msg"].removeprefix("Value error, ")


def _content(value: str, text: str) -> dict:
    called = re.fullmatch(r"([a-z]+)\s*\((.*)\)", value)
    if called:
        return _distribution(called[1], called[2], text)
    grid = [part.strip() for part in value.split(":")]
    if len(grid) == 3 and grid[2].isdecimal():
        return {"low": plain(grid[0]), "high": plain(grid[1]), "steps": int(grid[2])}
    if len(grid) > 1 and all(NUMBER.fullmatch(part) for part in grid):
        raise BadCall([f"--vary {text}: a grid is FROM:TO:STEPS, two values and a whole number of them"])
    return {"values": tuple(_listed(value))}


def _distribution(kind: str, inner: str, text: str) -> dict:
    if kind not in NEEDS:
        raise BadCall(
            [
                f"--vary {text}: no distribution '{kind}'{did_you_mean(kind, NEEDS)}; there are {', '.join(NEEDS)}"
            ]
        )
    found: dict = {"distribution": kind}
    for part in filter(None, (part.strip() for part in inner.split(","))):
        name, sign, value = (word.strip() for word in part.partition("="))
        if not sign:
            raise BadCall(
                [f"--vary {text}: '{part}': write NAME=NUMBER, for instance {' and '.join(NEEDS[kind][0])}"]
            )
        found[name] = plain(value)
    return found


def _listed(value: str) -> list:
    """Values between commas that stand in no brackets or quotes."""
    parts, depth, quote, last = [], 0, "", ""
    for letter in value:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "'\"":
            quote = letter
        elif letter in "[{":
            depth += 1
        elif letter in "]}":
            depth -= 1
        if letter == "," and not depth and not quote:
            parts.append(last)
            last = ""
        else:
            last += letter
    return [plain(part) for part in [*parts, last] if part.strip()]


def plain(text: str) -> object:
    """The value of a TOML text; anything that is not TOML is kept as text."""
    try:
        found = tomllib.loads(f"x = {text}")["x"]
    except ValueError:
        return text.strip()
    return tuple(found) if isinstance(found, list) else found
