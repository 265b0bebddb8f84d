"""The map of a terrain file: where its colours lie, and how its coordinates are written."""

import numpy as np

from coupler.commands.view.terrain_map import map_of


def test_colours_lie_at_their_places_and_coordinates_are_written_in_full():
    """Pixels reach half a cell beyond their middles, as the map of cells does; a map of points ends at the outermost.
    Eastings and northings are no small numbers beside +5e5 in a corner."""
    x, y = 500_001.0 + 2.0 * np.arange(30), 4_000_001.0 + 2.0 * np.arange(20)
    z = np.add.outer(0.1 * np.arange(30), 0.05 * np.arange(20)) - 1.0
    for covered in ([[500_000, 500_060], [4_000_000, 4_000_040]], [[x[0], x[-1]], [y[0], y[-1]]]):
        figure = map_of(x, y, z, np.array(covered, float), "tile")
        axes = figure.axes[0]
        np.testing.assert_allclose(axes.images[0].get_extent(), [500_000, 500_060, 4_000_000, 4_000_040])
        np.testing.assert_allclose([axes.get_xlim(), axes.get_ylim()], covered)
        figure.canvas.draw()
        assert axes.xaxis.get_offset_text().get_text() == axes.yaxis.get_offset_text().get_text() == ""
        assert "500010" in [label.get_text() for label in axes.get_xticklabels()]
