"""The multigrid cycle: a symmetric positive definite preconditioner whose work does not depend on size or shape."""

import numpy as np
import pytest
import scipy.sparse as sp

import kernels.threads as threads
from fluid.cut.bodies import ConvexBodies
from fluid.numerics import multigrid
from fluid.numerics.multigrid import Multigrid
from fluid.numerics.solve import solve
from tests.fluid.scenes import tank


def laplace(nx, ny, nz, weights=(1.0, 1.0, 1.0)):
    """Seven-point Laplacian, zero outside; weights of the three directions."""

    def line(n):
        return sp.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(n, n))

    one = [sp.eye_array(n) for n in (nx, ny, nz)]
    terms = [
        sp.kron(sp.kron(line(nx), one[1]), one[2]),
        sp.kron(sp.kron(one[0], line(ny)), one[2]),
        sp.kron(sp.kron(one[0], one[1]), line(nz)),
    ]
    return sp.csr_array(sum(w * t for w, t in zip(weights, terms)))


def applied(A):
    """M⁻¹ as a dense matrix."""
    cycle = Multigrid(A)
    return np.column_stack([cycle(e) for e in np.eye(A.shape[0])])


def pressure_system(cell):
    """Water half full in a tank with a box and a tilted surface."""
    box = ConvexBodies.boxes([[1.3, 0.5, 0.3]], [[0.2, 0.4, 0.6]])
    water = tank((2, 1, 1), cell, lambda x: x[:, 2] - 0.5 + 0.1 * (x[:, 0] - 1.0), box)
    return water.predict(water.stable_step())


@pytest.mark.parametrize("shape", [(5, 6, 7), (40, 3, 3), (300, 1, 1)])
def test_the_cycle_is_symmetric_and_positive_definite(shape):
    """What conjugate gradients need of it."""
    M = applied(laplace(*shape))
    np.testing.assert_allclose(M, M.T, atol=1e-13 * np.abs(M).max())
    assert np.linalg.eigvalsh((M + M.T) / 2).min() > 0.0


def test_iterations_hardly_grow_with_the_number_of_unknowns():
    """By a factor 1.3 at most from 1 100 to 8 000 unknowns, where the diagonal needs twice as many."""
    count = []
    for cell in (0.1, 0.05):
        p = pressure_system(cell)
        count.append(solve(p.matrix, p.rhs, np.zeros(len(p.rhs)), 1e-8).iterations)
    assert count[0] < 20
    assert count[-1] <= 1.3 * count[0]


@pytest.mark.parametrize("weights", [(1, 1, 100), (1, 100, 100), (1, 10, 1000)])
def test_flat_cells_cost_few_iterations_more(weights):
    """Strong couplings are taken together first: 12 x 12 x 12 lattices stretched up to 30-fold."""
    A = laplace(12, 12, 12, weights)
    b = np.random.default_rng(0).normal(size=A.shape[0])
    assert solve(A, b, np.zeros(len(b)), 1e-8).iterations < 30


def test_nothing_is_joined_that_is_not_coupled():
    """Two tanks in one matrix, no entry between them: every aggregate lies in one of them."""
    one = laplace(8, 8, 8)
    A = sp.csr_array(sp.block_diag([one, one]))
    cycle = Multigrid(A)
    tank_of = np.repeat([0, 1], 512)
    for level in cycle.levels:
        count = level.aggregate.max() + 1
        share = np.bincount(level.aggregate, tank_of, minlength=count) / np.bincount(level.aggregate)
        assert set(share) == {0.0, 1.0}
        tank_of = share.astype(int)


def test_single_unknowns_and_drops_are_solved():
    """Spray: a thousand unknowns without neighbours and a thousand pairs beside a body of water."""
    pairs = sp.block_diag([np.array([[2.0, -1.0], [-1.0, 2.0]])] * 1000)
    A = sp.csr_array(sp.block_diag([laplace(10, 10, 10), sp.diags_array(np.linspace(1, 10, 1000)), pairs]))
    exact = np.random.default_rng(1).normal(size=A.shape[0])
    result = solve(A, A @ exact, np.zeros(A.shape[0]), 1e-12)
    assert result.iterations < 25
    np.testing.assert_allclose(result.x, exact, atol=1e-9)


def test_a_last_level_too_large_for_its_inverse_is_swept():
    """Positive couplings are never joined, so this matrix has one level: the cycle is then Gauss-Seidel, and still
    symmetric."""
    A = sp.csr_array(sp.diags_array([0.3, 1.0, 0.3], offsets=[-1, 0, 1], shape=(250, 250)))
    M = applied(A)
    np.testing.assert_allclose(M, M.T, atol=1e-13)
    np.testing.assert_allclose(M @ (A @ np.ones(250)), np.ones(250), rtol=1e-3)


def test_every_run_gives_the_same_digits():
    p = pressure_system(0.1)
    first, second = (solve(p.matrix, p.rhs, np.zeros(len(p.rhs)), 1e-8).x for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_sweeps_by_blocks_are_symmetric_and_cost_few_iterations_more(monkeypatch):
    """Blocks of 100 unknowns on levels of 200 and more: still symmetric and positive definite, four iterations more at
    most, and a cycle of one thread and of three has the same bits."""
    A = laplace(9, 8, 7)
    whole = solve(A, np.ones(A.shape[0]), np.zeros(A.shape[0]), 1e-8, kept=[Multigrid(A)]).iterations
    monkeypatch.setattr(multigrid, "BLOCK", 100)
    M = applied(A)
    np.testing.assert_allclose(M, M.T, atol=1e-13 * np.abs(M).max())
    assert np.linalg.eigvalsh((M + M.T) / 2).min() > 0.0
    assert not np.array_equal(M, applied_whole(A, monkeypatch))
    cycle, r = Multigrid(A), np.random.default_rng(3).normal(size=A.shape[0])
    assert len(cycle.levels[0].blocks()) == 6
    blocks = solve(A, np.ones(A.shape[0]), np.zeros(A.shape[0]), 1e-8, kept=[cycle]).iterations
    assert whole <= blocks <= whole + 4
    alone = cycle(r)
    threads.use(3, least=1)
    try:
        np.testing.assert_array_equal(cycle(r), alone)
    finally:
        threads.use(1)


def applied_whole(A, monkeypatch):
    """`applied` without blocks."""
    with monkeypatch.context() as without:
        without.setattr(multigrid, "BLOCK", 10**9)
        return applied(A)


def _parts_of(A):
    """The parts of `multigrid._split` from dense rows."""
    n, rows = A.shape[0], [A[[i]].toarray()[0] for i in range(A.shape[0])]
    left = [[(j, r[j]) for j in np.flatnonzero(r) if j < i] for i, r in enumerate(rows)]
    right = [[(j, r[j]) for j in np.flatnonzero(r) if j > i] for i, r in enumerate(rows)]
    start = np.cumsum([0, *(len(a) + len(b) for a, b in zip(left, right))])
    entries = [entry for a, b in zip(left, right) for entry in a + b]
    middle = start[:-1] + [len(a) for a in left]
    return start, middle, [j for j, _ in entries], [v for _, v in entries], [rows[i][i] for i in range(n)]


@pytest.mark.parametrize("diagonal", ["one", "missing", "double"])
def test_rows_are_parted_at_the_diagonal(diagonal):
    """On any number of threads; also where a row has no entry there, or two that add up."""
    A = laplace(6, 5, 4)
    if diagonal == "missing":
        A = sp.csr_array(A - sp.diags_array(A.diagonal() * (np.arange(A.shape[0]) % 7 == 3)))
        A.eliminate_zeros()
    expected, rows = _parts_of(A), (A.indptr, A.indices, A.data)
    if diagonal == "double":
        one = A.tocoo()
        on = one.row == one.col
        row, col = np.concatenate([one.row, one.row[on]]), np.concatenate([one.col, one.col[on]])
        data = np.concatenate([np.where(on, 0.75, 1.0) * one.data, 0.25 * one.data[on]])
        order = np.argsort(row, kind="stable")
        indptr = np.concatenate([[0], np.cumsum(np.bincount(row))]).astype(np.int32)
        rows = (indptr, col[order].astype(np.int32), data[order])
    indptr, indices, data = rows
    for number in (1, 2, 3, 4):
        threads.use(number, least=1)
        found = multigrid._split(indptr.view(np.uint32), indices.view(np.uint32), data)
        threads.use(1)
        for part, given in zip(found, expected):
            np.testing.assert_array_equal(part, given)
