"""python -m coupler.commands.view.comparison DIRECTORY: the figure of a comparison of laws, from its files alone.

Load over opening, energies over opening, broken joints over time, cost of a substep, error against run time.
"""

import csv
import json
import sys
from pathlib import Path

from matplotlib.ticker import LogLocator, NullFormatter

from coupler.commands.view.figure_files import save
from coupler.commands.view.palette import LINES
from coupler.commands.view.plots import STYLE, plt, prefixed
from coupler.commands.view.study import MARKS, share

SIZE = (6.9, 7.2)
"""[inch] two columns of a journal."""
OURS = ("-", (0, (7, 1)), (0, (5, 1, 1, 1)))
DASH = 3.0
"""Length of a dash of a law of YADE [line widths]: those that coincide fill each other's gaps, so that all are seen."""


def draw(folder):
    """comparison.png, .pdf and .svg in the directory; returns the path of the PNG."""
    about = json.loads((folder / "comparison.json").read_text(encoding="utf-8"))
    first = min(row["multiple"] for row in about["laws"])
    laws = [row for row in about["laws"] if row["multiple"] == first]
    look = looks(laws)
    tables = {row["law"]: read(folder / f"{row['files']}.csv") for row in laws}
    with plt.rc_context(STYLE):
        drawing, axes = plt.subplots(3, 2, figsize=SIZE)
        load(axes[0, 0], tables, look)
        energy(axes[0, 1], tables, look, "dissipated", "taken by the joints")
        energy(axes[1, 0], tables, look, "stored", "stored")
        broken(axes[1, 1], tables, look)
        cost(axes[2, 0], laws, look)
        accuracy(axes[2, 1], about, look)
        handles = [plt.Line2D([], [], label=name, **style) for name, style in look.items()]
        drawing.legend(handles=handles, loc="outside upper center", ncols=min(4, len(handles)))
        save(drawing, folder / "comparison")
    return folder / "comparison.png"


def looks(laws):
    """Colour and line style of each law: ours nearly solid, those of YADE in short staggered dashes."""
    ours, stock = ([row["law"] for row in laws if row["stock"] is kind] for kind in (False, True))
    lines = {law: OURS[k % len(OURS)] for k, law in enumerate(ours)}
    gap = DASH * max(len(stock) - 1, 1)
    lines |= {law: (DASH * k, (DASH, gap)) for k, law in enumerate(stock)}
    return {
        row["law"]: {"color": LINES[k % len(LINES)], "linestyle": lines[row["law"]]}
        for k, row in enumerate(laws)
    }


def read(path):
    """Columns of a table by name."""
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {name: [float(row[name]) for row in rows] for name in rows[0]}


def along(tables):
    """Abscissa of the curves: the displacement where a block is driven, else time; its scale and label."""
    moved = max(table["displacement"][-1] for table in tables.values())
    column = "displacement" if moved > 0.0 else "time"
    power, unit = prefixed("m" if moved > 0.0 else "s", moved or max(t["time"][-1] for t in tables.values()))
    return column, 1000.0**power, f"{column} [{unit}]"


def curves(axis, tables, look, column, unit):
    """Draw a column of each law over the displacement; return the prefixed unit."""
    over, scale, label = along(tables)
    largest = max(abs(value) for table in tables.values() for value in table[column])
    power, text = prefixed(unit, largest)
    for name, table in tables.items():
        axis.plot([x / scale for x in table[over]], [y / 1000.0**power for y in table[column]], **look[name])
    axis.set_xlabel(label)
    axis.margins(x=0)
    return text


def load(axis, tables, look):
    """Force over time, a curve a run; tables: columns by name of each run, look: line of each."""
    axis.set_ylabel(f"force [{curves(axis, tables, look, 'force', 'N')}]")


def energy(axis, tables, look, column, what):
    """Draw an energy [J] over time, with a suitable unit prefix."""
    axis.set_ylabel(f"energy {what} [{curves(axis, tables, look, column, 'J')}]")


def broken(axis, tables, look):
    """Joints broken so far over time."""
    for name, table in tables.items():
        axis.step(table["time"], table["joints_broken"], where="post", **look[name])
    axis.set_xlabel("time [s]")
    axis.set_ylabel("joints broken")
    axis.yaxis.get_major_locator().set_params(integer=True)
    axis.margins(x=0)


def cost(axis, laws, look):
    """CPU time per substep and joint, one bar for each law."""
    names = [row["law"] for row in laws]
    axis.barh(names, [row["us_per_joint_substep"] for row in laws], color=[look[n]["color"] for n in names])
    axis.invert_yaxis()
    axis.grid(axis="y", visible=False)
    axis.set_xlabel("CPU time of a substep per joint [µs]")


def accuracy(axis, about, look):
    """Largest error against CPU time, one point for each substep."""
    for name, style in look.items():
        runs = sorted((r for r in about["laws"] if r["law"] == name), key=lambda r: r["cpu_seconds"])
        points = [(r["cpu_seconds"], r["largest_error"]) for r in runs if r["largest_error"]]
        if points:
            axis.plot(
                *zip(*points), marker=MARKS[list(look).index(name) % len(MARKS)], markersize=3.5, **style
            )
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_xlabel("CPU time of the run [s]")
    axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    axis.xaxis.set_major_formatter(plt.FuncFormatter(lambda value, _: f"{value:g}"))
    axis.xaxis.set_minor_formatter(NullFormatter())
    axis.yaxis.set_major_formatter(plt.FuncFormatter(lambda value, _: share(value)))
    axis.set_ylabel("error against " + ("the exact answer" if about["exact"] else about["reference"]))


if __name__ == "__main__":
    print(f"figure: {draw(Path(sys.argv[1]))}")
