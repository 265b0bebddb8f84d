"""A sheet of water thinner than a cell that meets a narrow column."""

import pytest

from coupler.commands.verify.cubes import CONVERGED, EDGE, held_column


def test_a_column_receives_most_of_a_sheet_thinner_than_a_cell():
    """The sheet of 3 to 5 cm on cells of 5 cm. While the water went on along the sides of the column behind its edges,
    it exerted half of its force."""
    assert held_column(EDGE / 3.0) == pytest.approx(CONVERGED, rel=0.25)
