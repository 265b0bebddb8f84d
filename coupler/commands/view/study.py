"""python -m coupler.commands.view.study DIRECTORY: error against run time, one figure a quantity, from study.json
alone.

Both axes are logarithmic. A line is a ladder of runs, its points carry their settings; a run that failed is a cross on
the upper edge at the time that it took, with its reason below; grey is the scatter of the measurement.
"""

import json
import math
import sys
import textwrap
from pathlib import Path

from matplotlib.colors import to_rgb

from coupler.commands.view.figure_files import save
from coupler.commands.view.labels import place_labels
from coupler.commands.view.palette import INK, LINES, SOLID
from coupler.commands.view.plots import STYLE, plt

SIZE = (5.2, 3.5)
"""[inch] one and a half columns of a journal."""
MARKS = "osD^vP*X"
DASHES = ("-", (0, (5, 1.2)), (0, (1.2, 1)), "-.", (0, (3, 1, 1, 1, 1, 1)))
"""Line styles of the curves in order, which distinguish them in grey print."""
DARKER = 0.75
"""Factor on a curve's colour for the texts at its points, since thin letters look paler than lines."""
LEVELS = (0.01, 0.05, 0.10)
"""Errors for which the cheapest setting is reported: thin lines."""
LOWEST = 1e-6
"""Errors below this are drawn here: they are round-off."""
SHORTEST = 1e-5
"""[s] CPU times below this, also 0 where all was spent in the compiler, are drawn here."""
SHORT = 24
"""Largest number of letters of a name for which the legend has three columns."""
NOTE_WIDTH = 105
"""Letters in a line below a figure."""


def draw(folder):
    """NAME.png, .pdf and .svg for every quantity with an error, NAME_laws.* where laws were compared; their paths."""
    study = json.loads((folder / "study.json").read_text(encoding="utf-8"))
    written = []
    for q in study["quantities"]:
        curves = ladder_curves(study, q["name"])
        if any(points for _, points in curves):
            failed = [point for point in study["points"] if point["reason"]]
            written.append(figure(folder / q["name"], q, curves, failed, "CPU time of the run [s]"))
        laws = law_curves(study, q["name"])
        if laws:
            written.append(
                figure(folder / f"{q['name']}_laws", q, laws, [], "CPU time of stepping alone [s]")
            )
    return written


def ladder_curves(study, name):
    """[(legend, [(CPU s, error, label, band)])] of a quantity, a curve for each ladder and value across it."""
    what = {ladder["name"]: ladder["what"] for ladder in study["ladders"]}
    curves = {}
    for point in study["points"]:
        legend = what[point["ladder"]] + (f", {point['curve']}" if point["curve"] else "")
        points = curves.setdefault(legend, [])
        reading = point["readings"].get(name)
        if reading and reading["error"] is not None and not point["reason"]:
            cpu = max(point["cpu_seconds"], SHORTEST)
            points.append((cpu, reading["error"], point["label"], reading["band"]))
    return list(curves.items())


def law_curves(study, name):
    """The same for laws of YADE and ours, a curve a law, a point a substep."""
    curves = {}
    for row in study["laws"]:
        if name in row["readings"]:
            reading = row["readings"][name]
            legend = f"{row['law']} (YADE)" if row["stock"] else row["law"]
            label = "" if row["multiple"] == 1 else f"×{row['multiple']}"
            curves.setdefault(legend, []).append(
                (max(row["cpu_seconds"], SHORTEST), reading["error"], label, reading["band"])
            )
    return list(curves.items())


def figure(stem, q, curves, failed, along):
    """One quantity; saved in every format under `stem`; returns the PNG."""
    with plt.rc_context(STYLE):
        notes = footnotes(failed)
        drawing, axis = plt.subplots(figsize=(SIZE[0], SIZE[1] + 0.14 * len(notes)))
        axis.set_xscale("log")
        axis.set_yscale("log")
        shown = [(legend, points) for legend, points in curves if points]
        for number, (legend, points) in enumerate(shown):
            line(axis, number, legend, points)
        band(axis, shown)
        limits(axis, shown, failed)
        axis.set_xlabel(along)
        axis.set_ylabel(ylabel(q))
        if len(shown) > 1 or q["against"] == "measured":
            drawing.legend(loc="outside upper center", ncols=columns(shown))
        if notes:
            drawing.supxlabel("\n".join(notes), x=0.01, ha="left", fontsize=6, color=INK)
        crosses(axis, failed)
        place_labels(drawing, axis, labels(shown), 6.5)
        save(drawing, stem)
    return stem.with_name(f"{stem.name}.png")


def columns(curves):
    """Columns of the legend: three of short names, else two."""
    longest = max(len(legend) for legend, _ in curves)
    return min(len(curves) + 1, 3 if longest <= SHORT else 2)


def ylabel(q):
    """The quantity whose error is shown, and its reference; a figure never mixes two kinds of reference."""
    against = {"exact": "exact answer", "measured": "measurement", "finest": "finest run"}[q["against"]]
    return "\n".join([*textwrap.wrap(f"error of {q['what']}", 46), f"against the {against}"])


def line(axis, number, legend, points):
    """A ladder: its points joined in their order."""
    x, y = [p[0] for p in points], [max(p[1], LOWEST) for p in points]
    mark = MARKS[number % len(MARKS)]
    dashes = DASHES[number % len(DASHES)]
    axis.plot(x, y, marker=mark, ls=dashes, markersize=4, color=colour(number), label=legend, zorder=3)


def colour(number):
    """Colour of a curve."""
    return LINES[number % len(LINES)]


def labels(curves):
    """(CPU s, error, setting, colour) of every point; a run that is in several ladders has its settings in all."""
    found = {}
    for number, (_, points) in enumerate(curves):
        for cpu, error, label, _ in points:
            texts, _ = found.setdefault((cpu, max(error, LOWEST)), ([], text_colour(number)))
            texts.append(label)
    return [
        (*place, _settings(place[1], texts), text_colour) for place, (texts, text_colour) in found.items()
    ]


def _settings(error, texts):
    study = " / ".join(dict.fromkeys(filter(None, texts)))
    return study if error > LOWEST else f"{study} (< {share(LOWEST)})".strip()


def text_colour(number):
    """Colour of the texts at the points of a curve."""
    return tuple(DARKER * part for part in to_rgb(colour(number)))


def band(axis, curves):
    """Shade the scatter of the measurement; errors within it are not significant."""
    bands = {p[3] for _, points in curves for p in points if p[3]}
    if bands:
        axis.axhspan(
            LOWEST, max(bands), color=SOLID, alpha=0.25, lw=0, label="scatter of the measurement", zorder=1
        )


def limits(axis, curves, failed):
    """Axes about the points, whole decades up; the levels of the tables as thin lines."""
    x = [p[0] for _, points in curves for p in points] + [
        p["cpu_seconds"] for p in failed if p["cpu_seconds"] > 0
    ]
    y = [max(p[1], LOWEST) for _, points in curves for p in points]
    axis.set_xlim(0.75 * min(x), 1.5 * max(x))
    low, high = 10.0 ** math.floor(math.log10(0.95 * min(y))), 10.0 ** math.ceil(math.log10(1.2 * max(y)))
    low = max(low, 0.5 * LOWEST)
    axis.set_ylim(low, high)
    for level in LEVELS:
        if low < level < high:
            axis.axhline(level, color=INK, lw=0.5, ls=":", zorder=2)
    axis.xaxis.set_major_formatter(plt.FuncFormatter(lambda value, _: f"{value:g}"))
    axis.yaxis.set_major_formatter(plt.FuncFormatter(lambda value, _: share(value)))
    axis.xaxis.set_minor_formatter(plt.FuncFormatter(minor(max(x) / min(x), "{:g}")))
    axis.yaxis.set_minor_formatter(plt.FuncFormatter(minor(high / low, "{:g} %", 100.0)))


def share(value):
    """A share as per cent, with no more digits than it needs."""
    return f"{100 * value:g} %"


def minor(extent, form, scale=1.0):
    """Names of the ticks between decades, the more the shorter the axis; extent: its end over its beginning."""
    named = (1.5, 2, 3, 4, 5, 6, 8) if extent < 4.0 else (2, 5) if extent < 100.0 else ()

    def ticks(value, _):
        first = value / 10.0 ** math.floor(math.log10(value))
        return form.format(scale * value) if any(abs(first - k) < 1e-6 for k in named) else ""

    return ticks


def crosses(axis, failed):
    """Failed runs, numbered, on the upper edge; one whose process took no time that counts stands at the left."""
    top, left = axis.get_ylim()[1], axis.get_xlim()[0]
    for number, point in enumerate(failed, start=1):
        x = max(point["cpu_seconds"], left)
        axis.plot([x], [top], marker="x", color=LINES[1], markersize=6, clip_on=False, zorder=5)
        axis.annotate(
            f"{number}",
            (x, top),
            xytext=(0, -5),
            textcoords="offset points",
            ha="center",
            va="top",
            fontsize=6,
        )


def footnotes(failed):
    """Lines that say which runs failed, and why."""
    lines = []
    for number, point in enumerate(failed, start=1):
        curve = f" ({point['curve']})" if point["curve"] else ""
        text = f"× {number}  failed: {point['ladder']} {point['label']}{curve}: {point['reason']}"
        lines += textwrap.wrap(text, NOTE_WIDTH, subsequent_indent="      ", max_lines=2, placeholder=" ...")
    return lines


if __name__ == "__main__":
    for path in draw(Path(sys.argv[1])):
        print(f"figure: {path}")
