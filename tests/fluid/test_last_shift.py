"""The last shift of the surface, which brings the total volume of the water to what is conserved."""

import numpy as np
import pytest

from fluid.surface.volume import VOLUME_TOLERANCE, correct_volume, nodal_volume
from tests.fluid.scenes import tank

LEVEL = 0.5


def corrected(lacks, total, level=LEVEL + 0.02):
    """x (N,) [m], φ (N,) [m], correction and target [m³] of a pool whose nodes on the side x < 0.3 lack a share of what
    they hold beside the surface, the water being a share `total` of it more in all."""
    water = tank([2, 0.2, 1], 0.1, lambda x: x[:, 2] - level)
    t, phi = water.topology, water.level_set
    own = nodal_volume(t, phi)
    carried = own.copy()
    there = (t.nodes[:, 0] < 0.3) & (np.abs(phi) < 0.1)
    carried[there] *= 1.0 + lacks
    target = (1.0 + total) * carried.sum()
    found = correct_volume(
        t, water.graph_for(water.listed), water.listed, phi, carried, target, 1.0, t.node_size
    )
    return t.nodes[:, 0], phi, found, target


def lowered(x, phi, found, where):
    near = np.abs(phi) < 0.1
    return np.abs(found.level_set - phi)[near & where(x)].max()


def test_what_the_total_misses_comes_from_where_the_surface_was_corrected():
    """A thousandth of the water, beside a correction at one end of the pool: by one length on all of the surface, its
    other end would sink by half a millimetre."""
    x, phi, found, target = corrected(0.3, -1e-3)
    assert found.nodal_water.sum() == pytest.approx(target, rel=2 * VOLUME_TOLERANCE)
    assert found.reinserted != 0.0
    assert lowered(x, phi, found, lambda x: x < 0.2) > 5e-3
    assert lowered(x, phi, found, lambda x: x > 1.5) < 1e-4


def test_where_nothing_was_corrected_the_surface_moves_alike():
    _, phi, found, target = corrected(0.0, 1e-3)
    assert found.nodal_water.sum() == pytest.approx(target, rel=2 * VOLUME_TOLERANCE)
    moved = (found.level_set - phi)[np.abs(phi) < 0.1]
    np.testing.assert_allclose(moved, moved.mean(), rtol=1e-6)
    assert moved.mean() == pytest.approx(-1e-3 * (LEVEL + 0.02), rel=0.02)


def test_more_than_a_corrected_place_can_take_goes_to_all_of_the_surface():
    """One hundredth of the water is 5 mm of all of the surface; the end that was corrected may take 10 mm more, a tenth
    of a cell."""
    x, phi, found, target = corrected(0.3, 1e-2)
    assert found.nodal_water.sum() == pytest.approx(target, rel=2 * VOLUME_TOLERANCE)
    assert lowered(x, phi, found, lambda x: x > 1.5) == pytest.approx(5e-3, rel=0.5)


@pytest.mark.parametrize(("lacks", "cells"), [(0.0, -0.15), (0.0, 0.25), (-0.9, -0.15), (0.9, 0.15)])
def test_the_surface_moves_by_more_than_a_tenth_of_a_cell_where_the_total_asks_for_it(lacks, cells):
    """In steps several cells long the correction of the nodes misses that much: of the water that breaks a wall in
    seven cells 0.17 % was gone for a step. What the nodes hold is what lies below the surface, also where it comes to
    cells that a shift of the usual size does not reach: at an end that was corrected as far as one step may."""
    level = LEVEL + 0.05 + 0.005 * np.sign(cells)
    x, phi, found, target = corrected(lacks, cells * 0.1 / level, level)
    assert found.nodal_water.sum() == pytest.approx(target, rel=2 * VOLUME_TOLERANCE)
    assert lowered(x, phi, found, lambda x: x > 1.5) > 0.01
    assert lacks == 0.0 or lowered(x, phi, found, lambda x: x < 0.2) > 0.046
    t = tank([2, 0.2, 1], 0.1, lambda x: x[:, 2] - LEVEL).topology
    np.testing.assert_allclose(nodal_volume(t, found.level_set), found.nodal_water, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("lacks", [0.02, 0.1])
def test_a_pool_that_lacks_nothing_is_left_alone(lacks):
    """Two columns of water on one floor, one of which holds less than its surface says: with one length for both, the
    other would sink by a tenth of what the first does; by as much where that takes more than a tenth of a cell."""
    water = tank([2, 0.2, 1], 0.1, lambda x: np.maximum(x[:, 2] - LEVEL - 0.02, 0.37 - np.abs(x[:, 0] - 1.0)))
    t, phi = water.topology, water.level_set
    carried = nodal_volume(t, phi)
    left = t.nodes[:, 0] < 1.0
    carried[left] *= 1.0 - lacks
    found = correct_volume(
        t, water.graph_for(water.listed), water.listed, phi, carried, carried.sum(), 1.0, t.node_size
    )
    assert found.nodal_water.sum() == pytest.approx(carried.sum(), rel=2 * VOLUME_TOLERANCE)
    assert found.reinserted != 0.0
    np.testing.assert_allclose(found.nodal_water[~left].sum(), carried[~left].sum(), rtol=1e-12)
