"""Transport: exact for linear fields, limited without a jump, paths stop at walls and never pass through a thin one."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.domain.topology import Topology
from fluid.mesh.background import Background, box_mesh
from fluid.transport.advection import COUNTED_IN_FULL, SWEEPS, TAKEN_BACK, Fields, carried, feet
from tests.fluid.scenes import transport


@pytest.fixture(scope="module", params=["lattice", "jittered"])
def cube(request):
    mesh = box_mesh(np.zeros(3), np.ones(3), 0.125)
    if request.param == "jittered":
        x, inside = mesh.nodes.copy(), np.all((mesh.nodes > 1e-9) & (mesh.nodes < 1 - 1e-9), axis=1)
        x[inside] += np.random.default_rng(2).uniform(-0.025, 0.025, (inside.sum(), 3))
        mesh = Background.from_arrays(x, mesh.cells)
    return Topology.of(mesh, cut_domain(mesh, ConvexBodies.empty()))


@pytest.mark.parametrize("courant", [0.5, 2.0])
def test_linear_field_in_uniform_flow_is_exact(cube, courant):
    """Away from the inflow, where no foot is stopped by a wall."""
    u = np.tile([1.0, 0.6, -0.3], (len(cube.nodes), 1))
    dt = courant * 0.125
    f = cube.nodes @ [1.0, 2.0, -1.0]
    every, fields = np.arange(len(f)), np.outer(f, [2.0, -1.0, 0.5])
    moved = transport(cube, every, dt, u, fields, f, np.zeros(len(f), bool))
    upstream = cube.nodes - dt * u - 0.26 * np.sign(u)
    downstream = cube.nodes + dt * u
    inner = np.all((upstream > 0) & (upstream < 1) & (downstream > 0) & (downstream < 1), axis=1)
    assert inner.sum() > 10
    expected = (cube.nodes - dt * u) @ [1.0, 2.0, -1.0]
    expected = np.outer(expected, [2.0, -1.0, 0.5, 1.0])
    np.testing.assert_allclose(moved[inner], expected[inner], atol=1e-12)


def test_fields_are_carried_again_once_they_are_renewed(cube):
    """What the first way brought to some nodes would otherwise be taken for the field itself."""
    random = np.random.default_rng(4)
    u, f = random.normal(size=(len(cube.nodes), 3)), random.normal(size=len(cube.nodes))
    fields, closed, some = Fields.of(u, f), np.zeros(len(f), bool), np.arange(0, len(f), 3)
    carried(cube, some, 0.1, u, fields, closed)
    fields.renew(some)
    others = some[:-1] + 1
    expected = transport(cube, others, 0.05, u, u, f, closed)
    np.testing.assert_array_equal(carried(cube, others, 0.05, u, fields, closed), expected)


def test_rotation_of_a_smooth_field_converges_faster_than_first_order():
    """A quarter turn of a bump: plain semi-Lagrangian steps halve the error with h and dt, the correction does
    better in spite of its limiter."""
    errors = [_rotation_error(n) for n in (16, 32)]
    assert errors[0] / errors[1] > 2.8


def _rotation_error(n):
    mesh = box_mesh(np.zeros(3), [1, 1, 2 / n], 1 / n)
    t = Topology.of(mesh, cut_domain(mesh, ConvexBodies.empty()))
    x = t.nodes - [0.5, 0.5, 0]
    u = np.column_stack([-x[:, 1], x[:, 0], 0 * x[:, 0]])
    f = np.exp(-25 * ((x[:, 0] - 0.2) ** 2 + x[:, 1] ** 2))
    dt = 0.5 * np.pi / n
    inward = -np.column_stack([x[:, 0], x[:, 1], 0 * x[:, 0]])
    for _ in range(n):
        way = u + 0.5 * dt * inward
        f = transport(t, np.arange(len(x)), dt, way, u, f, np.zeros(len(f), bool))[:, 3].copy()
    exact = np.exp(-25 * (x[:, 0] ** 2 + (x[:, 1] - 0.2) ** 2))
    return np.abs(f - exact).mean()


def noise(cube):
    """Values (N, 4) between 0 and 1, which limit most corrections."""
    return np.random.default_rng(4).uniform(size=(len(cube.nodes), 4))


def test_limited_correction_equals_its_formula_and_stays_within_the_cell_of_the_foot(cube):
    f = noise(cube)
    swirl = np.random.default_rng(5).normal(size=(len(f), 3))
    every, nowhere, dt = np.arange(len(f)), np.zeros(len(f), bool), 0.04
    moved = transport(cube, every, dt, swirl, f[:, :3], f[:, 3], nowhere)
    (cell, weight), (ahead, share) = (
        feet(every, s, dt, n, swirl, cube.paths) for s, n in ((-1, SWEEPS), (1, 0))
    )
    corners, counted = f[cube.cells[cell]], np.minimum(weight / COUNTED_IN_FULL, 1.0)[:, :, None]
    f1 = np.einsum("na,nak->nk", weight, corners)
    change = 0.5 * (f - np.einsum("na,nak->nk", share, f1[cube.cells[ahead]]))
    reach = f1[:, None] + counted * (corners - f1[:, None])
    beyond = np.maximum(f1 + change - reach.max(axis=1), reach.min(axis=1) - f1 - change).clip(0.0)
    expected = f1 + np.sign(change) * np.maximum(np.abs(change) - TAKEN_BACK * beyond, 0.0)
    assert (beyond > 0.0).mean() > 0.1
    np.testing.assert_allclose(moved, expected, atol=1e-13)
    low, high = corners.min(axis=1), corners.max(axis=1)
    assert np.all((moved >= low - 1e-13) & (moved <= high + 1e-13))


def test_result_does_not_jump_as_paths_turn(cube):
    """Feet that go a quarter round their nodes, through all cells on their way: a quarter of the angle a step leaves a
    quarter of the largest change in a step. Where a correction was rejected as a whole, 0.2 remained, however short the
    step, and a difference in the last digit became one of the result."""
    coarse, fine = (_largest_change(cube, steps) for steps in (500, 2000))
    assert fine < 0.05, fine
    assert fine < 0.5 * coarse


def _largest_change(cube, steps):
    f, inner = noise(cube), np.all((cube.nodes > 0.3) & (cube.nodes < 0.7), axis=1)
    nowhere, largest, last = np.zeros(len(f), bool), 0.0, None
    for angle in np.linspace(0.0, 0.5 * np.pi, steps + 1):
        u = np.tile([np.cos(angle), np.sin(angle), 0.3 * np.cos(3 * angle)], (len(f), 1))
        now = transport(cube, np.arange(len(f)), 0.1, u, f[:, :3], f[:, 3], nowhere)[inner]
        largest, last = max(largest, np.abs(now - last).max() if last is not None else 0.0), now
    return largest


def test_paths_do_not_cross_a_thin_wall():
    """A wall of a third of a cell with its own nodes on either side: feet of the water on the right stay there."""
    mesh = box_mesh(np.zeros(3), np.ones(3), 0.125)
    wall = ConvexBodies.boxes(np.array([[0.52, 0.5, 0.5]]), np.array([[0.04, 1.2, 1.2]]))
    domain = cut_domain(mesh, wall, "multiple")
    t = Topology.of(mesh, domain)
    right = np.flatnonzero((t.nodes[:, 0] > 0.6) & t.active)
    u = np.tile([4.0, 0.3, 0.1], (len(t.nodes), 1))
    cell, _ = feet(
        right,
        -1.0,
        0.1,
        3,
        u,
        t.paths,
    )
    assert domain.centroid[cell, 0].min() > 0.52
