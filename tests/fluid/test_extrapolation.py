"""Slopes that the velocity is continued with outside the water."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.surface.extrapolation import SWEEPS, continued, smoothed_slope
from tests.fluid.scenes import tank


def _slope_by_cells(t, cell_list, marked, u, sweeps):
    """∇u (N, 3, 3) after each number of sweeps up to `sweeps`, cell by cell, and the nodes (N,) bool that have one."""
    inside = cell_list[marked[t.cells[cell_list]].all(axis=1)]
    has = np.zeros(len(u), bool)
    has[t.cells[inside]] = True
    of_cells = np.einsum("eak,ead->ekd", u[t.cells[inside]], t.gradients[t.parent[inside]])
    total, weight = np.zeros((len(u), 3, 3)), np.zeros(len(u))
    for a in range(4):
        np.add.at(total, t.cells[inside, a], t.volume[inside, None, None] * of_cells)
        np.add.at(weight, t.cells[inside, a], t.volume[inside])
    found = [total / np.maximum(weight, 1e-300)[:, None, None]]
    corners = t.cells[cell_list]
    for _ in range(sweeps):
        known = has[corners]
        sums = (found[-1][corners] * known[:, :, None, None]).sum(axis=1)
        total, weight = np.zeros((len(u), 3, 3)), np.zeros(len(u))
        for a in range(4):
            np.add.at(total, corners[:, a], sums)
            np.add.at(weight, corners[:, a], known.sum(axis=1))
        found.append(total / np.maximum(weight, 1e-300)[:, None, None])
    return found, has


@pytest.mark.parametrize("calm", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("has_post", [False, True])
def test_slopes_are_averaged_over_the_corners_of_the_cells_around(calm, has_post):
    """The slope that the velocity is continued with, against the same averages cell by cell, at all nodes from which it
    is continued; wet nodes beside the surface without any wet cell have none."""
    post = ConvexBodies.boxes([[0.52, 0.37, 0.4]], [[0.15, 0.25, 0.8]])
    water = tank([1.0, 0.75, 1.0], 0.125, lambda x: x[:, 2] - 0.5 - 0.2 * x[:, 0], post if has_post else None)
    t, wet = water.topology, water.level_set < 0.0
    cell_list = np.flatnonzero(wet[t.cells].any(axis=1))
    u = np.random.default_rng(3).normal(size=t.nodes.shape)
    found = smoothed_slope(t, cell_list, wet, u, calm)
    swept, has = _slope_by_cells(t, cell_list, wet, u, SWEEPS + 1)
    expected = swept[1] + calm * (swept[SWEEPS] + SWEEPS * (swept[SWEEPS] - swept[SWEEPS + 1]) - swept[1])
    beside = np.zeros(len(u), bool)
    beside[t.cells[cell_list[~wet[t.cells[cell_list]].all(axis=1)]]] = True
    read = beside & wet
    assert (read & has).sum() > 20
    expected[~has] = 0.0
    assert found[read] == pytest.approx(expected[read], abs=1e-12 * np.abs(expected).max())


def test_slopes_are_set_wherever_water_is_continued_from(monkeypatch):
    """With friction no slope comes from cells beside the wall, and some wet nodes below the surface are then in none of
    the cells that count. Their slope is zero, not what the memory held before."""
    water = tank([0.6, 0.25, 0.4], 0.05, lambda x: x[:, 2] - 0.12 - 0.1 * x[:, 0])
    t, wet = water.topology, water.level_set < 0.0
    rubbed = t.nodes[:, 2] < 1e-9
    cell_list = np.flatnonzero(wet[t.cells].any(axis=1) & ~rubbed[t.cells].any(axis=1))
    empty = np.empty
    monkeypatch.setattr(
        np, "empty", lambda *a, **k: np.full(*a, np.nan, **k) if not a[1:] else empty(*a, **k)
    )
    for calm in (0.0, 0.5):
        found = smoothed_slope(t, cell_list, wet, np.ones((len(wet), 3)), calm)
        assert np.isfinite(found[wet]).all()


def test_a_node_is_continued_to_from_what_is_around_it_alone():
    """The velocity at a few nodes around the water has the digits that it has if the whole layer is continued, which
    takes a multiple of the time."""
    post = ConvexBodies.boxes([[0.52, 0.37, 0.4]], [[0.15, 0.25, 0.8]])
    water = tank([1.0, 0.75, 1.0], 0.125, lambda x: x[:, 2] - 0.5 - 0.2 * x[:, 0], post)
    u = np.random.default_rng(5).normal(size=water.topology.nodes.shape)
    for last in (1, 2):
        layers = (water.listed, water.layer_start[: last + 2])
        around = water.listed[water.layer_start[last] : water.layer_start[last + 1]]
        whole = continued(water.topology, layers, u, water.listed[water.layer_start[1] :])
        for wanted in (around[:1], around[::7]):
            some = continued(water.topology, layers, u, wanted)
            np.testing.assert_array_equal(some[wanted], whole[wanted])
