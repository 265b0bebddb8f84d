"""The depth beside a body is read where the cells that it cuts end, whatever the cells elsewhere."""

from types import SimpleNamespace

import numpy as np
import pytest

from coupler.verdict.depths import OUTSIDE, depths_around
from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.mesh.refinement import InBox, refined_mesh
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water

FINE = 0.125
"""Cells beside the house [m]."""
NEAR = InBox((2.4, 2.4, 0.0), (5.6, 5.6, 2.0), 3)
LOWER, UPPER = np.array([[3.5, 3.5, 0.0]]), np.array([[4.5, 4.5, 2.0]])


def pond(mesh):
    """Water 0.8 m deep within half a metre of a house of 1 m by 1 m."""
    domain = cut_domain(mesh, ConvexBodies.boxes([[4, 4, 0.5]], [[1, 1, 3.0]]), "single")

    def level(x):
        return np.maximum(x[:, 2] - 0.8, np.abs(x[:, :2] - 4.0).max(axis=1) - 1.0)

    return Water(mesh, domain, level, WaterParameters())


@pytest.mark.parametrize(
    "mesh",
    [
        box_mesh((0, 0, 0), (8, 8, 2), FINE),
        refined_mesh(box_mesh((-20, -20, 0), (28, 28, 2), 1.0), [NEAR]),
    ],
    ids=["equal cells", "refined in a large tank"],
)
def test_the_depth_is_read_beside_the_house_in_cells_of_its_place(mesh):
    """In the large tank it was read 0.92 m from the house, seven fine cells, where it is dry."""
    house = SimpleNamespace(names=["house"], rows=lambda k: np.array([0]))
    (depth,), (place,) = depths_around(pond(mesh), house, LOWER, UPPER)
    assert depth == pytest.approx(0.8, abs=1e-3)
    away = np.abs(place - 4.0).max() - 0.5
    assert away == pytest.approx(OUTSIDE * FINE)
    assert away > FINE  # the cells that a house cuts, wherever in them its side lies, end before the place
