"""The smallest water and the smallest structure, so that the coupler is tested without either engine."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp


@dataclass(frozen=True)
class FakeProblem:
    """A PressureProblem made of given matrices."""

    matrix: sp.csr_array
    rhs: np.ndarray
    coupling: sp.csr_array
    known: np.ndarray
    guess: np.ndarray


def piston_column(length=1.0, area=1.0, cells=10, dt=0.01, density=1000.0, known=0.0) -> FakeProblem:
    """A horizontal pipe of water at rest between a free surface (p = 0) at 0 and a piston at `length`.

    Linear finite elements in one dimension; the water moves as one mass, density * area * length.
    """
    h = length / cells
    main = np.r_[np.full(cells - 1, 2.0), 1.0] * area / h
    off = np.full(cells - 1, -area / h)
    K = sp.diags_array([off, main, off], offsets=[-1, 0, 1])
    coupling = np.zeros((cells, 6))
    coupling[-1, 0] = -area  # out of the piston into the water: towards smaller x
    return FakeProblem(
        sp.csr_array(K * dt / density),
        np.zeros(cells),
        sp.csr_array(coupling),
        np.full(cells, known),
        np.zeros(cells),
    )


@dataclass(frozen=True)
class DirectResult:
    x: np.ndarray
    iterations: int
    residual: float


def direct_solve(A, b, x0, rtol, extra=None) -> DirectResult:
    """The linear solver of the fakes: dense, exact, with the same call as the water's."""
    dense = A.toarray()
    if extra is not None:
        dense = dense + np.column_stack([extra(e) for e in np.eye(len(b))])
    return DirectResult(np.linalg.solve(dense, b), 1, 0.0)
