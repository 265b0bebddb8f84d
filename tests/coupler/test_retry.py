"""A step that fails is taken again with half of its length; when that does not help the run stops and says why.

Water and structure are the smallest there are: a pipe with a piston."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from coupler.balance.momentum import add_step, momentum_ledger
from coupler.scene.build import build
from coupler.step import coupled_step as loop
from coupler.step.coupled_step import CoupledStepper
from coupler.step.exchange import Exchange
from coupler.step.limits import HIGHEST_PRESSURE, Diverged, Limits
from coupler.step.residual import MISSES, RETRIES, SHORTEST, Defects
from coupler.step.step_limits import Attempt, check_step
from fluid.numerics.solve import NotConverged
from tests.fakes import FreeBody, no_clock, piston_column
from tests.physics.scenes import case

AFLOAT = Exchange._afloat


class Pipe:
    """Water that does nothing but solve its pressure; with `fails_above` only in steps up to that length."""

    viscous = sides = slits = None
    velocity, pressure = np.zeros((1, 3)), np.zeros(1)
    topology = SimpleNamespace(nodes=np.zeros((1, 3)))
    mesh = SimpleNamespace(spacing=1.0)
    report = SimpleNamespace(left_energy=0.0, bound=SimpleNamespace(work=0.0))
    volume_off = 0.0
    body_velocity = pushed_by = moved_on = np.zeros((1, 6))

    def __init__(
        self,
        fails_above=np.inf,
        gains_above=np.inf,
        gains=0.0,
        rate=0.0,
        fails_below=0.0,
        high_above=np.inf,
    ):
        """gains [J] in every step longer than gains_above; rate [W] in all; a pressure beyond that of any impact in
        steps longer than high_above."""
        self.fails_above, self.gains_above, self.gains = fails_above, gains_above, gains
        self.fails_below, self.rate, self.high_above = fails_below, rate, high_above
        self.energy, self.taken = 0.0, []

    def stable_step(self):
        return 1.0

    def air_energy(self):
        return 0.0

    def set_films(self, loose, share):
        """There are none."""

    leave_films_out = set_films

    def predict(self, dt):
        if dt > self.fails_above or dt < self.fails_below:
            raise NotConverged("pressure solver did not converge.", np.zeros(1))
        return piston_column(dt=dt)

    def correct(self, problem, x, parting):
        self.taken.append(problem.dt)
        self.energy += self.gains * (problem.dt > self.gains_above) + self.rate * problem.dt
        self.pressure = np.full(1, 2.0 * HIGHEST_PRESSURE * (problem.dt > self.high_above))

    def snapshot(self):
        return {"energy": self.energy, "taken": list(self.taken)}

    def restore(self, remembered):
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
    """Misses the motion that the pressure solve assumed in steps longer than `misses_above`: it runs the other way."""

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
    monkeypatch.setattr(loop, "add_step", lambda *given: None)
    monkeypatch.setattr(Exchange, "_afloat", lambda self, problem: (problem, None))


def coupling(pipe, piston, step_max=0.1, **more):
    still = SimpleNamespace(
        cell_sizes=lambda: np.ones(1),
        update=lambda: False,
        moved_on=lambda: np.zeros((1, 6)),
        films=lambda: (np.zeros(1, bool), np.zeros(1)),
        cut_again=0,
        connection=None,
        n_solids=0,
    )
    return CoupledStepper(pipe, piston, still, rtol=1e-10, step_max=step_max, clock=no_clock, **more)


def test_a_good_step_is_taken_as_it_is():
    c = coupling(Pipe(), Piston())
    record = c.step(0.1)
    assert (record.retries, record.dt, c.time, c.defects.share) == (0, 0.1, 0.1, 1.0)


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
    with pytest.raises(Diverged, match=r"did not converge\. Steps down to 0\.00313 s did not help"):
        coupling(Pipe(0.0), Piston()).step(0.1)


def test_blocks_that_never_follow_stop_the_run_and_say_which_limit():
    """One step may miss, as when a joint breaks; several in a row are no chance. Shorter ones miss as much, so the
    whole one stays."""
    c = coupling(Pipe(), Piston(0.0))
    for number in range(1, MISSES):
        record = c.step(0.1)
        assert (record.retries, record.dt, record.bad) == (0, 0.1, True)
        assert c.time == pytest.approx(0.1 * number)
        assert c.step_size(1.0) == 0.1
    with pytest.raises(Diverged, match=r"3 steps in a row.*limits\.defect.*coupling\.passes"):
        c.step(0.1)


def alone(pipe):
    """Water without blocks."""
    return CoupledStepper(pipe, None, None, rtol=1e-10, step_max=0.1, clock=no_clock, limits=LIMITS)


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
    assert (record.retries, record.bad) == (0, True)
    told = r"energy balance.*water has gained 0\.1 J, of 1 J put in.*fastest, 3 m/s, at \(0\.1, 0\.2, 0\.3\) m\. Take"
    with pytest.raises(Diverged, match=told):
        check_step(c, record, LIMITS)


def test_a_step_whose_pressure_is_beyond_that_of_any_impact_is_taken_again(monkeypatch):
    """0.1 -> 0.05 -> 0.025; in the last one the pressure is what it may be."""
    monkeypatch.setattr(loop, "pressure_to_start", lambda water, dt: 0.0)
    c = coupling(Pipe(high_above=0.03), Piston())
    record = c.step(0.1)
    assert (record.retries, record.dt, c.water.taken) == (2, 0.025, [0.025])
    with pytest.raises(Diverged, match=r"the pressure is 2e\+08 Pa.*Steps down to 0\.00313 s did not help"):
        coupling(Pipe(high_above=0.0), Piston()).step(0.1)


def test_a_step_that_breaks_the_balance_of_momentum_is_taken_again(monkeypatch):
    """Of the shares missed only that of the step that stays counts."""
    missed = {0.1: 2e-8, 0.05: 1.1e-8, 0.025: 0.9e-8}
    monkeypatch.setattr(
        loop, "add_step", lambda ledger, water, structure, dt, *given: SimpleNamespace(error=missed[dt])
    )
    c = alone(Pipe())
    record = c.step(0.1)
    assert (record.retries, record.dt, record.bad) == (2, 0.025, False)
    assert LIMITS.momentum_error == 1e-8


def test_water_that_lost_its_volume_is_stepped_again():
    """Shorter steps lose none, so none helps."""
    pipe = Pipe()
    pipe.volume_off = 0.03
    c = alone(pipe)
    taken = []
    c._take = lambda record, start: (taken.append(record.dt), CoupledStepper._take(c, record, start))
    record = c.step(0.1)
    assert taken == [0.1 / 2**k for k in range(RETRIES + 1)] + [0.1]
    assert (record.retries, record.dt) == (0, 0.1)
    with pytest.raises(Diverged, match="water volume"):
        check_step(c, record, LIMITS)


STEADY = 0.48
"""[J] in 0.1 s: 1.2 times what a step may put out of balance even in the shortest."""


def test_what_goes_wrong_as_fast_in_shorter_steps_leaves_the_step_as_it_is():
    """Shorter steps take it in more pieces, no less in all. The run has gained so much that none of them ends it."""
    c = alone(Pipe(rate=STEADY / 0.1))
    c._judge = not_ending(c)
    for _ in range(3):
        record = c.step(c.step_size(1.0))
        assert (record.retries, record.bad) == (0, True)
        assert record.dt == pytest.approx(0.1, rel=0.2)
    assert c.water.energy == pytest.approx(STEADY / 0.1 * c.time)


def not_ending(c):
    """As `CoupledStepper._judge`, of a run that goes on."""
    return lambda record, volume: replace(CoupledStepper._judge(c, record, volume), ends=False)


def test_only_the_longest_ends_the_run_so_the_shortest_stays():
    """Half of the energy at once would end it; the last part of that does not."""
    c = alone(Pipe(rate=STEADY / 0.1))
    record = c.step(0.1)
    assert (record.retries, record.dt, record.bad) == (RETRIES, 0.1 * SHORTEST, True)
    check_step(c, record, LIMITS)


def test_no_row_of_bad_steps_makes_them_shorter_than_the_most_halvings_do():
    """What the blocks miss falls with the step, but never enough."""
    c = coupling(Pipe(), Piston())
    c._judge = lambda record, volume: Attempt(
        record.retries, {"defect": record.dt}, frozenset({"defect"}), False
    )
    steps = [c.step(c.step_size(100.0)) for _ in range(40)]
    assert steps[0].dt == pytest.approx(0.1 * SHORTEST)
    assert min(record.dt for record in steps) > 0.99 * 0.1 * SHORTEST
    assert all(record.bad for record in steps)


def test_halves_without_a_solution_leave_the_whole_one():
    """It gains too much, but shorter ones do not even have a pressure."""
    c = alone(Pipe(gains_above=0.0, gains=0.02, fails_below=0.1))
    record = c.step(0.1)
    assert (record.retries, record.dt, record.bad, c.water.taken) == (0, 0.1, True, [0.1])


def test_a_step_without_a_solution_is_halved_although_it_is_short_already():
    c = coupling(Pipe(0.1 * SHORTEST / 2), Piston())
    c.defects.share = SHORTEST
    assert c.step(0.1 * SHORTEST).retries == 1
    assert c.defects.share == SHORTEST


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
    monkeypatch.setattr(loop, "add_step", add_step)
    monkeypatch.setattr(Exchange, "_afloat", AFLOAT)
    again, straight = (after_steps(splash(**sections), good) for good in ([False, True], [True]))
    assert all(np.array_equal(a, b) for a, b in zip(again, straight))


def after_steps(c, good):
    """What three steps leave, one that is as `good` says and two that are, the first one 5 ms long in the end."""
    for _ in range(3):
        c.step(0.01)
    verdicts = iter(good)
    c._judge = lambda record, volume: Attempt(
        0, {}, frozenset() if next(verdicts, True) else {"defect"}, False
    )
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
    assert second.step_size(1.0) == first.step_size(1.0) == 0.025
    assert second.defects.halvings == first.defects.halvings == RETRIES - 2


def test_a_step_is_taken_again_from_three_fifths_of_the_largest_defect_on():
    defects = Defects(0.5)
    assert not defects.too_large(0.6 * 0.5)
    assert defects.too_large(0.61 * 0.5)
    assert defects.too_large(np.nan)
