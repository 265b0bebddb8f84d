"""python -m coupler.commands.view.curves FOLDER FILE...: figures of computed curves over measured ones.

Each line of a file is one figure (coupler/commands/verify/curves.py): panels of curves of the kinds computed, other,
measured, band and exact. Writes FOLDER/NAME.png, .pdf and .svg.
"""

import json
import sys
from pathlib import Path

import numpy as np
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter

from coupler.commands.view.figure_files import FORMATS, save
from coupler.commands.view.palette import INK, LINES
from coupler.commands.view.plots import STYLE, WIDTH, plt

PANEL_HEIGHT, SINGLE = 2.1, 2.9
"""Height [inch] of a panel among others, and of one alone."""
MARKERS = "osv^D"
"""Markers of the measured points, in order."""
MOST_POINTS = 60
"""Measured points drawn one by one; a denser record is a line."""
FEW = 8
"""Computed values of a line up to which each is marked."""
BAND = "#d9d9d9"
OWN = LINES
"""Colours of the computed curves, in order."""
DASHES = ("-", (0, (6, 1.2)), (0, (1.5, 0.9)), (0, (6, 1.2, 1.5, 1.2)))
"""Line styles of the computed curves, which distinguish them in grey print."""
EXACT = ("--", (0, (1, 1.5)), "-.")
"""Style of the exact curves."""
LEGEND_ROW = 0.16
"""[inch] of a row of the legend above the panels."""


def draw(figure, folder, endings=FORMATS):
    """Draw one figure (the parsed JSON of it); its path with the last of the endings."""
    panels, columns = figure["panels"], figure.get("columns", 1)
    rows = -(-len(panels) // columns)
    height = SINGLE if len(panels) == 1 else PANEL_HEIGHT * rows
    shared = len(panels) > 1 and len({_named(panel) for panel in panels}) == 1
    with plt.rc_context(STYLE):
        drawing, axes = plt.subplots(rows, columns, squeeze=False, figsize=(WIDTH, 0.45 + height))
        for axis, panel in zip(axes.ravel(), panels):
            draw_panel(axis, panel, legend_columns=0 if shared else 3 if columns == 1 else 2)
        for axis in axes.ravel()[len(panels) :]:
            axis.set_axis_off()
        if shared:
            handles, names = axes[0, 0].get_legend_handles_labels()
            drawing.legend(handles, names, loc="outside upper left", ncols=min(4, len(names)))
            drawing.set_figheight(drawing.get_figheight() - LEGEND_ROW * (rows - 1))
        _label_axes_once(axes, panels, columns)
        stem = Path(folder) / figure["name"]
        save(drawing, stem, endings)
    return stem.with_suffix(f".{endings[-1]}")


def _named(panel):
    """What its legend says."""
    return tuple((curve["kind"], curve["label"]) for curve in panel["curves"] if curve["label"])


def _label_axes_once(axes, panels, columns):
    """The name of an axis that all panels of a column share stands below the last one only."""
    for column in range(columns):
        same = panels[column::columns]
        if len({(panel["x_label"], tuple(panel.get("x_range") or ())) for panel in same}) == 1:
            for row in range(len(same) - 1):
                axes[row, column].set_xlabel("")


def draw_panel(axis, panel, legend_columns):
    """All curves of a panel, measured ones below the computed ones, with axes; the legend stands above, on no curve
    (none with 0 columns)."""
    if "x" in panel.get("log", ""):
        axis.set_xscale("log")
    if "y" in panel.get("log", ""):
        axis.set_yscale("log")
    _plain_numbers(axis, panel.get("log", ""))
    if "x" in panel.get("log", ""):
        _ticks_of_a_ladder(axis, panel["curves"])
    seen = dict.fromkeys(("computed", "measured", "exact"), 0)
    for curve in panel["curves"]:
        style = look(curve, seen)
        x, y = np.array(curve["x"], float), np.array(curve["y"], float)
        if curve["kind"] == "band":
            axis.fill_between(x, y, np.array(curve["upper"], float), **style)
        else:
            axis.plot(x, y, **style)
    axis.set_xlabel(panel["x_label"])
    axis.set_ylabel(panel["y_label"])
    axis.margins(x=0.06 if "x" in panel.get("log", "") else 0)
    if panel.get("x_range"):
        axis.set_xlim(panel["x_range"])
    if panel.get("y_range"):
        axis.set_ylim(panel["y_range"])
    elif all(np.ptp(curve["y"]) == 0.0 for curve in panel["curves"]):
        axis.set_ylim(-0.05, 1.0)
    if not legend_columns:
        return
    axis.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=legend_columns,
        borderaxespad=0.2,
        columnspacing=1.2,
    )


def _plain_numbers(axis, log):
    """Short logarithmic axes: 0.5, 1, 2 instead of powers of ten."""
    for name in log:
        along = axis.xaxis if name == "x" else axis.yaxis
        along.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        along.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        along.set_minor_formatter(NullFormatter())


def _ticks_of_a_ladder(axis, curves):
    """Label every value where the curves share only a few, such as the Courant numbers 0.5 to 4."""
    places = sorted({place for curve in curves for place in curve["x"]})
    if len(places) <= FEW:
        axis.xaxis.set_major_locator(FixedLocator(places))


def look(curve, seen):
    """Style of a curve; seen: the number of computed and of measured curves so far, which is updated."""
    kind, style = curve["kind"], {"label": curve["label"] or "_unnamed"}
    if kind == "band":
        return style | {"color": BAND, "linewidth": 0, "zorder": 1}
    if kind == "exact":
        dashes = EXACT[seen["exact"] % len(EXACT)]
        seen["exact"] += 1
        return style | {"color": INK, "linestyle": dashes, "linewidth": 0.9, "zorder": 2.5}
    if kind == "measured":
        return style | measured(len(curve["x"]), seen, curve.get("points", False))
    number = seen["computed"]
    seen["computed"] += 1
    style |= {"color": OWN[number % len(OWN)], "zorder": 3}
    if curve.get("points") or len(curve["x"]) <= FEW:
        style |= {"marker": MARKERS[number % len(MARKERS)], "markersize": 3.6}
    if curve.get("points"):
        return style | {"linestyle": "none"}
    return style | {"linestyle": DASHES[number % len(DASHES)] if kind == "computed" else "-."}


def measured(count, seen, single):
    """Style of a measured curve: points, or a line where there are too many and they are not single results."""
    if count > MOST_POINTS and not single:
        return {"color": INK, "linewidth": 1.0, "zorder": 2}
    marker = MARKERS[seen["measured"] % len(MARKERS)]
    seen["measured"] += 1
    points = {"linestyle": "none", "marker": marker, "markersize": 3.4, "markerfacecolor": "white"}
    return {"color": INK, "zorder": 2, **points}


def main(folder, *files):
    """Draw the figures of all files and print the paths of the pictures."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    for file in files:
        for line in Path(file).read_text(encoding="utf-8").splitlines():
            print(draw(json.loads(line), folder), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
