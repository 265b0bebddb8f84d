"""Tables of a run's report, from its histories: the balances of energy, volume and momentum; cracks; limits."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from coupler.commands.report.html import note, paragraph, table
from coupler.program.quantities import in_one_unit, percent, power_of, quantity, unit_text
from coupler.results.history import History, read_history

MOST_CRACKS = 25
"""Broken joints that are listed one by one."""
NEGLIGIBLE = 1e-12
"""Share of the largest line of a balance below which a line is round-off and left out."""


def history(run: Path, name: str) -> History | None:
    """A table of the run, None without it or without rows."""
    path = run / "history" / f"{name}.csv"
    if not path.exists():
        return None
    found = read_history(path)
    return found if len(found["time"]) else None


def energy(run: Path) -> str:
    """Energy at the first step and the last, line by line [J]."""
    found = history(run, "energy")
    if found is None:
        return ""
    error = _share(float(found["energy_error"][-1]))
    note_text = f"Energy missing in the balance at the end, share of the energy put in: {error}."
    return _book("energy", found, "J") + note(note_text)


def volume(run: Path) -> str:
    """Volume of the water [m³] with inflow and outflow."""
    found = history(run, "water")
    if found is None:
        return ""
    error = _share(float(found["volume_error"][-1]))
    return _book("volume", found, "m3") + note(f"Volume missing in the balance at the end: {error}.")


def _book(title: str, found: History, unit: str) -> str:
    """Columns of one unit as lines with their first and last value; those that are zero throughout are left out."""
    lines = [c for c in found.columns if c.unit == unit]
    largest = max(np.abs(found[c.name]).max() for c in lines)
    power = power_of(largest, unit)
    rows = [
        [_words(c.name), *(in_one_unit(v, power) for v in _ends(found[c.name], largest)), c.meaning]
        for c in lines
        if np.abs(found[c.name]).max() > NEGLIGIBLE * largest
    ]
    head = [
        f"{title} [{unit_text(unit, power)}]",
        "after the first step",
        "at the end",
        "change",
        "what it is",
    ]
    return table(head, rows, (0, 4))


def _ends(values: np.ndarray, largest: float) -> list[float]:
    """First value, last value and change; 0 for round-off compared with the largest term of the balance."""
    return [_no_noise(v, largest) for v in (values[0], values[-1], values[-1] - values[0])]


def _no_noise(value: float, largest: float) -> float:
    return float(value) if abs(value) > NEGLIGIBLE * largest else 0.0


def momentum(run: Path, name: str) -> str:
    """The balance of momentum at the end: what each line has added, x, y, z; lines of round-off are left out."""
    found = history(run, name)
    if found is None:
        return ""
    ends = [c.name[:-2] for c in found.columns if c.name.endswith("_x")]
    vectors = {end: [float(found[f"{end}_{axis}"][-1]) for axis in "xyz"] for end in ends}
    largest = max((abs(v) for vector in vectors.values() for v in vector), default=0.0)
    if largest == 0.0:
        return ""
    column = {c.name: c for c in found.columns}
    unit = column[f"{ends[0]}_x"].unit
    power = power_of(largest, unit)
    rows = [
        [
            _words(end),
            *(in_one_unit(_no_noise(v, largest), power) for v in vector),
            column[f"{end}_x"].meaning,
        ]
        for end, vector in vectors.items()
        if end == "residual" or max(map(abs, vector)) > NEGLIGIBLE * largest
    ]
    return table([f"{_words(name)} [{unit_text(unit, power)}]", "x", "y", "z", "what it is"], rows, (0, 4))


def cracks(run: Path) -> str:
    """How many joints broke, when, how much they dissipated; the first of them one by one."""
    path = run / "cracks.csv"
    if not path.exists():
        return ""
    found = read_history(path)
    broken = np.flatnonzero(found["intact"] == 0)
    total = len(found["intact"])
    if not len(broken):
        return paragraph(f"None of {total} joints broke; the largest damage is {_largest(found['damage'])}.")
    order = broken[np.argsort(found["time"][broken])]
    note_text = (
        f"{len(broken)} of {total} joints broke, between t = {quantity(found['time'][order[0]], 's')} and "
        f"{quantity(found['time'][order[-1]], 's')}, over {quantity(found['area'][broken].sum(), 'm2')}. They "
        f"dissipated {quantity(found['dissipated'][broken].sum(), 'J')}; all joints together "
        f"{quantity(found['dissipated'].sum(), 'J')}."
    )
    extent = max(np.abs(found[f"centre_{axis}"]).max() for axis in "xyz")
    digits = max(0, 3 - int(np.ceil(np.log10(extent)))) if extent > 0.0 else 0
    rows = [_crack(found, i, digits) for i in order[:MOST_CRACKS]]
    head = [
        "joint",
        "blocks",
        "broke at",
        "area",
        "place",
        "opening",
        "sliding",
        "share of shear",
        "dissipated",
    ]
    left = len(order) - len(rows)
    return paragraph(note_text) + table(head, rows) + note(f"and {left} more in cracks.csv" if left else "")


def _crack(found: History, i: int, digits: int) -> list[str]:
    """A joint; digits: decimals of its place [m], as many as tell one block from the next."""
    other = "ground" if found["b"][i] < 0 else f"{found['b'][i]:.0f}"
    where = (round(float(found[f"centre_{axis}"][i]), digits) + 0.0 for axis in "xyz")
    place = ", ".join(f"{x:.{digits}f}" for x in where)
    return [
        f"{found['joint'][i]:.0f}",
        f"{found['a'][i]:.0f} – {other}",
        *(quantity(float(found[name][i]), unit) for name, unit in (("time", "s"), ("area", "m2"))),
        f"({place}) m",
        *(quantity(float(found[name][i]), "m") for name in ("opening", "sliding")),
        percent(float(found["mode_mix"][i])),
        quantity(float(found["dissipated"][i]), "J"),
    ]


def _largest(values: np.ndarray) -> str:
    return f"{values.max():.3g}" if len(values) else "none"


LITTLE = 1e-4
"""Share of a limit below which the digits of a value are not significant."""
LIMITS = (
    ("volume_error", "largest_volume_error", "volume of water missing in the balance"),
    ("energy_error", "largest_energy_error", "energy missing in the balance, share of the energy put in"),
    (
        "momentum_error",
        "largest_momentum_error",
        "impulse missing in the balance, share of the impulses of a step",
    ),
    ("defect", "largest_defect", "coupling residual of a step"),
)
"""Name in [limits], figure of run.json, what it is."""


def limits(summary: dict) -> str:
    """The largest of each controlled quantity beside the limit that the case sets."""
    wanted, figures = summary["case"].get("limits", {}), summary["figures"]
    rows = [
        [
            what,
            _share(figures[figure]),
            _share(wanted[name]),
            _reached(figures[figure], wanted[name]),
            f"limits.{name}",
        ]
        for name, figure, what in LIMITS
        if name in wanted and figure in figures
    ]
    if wanted.get("cpu_seconds"):
        used, most = summary.get("cpu_seconds", 0.0), wanted["cpu_seconds"]
        rows.append(
            [
                "processor time",
                quantity(used, "s"),
                quantity(most, "s"),
                _reached(used, most),
                "limits.cpu_seconds",
            ]
        )
    return table(["quantity", "largest", "limit", "share of the limit", "key"], rows, (0, 4)) + note(
        "The run stops where a limit is passed; that of the coupling residual applies to the mean over 20 steps, so "
        "that a single step may exceed it."
        if rows
        else ""
    )


def _share(value: float) -> str:
    return f"{100.0 * value:.1e} %" if 0.0 < abs(value) < 1e-5 else percent(value)


def _reached(value: float, limit: float) -> str:
    if 0.0 < value < LITTLE * limit:
        return f"< {100.0 * LITTLE:g} %"
    return f"{100.0 * value / limit:.3g} %" + (" – passed" if value > limit else "")


def _words(name: str) -> str:
    return name.replace("_", " ")
