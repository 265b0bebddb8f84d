"""Input of quantities: text with a unit becomes a float in SI; plain numbers are in SI already.

    to_si("24 kN/m3", "N/m3") = 24000.0        to_si(24000, "N/m3") = 24000.0

Units that most cases have are in a table (`COMMON`). Others are read by pint, which takes half a second of processor
time to begin and is imported only then. A digit behind a letter is a power
(`kg/m3`, `m/s2`, `s-1`), which pint itself does not read; `kg/m³` is the same.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

from annotated_types import Ge, GroupedMetadata, Gt, Le, Lt
from pydantic import BeforeValidator

from coupler.program.errors import UnitError, briefly

DIMENSIONS = {
    "": "a plain number",
    "m": "a length",
    "m2": "an area",
    "m3": "a volume",
    "s": "a time",
    "1/s": "a frequency",
    "kg": "a mass",
    "m/s": "a velocity",
    "m/s2": "an acceleration",
    "kg/m3": "a density",
    "Pa": "a pressure",
    "Pa s": "a dynamic viscosity",
    "N": "a force",
    "N/m": "a stiffness",
    "J": "an energy",
    "rad": "an angle",
    "rad/s": "an angular velocity",
}
"""Name of the dimension of each unit in the case file."""

LEAST, MOST = 1e-30, 1e30
"""Sizes of numbers, zero aside, with whose products and powers the program can still count."""
LONGEST = 100
"""Largest number of characters in the text of a quantity."""

COMMON = {
    "": {"%": 0.01, "": 1.0},
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3},
    "m2": {"m2": 1.0},
    "m3": {"m3": 1.0},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0},
    "1/s": {"1/s": 1.0, "Hz": 1.0},
    "kg": {"kg": 1.0, "g": 1e-3, "t": 1e3},
    "m/s": {"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2},
    "m/s2": {"m/s2": 1.0, "mm/s2": 1e-3},
    "kg/m3": {"kg/m3": 1.0, "t/m3": 1e3},
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "kN/m2": 1e3, "N/mm2": 1e6},
    "Pa s": {"Pa s": 1.0},
    "N": {"N": 1.0, "kN": 1e3, "MN": 1e6},
    "N/m": {"N/m": 1.0, "kN/m": 1e3, "MN/m": 1e6, "GN/m": 1e9, "N/mm": 1e3},
    "J": {"J": 1.0, "kJ": 1e3},
    "rad": {"rad": 1.0, "deg": 0.017453292519943295},
    "rad/s": {"rad/s": 1.0},
}
"""Factors from texts of units to the unit of the case file, with the bits that pint finds."""

_QUANTITY = re.compile(r"\s*([-+]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")
_COMMA = re.compile(r",(\d+)")
_FACTOR = r"[^\W\d_%°]*[A-Za-z%°](?:(?:\^|\*\*)?-?\d+)?"
_UNIT_TEXT = re.compile(rf"(?:(?:1\s*/\s*)?{_FACTOR}(?:(?:\s*[*/·]\s*|\s+){_FACTOR})*)?")
_CAPITALS = (
    "m", "mm", "cm", "km", "s", "ms", "g", "kg", "t", "N", "kN", "MN", "Pa", "kPa", "MPa", "GPa", "J", "kJ", "Hz",
    "rad", "deg", "kg/m3", "t/m3", "g/cm3", "kN/m3", "N/m", "kN/m", "MN/m", "GN/m", "N/mm", "m/s", "mm/s", "m/s2",
)  # fmt: skip
"""Units that people write with wrong capitals."""
_SYMBOL_WITH_S = re.compile("(?:[munpfkhdcMGT]|da)?(?:Pa|N|J|W|Hz|g|t|m)s")
_RAISED = str.maketrans("⁻¹²³⁴", "-1234")
_POWER = re.compile(r"(?<=[A-Za-z])(-?\d+)")


@dataclass(frozen=True)
class InSI(GroupedMetadata):
    """Annotated[float, InSI("Pa", gt=0)]: a float in SI `unit`, or text with any unit of its kind, within limits."""

    unit: str
    gt: float | None = None
    ge: float | None = None
    lt: float | None = None
    le: float | None = None

    def __iter__(self) -> Iterator[object]:
        """What pydantic does with it: read the text, then compare."""
        yield BeforeValidator(partial(to_si, unit=self.unit))
        for kind, limit in ((Gt, self.gt), (Ge, self.ge), (Lt, self.lt), (Le, self.le)):
            if limit is not None:
                yield kind(limit)
        yield _ForEditors(self.unit)


@dataclass(frozen=True)
class _ForEditors:
    """A quantity in the JSON Schema: a number, or a text that begins with one."""

    unit: str

    def __get_pydantic_json_schema__(self, core: Any, handler: Any) -> dict[str, Any]:
        """The choice of the two, around the limits of the number."""
        text = {"type": "string", "pattern": r"^\s*[-+]?(\d|\.\d)"}
        title = f"a number in {self.unit}, or text with a unit" if self.unit else "a plain number"
        return {"title": title, "anyOf": [handler(core), text]}


def to_si(value: object, unit: str) -> float:
    """value (number, or text such as "5 MN/mm") in SI `unit`.

    Raises UnitError, naming the value, when the text is no quantity or one of another kind.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise UnitError(f"{briefly(value)} is not a number{_example(unit)}")
    if isinstance(value, str) and len(value) > LONGEST:
        raise UnitError(
            f"{briefly(value)} has {len(value)} characters, a quantity at most {LONGEST}{_example(unit)}"
        )
    number = _from_text(value, unit) if isinstance(value, str) else value
    if _is_finite(number) and number != 0 and not LEAST <= abs(number) <= MOST:
        raise UnitError(
            f"{briefly(value)} is outside the range of the computation: write 0, or a number of a size "
            f"between {LEAST:g} and {MOST:g}{_in(unit)}"
        )
    return float(number)


def _is_finite(number: int | float) -> bool:
    """Infinities and NaN are refused by the schema, as of any number; whole numbers may have any length."""
    return isinstance(number, int) or math.isfinite(number)


def _from_text(text: str, unit: str) -> float:
    match = _QUANTITY.fullmatch(text)
    if match is None:
        raise UnitError(f"{text!r} is not a number with a unit{_example(unit)}")
    number, given = float(match[1]), match[2].translate(_RAISED)
    if comma := _COMMA.match(given):
        point, none = (f"'{text.strip().replace(',', by)}'" for by in (".", ""))
        thousands = f", or {none} if it parts thousands" if len(comma[1]) == 3 else ""
        raise UnitError(f"{text!r}: a comma is no decimal point: write {point}{thousands}{_example(unit)}")
    if not given and unit:
        raise UnitError(f"{text!r} has no unit{_example(unit)}")
    return number * _factor(given, unit, text)


def _factor(given: str, unit: str, value: str) -> float:
    known = COMMON[unit].get(given)
    return factor_by_pint(given, unit, value) if known is None else known


@lru_cache(maxsize=256)
def factor_by_pint(given: str, unit: str, value: str) -> float:
    """Factor from a text of a unit to `unit` of the case file.

    Raises UnitError, naming the value, where the text is no unit or one of another kind."""
    import pint

    registry = _registry()
    plural = _plural_symbol(given)
    if plural:
        raise UnitError(f"{value!r}: unknown unit '{given}'; did you mean '{plural}'?{_example(unit)}")
    try:
        if not _UNIT_TEXT.fullmatch(given):
            raise ValueError(given)
        source = 1.0 * registry.parse_units(_POWER.sub(r"^\1", given.replace("·", "*")))
    except (pint.PintError, ValueError, AttributeError, ArithmeticError) as error:
        raise UnitError(f"{value!r}: unknown unit '{given}'{_near(given)}{_example(unit)}") from error
    target = _si(unit)
    of_other_kind = source.dimensionality != target.dimensionality
    if unit == "kg/m3" and source.dimensionality == _si("N/m3").dimensionality:
        raise UnitError(f"{value!r} is a unit weight, needs a density [kg/m3]; divide it by 9.81 m/s2")
    if of_other_kind or _is_angle(source) != _is_angle(target):
        raise UnitError(f"{value!r} is {_kind(source)}, needs {DIMENSIONS[unit]}{_in(unit)}")
    return float(source.to(target.units).magnitude)


def _plural_symbol(given: str) -> str:
    """The text without an s behind a symbol, which pint takes for a plural: 'MPas' is no pressure, 'Pa s' was meant or
    'MPa'. Names have plurals (pascals), and 'ms' is a unit of its own."""
    words = re.findall(r"[A-Za-z]+", given)
    for word in words:
        if word != "ms" and _SYMBOL_WITH_S.fullmatch(word):
            return given.replace(word, word[:-1], 1)
    return ""


def _near(given: str) -> str:
    """The same with other capitals, if that is a unit: kpa, MM."""
    right = {name.lower(): name for name in _CAPITALS}.get(given.lower())
    return f"; did you mean '{right}'?" if right and right != given else ""


def _is_angle(source: Any) -> bool:
    """Whether a quantity contains an angle: pint treats angles as plain numbers, but a friction of "30 deg" is a
    mistake."""
    return any(name == "radian" for name, _ in source.to_root_units().unit_items())


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


def _si(unit: str) -> Any:
    text = _POWER.sub(r"^\1", unit).replace("1/", "dimensionless/")
    return 1.0 * _registry().parse_units(text)


def _kind(source: Any) -> str:
    """The name of the dimension of a pint quantity, in words where it has one here."""
    for unit, name in DIMENSIONS.items():
        known = _si(unit)
        if known.dimensionality == source.dimensionality and _is_angle(known) == _is_angle(source):
            return name
    return f"of dimension {source.dimensionality}"


def _in(unit: str) -> str:
    return f" [{unit}]" if unit else ""


def _example(unit: str) -> str:
    if not unit:
        return "; write a plain number"
    return f'; write {DIMENSIONS[unit]} as a number in {unit}, or as text such as "2 {unit}"'
