"""Maps of a flood from a run directory: largest depth, speed and h v², arrival, with solids and blocks in outline and
the buildings by their state.

python -m coupler.commands.view.flood_map RUN PICTURE.png TITLE
"""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import numpy as np

from coupler.commands.view.footprints import of_blocks, of_solids
from coupler.commands.view.palette import INK, PAPER
from coupler.results.maps import Map, read_map

MAPS = (
    ("depth", "largest depth [m]", "Blues"),
    ("speed", "largest speed [m/s]", "viridis"),
    ("flux", "largest $h v^2$ [m$^3$/s$^2$]", "magma_r"),
    ("arrival", "arrival [s]", "cividis"),
)
SHOWN = 99.5
"""Percentile of a map at which its colours end; a tip on the bar says that few points are beyond."""
NOWHERE = "no water", "no dry ground was reached"
"""What a map without a value says, and that of the arrival."""
FIXED = "#6b6b6b"
"""Colour of fixed solids, darker than that of dry ground."""
MOST_NAMED = 40
"""Buildings whose names still find room on a map."""
STATES = {"stands": "#2a9d5c", "damaged": "#f2a73b", "collapsed": "#c8322b"}


def draw(run: Path, picture: Path, title: str) -> None:
    """The four maps with the buildings, as one PNG."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    found = read_map(run / "maps" / "bed.asc")
    x, y, bed = *in_tank(run, found), found.z
    houses, blocks, solids = _buildings(run), of_blocks(run), of_solids(run)
    tall = np.ptp(y) / np.ptp(x)
    figure, axes = plt.subplots(2, 2, figsize=(12.0, 1.9 + 11.0 * min(tall, 1.2)), layout="constrained")
    for axis, (name, label, colours) in zip(axes.flat, MAPS):
        z = read_map(run / "maps" / f"{name}.asc").z
        axis.contourf(x, y, bed, levels=12, cmap="Greys", alpha=0.35)
        if np.isfinite(z).any():
            image = axis.pcolormesh(
                x, y, z, cmap=colours, vmin=0.0 if name != "arrival" else None,
                vmax=np.nanpercentile(z, SHOWN), shading="nearest",
            )  # fmt: skip
            figure.colorbar(image, ax=axis, shrink=0.85, extend="max")
        else:
            axis.text(0.5, 0.5, NOWHERE[name == "arrival"], transform=axis.transAxes, ha="center")
        axis.contour(x, y, bed, levels=[0.0], colors="k", linewidths=0.8)
        _draw_outlines(axis, solids, FIXED, "fixed solids")
        _draw_outlines(axis, blocks, PAPER, "blocks at the start")
        for state, colour in STATES.items() if houses else ():
            of_state = [h for h in houses if h["state"] == state]
            places = np.array([(float(h["x"]), float(h["y"])) for h in of_state]).reshape(-1, 2)
            axis.scatter(
                *places.T,
                s=42,
                marker="s",
                c=colour,
                edgecolors="k",
                linewidths=0.6,
                zorder=3,
                label=f"{state}: {len(places)}",
            )
        axis.set(
            title=label,
            aspect="equal",
            xlabel="x [m]",
            ylabel="y [m]",
            xlim=(x[0], x[-1]),
            ylim=(y[0], y[-1]),
        )
    if len(houses) <= MOST_NAMED:
        _write_names(axes[0, 0], houses)
    if houses or blocks or solids:
        figure.legend(
            *axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5, fontsize=8
        )
    figure.suptitle(title)
    figure.savefig(picture, dpi=150)


def _draw_outlines(axis, outlines: list[np.ndarray], colour: str, label: str) -> None:
    """Bodies in plan, with a line around all that touch one another and none between them."""
    from matplotlib.collections import PolyCollection

    if outlines:
        for fill, width, order in ((INK, 1.4, 2.2), (colour, 0.2, 2.3)):
            axis.add_collection(
                PolyCollection(outlines, facecolors=fill, edgecolors=fill, linewidths=width, zorder=order)
            )
        axis.plot([], [], "s", color=colour, markeredgecolor=INK, markersize=8, label=label)


def _write_names(axis, houses: list[dict]) -> None:
    """The name of each building beside it, by which it is found in the table of buildings."""
    from matplotlib.patheffects import withStroke

    for house in houses:
        axis.annotate(
            house["name"],
            (float(house["x"]), float(house["y"])),
            xytext=(7.0, 5.0),
            textcoords="offset points",
            fontsize=7,
            color=INK,
            path_effects=[withStroke(linewidth=2.0, foreground=PAPER)],
            zorder=4,
        )


def in_tank(run: Path, found: Map) -> tuple[np.ndarray, np.ndarray]:
    """Columns and rows of a map (x,), (y,) [m] in the coordinates of the tank, which are those of the buildings.

    The map itself is in the coordinates of the terrain file; its first column and row are the sides of the tank."""
    lower = json.loads((run / "effective.json").read_text(encoding="utf-8"))["tank"]["lower"]
    return found.x - found.x[0] + lower[0], found.y - found.y[0] + lower[1]


def _buildings(run: Path) -> list[dict]:
    path = run / "buildings.csv"
    if not path.is_file():
        return []
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return list(csv.DictReader(lines))


if __name__ == "__main__":
    draw(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])
