"""Pressure with a lower bound: water separates where its pressure would fall below the bound.

    x ≥ l,    A x - b ≥ 0,    (x - l)·(A x - b) = 0                                                         (1)

Where x lies above its bound the mass balance A x = b holds; where it is at the bound, A x - b [m³/s] is the rate at
which the water separates there, from itself or from a wall.  For a symmetric positive definite A there is one solution.
It is found by block principal pivoting: solve with the unknowns of a set held at their bound, exchange all that have
the wrong sign, and repeat; where this does not reduce their number for some rounds, exchange one at a time for a while
(the last one; this alone would end after finitely many rounds: Murty's rule; Judice and Pires, Comput. Oper. Res. 21
(1994) 587).  From the set of the step before, one to three rounds suffice.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from array_types import Bools, Floats
from fluid.numerics.solve import MOST_ITERATIONS, NotConverged, conjugate_gradients, operators, solve
from kernels.decorators import kernel, ranged
from kernels.threads import over

LOOSE = 1e-3
"""Residual at which a round with unknowns far below their bound ends; the next one continues from there."""
FAR_BELOW, SLACK = 1e-2, 1e-6
"""Shares of the largest |x| by which x may lie below its bound: beyond the first a round ends early, within the second
x is accepted."""
UNSETTLED = 10.0
"""Rate at which water may converge at the bound, in residuals of the solver, which is no more exact than that."""
REACH = 8
"""Number of cells over which air advances within a step: it is faster than any water."""
PATIENCE = 5
"""Rounds without fewer wrong signs after which single unknowns are exchanged."""
SINGLES = 10
"""Single exchanges after which all unknowns of wrong sign are tried again: the first, loosely solved rounds may have
shown few of them, and hundreds of single exchanges would be needed to come below that number."""
MOST_ROUNDS = 100


@dataclass(frozen=True, kw_only=True)
class BoundedResult:
    """x (n,) · at_bound (n,) bool: held at the bound · parting (n,) [m³/s]: A x - b there, 0 elsewhere · lower (n,):
    bound at the end, None without a bound · iterations of all rounds · residual of the free rows over ‖b‖ · rounds."""

    x: Floats
    at_bound: Bools
    parting: Floats
    lower: Floats | None
    iterations: int
    residual: float
    rounds: int


def solve_bounded(
    A,
    b,
    x0,
    rtol: float,
    lower=None,
    at_bound=None,
    air=None,
    extra: Callable | None = None,
    most: int = MOST_ITERATIONS,
    kept: list | None = None,
) -> BoundedResult:
    """Problem (1) for A + extra to a residual of rtol ‖b‖.

    lower (n,): bound l, None: there is none · at_bound (n,) bool: first guess of the set, None: empty · air (n,): bound
    in air, which `lower` already has at unknowns that air reaches at the start; where water separates there, air
    advances to neighbouring unknowns that lie below `air`, over at most REACH cells; None: it does not · the other
    arguments as in `solve`. Without any unknown at the bound, x is that of `solve` to the last bit.  Raises
    NotConverged."""
    if lower is None:
        found = solve(A, b, x0, rtol, extra, most, kept)
        return BoundedResult(
            x=found.x,
            at_bound=np.zeros(len(b), bool),
            parting=np.zeros(len(b)),
            lower=None,
            iterations=found.iterations,
            residual=found.residual,
            rounds=1,
        )
    held = np.zeros(len(b), bool) if at_bound is None else at_bound.copy()
    scale = float(np.linalg.norm(b))
    if scale == 0.0 and not held.any() and not (lower > 0.0).any():
        return BoundedResult(
            x=np.zeros_like(b),
            at_bound=held,
            parting=np.zeros_like(b),
            lower=lower,
            iterations=0,
            residual=0.0,
            rounds=1,
        )
    apply, precondition = operators(A, extra, kept)
    x, signs, iterations, reach = np.array(x0, float), _Signs(lower), 0, 0
    for rounds in range(1, MOST_ROUNDS + 1):
        free = held if held.any() else None
        if free is not None:
            x[held] = lower[held]
        found = conjugate_gradients(
            apply,
            precondition,
            b,
            x,
            rtol,
            most,
            free,
            lambda x, residual, held=held, signs=signs: signs.early(x, residual, held),
        )
        x, iterations = found.x, iterations + found.iterations
        parting = apply(x) - b if free is not None else None
        wrong = signs.wrong(x, held, parting, UNSETTLED * rtol * scale)
        if wrong is None:
            if found.residual > rtol:
                continue
            apart = np.zeros_like(b) if parting is None else np.where(held, np.maximum(parting, 0.0), 0.0)
            vented = _air_goes_on(A, x, lower, air) if air is not None and reach < REACH else None
            if vented is None or not vented.any():
                return BoundedResult(
                    x=x,
                    at_bound=held,
                    parting=apart,
                    lower=lower,
                    iterations=iterations,
                    residual=found.residual,
                    rounds=rounds,
                )
            lower, held, reach = np.where(vented, air, lower), held | vented, reach + 1
            signs = _Signs(lower)
            continue
        held = signs.exchanged(held, wrong)
    raise NotConverged(
        f"the bound of the pressure was not settled in {MOST_ROUNDS} rounds: "
        f"{0 if wrong is None else int(wrong.sum())} of {len(b)} unknowns still change sides. Reduce time.cfl.",
        np.array([found.residual]),
        None if wrong is None else int(np.flatnonzero(wrong)[-1]),
    )


def solve_pressure(problem, rtol: float, moved=0.0) -> BoundedResult:
    """The pressure of a `projection.PressureProblem` whose bodies have a given motion: moved (n,) [m³/s], their G V."""
    rhs = problem.rhs if np.ndim(moved) == 0 and moved == 0.0 else problem.rhs + moved
    return solve_bounded(
        problem.matrix, rhs, problem.guess, rtol, problem.lower, problem.at_bound, problem.air
    )


def _air_goes_on(A, x, lower, air):
    """(n,) bool: unknowns below the bound of air that air has not reached, next to those where it separates the
    water."""
    source, below = np.empty(len(x), bool), np.empty(len(x), bool)
    counts = over(_beside_air, len(x), x, lower, air, SLACK * _largest(x), source, below)
    if any(not any(count) for count in zip(*counts)):
        return None
    return below & _beside(A.indptr, A.indices, source)


@ranged
def _beside_air(first, last, x, lower, air, slack, source, below):
    """Mark where x (n,) is at the bound of air within the slack of the solver, so that round-off above it does not
    decide where air advances: where that is its own bound, and where its own lies below; how many of both."""
    n_source, n_below = 0, 0
    for j in range(first, last):
        i = np.uint64(j)
        near = x[i] <= air[i] + slack
        source[i], below[i] = near and lower[i] == air[i], near and lower[i] < air[i]
        n_source += source[i]
        n_below += below[i]
    return n_source, n_below


@kernel
def _beside(indptr, indices, source):
    """(n,) bool: rows with an entry in the column of a source (n,) bool."""
    found = np.zeros(source.shape[0], np.bool_)
    for i in range(source.shape[0]):
        for s in range(indptr[i], indptr[i + 1]):
            found[i] = found[i] or source[indices[s]]
    return found


def _largest(x) -> float:
    """max |x_i|, 0 without any."""
    return max(over(_largest_of, len(x), x))


@ranged
def _largest_of(first, last, x):
    largest = 0.0
    for j in range(first, last):
        largest = max(largest, abs(x[np.uint64(j)]))
    return largest


@ranged
def _far_below(first, last, x, lower, held, slack, found):
    """Mark which x lie below their bound by more than the slack and are not held; how many."""
    count = 0
    for j in range(first, last):
        i = np.uint64(j)
        found[i] = x[i] < lower[i] - slack and not held[i]
        count += found[i]
    return count


@ranged
def _some_below(first, last, x, lower, held):
    """How many x lie below their bound and are not held."""
    count = 0
    for k in range(first, last):
        i = np.uint64(k)
        count += x[i] < lower[i] and not held[i]
    return count


class _Signs:
    """The unknowns of wrong sign, and the choice of those to exchange."""

    def __init__(self, lower):
        self.lower, self.fewest, self.patience, self.singles = lower, len(lower) + 1, PATIENCE, 0

    def _below(self, x, held, share: float):
        """(n,) bool: below the bound by more than this share of the largest |x|, and not held; None: nowhere."""
        slack, found = share * _largest(x), np.empty(len(x), bool)
        return found if any(over(_far_below, len(x), x, self.lower, held, slack, found)) else None

    def early(self, x, residual: float, held) -> bool:
        """Whether to end a round early: it is solved to a loose tolerance, and some value lies far below its bound."""
        if residual > LOOSE or not any(over(_some_below, len(x), x, self.lower, held)):
            return False
        return self._below(x, held, FAR_BELOW) is not None

    def wrong(self, x, held, parting, tolerance: float):
        """(n,) bool: below the bound, or held there although water converges; None: nowhere."""
        below = self._below(x, held, SLACK)
        if parting is None:
            return below
        wrong = held & (parting < -tolerance)
        wrong = wrong if below is None else below | wrong
        return wrong if wrong.any() else None

    def exchanged(self, held, wrong):
        """The next set (n,) bool."""
        count = int(wrong.sum())
        if count < self.fewest or self.singles == SINGLES:
            self.fewest, self.patience, self.singles = count, PATIENCE, 0
        elif self.patience == 0:
            self.singles += 1
            last = np.flatnonzero(wrong)[-1]
            wrong = np.zeros(len(held), bool)
            wrong[last] = True
        else:
            self.patience -= 1
        return held ^ wrong
