"""The drawn water is the computed water: the skin encloses exactly the volume of the linear level set."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coupler.commands.view.water_surface import shading_normals, skin, surfaces_of_pockets
from tests.coupler.synthetic_run import tank_mesh

SIZE = (3.0, 2.0, 2.0)
NODES, CELLS = tank_mesh(SIZE, 0.5)


def area_vectors(corners):
    """Area times outward normal (t, 3) of triangles (t, 3, 3)."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2


def volume(corners):
    """Volume inside closed triangles: V = 1/3 ∮ x · n dA."""
    return np.einsum("ti,ti->", corners.mean(axis=1), area_vectors(corners)) / 3


def test_still_water_is_the_box_below_its_level():
    """Level at 0.8 m in a box of 3 m x 2 m: 4.8 m³, exactly; all normals of the free surface point up."""
    level_set = NODES[:, 2] - 0.8
    found = skin(NODES, CELLS, level_set)
    corners = found.of(NODES)
    assert volume(corners) == pytest.approx(4.8, rel=1e-13)
    normal = shading_normals(found, NODES, CELLS, level_set)
    np.testing.assert_allclose(
        normal[: found.free], np.broadcast_to([0, 0, 1.0], normal[: found.free].shape), atol=1e-12
    )
    assert area_vectors(corners[: found.free])[:, 2].sum() == pytest.approx(6.0, rel=1e-13)


@given(
    slope=st.tuples(st.floats(-1, 1), st.floats(-1, 1)),
    level=st.floats(0.1, 1.9),
)
@settings(max_examples=40, deadline=None)
def test_tilted_water_has_the_volume_of_its_mean_level(slope, level):
    """A plane through the middle at height z0 that stays between floor and lid holds A z0, whatever its tilt."""
    a, b = (
        np.array(slope) * min(level, 2 - level) / 2.6
    )  # 1.5 |a| + 1 |b| stays below the smaller of z0, 2 - z0
    level_set = NODES[:, 2] - level - a * (NODES[:, 0] - 1.5) - b * (NODES[:, 1] - 1.0)
    found = skin(NODES, CELLS, level_set)
    assert volume(found.of(NODES)) == pytest.approx(6.0 * level, rel=1e-11)


@given(seed=st.integers(0, 10_000), kept=st.floats(0.3, 1.0))
@settings(max_examples=40, deadline=None)
def test_the_skin_is_closed_for_any_water_in_any_mesh(seed, kept):
    """∮ n dA = 0: no hole and no triangle turned inside out, with cells missing and nodes exactly on the surface."""
    rng = np.random.default_rng(seed)
    cells = CELLS[rng.random(len(CELLS)) < kept]
    cells = np.where(
        rng.random(len(cells))[:, None] < 0.5, cells, cells[:, [1, 0, 2, 3]]
    )  # left- and right-handed
    level_set = np.round(rng.normal(size=len(NODES)), 1)
    corners = skin(NODES, cells, level_set).of(NODES)
    np.testing.assert_allclose(area_vectors(corners).sum(axis=0), 0.0, atol=1e-12)
    assert volume(corners) >= 0.0


def test_a_drop_is_round_to_second_order():
    """Linear cells under a curved surface: the missing volume falls with h²."""
    error = []
    for h in (0.25, 0.125):
        nodes, cells = tank_mesh((2.0, 2.0, 2.0), h)
        found = skin(nodes, cells, np.linalg.norm(nodes - 1.0, axis=1) - 0.7)
        error.append(abs(volume(found.of(nodes)) / (4 / 3 * np.pi * 0.7**3) - 1))
    assert np.log2(error[0] / error[1]) > 1.8
    assert error[1] < 0.02


def test_no_water_has_no_skin():
    """A dry step draws nothing and does not fail."""
    found = skin(NODES, CELLS, np.ones(len(NODES)))
    assert found.of(NODES).shape == (0, 3, 3)
    assert shading_normals(found, NODES, CELLS, np.ones(len(NODES))).shape == (0, 3, 3)


def test_faces_of_cut_cells_are_no_skin_unless_they_lie_in_a_side_of_the_tank():
    """A full box; one cell in its middle has a body in it, so the cells beside it end there: those ends are no water
    that is seen. The sides of the tank are, also where a cell at them is cut."""
    nodes, cells = tank_mesh((3.0, 3.0, 3.0), 1.0)
    middle = nodes[cells].mean(axis=1)
    inside = (np.abs(middle - 1.5) < 0.5).all(axis=1)
    near = (np.abs(middle - 1.5) < 1.5).all(axis=1)
    fraction = np.where(near, 0.9, 1.0)[~inside]
    tank = np.array([[0.0, 0, 0], [3.0, 3, 3]])
    wet = np.full(len(nodes), -1.0)
    plain, clean = (
        area(skin(nodes, cells[~inside], wet, *more).of(nodes)) for more in ((), (fraction, tank))
    )
    assert plain == pytest.approx(6 * 9.0 + 6 * 1.0)
    assert clean == pytest.approx(6 * 9.0)


def area(triangles):
    return (
        0.5
        * np.linalg.norm(
            np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
        ).sum()
    )


def test_each_pocket_of_air_has_the_surface_below_it_and_its_pressure():
    """Two chambers of one tank with open air between, the larger one first, and at its ends a part of a cell."""
    level_set = NODES[:, 2] - 0.8
    dry = level_set >= 0.0
    pocket = np.where(dry & (NODES[:, 0] < 0.6), 4, np.where(dry & (NODES[:, 0] > 1.4), 7, 0))
    pressure = np.select([pocket == 4, pocket == 7], [-250.0, 1500.0], 9e9)
    found = surfaces_of_pockets(NODES, CELLS, level_set, pocket, pressure)
    assert [(number, held) for number, held, _ in found] == [(7, 1500.0), (4, -250.0)]
    area = [np.linalg.norm(area_vectors(corners), axis=1).sum() for *_, corners in found]
    assert 3.0 <= area[0] <= 4.0
    assert 1.0 <= area[1] <= 2.0
    assert surfaces_of_pockets(NODES, CELLS, level_set, 0 * pocket, pressure) == []
