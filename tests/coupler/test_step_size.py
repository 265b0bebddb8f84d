"""How long a step may be: blocks cross no more of a cell than their cells can follow, which are cut once a step."""

import numpy as np
import pytest

from coupler.commands.verify.scenes import level_at, tank
from tests.fakes import FreeBody


@pytest.mark.parametrize("motion", [[5.0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 5.0 / (0.1 * np.sqrt(3.0)), 0]])
def test_the_fastest_corner_of_a_block_crosses_half_a_cell(motion):
    """Cells of 0.25 m and still water; a cube of 0.2 m flies at 5 m/s, or its corners turn at that speed."""
    body = FreeBody.cube(0.2, (0.5, 0.5, 0.7), 500.0, 9.81)
    coupling = tank((1.0, 1.0, 1.0), (4, 4, 4), level_at(0.5), body)
    assert coupling.step_size(1.0) > 0.04
    body._v[0] = motion
    assert coupling.step_size(1.0) == pytest.approx(0.5 * 0.25 / 5.0, rel=0.03)
