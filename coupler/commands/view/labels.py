"""Labels beside points of a figure, placed so that each covers no point, no other label and as little of a line as
possible."""

import itertools

import numpy as np
from matplotlib.patheffects import withStroke
from matplotlib.text import Text

SIDES = ((1, 1), (1, -1), (-1, 1), (-1, -1), (0, 1.5), (0, -1.5), (1.5, 0), (-1.5, 0))
PLACES = [(far * x, far * y) for far in (4, 11, 19, 28) for x, y in SIDES]
"""Offsets [points] of a text from its point; of two that are as good the first is taken."""
NEAR = 6
"""Offset [points] up to which a text stands beside its point; a thin line leads from one farther away."""
HALO = (withStroke(linewidth=1.5, foreground="white", alpha=0.8),)
"""A white rim, so that a text can be read across a line."""
ROOM = 1.0
"""Free space around a text [pixels]."""
ON_TEXT, ON_POINT, OUTSIDE, ON_LINE = 100.0, 60.0, 30.0, 4.0
"""Price of covering a text or a point, of leaving the axes, of each stretch of a line that is covered; that of an
offset is its length over NEAR."""
STRETCH = 4.0
"""Distance [pixels] of the sampled places of a line."""


def place_labels(drawing, axis, labels, size):
    """Write labels [(x, y, text, colour)] (data coordinates), each at the cheapest of PLACES.

    Isolated points come last, because their labels find room anywhere.
    """
    drawing.draw_without_rendering()
    renderer = drawing.canvas.get_renderer()
    points = np.array([axis.transData.transform((x, y)) for x, y, *_ in labels]).reshape(-1, 2)
    lines = _along_lines(axis)
    taken = []
    for k in _crowded_first(points):
        x, y, text, colour = labels[k]
        written = _written(axis, x, y, text, colour, size)
        prices = [_price(written, offset, renderer, axis, taken, points, lines) for offset in PLACES]
        _move(written, PLACES[int(np.argmin(prices))])
        taken.append(_extent(written, renderer).padded(ROOM))


def _crowded_first(points):
    """Order of the points by the distance to the nearest other one."""
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    return np.argsort(apart.min(axis=1, initial=np.inf), kind="stable")


def _price(written, offset, renderer, axis, taken, points, lines):
    """Cost of placing a text at this offset, from what it would cover."""
    _move(written, offset)
    box = _extent(written, renderer).padded(ROOM)
    frame = axis.bbox
    outside = box.x0 < frame.x0 or box.x1 > frame.x1 or box.y0 < frame.y0 or box.y1 > frame.y1
    return (
        ON_TEXT * sum(box.overlaps(other) for other in taken)
        + ON_POINT * _inside(box, points)
        + OUTSIDE * outside
        + ON_LINE * _inside(box, lines)
        + max(map(abs, offset)) / NEAR
    )


def _inside(box, places):
    """How many places (n, 2) [pixels] lie in a box."""
    x, y = places[:, 0], places[:, 1]
    return int(np.sum((x > box.x0) & (x < box.x1) & (y > box.y0) & (y < box.y1)))


def _along_lines(axis):
    """Places (n, 2) [pixels] every STRETCH along the lines that are drawn in data coordinates."""
    found = [np.empty((0, 2))]
    for line in axis.lines:
        if line.get_transform() != axis.transData:
            continue
        corners = axis.transData.transform(line.get_xydata())
        for a, b in itertools.pairwise(corners):
            share = np.arange(0.0, 1.0, STRETCH / max(np.linalg.norm(b - a), STRETCH))
            found.append(a + share[:, None] * (b - a))
    return np.concatenate(found)


def _written(axis, x, y, text, colour, size):
    """A text with a thin line to its point."""
    line = {"arrowstyle": "-", "linewidth": 0.4, "color": colour, "shrinkA": 0, "shrinkB": 2}
    return axis.annotate(
        text,
        (x, y),
        xytext=PLACES[0],
        textcoords="offset points",
        fontsize=size,
        color=colour,
        zorder=4,
        arrowprops=line,
        path_effects=HALO,
    )


def _extent(written, renderer):
    """The box of the text without its line [pixels]."""
    written.update_positions(renderer)
    return Text.get_window_extent(written, renderer)


def _move(written, offset):
    """Move a text to an offset; its alignment follows from the direction to the point."""
    x, y = offset
    written.set_position(offset)
    written.arrow_patch.set_visible(max(abs(x), abs(y)) > NEAR)
    written.set_horizontalalignment("left" if x > 0 else "right" if x < 0 else "center")
    written.set_verticalalignment("bottom" if y > 0 else "top" if y < 0 else "center")
