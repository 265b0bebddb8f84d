"""A step that fails is taken again with half of its length; when that does not help the run stops and says why.

Water and structure are the smallest there are: a pipe with a piston."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from coupler import loop
from coupler.defects import MISSES, RETRIES
from coupler.limits import Diverged
from coupler.loop import Coupling
from fluid.solve import NotConverged
from tests.fakes import FreeBody, no_clock, piston_column


class Pipe:
    """Water that does nothing but solve its pressure; with `fails_above` only in steps up to that length."""

    viscous = sides = slits = None
    velocity, pressure = np.zeros((1, 3)), np.zeros(1)
    topology = SimpleNamespace(nodes=np.zeros((1, 3)))
    mesh = SimpleNamespace(spacing=1.0)
    report = SimpleNamespace(left_energy=0.0)

    def __init__(self, fails_above=np.inf):
        self.fails_above, self.taken = fails_above, []

    def stable_step(self):
        return 1.0

    def predict(self, dt):
        if dt > self.fails_above:
            raise NotConverged("pressure solver did not converge.", np.zeros(1))
        problem = piston_column(dt=dt)
        return SimpleNamespace(**vars(problem) | {"predicted": SimpleNamespace(shear=None)}, dt=dt)

    def correct(self, problem, x):
        self.taken.append(problem.dt)

    def available_energy(self):
        return 0.0

    def kinetic_energy(self):
        return 0.0

    def potential_energy(self):
        return 0.0


class Piston(FreeBody):
    """Misses what the water was told in steps longer than `misses_above`: it runs the other way."""

    def __init__(self, misses_above=np.inf):
        super().__init__((1, 1, 1), (0, 0, 0), 500.0, 0.0)
        self.misses_above, self._v[0, 0] = misses_above, 1.0

    def advance(self, dt):
        report = super().advance(dt)
        return replace(report, mean_velocity=-report.mean_velocity) if dt > self.misses_above else report


@pytest.fixture(autouse=True)
def _no_books_of_momentum(monkeypatch):
    """The pipe has no nodes to sum over."""
    monkeypatch.setattr(loop, "momentum_ledger", lambda water, structure: None)
    monkeypatch.setattr(loop, "book_step", lambda coupling, record: None)


def coupling(pipe, piston, **more):
    still = SimpleNamespace(update=lambda: False, cut_again=0, n_solids=0)
    return Coupling(pipe, piston, still, rtol=1e-10, step_max=1.0, clock=no_clock, **more)


def test_a_good_step_is_taken_as_it_is():
    c = coupling(Pipe(), Piston())
    record = c.step(0.1)
    assert (record.retries, record.dt, c.time, c.defects.longest) == (0, 0.1, 0.1, np.inf)


@pytest.mark.parametrize(("pipe", "piston"), [(Pipe(0.03), Piston()), (Pipe(), Piston(0.03))])
def test_a_step_is_halved_until_it_has_a_solution_and_the_blocks_follow(pipe, piston):
    """0.1 → 0.05 → 0.025; both sides take the short step once, and the next ones are kept short for a while."""
    c = coupling(pipe, piston)
    start = piston._x[0, 0]
    record = c.step(0.1)
    assert (record.retries, record.dt) == (2, 0.025)
    assert c.time == record.time == 0.025
    assert pipe.taken == [0.025]
    assert piston._x[0, 0] - start == pytest.approx(0.5 * 0.025 * (1.0 + piston._v[0, 0]))
    assert c.step_size(1.0) == 0.025
    assert c.step(0.025).retries == 0
    assert 0.025 < c.step_size(1.0) <= 1.5 * 0.025


def test_a_solver_that_never_converges_stops_the_run_with_what_it_said():
    with pytest.raises(Diverged, match=r"did not converge\. Steps down to 0\.0125 s did not help"):
        coupling(Pipe(0.0), Piston()).step(0.1)


def test_blocks_that_never_follow_stop_the_run_and_say_which_limit():
    """One step may miss, as when a joint breaks; several in a row at their shortest are no chance."""
    c = coupling(Pipe(), Piston(0.0))
    for _ in range(MISSES - 1):
        assert c.step(0.1).retries == RETRIES
    with pytest.raises(Diverged, match=r"3 steps in a row.*limits\.defect.*coupling\.passes"):
        c.step(0.1)


def test_what_a_retry_leaves_behind_is_saved_and_restored():
    first, second = coupling(Pipe(0.03), Piston()), coupling(Pipe(), Piston())
    first.step(0.1)
    second.restore(first.save())
    assert second.step_size(1.0) == first.step_size(1.0)
