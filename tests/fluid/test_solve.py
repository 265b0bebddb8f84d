"""The linear solver: right answers from both preconditioners, and a failure that tells its history."""

import numpy as np
import pytest
import scipy.sparse as sp

from fluid.numerics import solve as solver
from fluid.numerics.solve import NotConverged, solve


def laplace(n):
    """Seven-point Laplacian on n³ points, zero outside."""
    d = sp.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(n, n))
    one = sp.eye_array(n)
    return sp.csr_array(
        sp.kron(sp.kron(d, one), one) + sp.kron(sp.kron(one, d), one) + sp.kron(sp.kron(one, one), d)
    )


@pytest.mark.parametrize("multigrid_from", [10, 10**9], ids=["multigrid", "diagonal"])
def test_solution_meets_the_tolerance(multigrid_from, monkeypatch):
    monkeypatch.setattr(solver, "MULTIGRID_FROM", multigrid_from)
    A = laplace(12)
    exact = np.random.default_rng(0).normal(size=A.shape[0])
    result = solve(A, A @ exact, np.zeros(A.shape[0]), 1e-10)
    np.testing.assert_allclose(result.x, exact, atol=1e-7)
    assert result.residual <= 1e-10


def test_added_operator_is_part_of_the_system():
    """(A + s sᵀ) x = b, the shape of the structure inside the pressure solve."""
    A, s = laplace(6), np.linspace(0, 3, 216)
    exact = np.cos(np.arange(216.0))
    result = solve(A, A @ exact + s * (s @ exact), np.zeros(216), 1e-11, extra=lambda v: s * (s @ v))
    np.testing.assert_allclose(result.x, exact, atol=1e-8)


@pytest.mark.parametrize("multigrid_from", [0, 10**9])
def test_indices_of_64_bits_are_the_same_matrix(multigrid_from, monkeypatch):
    """Sums of scipy's matrices may have them; read as 32 bits they name other rows."""
    monkeypatch.setattr(solver, "MULTIGRID_FROM", multigrid_from)
    A = laplace(12)
    long = A.copy()
    long.indptr, long.indices = A.indptr.astype(np.int64), A.indices.astype(np.int64)
    b = np.sin(np.arange(A.shape[0], dtype=float))
    found = [solve(matrix, b, np.zeros_like(b), 1e-9).x for matrix in (A, long)]
    assert np.array_equal(*found)


def test_warm_start_at_the_solution_needs_no_iteration():
    A, x = laplace(5), np.arange(125.0)
    assert solve(A, A @ x, x, 1e-8).iterations == 0


def test_zero_load_gives_zero():
    A = laplace(3)
    assert not solve(A, np.zeros(27), np.ones(27), 1e-8).x.any()


def test_failure_raises_with_the_residual_history():
    A, b = laplace(10), np.ones(1000)
    with pytest.raises(
        NotConverged, match=r"did not converge after 3 iterations: residual .* wanted 1e-14"
    ) as error:
        solve(A, b, np.zeros(1000), 1e-14, most=3)
    history = error.value.history
    assert len(history) == 4
    assert history[0] == 1.0


def test_indefinite_matrix_is_refused():
    A = sp.csr_array(sp.diags_array([1.0, 2.0, -3.0]))
    with pytest.raises(NotConverged, match="curvature"):
        solve(A, np.array([1.0, 1.0, 5.0]), np.zeros(3), 1e-12, extra=lambda v: -4.0 * v)
