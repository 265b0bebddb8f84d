"""Loops that a compiled driver hands out one after the other: what `over` would make of them, at any number of
threads."""

import numpy as np
import pytest

import kernels.threads as kernels
from kernels.decorators import nogil, ranged
from kernels.in_a_row import done, handed, through
from kernels.threads import in_a_row, marked, over

N, ROUNDS = 3000, 50


@pytest.fixture(params=[1, 2, 4])
def threads(request):
    kernels.use(request.param, least=100)
    yield request.param
    kernels.use(1)


@ranged
def _neighbours(first, last, given, out):
    for i in range(first, last):
        out[i] = 0.5 * (given[i - 1] + given[(i + 1) % given.shape[0]])


@ranged
def _no_larger(first, last, given, most):
    for i in range(first, last):
        if given[i] > most:
            raise ValueError("too large")


@nogil
def _smoothed(crew, rounds, a, b):
    """Means of both neighbours, to and fro: each loop needs all that the one before it has made."""
    n = len(a)
    for _ in range(rounds):
        through(_neighbours, handed(crew, n, 1.0, 2), n, (a, b))
        done(crew)
        through(_neighbours, handed(crew, n, 1.0, 1), n, (b, a))
        done(crew)


@nogil
def _checked(crew, a, most):
    through(_no_larger, handed(crew, len(a), 1.0, 1), len(a), (a, most))
    done(crew)


def _expected(a):
    for _ in range(2 * ROUNDS):
        a = 0.5 * (np.roll(a, 1) + np.roll(a, -1))
    return a


def test_a_driver_s_loops_see_what_those_before_them_made(threads):
    a = np.random.default_rng(1).random(N)
    expected = _expected(a)
    in_a_row(_smoothed, ROUNDS, a, np.empty(N))
    assert np.array_equal(a, expected)


def test_drivers_and_loops_from_python_take_turns(threads):
    """What a shared loop returned to Python was given back there, and is not given back again by the driver after it,
    whose loop is too short to be shared."""
    mask = np.random.default_rng(2).random(N) < 0.3
    short = np.random.default_rng(3).random(60)
    expected = _expected(short)
    for _ in range(20):
        a = short.copy()
        assert np.array_equal(marked(mask), np.flatnonzero(mask))
        in_a_row(_smoothed, ROUNDS, a, np.empty(60))
        assert np.array_equal(a, expected)


def test_a_loop_of_a_driver_that_fails_ends_it(threads):
    """And the threads go on with the next one."""
    a = np.zeros(N)
    a[-1] = 2.0
    with pytest.raises(ValueError, match="too large"):
        in_a_row(_checked, a, 1.0)
    in_a_row(_checked, a, 3.0)
    over(_neighbours, N, a, np.empty(N))


def test_loops_of_a_driver_are_watched_where_threads_would_share_them():
    """The benchmark counts the time in them as shared, and that between them as one thread's."""
    for n, loops in ((N, 2 * ROUNDS), (60, 0)):
        a = np.zeros(n)
        with kernels.watched() as calls:
            in_a_row(_smoothed, ROUNDS, a, np.empty(n))
        assert [call.name for call in calls] == ["_smoothed"] * loops
        begun = [call.began for call in calls]
        assert begun == sorted(begun)
        assert all(call.seconds >= 0.0 for call in calls)
