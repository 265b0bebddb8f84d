"""Texts beside points of a figure, each where it covers neither a point nor another text."""

from matplotlib.patheffects import withStroke
from matplotlib.text import Text

PLACES = [(x, y) for far in (4, 11, 19) for x, y in ((far, far), (far, -far), (-far, far), (-far, -far), (0, 1.5 * far),
                                                     (0, -1.5 * far), (1.5 * far, 0), (-1.5 * far, 0))]  # fmt: skip
"""Offsets [points] of a text from its point, in the order in which they are tried."""
NEAR = 6
"""Offset [points] up to which a text stands beside its point; a thin line leads from one farther away."""
HALO = (withStroke(linewidth=1.5, foreground="white", alpha=0.8),)
"""A white rim, so that a text can be read across a line."""
ROOM = 1.0
"""Free space around a text [pixels]."""


def place_labels(drawing, axis, labels, size):
    """Write labels [(x, y, text, colour)] (data coordinates); those for which no place is free go to the last one."""
    drawing.draw_without_rendering()
    renderer = drawing.canvas.get_renderer()
    points = [axis.transData.transform((x, y)) for x, y, *_ in labels]
    taken = []
    for x, y, text, colour in labels:
        written = _written(axis, x, y, text, colour, size)
        for offset in PLACES:
            _move(written, offset)
            box = _extent(written, renderer).padded(ROOM)
            if not any(box.overlaps(other) for other in taken) and not any(box.contains(*p) for p in points):
                break
        taken.append(box)


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
    """The side of the text that faces the point follows from where it stands."""
    x, y = offset
    written.set_position(offset)
    written.arrow_patch.set_visible(max(abs(x), abs(y)) > NEAR)
    written.set_horizontalalignment("left" if x > 0 else "right" if x < 0 else "center")
    written.set_verticalalignment("bottom" if y > 0 else "top" if y < 0 else "center")
