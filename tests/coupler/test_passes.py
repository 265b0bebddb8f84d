"""The passes of a coupled step: when they end, when they are relaxed, and whose load is applied."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

from coupler.step.passes import RELAXED_PASSES, CouplingPass, Passes

TOLERANCE = 0.02
ASSUMED, MOVED = np.zeros((1, 6)), np.ones((1, 6))


def made(defect: float, breaks: bool = False) -> CouplingPass:
    """A pass with a solution of its own."""
    solution = cast("Any", object())
    return CouplingPass(solution=solution, assumed=ASSUMED, defect=defect, breaks_joints=breaks)


def after(*defects: float, most: int = 2) -> Passes:
    """Passes that have made these defects."""
    passes = Passes(most, TOLERANCE)
    for defect in defects:
        passes.add(made(defect))
    return passes


def test_a_pass_within_the_tolerance_ends_the_step():
    assert not Passes(2, TOLERANCE).done
    assert after(TOLERANCE).done
    assert not after(0.5).done


def test_passes_that_converge_are_limited_and_start_from_the_motion_of_the_blocks():
    assert after(0.5, 0.3).done
    assert after(0.5).next_start(ASSUMED, MOVED) == pytest.approx(MOVED)


@pytest.mark.parametrize("second", [0.46, 0.5, 2.0])
def test_passes_that_do_not_converge_are_relaxed(second):
    passes = after(0.5, second)
    assert not passes.done
    assert passes.next_start(ASSUMED, MOVED) == pytest.approx(0.5 * MOVED)
    for _ in range(RELAXED_PASSES):
        assert not passes.done
        passes.add(made(0.1))
    assert passes.done


def test_a_defect_that_is_no_number_does_not_end_the_passes():
    assert not after(np.nan).done


def test_the_load_that_broke_joints_is_applied_where_the_last_relaxed_pass_breaks_none():
    passes, breaking = Passes(2, TOLERANCE), made(0.5, breaks=True)
    passes.add(breaking)
    passes.add(made(0.1))
    assert not passes.done, "joints that hold again are an oscillation, however small the defect became"
    assert passes.next_start(ASSUMED, MOVED) == pytest.approx(0.5 * MOVED)
    passes.add(made(0.01))
    assert passes.done
    assert passes.replacement() is breaking


def test_a_last_pass_that_breaks_joints_too_is_applied():
    passes = Passes(2, TOLERANCE)
    passes.add(made(0.5, breaks=True))
    passes.add(made(0.5, breaks=False))
    passes.add(made(0.01, breaks=True))
    assert passes.replacement() is None


def test_without_relaxed_passes_the_last_one_is_applied():
    passes = Passes(2, TOLERANCE)
    passes.add(made(0.5, breaks=True))
    passes.add(made(0.01))
    assert passes.done
    assert passes.replacement() is None
