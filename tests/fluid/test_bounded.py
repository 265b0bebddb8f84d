"""Pressure with a lower bound: the complementarity problem, and water that parts instead of pulling."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st

from fluid.cut.bodies import ConvexBodies
from fluid.numerics.bounded import solve_bounded
from fluid.numerics.solve import NotConverged, solve
from tests.fluid.scenes import advance, tank


def system(n: int, seed: int):
    """A symmetric positive definite matrix (n, n) with entries of both signs off its diagonal, b (n,), l (n,)."""
    rng = np.random.default_rng(seed)
    half = sp.random_array((n, n), density=min(1.0, 4.0 / n), rng=rng)
    A = sp.csr_array(half @ half.T + sp.diags_array(np.full(n, 0.1)))
    return A, rng.standard_normal(n), 0.1 * rng.standard_normal(n)


@given(st.integers(1, 60), st.integers(0, 10_000), st.booleans())
def test_the_three_conditions_hold_for_any_matrix_and_first_guess(n, seed, guessed):
    A, b, lower = system(n, seed)
    guess = np.random.default_rng(seed + 1).random(n) < 0.5 if guessed else None
    found = solve_bounded(A, b, np.zeros(n), 1e-12, lower, guess)
    apart = A @ found.x - b
    scale = np.linalg.norm(b)
    assert (found.x >= lower - 1e-5 * np.abs(found.x).max()).all()
    assert (found.x[found.at_bound] == lower[found.at_bound]).all()
    assert (apart[found.at_bound] >= -1e-10 * scale).all()
    np.testing.assert_allclose(apart[~found.at_bound], 0.0, atol=1e-10 * scale)
    np.testing.assert_allclose(
        found.parting, np.where(found.at_bound, np.maximum(apart, 0.0), 0.0), atol=1e-12
    )


def test_the_solution_does_not_depend_on_the_first_guess_of_the_set():
    A, b, lower = system(40, 3)
    first = solve_bounded(A, b, np.zeros(40), 1e-12, lower)
    again = solve_bounded(A, b, first.x, 1e-12, lower, ~first.at_bound)
    np.testing.assert_array_equal(first.at_bound, again.at_bound)
    np.testing.assert_allclose(first.x, again.x, atol=1e-9)


def test_where_nothing_meets_the_bound_the_bits_are_those_of_the_plain_solver():
    """Still water and waves must not change by a bit because there could have been a bound."""
    A, b, _ = system(2000, 5)
    plain = solve(A, b, np.zeros(2000), 1e-8)
    bounded = solve_bounded(A, b, np.zeros(2000), 1e-8, np.full(2000, plain.x.min() - 1.0))
    np.testing.assert_array_equal(plain.x, bounded.x)
    assert not bounded.at_bound.any()


def test_an_operator_inside_the_matrix_counts_for_the_bound_too():
    """A rank-one term, like a body: the same as with the term written into the matrix."""
    A, b, lower = system(30, 7)
    v = np.random.default_rng(8).standard_normal(30)
    inside = solve_bounded(A, b, np.zeros(30), 1e-12, lower, extra=lambda x: v * (v @ x))
    written = solve_bounded(sp.csr_array(A + sp.csr_array(np.outer(v, v))), b, np.zeros(30), 1e-12, lower)
    np.testing.assert_allclose(inside.x, written.x, atol=1e-9)


def test_a_matrix_that_is_not_definite_is_refused():
    A = sp.csr_array(sp.diags_array([1.0, -1.0]))
    with pytest.raises(NotConverged):
        solve_bounded(A, np.ones(2), np.zeros(2), 1e-10, np.full(2, -10.0))


def plate_that_leaves(steps: int, **settings):
    """A tank of still water with a plate in its surface that is pulled up at 1 m/s: the water after so many steps of
    10 ms, and the bound of the pressure, the pressure [Pa] and the lift [N] of the last one."""
    plate = ConvexBodies.boxes([[0.5, 0.5, 0.65]], [[0.5, 0.5, 0.3]])
    water = tank([1, 1, 1], 0.1, lambda x: x[:, 2] - 0.52, plate, **settings)
    for _ in range(steps):
        problem, x = advance(water, 0.01, np.array([0, 0, 1.0, 0, 0, 0]))
    lift = problem.load(x)[0, 2]
    return water, problem.bound, x + problem.known, lift


def test_air_comes_under_a_plate_that_leaves_the_water():
    """Beside the air the pressure does not fall below it; where the water parts there, air goes on at once, so that
    nothing holds the plate. Without the bound the water pulls at it with kilopascals for ever."""
    water, bound, pressure, lift = plate_that_leaves(1)
    assert (bound == 0.0).any()
    assert (bound < 0.0).any()
    assert pressure.min() >= -1e-5 * np.abs(pressure).max()
    assert water.report.bound.volume > 0.0
    _, none, free, pulled = plate_that_leaves(6, suction="unlimited")
    assert none is None
    assert free.min() < -1e3
    assert pulled < -1.0
    assert lift > 0.02 * pulled


def test_cavities_open_at_the_pressure_of_vapour_where_no_air_comes():
    """A closed box full of water but for its free surface far away: a plate deep in it that is torn away at 200 m/s
    leaves its water at the vapour pressure and no lower; the work on the vapour is in the report."""
    plate = ConvexBodies.boxes([[0.5, 0.5, 0.35]], [[0.4, 0.4, 0.2]])
    water = tank([1, 1, 1], 0.1, lambda x: x[:, 2] - 0.9, plate)
    advance(water, 1e-3, np.array([0, 0, 200.0, 0, 0, 0]))
    bound = water.report.bound
    assert bound.lowest == pytest.approx(-98e3, rel=1e-9)
    assert bound.work == pytest.approx(98e3 * bound.volume, rel=1e-6)
    assert bound.volume > 0.0
    assert water.at_bound.any()
    assert not water.ventilated[water.at_bound].any()


@pytest.mark.parametrize("settings", [{"suction": "none"}, {"vapour_pressure": 1.0}])
def test_settings_of_the_bound_are_checked(settings):
    with pytest.raises(ValueError, match=r"suction|vapour_pressure"):
        tank([1, 1, 1], 0.5, lambda x: x[:, 2] - 0.5, **settings)
