"""A step that fails is taken again with half of its length; when that does not help the run stops and says why.

Water and structure are the smallest there are: a pipe with a piston."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from coupler import loop
from coupler.build import build
from coupler.defects import MISSES, RETRIES, Defects
from coupler.limits import Diverged, Limits
from coupler.loop import Coupling
from coupler.momentum import book_step, momentum_ledger
from coupler.step_limits import check_step
from fluid.solve import NotConverged
from tests.fakes import FreeBody, no_clock, piston_column
from tests.physics.scenes import case

AFLOAT = Coupling._afloat


class Pipe:
    """Water that does nothing but solve its pressure; with `fails_above` only in steps up to that length."""

    viscous = sides = slits = None
    velocity, pressure = np.zeros((1, 3)), np.zeros(1)
    topology = SimpleNamespace(nodes=np.zeros((1, 3)))
    mesh = SimpleNamespace(spacing=1.0)
    report = SimpleNamespace(left_energy=0.0, bound=SimpleNamespace(work=0.0))
    volume_off = 0.0
    body_velocity = pushed_by = moved_on = np.zeros((1, 6))

    def __init__(self, fails_above=np.inf, gains_above=np.inf, gains=0.0):
        """gains [J] in every step longer than gains_above."""
        self.fails_above, self.gains_above, self.gains = fails_above, gains_above, gains
        self.energy, self.taken = 0.0, []

    def stable_step(self):
        return 1.0

    def predict(self, dt):
        if dt > self.fails_above:
            raise NotConverged("pressure solver did not converge.", np.zeros(1))
        problem = piston_column(dt=dt)
        return SimpleNamespace(**vars(problem) | {"predicted": SimpleNamespace(shear=None)}, dt=dt)

    def correct(self, problem, x, parting):
        self.taken.append(problem.dt)
        self.energy += self.gains * (problem.dt > self.gains_above)

    def remember(self):
        return {"energy": self.energy, "taken": list(self.taken)}

    def go_back(self, remembered):
        self.energy, self.taken = remembered["energy"], list(remembered["taken"])

    def available_energy(self):
        return 1.0

    def kinetic_energy(self):
        return self.energy

    def potential_energy(self):
        return 0.0

    def volume_error(self):
        return self.volume_off

    def fastest_place(self):
        return 3.0, np.array([0.1, 0.2, 0.3])


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
    """The pipe has no nodes to sum over, and no surface on the piston."""
    monkeypatch.setattr(loop, "momentum_ledger", lambda water, structure: None)
    monkeypatch.setattr(loop, "book_step", lambda coupling, record: None)
    monkeypatch.setattr(Coupling, "_afloat", lambda self, problem: (problem, None))


def coupling(pipe, piston, **more):
    still = SimpleNamespace(update=lambda: False, moved_on=lambda: np.zeros((1, 6)), cut_again=0, n_solids=0)
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


def alone(pipe):
    """Water without blocks."""
    return Coupling(pipe, None, None, rtol=1e-10, step_max=1.0, clock=no_clock, limits=LIMITS)


LIMITS = Limits(volume_error=0.02, energy_error=0.05, cpu_seconds=None)


@pytest.mark.parametrize("gains", [0.013, 0.1])
def test_a_step_that_gains_energy_is_taken_again(gains):
    """Of 1 J put in a quarter of what the run may miss is too much. The books forget a step taken back."""
    c = alone(Pipe(gains_above=0.03, gains=gains))
    record = c.step(0.1)
    assert (record.retries, record.dt, c.water.taken) == (2, 0.025, [0.025])
    assert c.water.energy == 0.0
    assert record.balance.step_error < 0.001
    assert c.step_size(1.0) == 0.025


def test_a_step_that_gains_little_stays():
    c = alone(Pipe(gains_above=0.03, gains=0.011))
    assert c.step(0.1).retries == 0


def test_a_limit_that_shorter_steps_do_not_keep_is_reported_with_the_place():
    c = alone(Pipe(gains_above=0.0, gains=0.1))
    record = c.step(0.1)
    assert record.retries == RETRIES
    with pytest.raises(Diverged, match=r"energy balance.*fastest, 3 m/s, at \(0\.1, 0\.2, 0\.3\) m\. Reduce"):
        check_step(c, record, LIMITS)


def test_water_that_lost_its_volume_is_stepped_again():
    pipe = Pipe()
    pipe.volume_off = 0.03
    c = alone(pipe)
    record = c.step(0.1)
    assert record.retries == RETRIES
    with pytest.raises(Diverged, match="water volume"):
        check_step(c, record, LIMITS)


def splash(**sections):
    """Water that falls to one side of a small tank, with a sea beside it, and a block in its way."""
    return build(
        case(
            time={"end": 1.0, "step_max": 0.02},
            tank={"lower": [0, 0, 0], "upper": [1, 0.4, 0.6], "cell": 0.1},
            water={
                "fill": [{"lower": [0, 0, 0], "upper": [0.4, 0.4, 0.4]}],
                "sea": [{"side": "x+", "level": 0.15}],
            },
            **sections,
        ),
        no_clock,
    ).coupling


BLOCK = {
    "structure": {
        "density": 600.0,
        "block": [{"name": "b", "centre": [0.6, 0.2, 0.12], "size": [0.2, 0.2, 0.2]}],
    },
    "contact": {"stiffness": 1e5},
}


@pytest.mark.parametrize("sections", [{}, BLOCK])
def test_a_step_taken_again_is_the_short_step_bit_for_bit(sections, monkeypatch):
    """Nothing of the step that was taken back is left in water, sea, structure and books, with and without blocks."""
    monkeypatch.setattr(loop, "momentum_ledger", momentum_ledger)
    monkeypatch.setattr(loop, "book_step", book_step)
    monkeypatch.setattr(Coupling, "_afloat", AFLOAT)
    again, straight = (after_steps(splash(**sections), good) for good in ([False, True], [True]))
    assert all(np.array_equal(a, b) for a, b in zip(again, straight))


def after_steps(c, good):
    """What three steps leave, one that is as `good` says and two that are, the first one 5 ms long in the end."""
    for _ in range(3):
        c.step(0.01)
    verdicts = iter(good)
    c._is_good = lambda record: next(verdicts, True)
    dt = 0.005 * 2 ** (len(good) - 1)
    assert c.step(dt).retries == len(good) - 1
    c.step(0.005)
    record = c.step(0.005)
    state = [c.water.velocity, c.water.level_set, c.water.pressure, record.load, c.momentum.residual]
    state += [np.array([vars(record.balance)[name] for name in sorted(vars(record.balance))])]
    if c.structure is not None:
        state += [c.structure.centre(), c.structure.velocity()]
        c.structure.close()
    return state


def test_what_a_retry_leaves_behind_is_saved_and_restored():
    first, second = coupling(Pipe(0.03), Piston()), coupling(Pipe(), Piston())
    first.step(0.1)
    second.restore(first.save())
    assert second.step_size(1.0) == first.step_size(1.0)


def test_a_step_is_taken_again_from_three_fifths_of_the_largest_defect_on():
    defects = Defects(0.5, 0.01)
    assert not defects.too_large(0.6 * 0.5)
    assert defects.too_large(0.61 * 0.5)
    assert defects.too_large(np.nan)
