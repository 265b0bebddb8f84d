"""The factor by which the structure answers a load."""

import numpy as np
import pytest
import scipy.sparse as sp

from coupler.step.block_factor import BlockFactor


def bodies_on_springs(ties, n, rng, stiffness=1e6):
    """Matrix (6n, 6n) of n bodies of 1 to 3 kg, of which each pair in `ties` is joined by a spring for two of the six
    directions between them, stiffer than the bodies are heavy."""
    matrix = np.diag(rng.uniform(1.0, 3.0, 6 * n))
    for a, b in ties:
        for _ in range(2):
            arm = np.zeros(6 * n)
            arm[6 * a : 6 * a + 6] = rng.normal(size=6)
            arm[6 * b : 6 * b + 6] = rng.normal(size=6)
            matrix += stiffness * np.outer(arm, arm)
    return matrix


def assert_solved(matrix, found, right):
    """What is left of each row is round-off of the products in it."""
    size = np.abs(matrix) @ np.abs(found) + np.abs(right)
    assert (np.abs(matrix @ found - right) <= 1e-13 * size).all()


def wall(columns, rows):
    """Pairs of the blocks of a wall that lie side by side or on one another."""
    at = np.arange(columns * rows).reshape(rows, columns)
    return np.concatenate(
        [np.stack([at[:, 1:], at[:, :-1]], -1).reshape(-1, 2), np.stack([at[1:], at[:-1]], -1).reshape(-1, 2)]
    )


@pytest.mark.parametrize(
    ("ties", "n"),
    [
        (np.zeros((0, 2), int), 3),  # loose bodies
        (np.array([[0, 1], [1, 2], [2, 3], [3, 0], [5, 6]]), 8),  # a ring, a pair, and two alone
        (np.array([[0, k] for k in range(1, 9)]), 9),  # all on one, which goes last
        (wall(7, 5), 35),
        (np.array([[a, b] for a in range(6) for b in range(a)]), 6),  # each on each
    ],
)
def test_the_answer_solves_the_system_to_round_off(ties, n):
    """Also in the worst order of the bodies, and where the bodies of a wall fill the factor beyond the matrix."""
    rng = np.random.default_rng(n)
    for shuffled in (np.arange(n), rng.permutation(n)):
        matrix = bodies_on_springs(shuffled[ties], n, rng)
        right = rng.normal(size=6 * n)
        found = BlockFactor.of(sp.csr_array(matrix), np.ones(n, bool)).solve(right)
        assert_solved(matrix, found, right)


def test_bodies_that_are_held_stay_out_of_it():
    """Those tied to a held body answer as if it stood still: their own springs stay, its row does not count."""
    rng = np.random.default_rng(3)
    matrix, right, free = bodies_on_springs(wall(4, 3), 12, rng), rng.normal(size=72), np.ones(12, bool)
    free[[1, 6]] = False
    found = BlockFactor.of(sp.csr_array(matrix), free).solve(right)
    of_free = np.repeat(free, 6)
    assert (found[~of_free] == 0.0).all()
    assert_solved(matrix[np.ix_(of_free, of_free)], found[of_free], right[of_free])


def test_a_tree_of_bodies_is_factored_without_further_blocks():
    """Those with one tie go first, so no two bodies are tied that were not: work in proportion to the ties."""
    n = 200
    rng = np.random.default_rng(1)
    ties = np.array([[k, rng.integers(k)] for k in range(1, n)])
    factor = BlockFactor.of(sp.csr_array(bodies_on_springs(ties, n, rng)), np.ones(n, bool))
    assert len(factor.below) == len(ties)


def test_zeros_tie_no_bodies():
    """Springs that act no longer leave entries of zero, which stay in the matrix."""
    matrix = sp.csr_array(np.ones((18, 18)))
    matrix.data[:] = np.eye(18).ravel()
    factor = BlockFactor.of(matrix, np.ones(3, bool))
    assert len(factor.below) == 0
    assert factor.solve(np.arange(18.0)) == pytest.approx(np.arange(18.0))
