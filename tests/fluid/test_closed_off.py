"""Water without a surface is found where it is, however it is closed in."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.covers import OPENINGS
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.mesh.refinement import InBox, refined_mesh
from fluid.readings.closed_off import closed_off
from fluid.step.water import Water


def tank(gap, openings="all", is_open=None):
    """A tank of 2 m by 0.5 m by 1 m, full to 0.8 m, whose right half a lid at 0.5 m covers up to a wall, but for a gap
    above the bed."""
    mesh = box_mesh((0, 0, 0), (2, 0.5, 1), 0.125)
    low, high = gap, 0.55
    bodies = ConvexBodies.boxes(
        [[1.03, 0.25, 0.5 * (low + high)], [1.53, 0.25, 0.53]], [[0.06, 0.6, high - low], [1.06, 0.6, 0.06]]
    )
    domain = cut_domain(mesh, bodies, "multiple", connection=OPENINGS[openings])
    return Water(mesh, domain, lambda x: x[:, 2] - 0.8, is_open=is_open)


def test_a_chamber_without_a_way_out_is_found_with_its_volume():
    (found,) = closed_off(tank(gap=-0.1))
    assert found.volume == pytest.approx(0.94 * 0.5 * 0.5, rel=1e-6)
    np.testing.assert_allclose(found.place, [1.53, 0.25, 0.25], atol=0.02)


def test_an_opening_or_an_open_side_connects_it():
    assert closed_off(tank(gap=0.25)) == []
    assert closed_off(tank(gap=-0.1, is_open=lambda normals, centres: normals[:, 0] > 0.5)) == []


def test_thresholds_of_the_covers_close_narrow_openings():
    """Two centimetres above the bed are a sixth of a cell."""
    assert closed_off(tank(gap=0.02)) == []
    (found,) = closed_off(tank(gap=0.02, openings="wide"))
    assert found.volume == pytest.approx(0.94 * 0.5 * 0.5, rel=0.05)


def chamber(inner, wall=0.05):
    """Six plates around a cube of water with edges of `inner` [m] in the middle of a cubic metre."""
    boxes = []
    for k in range(3):
        for side in (-0.5, 0.5):
            middle, size = np.full(3, 0.5), np.full(3, inner + 2.0 * wall)
            middle[k] += side * (inner + wall)
            size[k] = wall
            boxes.append((middle, size))
    return ConvexBodies.boxes(*map(np.array, zip(*boxes)))


@pytest.mark.parametrize(("inner", "count"), [(0.11, 0), (0.14, 1)])
def test_a_gap_smaller_than_a_cell_is_no_chamber(inner, count):
    """Stacked blocks have many of them. The cells have edges of 0.125 m."""
    mesh = box_mesh((0, 0, 0), (1, 1, 1), 0.125)
    water = Water(mesh, cut_domain(mesh, chamber(inner), "multiple"), lambda x: x[:, 2] - 0.85)
    assert len(closed_off(water)) == count


def test_a_chamber_in_fine_cells_of_a_large_tank_is_found():
    """It is a third of a mean cell of the tank and 57 of those around it: it was taken for a gap between blocks."""
    inner = 0.12
    mesh = refined_mesh(box_mesh((0, 0, 0), (8, 8, 1), 0.25), [InBox((0.3, 0.3, 0.3), (0.7, 0.7, 0.7), 3)])
    assert inner**3 < mesh.spacing**3
    domain = cut_domain(mesh, chamber(inner), "multiple")
    (found,) = closed_off(Water(mesh, domain, lambda x: x[:, 2] - 0.85))
    assert found.volume == pytest.approx(inner**3, rel=1e-6)
    np.testing.assert_allclose(found.place, 0.5, atol=1e-6)
