"""Water shut in by solids: no surface anchors its pressure, yet it stays at rest and weighs on its walls."""

import numpy as np
import pytest

from fluid.domain.covers import components
from fluid.domain.physical_domain import cut_domain
from tests.fluid.scenes import advance, load, tank
from tests.fluid.still import RHO_G
from tests.fluid.test_covers import hollow_box
from tests.fluid.test_thin_walls import BOX, H, bricks


@pytest.mark.parametrize("inner", [2.5, 1.0, 0.5, 0.2, 0.11, 0.09, 0.02])
def test_hollow_box_under_water(inner):
    """A cavity of 2.5 cells down to 0.02: at rest to round-off, and all six plates together are lifted by what they
    displace, the cavity included where it is dropped as too small to hold pressure (below 1e-3 h^3)."""
    bodies = hollow_box(inner * H)
    water = tank((1, 1, 1), H, lambda x: x[:, 2] - 0.93, bodies, covers="multiple")
    for _ in range(4):
        problem, x = advance(water, rtol=1e-12)
    assert np.abs(water.velocity[water.level_set < 0]).max() < 1e-8
    outer, shut_in = (inner + 1.0) * H, inner * H if inner > 0.1 else 0.0
    force = load(problem, x)[:, :3].sum(axis=0)
    np.testing.assert_allclose(
        force, [0, 0, RHO_G * (outer**3 - shut_in**3)], rtol=1e-8, atol=1e-8 * RHO_G * H**3
    )
    parts = components(water.topology.cells, len(water.topology.nodes)).max() + 1
    assert parts == (2 if inner > 0.1 else 1)


def test_many_tiny_pockets_between_blocks():
    """Gaps of 1e-9 between the blocks of a wall make pockets of no volume: none is left to make the system singular."""
    domain = cut_domain(BOX, bricks(5, 0.5 * H, 1e-9, 0.0), "multiple")
    volume = np.bincount(components(domain.cells, len(domain.nodes)), domain.volume)
    assert volume.min() > 1e-3 * H**3
