"""Figures of a verdict: damage over time by part, walls and floors with their cracks by time, and what pressed on them.

From cracks.csv, blocks.csv, joints.vtu and the first step of blocks.vtkhdf. A wall is drawn as it is seen from its
side, a floor or roof from above, each with its own blocks at the start; x and y are those of the case.
"""

from dataclasses import dataclass

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import ListedColormap
from matplotlib.ticker import MaxNLocator

from coupler.commands.view.figure_files import FORMATS, save
from coupler.commands.view.palette import DAMAGE_ENDS, INK, SHADOW, WATER_ENDS, scale
from coupler.commands.view.plots import STYLE, WIDTH, plt, prefixed
from coupler.results import vtkhdf
from coupler.results.history import read_history
from coupler.verdict.divisions import in_words

NAMES = ("damage", "cracks", "wall_pressure")
"""Files of these figures, without ending."""
MOST_PARTS = 16
"""Walls and floors that are drawn: those that broke first, then the largest."""
FROM_ABOVE = 0.7
"""Upward component of the normal of a part from which it is drawn in plan."""
INSTANTS = 400
TALLEST = 8.2
"""Largest height [inch] of a figure."""
LOWEST = 1.5
"""Least height [inch] of the figure of damage over time: its colour bar is as long as the words beside it."""
LEFT, STAYED = "#f3d9cf", "#e4e4e4"
"""Colours of blocks that left their place, and of those that did not; openings are white."""


@dataclass(frozen=True)
class Files:
    """What a run says of its joints and blocks: tables cracks (None without joints) and blocks; corners (c, 3) [m] of
    the joined faces at the start, a list (J,) of rows of corners; faces of the blocks at the start, a list of (k, 3)
    [m], and the block of each."""

    cracks: object
    blocks: object
    joints: list
    faces: list
    block_of_face: np.ndarray
    end: float


def damage_figures(run, folder, endings=FORMATS):
    """Write the figures for which there is data; return their paths with the first of the endings."""
    if not (run / "blocks.csv").exists() or not (run / "blocks.vtkhdf").exists():
        return []
    found = read(run)
    parts = shown_parts(found)
    if not parts:
        return []
    with plt.rc_context(STYLE):
        drawn = {}
        if found.cracks is not None and len(found.cracks["joint"]):
            drawn["damage"] = over_time(found, parts)
            glued = [part for part in parts if joints_of(found, part).any()]
            if found.joints and glued:
                drawn["cracks"] = elevations(found, glued, cracks_on, crack_colours(found))
        if np.nanmax(found.blocks["pressure"], initial=0.0) > 0.0:
            drawn["wall_pressure"] = elevations(found, parts, pressure_on, pressure_colours(found))
        for name, drawing in drawn.items():
            save(drawing, folder / name, endings)
    return [folder / f"{name}.{endings[0]}" for name in drawn]


def read(run):
    """Files of a run."""
    cracks = read_history(run / "cracks.csv") if (run / "cracks.csv").exists() else None
    points, _, data = vtkhdf.read_step(run / "blocks.vtkhdf", 0)
    rows, ends = vtkhdf.read_polygons(run / "blocks.vtkhdf")
    times = vtkhdf.read_times(run / "blocks.vtkhdf")
    faces = [points[ring] for ring in np.split(rows, ends[:-1])]
    joints = read_joints(run / "joints.vtu") if (run / "joints.vtu").exists() else []
    return Files(cracks, read_history(run / "blocks.csv"), joints, faces, data["block"], float(times[-1]))


def read_joints(path):
    """Joined faces at the start by number of the joint."""
    import meshio

    mesh = meshio.read(path)
    found = {}
    for block, numbers in zip(mesh.cells, mesh.cell_data["joint"]):
        found |= {int(number): mesh.points[ring] for number, ring in zip(numbers, block.data)}
    return [found[k] for k in sorted(found)]


def shown_parts(found):
    """Names of walls, floors and other parts, ordered by the time of their first break, then by weight."""
    member, first = found.blocks["member"], found.blocks["first_break"]
    names = list(dict.fromkeys(member))
    early = {n: np.nanmin(first[member == n], initial=np.inf) for n in names}
    heavy = {n: -found.blocks["mass"][member == n].sum() for n in names}
    return sorted(names, key=lambda n: (early[n], heavy[n]))[:MOST_PARTS]


def words(found):
    """How parts are named on the figures."""
    bodies = set(found.blocks["body"])
    return lambda name: in_words(name, bodies)


# ---------------------------------------------------------------- damage over time


def over_time(found, parts):
    """Draw a row for each part; the darkness shows the broken share of its joined area over time."""
    time = np.linspace(0.0, found.end, INSTANTS)
    share = np.array([broken_share(found, part, time) for part in parts])
    kept = [k for k in range(len(parts)) if np.isfinite(share[k]).all()]
    drawing, axis = plt.subplots(figsize=(WIDTH, max(0.9 + 0.24 * len(kept), LOWEST)))
    edges = np.linspace(0.0, found.end, INSTANTS + 1)
    mesh = axis.pcolormesh(
        edges, np.arange(len(kept) + 1) - 0.5, share[kept], cmap=colours(DAMAGE_ENDS), vmin=0.0, vmax=1.0,
        rasterized=True,
    )  # fmt: skip
    for row, k in enumerate(kept):
        own = (found.blocks["member"] == parts[k]) & np.isfinite(found.blocks["left_at"])
        if own.any():
            axis.plot(
                [found.blocks["left_at"][own].min()],
                [row],
                marker="|",
                color=INK,
                markersize=9,
                markeredgewidth=1.5,
            )
    axis.set_yticks(range(len(kept)), [words(found)(parts[k]) for k in kept])
    axis.invert_yaxis()
    axis.grid(False)
    axis.set_xlabel("time [s]   (a bar marks the first block that left its place)")
    bar = drawing.colorbar(mesh, ax=axis, pad=0.02)
    bar.set_label("broken share of\nthe joined area")
    bar.ax.yaxis.set_major_formatter(lambda value, _: f"{100 * value:.0f} %")
    return drawing


def broken_share(found, part, time):
    """Share of the joined area of a part that is broken at each time (t,); NaN for one without joints."""
    own = joints_of(found, part)
    if not own.any():
        return np.full(len(time), np.nan)
    broke, area = found.cracks["time"][own], found.cracks["area"][own]
    return np.array([area[broke <= t].sum() for t in time]) / area.sum()


def joints_of(found, part):
    """(J,) bool: the joints of a part, within it and with others."""
    a, b = (found.cracks[name].astype(int) for name in ("a", "b"))
    return of(found.blocks["member"], a, part) | of(found.blocks["member"], b, part)


def of(member, rows, part):
    """(J,) bool: whether the block of each row is in a part; the ground is in none."""
    inside = (rows >= 0) & (rows < len(member))
    return inside & (member[np.where(inside, rows, 0)] == part)


# ---------------------------------------------------------------- plan and elevations


@dataclass(frozen=True)
class View:
    """Direction from which a part is seen: unit vectors across, right, up (3,), and the names of the picture's axes."""

    across: np.ndarray
    right: np.ndarray
    up: np.ndarray
    axes: tuple

    def flat(self, points):
        """(k, 2) of points (k, 3)."""
        return np.column_stack([points @ self.right, points @ self.up])


def view_of(points):
    """The view in which the part is widest; points (k, 3) [m] of its blocks."""
    middle = points - points.mean(axis=0)
    across = np.linalg.svd(middle, full_matrices=False)[2][2]
    if abs(across[2]) > FROM_ABOVE:
        return View(np.array([0.0, 0, 1]), np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), ("x [m]", "y [m]"))
    across = np.array([across[0], across[1], 0.0]) / np.hypot(across[0], across[1])
    right = np.array([-across[1], across[0], 0.0])
    right *= np.sign(right[np.argmax(np.abs(right))])
    along = "xy"[int(np.argmax(np.abs(right[:2])))] if np.abs(right).max() > 0.999 else "along"
    return View(across, right, np.array([0, 0, 1.0]), (f"{along} [m]", "z [m]"))


def elevations(found, parts, draw, coloured):
    """A panel for each part with its blocks; draw(axis, found, rows, view, coloured) draws the content."""
    views = [view_of(np.concatenate([found.faces[k] for k in faces_of(found, part)])) for part in parts]
    spans = [span(found, part, view) for part, view in zip(parts, views)]
    columns = 2 if len(parts) > 1 else 1
    lines = [list(range(k, min(k + columns, len(parts)))) for k in range(0, len(parts), columns)]
    width = WIDTH / columns - 0.8
    tall = [max(np.clip(width * spans[k][1] / spans[k][0], 0.5, 2.6) for k in line) + 0.55 for line in lines]
    shrink = min(1.0, TALLEST / sum(tall))
    drawing, axes = plt.subplots(
        len(lines), columns, figsize=(WIDTH, shrink * sum(tall) + 0.6), height_ratios=tall, squeeze=False
    )
    for axis in axes.ravel()[len(parts) :]:
        axis.set_axis_off()
    for axis, part, view in zip(axes.ravel(), parts, views):
        draw(axis, found, part, view, coloured)
        axis.set_title(words(found)(part), fontsize=8, loc="left")
        axis.set_xlabel(view.axes[0], labelpad=1)
        axis.set_ylabel(view.axes[1], labelpad=1)
        axis.set_aspect("equal", adjustable="box", anchor="SW")
        for scale_of in (axis.xaxis, axis.yaxis):
            scale_of.set_major_locator(MaxNLocator(7, steps=[1, 2, 5, 10]))
        axis.grid(False)
        axis.margins(0.03)
        axis.autoscale_view()
    mappable, label = coloured
    if mappable is not None:
        bar = drawing.colorbar(mappable, ax=axes, location="bottom", shrink=0.6, aspect=45, pad=0.01)
        bar.set_label(label)
    return drawing


def faces_of(found, part):
    """Numbers of the faces of the blocks of a part."""
    return np.flatnonzero((found.blocks["member"] == part)[found.block_of_face])


def span(found, part, view):
    """Width and height of a part in its picture [m]."""
    flat = view.flat(np.concatenate([found.faces[k] for k in faces_of(found, part)]))
    return np.maximum(np.ptp(flat, axis=0), 1e-9)


def outlines(found, part, view):
    """Polygons (k, 2) of the block faces of a part that are turned towards the viewer, and the rows of these faces."""
    chosen = [k for k in faces_of(found, part) if normal(found.faces[k]) @ view.across > 0.5]
    return [view.flat(found.faces[k]) for k in chosen], found.block_of_face[chosen]


def normal(ring):
    """Unit normal of a plane polygon (k, 3)."""
    n = np.cross(ring - ring[0], np.roll(ring, -1, axis=0) - ring[0]).sum(axis=0)
    return n / max(np.linalg.norm(n), 1e-300)


def cracks_on(axis, found, part, view, coloured):
    """Draw blocks with their joints: intact ones thin, broken ones thick in the colour of the time of failure."""
    rings, rows = outlines(found, part, view)
    gone = np.isfinite(found.blocks["left_at"])[rows]
    fill = np.where(gone, LEFT, STAYED)
    axis.add_collection(PolyCollection(rings, facecolors=fill, edgecolors=SHADOW, linewidths=0.4))
    c = found.cracks
    own = np.flatnonzero(joints_of(found, part))
    broken = own[c["intact"][own] == 0]
    mappable = coloured[0]
    seen = [(view.flat(found.joints[k]), k) for k in broken]
    lines = [(longest(flat), k) for flat, k in seen if is_line(flat)]
    areas = [(flat, k) for flat, k in seen if not is_line(flat)]
    if areas:
        tint = [mappable.to_rgba(c["time"][k], alpha=0.35) for _, k in areas]
        axis.add_collection(PolyCollection([flat for flat, _ in areas], facecolors=tint, edgecolors="none"))
    if lines:
        tint = [mappable.to_rgba(c["time"][k]) for _, k in lines]
        axis.add_collection(LineCollection([line for line, _ in lines], colors=tint, linewidths=2.0))


def is_line(flat):
    """Whether a face is seen edge-on."""
    x, y = (flat - flat[0]).T
    area = 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
    return area < 0.02 * np.ptp(flat, axis=0).max() ** 2


def longest(flat):
    """The two corners (2, 2) farthest apart."""
    apart = np.linalg.norm(flat[:, None] - flat[None], axis=2)
    return flat[list(np.unravel_index(np.argmax(apart), apart.shape))]


def crack_colours(found):
    """Colour scale of the times of failure."""
    c = found.cracks
    broke = c["time"][c["intact"] == 0]
    if not len(broke):
        return None, ""
    label = (
        "time at which the joint broke [s] (areas: joints parallel to the picture)\n"
        "red blocks left their place, grey ones did not"
    )
    return mapped(broke.min(), broke.max(), WATER_ENDS[::-1]), label


def pressure_on(axis, found, part, view, coloured):
    """Draw blocks in the colour of the largest pressure on them."""
    rings, rows = outlines(found, part, view)
    power = pressure_power(found)
    fill = coloured[0].to_rgba(found.blocks["pressure"][rows] / 1000.0**power)
    axis.add_collection(PolyCollection(rings, facecolors=fill, edgecolors="white", linewidths=0.5))


def pressure_power(found):
    """Power of 1000 that makes the largest pressure a short number."""
    return prefixed("Pa", np.nanmax(found.blocks["pressure"]))[0]


def pressure_colours(found):
    """Colour scale from zero to the largest pressure."""
    power, unit = prefixed("Pa", np.nanmax(found.blocks["pressure"]))
    top = np.nanmax(found.blocks["pressure"]) / 1000.0**power
    label = f"largest net pressure of the water across each block while it was in its place [{unit}]"
    return mapped(0.0, top, WATER_ENDS), label


def mapped(low, high, ends):
    """Colour scale from low to high; where both are equal, a range around the value."""
    if not high > low:
        low, high = low - 0.5 * abs(low) - 1e-12, high + 0.5 * abs(high) + 1e-12
    return plt.cm.ScalarMappable(plt.Normalize(low, high), colours(ends))


def colours(ends):
    """A scale of the palette for matplotlib."""
    return ListedColormap(scale(ends))
