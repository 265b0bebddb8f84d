"""Numbers with their units for people: four digits, and a prefix that keeps them short."""

from __future__ import annotations

PREFIXES = {-3: "n", -2: "µ", -1: "m", 0: "", 1: "k", 2: "M", 3: "G", 4: "T"}
PREFIXED = ("J", "N", "N m", "N s", "N m s", "Pa", "W", "s", "m", "m/s", "B")
UNIT_TEXT = {"1": "", "m2": "m²", "m3": "m³", "m/s2": "m/s²", "kg/m3": "kg/m³"}


def quantity(value: float | None, unit: str) -> str:
    """A number with its unit and a prefix that keeps it short: 1.23 kN; a dash for none."""
    if value is None or value != value:
        return "–"
    power = power_of(value, unit)
    digits = f"{_digits(value / 1000.0**power)}"
    return f"{digits} {unit_text(unit, power)}".strip()


def in_one_unit(value: float, power: int) -> str:
    """A number of a balance whose lines all have the unit with this power of 1000, so that they can be compared."""
    return _digits(value / 1000.0**power)


def unit_text(unit: str, power: int) -> str:
    """The unit with the prefix of a power of 1000."""
    return f"{PREFIXES[power]}{UNIT_TEXT.get(unit, unit)}"


def power_of(value: float, unit: str) -> int:
    """Power of 1000 that keeps a number of this unit short."""
    power = _power(abs(value)) if unit in PREFIXED else 0
    return min(power, 0) if unit == "s" else power


def _digits(value: float, count: int = 4) -> str:
    """So many digits; of numbers below 1e9 all whole ones, without a power of ten, also where rounding adds one."""
    return f"{value:.0f}" if 10.0**count - 0.5 <= abs(value) < 1e9 else f"{value:.{count}g}"


def _power(size: float) -> int:
    """Of 1000, so that 1 ≤ size / 1000^power < 1000 where a prefix allows it."""
    power = 0
    while power < max(PREFIXES) and size >= 1000.0 ** (power + 1):
        power += 1
    while power > min(PREFIXES) and 0.0 < size < 1000.0**power:
        power -= 1
    return power


def percent(value: float | None) -> str:
    """A share; a dash for none."""
    return "–" if value is None else f"{_digits(100.0 * value, 3)} %"


def counted(number: int, noun: str) -> str:
    """1 block, 2 blocks: a number of things, noun: one of them."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def signed_percent(value: float) -> str:
    """A share with its sign in hundredths of a percent, +0.02%; none is +0.00% from either side."""
    return f"{round(value, 4) + 0.0:+.2%}"


def moment_of(seconds: float | None) -> str:
    """A time of a run [s] as people say it: 0.568 s rather than 568 ms, so that times of one list compare at sight."""
    if seconds is None or not seconds >= 0.01:
        return quantity(seconds, "s")
    return f"{_digits(seconds)} s"


def length(metres: float | None) -> str:
    """A length [m] in m from a decimetre up, below it in mm."""
    if metres is None or not metres >= 0.1:
        return quantity(metres, "m")
    return f"{_digits(metres, 3)} m"


def as_said(value: float | None, unit: str) -> str:
    """A number with its unit as people say it beside others of its kind: lengths in m and times in s from where these
    have digits, everything else with a prefix."""
    if unit == "m":
        return length(value)
    return moment_of(value) if unit == "s" else quantity(value, unit)
