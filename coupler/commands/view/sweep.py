"""python -m coupler.commands.view.sweep DIRECTORY: figures of a sweep, from its files alone.

fragility_NAME    probability of each state over the intensity, bands, shares of the runs with their intervals
convergence_NAME  width of the band of the median over the number of runs
sensitivity       indices or rank correlations with their intervals
results           every quantity over everything that was varied
"""

import json
import re
import sys
import textwrap
from pathlib import Path

import numpy as np

from coupler.commands.view.figure_files import save
from coupler.commands.view.palette import INK, LINES, SOLID
from coupler.commands.view.plots import STYLE, UNIT_TEXT, plt
from coupler.results.history import read_history

SIZE = (3.4, 2.6)
"""[inch] one column of a journal."""
PANEL = (1.9, 1.5)
MOST = 4
"""Panels beside and below one another in the figure of the results."""
MARKS = "osD^vP*X"
DASHES = ("-", (0, (5, 1.2)), (0, (1.2, 1)), "-.", (0, (3, 1, 1, 1, 1, 1)))
OWN = (
    "run",
    "point",
    "sample",
    "repeat",
    "outcome",
    "reason",
    "cpu_seconds",
    "wall_seconds",
    "memory",
    "attempts",
    "id",
)
DONE = ("done", "cannot stand")
PREFIXES = {0: "", 1: "k", 2: "M", 3: "G", -1: "m", -2: "µ"}
PREFIXED = ("Pa", "N", "J", "m", "s", "N/m")


def draw(folder):
    """Write all figures; their PNG paths."""
    written = []
    with plt.rc_context(STYLE):
        for f in _read(folder / "fragility.json"):
            if f["runs"]:
                written.append(fragility(folder, f))
            if len(f["convergence"]) > 1:
                written.append(convergence(folder, f))
        found = [s for s in _read(folder / "sensitivity.json") if s["rows"]]
        if found:
            written.append(sensitivity(folder, found))
        made = results(folder)
    return written + ([made] if made else [])


def _read(path):
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else []


def _save(drawing, folder, stem):
    save(drawing, folder / stem)
    return folder / f"{stem}.png"


def fragility(folder, f):
    """Curves with bands; bars for the runs, those of different states side by side; known curves dashed."""
    drawing, axis = plt.subplots(figsize=SIZE)
    what = {s["name"]: s["what"] for s in f["states"]}
    power = _power([bar["x"] for bars in f["bars"] for bar in bars], f["measure"]["unit"])
    size = 1000.0**power
    levels = np.array([bar["x"] for bar in f["bars"][0]]) / size
    apart = 0.012 * (np.ptp(levels) or levels.max())
    for k, (state, bars) in enumerate(zip(f["states"], f["bars"])):
        shift = (k - 0.5 * (len(f["bars"]) - 1)) * apart
        axis.errorbar(
            levels + shift,
            [b["count"] / b["runs"] for b in bars],
            yerr=np.array([[b["count"] / b["runs"] - b["low"], b["high"] - b["count"] / b["runs"]] for b in bars]).T,
            fmt=MARKS[k % len(MARKS)], ms=2.6, lw=0.6, color=LINES[k % len(LINES)],
            label=what[state["name"]] if not f["curves"] else None, zorder=4,
        )  # fmt: skip
    for k, curve in enumerate(f["curves"]):
        number = [s["name"] for s in f["states"]].index(curve["state"])
        colour, x = LINES[number % len(LINES)], np.array(curve["x"]) / size
        axis.plot(
            x, curve["p"], color=colour, ls=DASHES[k % len(DASHES)], label=what[curve["state"]], zorder=3
        )
        if curve["low"] is not None:
            axis.fill_between(x, curve["low"], curve["high"], color=colour, alpha=0.18, lw=0, zorder=2)
    for known in f["exact"]:
        axis.plot(
            np.array(known["x"]) / size,
            known["p"],
            color=INK,
            ls="--",
            lw=0.9,
            label=f"{what[known['state']]}, known",
            zorder=5,
        )
    axis.set_ylim(-0.02, 1.02)
    axis.set_xlim(levels.min() - 0.06 * (np.ptp(levels) or 1), levels.max() + 0.06 * (np.ptp(levels) or 1))
    axis.set_xlabel(_axis(f["measure"]["what"], f["measure"]["unit"], power))
    axis.set_ylabel("probability")
    drawing.legend(loc="outside upper center", ncols=2)
    return _save(drawing, folder, f"fragility_{f['name']}")


def convergence(folder, f):
    """Width of the band of the median in per cent of it; a thin line of the slope that it should have."""
    drawing, axis = plt.subplots(figsize=(SIZE[0], 2.1))
    n = np.array([row["runs"] for row in f["convergence"]], float)
    width, least, most = (
        100 * np.array([row[k] for row in f["convergence"]]) for k in ("width", "least", "most")
    )
    axis.errorbar(
        n, width, yerr=[width - least, most - width], fmt="o-", ms=3, lw=1.0, elinewidth=0.6, color=LINES[0]
    )
    axis.plot(n, width[-1] * np.sqrt(n[-1] / n), color=SOLID, ls=":", lw=0.9, label="∝ 1/√(runs)")
    axis.set_xscale("log")
    axis.set_yscale("log")
    for a, values in ((axis.xaxis, n), (axis.yaxis, np.append(width, [least.min(), most.max()]))):
        a.set_major_formatter(plt.FuncFormatter(lambda value, _: f"{value:g}"))
        few = values.max() < 30 * values.min()
        a.set_minor_formatter(plt.FuncFormatter(_few if few else lambda value, _: ""))
    axis.set_xlabel("runs")
    axis.set_ylabel(f"width of the {f['confidence']:.0%} band\nof the median [%]")
    axis.legend()
    return _save(drawing, folder, f"convergence_{f['name']}")


def _few(value, _):
    first = value / 10.0 ** np.floor(np.log10(value))
    return f"{value:g}" if any(abs(first - k) < 1e-6 for k in (2, 5)) else ""


def sensitivity(folder, found):
    """A group of bars for each quantity."""
    sobol = "total" in found[0]["rows"][0]
    names = [row["name"] for row in found[0]["rows"]]
    height = 0.6 + 0.28 * len(names) * len(found)
    drawing, axes = plt.subplots(
        len(found), 1, figsize=(SIZE[0], max(height, 1.4)), sharex=True, squeeze=False
    )
    for axis, s in zip(axes[:, 0], found):
        y = np.arange(len(names), dtype=float)[::-1]
        kinds = (("value", "low", "high", "first order"), ("total", "total_low", "total_high", "total"))
        for k, (value, low, high, label) in enumerate(kinds if sobol else kinds[:1]):
            v, a, b = (np.array([row[n] for row in s["rows"]]) for n in (value, low, high))
            place = y + (0.2 - 0.4 * k if sobol else 0.0)
            axis.barh(
                place,
                v,
                height=0.36 if sobol else 0.6,
                color=LINES[k],
                alpha=0.75,
                label=label if sobol else None,
            )
            axis.errorbar(
                v,
                place,
                xerr=[np.maximum(v - a, 0), np.maximum(b - v, 0)],
                fmt="none",
                ecolor=INK,
                elinewidth=0.8,
                capsize=2,
            )
        axis.set_yticks(y, [name.replace("_", " ") for name in names])
        axis.axvline(0.0, color=INK, lw=0.6)
        axis.grid(axis="y", visible=False)
        axis.set_title(s["quantity"].replace("_", " "), fontsize=8, loc="left")
    axes[-1, 0].set_xlabel("share of the variance (Sobol index)" if sobol else "partial rank correlation")
    axes[-1, 0].set_xlim((min(0.0, axes[-1, 0].get_xlim()[0]), 1.0) if sobol else (-1.05, 1.05))
    if sobol:
        drawing.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return _save(drawing, folder, "sensitivity")


def results(folder):
    """Panels of quantities (down) over what was varied (across); None without numbers for either."""
    stored = json.loads((folder / "sweep.json").read_text(encoding="utf-8"))
    table = read_history(folder / "table.csv")
    units = {c.name: c.unit for c in table.columns}
    meaning = {c.name: c.meaning.partition(": sets")[0].removesuffix(" (free field)") for c in table.columns}
    varied = [
        c["name"] for c in stored["columns"] if units[c["name"]] and np.ptp(_finite(table, c["name"])) > 0
    ][:MOST]
    first = len(stored["columns"]) + len(stored["sweep"]["seeds"]) + 4
    names = [c.name for c in table.columns[first:] if c.name not in OWN and c.unit]
    names = [n for n in names if len(_finite(table, n)) and np.ptp(_finite(table, n)) > 0][:MOST]
    if not varied or not names:
        return None
    shape = (len(names), len(varied))
    size = (0.7 + PANEL[0] * shape[1], 0.5 + PANEL[1] * shape[0])
    drawing, axes = plt.subplots(*shape, figsize=size, squeeze=False, sharex="col", sharey="row")
    failed = ~np.isin(table["outcome"], DONE)
    for row, name in enumerate(names):
        for column, key in enumerate(varied):
            _cloud(axes[row, column], table, key, name, units, failed)
    for column, key in enumerate(varied):
        axes[-1, column].set_xlabel(_axis(meaning[key], units[key], _power(table[key], units[key]), 26))
    for row, name in enumerate(names):
        axes[row, 0].set_ylabel(_axis(meaning[name], units[name], _power(table[name], units[name]), 20))
    drawing.align_ylabels()
    _explain_marks(drawing, table, names, failed)
    return _save(drawing, folder, "results")


def _explain_marks(drawing, table, names, failed):
    """A legend of the marks beside the points of runs that are done, where there are any."""
    without = np.any([~np.isfinite(table[name]) for name in names], axis=0) & (table["outcome"] != "not yet")
    without &= ~failed
    why = "cannot stand" if (table["outcome"][without] == "cannot stand").all() else "no number"
    kinds = ((without, "^", LINES[2], why), (failed, "x", LINES[1], "failed"))
    marks = [
        plt.Line2D([], [], marker=mark, ls="", ms=4, mew=0.6, color=colour, label=label)
        for own, mark, colour, label in kinds
        if own.any()
    ]
    if marks:
        drawing.legend(handles=marks, loc="outside upper right", ncols=2)


def _finite(table, name):
    values = table[name]
    return values[np.isfinite(values)] if values.dtype.kind == "f" else np.zeros(0)


def _cloud(axis, table, key, name, units, failed):
    x = table[key] / 1000.0 ** _power(table[key], units[key])
    y = table[name] / 1000.0 ** _power(table[name], units[name])
    axis.plot(x[~failed], y[~failed], "o", ms=2.2, mew=0, alpha=0.6, color=LINES[0])
    axis.plot(x[failed], y[failed], "x", ms=3, color=LINES[1])
    without = ~np.isfinite(y) & (table["outcome"] != "not yet")  # on the upper edge: no number, but a place
    for own, mark, colour in ((without & ~failed, "^", LINES[2]), (without & failed, "x", LINES[1])):
        if own.any():
            edge = axis.get_xaxis_transform()
            found = axis.plot(x[own], np.ones(own.sum()), mark, ms=2.4, mew=0.6, color=colour, transform=edge)
            found[0].set_clip_on(False)
            found[0].set_in_layout(False)


def _power(values, unit):
    """Power of 1000 that keeps the largest of the values short."""
    largest = np.nanmax(np.abs(np.asarray(values, float)), initial=0.0)
    if unit not in PREFIXED or largest == 0.0:
        return 0
    return int(
        np.clip(np.floor(np.log10(largest) / 3.0 + 1e-9), min(PREFIXES), 0 if unit == "s" else max(PREFIXES))
    )


def _axis(what, unit, power, letters=42):
    """An axis label with its unit, broken into lines of at most `letters` letters."""
    text = UNIT_TEXT.get(unit, re.sub(r"(?<=[a-zA-Z])([23])", lambda found: "²³"[int(found[1]) - 2], unit))
    stored = f"{what} [{PREFIXES[power]}{text}]" if unit not in ("", "1") else what
    return "\n".join(textwrap.wrap(stored, letters))


if __name__ == "__main__":
    for path in draw(Path(sys.argv[1])):
        print(f"figure: {path}")
