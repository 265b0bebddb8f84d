"""Figures of the histories of a run for publication: one file per table, one panel per unit, as vectors and pixels."""

import matplotlib.pyplot as plt
import numpy as np

from coupler.commands.view.figure_files import FORMATS, save
from coupler.commands.view.palette import INK, LINES, SOLID
from coupler.results.history import Column, History, by_block, read_history

WIDTH = 6.9  # [inch] two columns of a journal
PANEL, LOW_PANEL = 1.75, 1.05  # [inch] height of a panel, and of one with a pure number
LINES_PER_PANEL = len(LINES)
PLACE = "_centre_"  # in the columns of the place of a block
NEGLIGIBLE = 1e-9  # of the largest change in a table and unit: round-off, not shown
FLAT = (
    1 / 30
)  # of the largest line of a panel: what is smaller would lie on the axis and goes to a panel of its own
LEVEL = 0.01
TALLEST = 8.4  # [inch] of the panels of one figure: with its caption it fits on a page of A4
ROUND_OFF = 1e-12  # pure numbers below this all the time are not shown
QUANTITY = {"J": "energy", "N": "force", "Pa": "pressure", "m3": "volume", "m/s": "speed"}
"""Of a panel whose lines have no word in common."""
UNIT_TEXT = {"1": "–", "m3": "m³", "m2": "m²", "N m": "N·m", "N s": "N·s", "N m s": "N·m·s"}
PREFIXED = ("J", "N", "N m", "N s", "N m s", "Pa", "W", "m", "m/s", "s")
PREFIXES = {-2: "µ", -1: "m", 0: "", 1: "k", 2: "M", 3: "G", 4: "T"}
SINCE_START = (
    "energy",
)  # tables whose columns count from an arbitrary zero: shown as change since the start
STYLE = {
    "font.family": "DejaVu Sans", "font.size": 8, "axes.labelsize": 8, "legend.fontsize": 7, "axes.linewidth": 0.6,
    "axes.edgecolor": INK, "axes.spines.top": False, "axes.spines.right": False, "lines.linewidth": 1.1,
    "xtick.direction": "in", "ytick.direction": "in", "axes.grid": True, "grid.color": "#dddddd", "grid.linewidth": 0.4,
    "legend.frameon": False, "svg.hashsalt": "surgebreak", "savefig.dpi": 300, "figure.constrained_layout.use": True,
    "axes.prop_cycle": plt.cycler(color=LINES), "axes.formatter.useoffset": False,
}  # fmt: skip


def plots(directory, folder, endings=FORMATS):
    """Write the figures of all tables in `directory`/history, but for those of more blocks than a panel has lines;
    return their paths with the first of the endings."""
    written = []
    for table in sorted((directory / "history").glob("*.csv")):
        history = read_history(table)
        blocks = by_block(history)
        if blocks is not None and len(blocks.names) > LINES_PER_PANEL:
            continue
        if blocks is None:
            panels = by_component(history) if is_loads(history) else grouped(history)
        else:
            history, panels = of_each_block(history, blocks)
        if panels and len(history["time"]) > 1:
            written += [
                figure(history, some, folder / (table.stem if leaf == 1 else f"{table.stem}_{leaf}"), endings)
                for leaf, some in enumerate(leaves(panels), start=1)
            ]
    return written


def of_each_block(history, blocks):
    """A table with a column for each block, and its panels: one for each column that is more than round-off."""
    columns, values, panels, largest = [Column("time", "s", "time")], {"time": blocks.times}, [], {}
    shown = [c for c in history.columns if c.name in blocks.values]
    for column in shown:
        size = np.nanmax(np.abs(blocks.values[column.name]), initial=0.0)
        largest[column.unit] = max(largest.get(column.unit, 0.0), size)
    for column in shown:
        names = [f"{column.name}_{name}" for name in blocks.names]
        columns += [Column(name, column.unit, column.meaning) for name in names]
        values |= dict(zip(names, blocks.values[column.name].T))
        if np.nanmax(np.abs(blocks.values[column.name]), initial=0.0) > NEGLIGIBLE * largest[column.unit]:
            panels.append((column.unit, names))
    return History(history.title, tuple(columns), values), panels


def leaves(panels):
    """Panels divided into lists, each of which fits on a page."""
    found, room = [[]], TALLEST
    for unit, names in panels:
        height = LOW_PANEL if unit == "1" else PANEL
        if found[-1] and height > room:
            found.append([])
            room = TALLEST
        found[-1].append((unit, names))
        room -= height
    return found


LOADS, TOTAL, PARTS = "loads_", "total", ("pressure", "friction", "contact", "joint", "weight")
"""Tables of loads by their origin begin so; their columns PART_force_x, ... are of these parts and of their sum."""


def is_loads(history):
    """Whether a table has the loads on a group by their origin."""
    return history.title.startswith(LOADS) and f"{TOTAL}_force_x" in history.values


def by_component(history):
    """Panels [(unit, [column names])] of a table of loads: each component of forces, moments, impulses, ... with its
    parts beside one another, their sum last; without parts and components that are round-off."""
    largest, found = {}, {}
    for column in history.columns:
        if column.name != "time" and column.unit:
            size = np.nanmax(np.abs(history[column.name]), initial=0.0)
            largest[column.unit] = max(largest.get(column.unit, 0.0), size)
            found.setdefault((column.unit, _component(column.name)), {})[column.name] = size
    panels = [
        (unit, [name for name, size in sizes.items() if size > NEGLIGIBLE * largest[unit]])
        for (unit, _), sizes in found.items()
    ]
    return [(unit, names) for unit, names in panels if names]


def _component(name):
    """force_x of contact_force_x."""
    return name.partition("_")[2]


def grouped(history):
    """Panels [(unit, [column names])] of the numbers that are more than round-off, by unit and size, none too full.

    Components of a vector stay together. Pure numbers get a panel each: a count and a share have no scale in common.
    Places of blocks are apart from depths, which are flat lines beside the length of a tank.
    """
    sizes = {}
    for column in history.columns:
        if column.name != "time" and column.unit:
            size = np.nanmax(np.abs(changed(history, column.name)), initial=0.0)
            sizes.setdefault((column.unit, PLACE in column.name), {})[column.name] = size
    return [(unit, names) for (unit, _), named in sizes.items() for names in _panels(named, unit)]


def _panels(sizes, unit):
    """Lists of the columns whose largest number counts beside that of the others in the unit; pure numbers all do."""
    least = ROUND_OFF if unit == "1" else NEGLIGIBLE * max(sizes.values())
    shown = {name: size for name, size in sizes.items() if size > least}
    if unit == "1":
        return [[name] for name in shown]
    return [panel for alike in _alike(_vectors(shown)) for panel in _not_too_full(alike)]


def _vectors(sizes):
    """Columns with their sizes as {what they are components of: {name: size}}; a number alone is its own."""
    found = {}
    for name, size in sizes.items():
        found.setdefault(name[:-2] if name[-2:] in ("_x", "_y", "_z") else name, {})[name] = size
    return found


def _alike(vectors):
    """Lists of vectors of like size, the largest first: [[{name: size}]]."""
    left, found = list(vectors.values()), []
    while left:
        least = FLAT * max(max(vector.values()) for vector in left)
        found.append([vector for vector in left if max(vector.values()) >= least])
        left = [vector for vector in left if max(vector.values()) < least]
    return found


def _not_too_full(vectors):
    """Lists of names, each of whole vectors, as many as one panel can show."""
    found = [[]]
    for vector in vectors:
        if found[-1] and len(found[-1]) + len(vector) > LINES_PER_PANEL:
            found.append([])
        found[-1] += vector
    return found


def changed(history, name):
    """Values of a column; for tables of energies less the first, since their zero is arbitrary."""
    unit = {c.name: c.unit for c in history.columns}[name]
    values = history[name]
    return values - values[0] if history.title in SINCE_START and unit == "J" and len(values) else values


def figure(history, panels, stem, endings=FORMATS):
    """One figure, a panel under the other over the same time axis; its path with the first of the endings."""
    with plt.rc_context(STYLE):
        height = [LOW_PANEL if unit == "1" else PANEL for unit, _ in panels]
        drawing, axes = plt.subplots(
            len(panels), sharex=True, squeeze=False, figsize=(WIDTH, 0.35 + sum(height)), height_ratios=height
        )
        drawing.align_ylabels(axes[:, 0])
        for axis, (unit, names) in zip(axes[:, 0], panels):
            panel(axis, history, unit, names)
        axes[-1, 0].set_xlabel("time [s]")
        drawing.get_layout_engine().execute(drawing)  # once, and not again for every format
        drawing.set_layout_engine("none")
        save(drawing, stem, endings)
    return stem.with_suffix(f".{endings[0]}")


def panel(axis, history, unit, names):
    """The named columns of one unit over time, with a prefix that keeps the numbers short."""
    values = {name: changed(history, name) for name in names}
    power, text = prefixed(unit, max(np.nanmax(np.abs(v), initial=0.0) for v in values.values()))
    for name, value in values.items():
        axis.plot(history["time"], value / 1000.0**power, **_look(history, name))
    axis.set_ylabel(f"{_words(history, unit, names)} [{text}]".strip())
    axis.margins(x=0)
    _keep_flat(axis)
    if len(names) > 1 or is_loads(history):
        axis.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)


def _look(history, name):
    """Label and colour of a line. The sum of loads lies broad and grey beneath its parts, so that it is seen where one
    part is all there is."""
    if not is_loads(history):
        return {"label": name.replace("_", " ")}
    part = name.partition("_")[0]
    if part == TOTAL:
        return {"label": part, "color": SOLID, "linewidth": 3.0, "zorder": 1.9}
    return {"label": part, "color": LINES[PARTS.index(part)]}


def _words(history, unit, names):
    """What the axis of a panel measures."""
    if is_loads(history):
        return _component(names[0]).replace("_", " ")
    if len(names) > 1 and history.title in SINCE_START and unit == "J":
        return "change since start"
    return common(names) or QUANTITY.get(unit, "")


def common(names):
    """The words that all names of lines have in common, without x, y and z where there are several."""
    words = [name.split("_") for name in names]
    if len(words) == 1:
        return " ".join(words[0])
    return " ".join(
        word for word in words[0] if word not in ("x", "y", "z") and all(word in other for other in words)
    )


def _keep_flat(axis):
    """Show a line that varies by less than LEVEL of its value as level; its last digits would look like a swing."""
    values = np.concatenate([line.get_ydata() for line in axis.lines])
    low, high = np.nanmin(values), np.nanmax(values)
    room = LEVEL * max(abs(low), abs(high))
    if high - low < room:
        axis.set_ylim((low + high) / 2 - room, (low + high) / 2 + room)


def prefixed(unit, largest):
    """Power of 1000 and the unit with its prefix, so that the largest number is between 1 and 1000."""
    if unit not in PREFIXED or largest <= 0:
        return 0, UNIT_TEXT.get(unit, unit)
    power = int(np.clip(np.floor(np.log10(largest) / 3), -2, 4))
    return power, PREFIXES[power] + UNIT_TEXT.get(unit, unit)
