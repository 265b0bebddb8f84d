"""python -m coupler.commands.view.over_one_another DIRECTORY: histories of several runs over one another, a panel for
each quantity, from the diff.json of `surgebreak diff`."""

import json
import sys
from itertools import cycle
from pathlib import Path

import numpy as np

from coupler.commands.view.figure_files import save
from coupler.commands.view.palette import LINES
from coupler.commands.view.plots import PANEL, STYLE, TALLEST, WIDTH, plt, prefixed
from coupler.commands.view.study import DASHES
from coupler.results.history import read_history

STEM = "curves"
LONG = 20
"""Letters of a name beyond which its unit stands in a line of its own."""


def draw(folder):
    """curves.png, .pdf and .svg, curves_2.* and so on where one page is too short; paths of the PNG files."""
    content = json.loads((folder / "diff.json").read_text(encoding="utf-8"))
    each = int(TALLEST // PANEL)
    pages = [content["curves"][k : k + each] for k in range(0, len(content["curves"]), each)]
    return [
        figure(content["runs"], names, folder / (STEM if number == 1 else f"{STEM}_{number}"))
        for number, names in enumerate(pages, start=1)
    ]


def figure(runs, names, stem):
    """The panels of one page, over the same time axis."""
    with plt.rc_context(STYLE):
        drawing, axes = plt.subplots(
            len(names), sharex=True, squeeze=False, figsize=(WIDTH, 0.6 + PANEL * len(names))
        )
        drawing.align_ylabels(axes[:, 0])
        for axis, name in zip(axes[:, 0], names):
            panel(axis, runs, name)
        lines, labels = axes[0, 0].get_legend_handles_labels()
        drawing.legend(lines, labels, loc="outside upper left", ncols=min(3, len(labels)))
        axes[-1, 0].set_xlabel("time [s]")
        save(drawing, stem)
    return stem.with_suffix(".png")


def panel(axis, runs, name):
    """One column of a history, a line for each run; a run without it has none."""
    table, column = name.split(".", 1)
    curves = {
        f"{run['label']}  {Path(run['path']).name}": values(Path(run["path"]), table, column) for run in runs
    }
    sizes = [np.nanmax(np.abs(v), initial=0.0) for _, v, _ in filter(None, curves.values())]
    unit = next(unit for _, _, unit in filter(None, curves.values()))
    power, shown = prefixed(unit, max(sizes))
    for (label, curve), colour, dashes in zip(curves.items(), cycle(LINES), cycle(DASHES)):
        time, heights, _ = curve or ([], np.zeros(0), unit)
        axis.plot(time, heights / 1000.0**power, color=colour, linestyle=dashes, label=label)
    words = column.replace("_", " ")
    axis.set_ylabel(f"{words}{chr(10) if len(words) > LONG else ' '}[{shown}]")
    axis.margins(x=0)


def values(run, table, column):
    """Times (n,) [s], values (n,) and unit of a column; None where the run does not have it."""
    path = run / "history" / f"{table}.csv"
    if not path.is_file():
        return None
    history = read_history(path)
    units = {c.name: c.unit for c in history.columns}
    return (history["time"], history[column], units[column]) if column in units else None


if __name__ == "__main__":
    for written in draw(Path(sys.argv[1])):
        print(written)
