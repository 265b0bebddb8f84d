"""Symmetric positive definite systems: conjugate gradients behind one function.

Preconditioner: the diagonal for small systems, else a multigrid cycle (`multigrid.py`); `surgebreak benchmark --only
solver` compares it with others on pressure systems.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from array_types import Array, Floats
from fluid.numerics.multigrid import Multigrid, unsigned
from kernels.decorators import ranged
from kernels.threads import over

MULTIGRID_FROM = 1_000
MULTIGRID_FROM_WITH_EXTRA = 300
"""Number of unknowns from which multigrid pays; it pays earlier with an extra operator, which costs a solve in every
iteration."""
MOST_ITERATIONS = 2000


class NotConverged(RuntimeError):
    """The linear solver stopped above its tolerance; `history` holds the residual norms of every iteration, `unknown`
    the row where it is worst, None where that has no meaning."""

    def __init__(self, message: str, history: Array, unknown: int | None = None):
        super().__init__(message)
        self.history, self.unknown = history, unknown


@dataclass(frozen=True)
class SolveResult:
    """x (n,) · iterations · residual, ‖b - A x‖ / ‖b‖."""

    x: Floats
    iterations: int
    residual: float


def solve(
    A,
    b,
    x0,
    rtol: float,
    extra: Callable | None = None,
    most: int = MOST_ITERATIONS,
    kept: list | None = None,
) -> SolveResult:
    """x with ‖b - (A + extra) x‖ ≤ rtol ‖b‖ by preconditioned conjugate gradients from x0.

    A: csr (n, n), symmetric positive definite · b, x0 (n,) · extra: v ↦ S v, S symmetric positive semidefinite.
    kept: an empty list receives the preconditioner; pass it again with the same A.
    Raises NotConverged after `most` iterations or when A turns out not to be positive definite."""
    if np.linalg.norm(b) == 0.0:
        return SolveResult(np.zeros_like(b), 0, 0.0)
    apply, precondition = operators(A, extra, kept)
    return conjugate_gradients(apply, precondition, b, np.array(x0, float), rtol, most)


def operators(A, extra: Callable | None = None, kept: list | None = None) -> tuple[Callable, Callable]:
    """v ↦ (A + extra) v, and a preconditioner of it; arguments of `solve`."""
    kept = [] if kept is None else kept
    if not kept:
        kept.append(_preconditioner(A, MULTIGRID_FROM if extra is None else MULTIGRID_FROM_WITH_EXTRA))
    rows = (*unsigned(A), A.data)
    apply = (lambda v: _product(*rows, v)) if extra is None else (lambda v: _product(*rows, v) + extra(v))
    return apply, kept[0]


def conjugate_gradients(
    apply: Callable,
    precondition: Callable,
    b,
    x,
    rtol: float,
    most: int = MOST_ITERATIONS,
    held=None,
    enough: Callable | None = None,
) -> SolveResult:
    """Preconditioned conjugate gradients from x (n,), which is overwritten, down to a residual of rtol ‖b‖.

    held (n,) bool: unknowns that keep their value, and whose rows do not count; None: all are free.
    enough: called with x after every iteration; True ends the iteration there.
    Raises NotConverged."""
    scale = float(np.linalg.norm(b)) or 1.0
    free = _all if held is None else partial(_without, held)
    r = free(b - apply(x))
    history = [_length(r) / scale]
    p = rz = None
    while not history[-1] <= rtol:
        if len(history) > most or not np.isfinite(history[-1]):
            raise _failure("did not converge", history, rtol, r)
        z = free(precondition(r))
        rz, rz_before = r @ z, rz
        if p is None:
            p = z
        else:
            over(_turn, len(p), z, rz / rz_before, p)
        Ap = free(apply(p))
        curvature = p @ Ap
        if curvature <= 0.0:
            raise _failure(f"met a direction of curvature {curvature:.3g} ≤ 0", history, rtol, p)
        over(_advance, len(x), rz / curvature, p, Ap, x, r)
        history.append(_length(r) / scale)
        if enough is not None and enough(x, history[-1]):
            break
    return SolveResult(x, len(history) - 1, history[-1])


def _all(v):
    return v


def _without(held, v):
    """v (n,) with zeros where held, in place."""
    v[held] = 0.0
    return v


def _length(v) -> float:
    """np.linalg.norm of v (n,), to the bit."""
    return math.sqrt(v @ v)


@ranged
def _turn(first, last, z, share, p):
    """z + share p (n,) in the place of p."""
    for k in range(first, last):
        i = np.uint64(k)
        p[i] = z[i] + share * p[i]


@ranged
def _advance(first, last, share, p, Ap, x, r):
    """x + share p and r - share Ap in place."""
    for k in range(first, last):
        i = np.uint64(k)
        x[i] += share * p[i]
        r[i] -= share * Ap[i]


def product(A, v):
    """A v (n,) of a csr matrix."""
    return _product(*unsigned(A), A.data, v)


def _product(indptr, indices, data, v):
    """A v (n,): for small systems scipy spends most of its time before it multiplies."""
    out = np.empty(len(v))
    over(_rows, len(v), indptr, indices, data, v, out)
    return out


@ranged
def _rows(first, last, indptr, indices, data, v, out):
    for k in range(first, last):
        i = np.uint64(k)
        total = 0.0
        for s in range(indptr[i], indptr[i + np.uint64(1)]):
            total += data[s] * v[indices[s]]
        out[i] = total


def _preconditioner(A, multigrid_from: int) -> Callable:
    if A.shape[0] < multigrid_from:
        inverse = 1.0 / A.diagonal()
        return lambda r: inverse * r
    return Multigrid(A)


def _failure(what: str, history, rtol: float, vector) -> NotConverged:
    """vector (n,): the residual, or the direction of breakdown; its largest entry names the worst unknown."""
    text = (
        f"pressure solver {what} after {len(history) - 1} iterations: residual {history[-1]:.3g}, wanted {rtol:.3g}, "
        f"{len(vector)} unknowns, last residuals {', '.join(f'{r:.2g}' for r in history[-5:])}."
    )
    return NotConverged(text, np.array(history), int(np.argmax(np.abs(vector))))
