"""Limits of a run: on which side of them it ends, and what the message asks for."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

from coupler.balance.energy import Balance
from coupler.geometry.overlaps import Overlap
from coupler.step.limits import Diverged, Limits, check_air, check_balance, check_momentum, check_overlap
from coupler.step.step_limits import (
    STEP_SHARE,
    Attempt,
    attempt_of,
    attempt_to_keep,
    energy_advice,
    worst_place,
)


def test_a_run_ends_just_beyond_its_limit_of_momentum():
    check_momentum(1.0, 1e-6, 1e-6)
    with pytest.raises(Diverged, match=r"miss 1\.1e-06 of the impulses"):
        check_momentum(1.0, 1.1e-6, 1e-6)
    with pytest.raises(Diverged):
        check_momentum(1.0, np.nan, 1e-6)


def test_small_limits_of_a_balance_are_told_with_their_digits():
    """Not: off by 0.00% of the input energy, limit 0.00%."""
    limits = Limits(2e-6, 1e-9, None)
    with pytest.raises(Diverged, match=r"off by 1\.5e-07 % of the input energy at t = 1 s; limit 1e-07 % "):
        check_balance(1.0, 0.0, 1.5e-9, limits)
    with pytest.raises(Diverged, match=r"volume is off by -0\.0003 % at t = 1 s; limit 0\.0002 % "):
        check_balance(1.0, -3e-6, 0.0, limits)


def test_contact_is_to_be_stiffer_by_the_square_of_what_the_overlap_exceeds():
    """A block that falls goes in by v sqrt(m/K): a quarter of the depth takes sixteen times the stiffness."""
    with pytest.raises(Diverged, match="about 16 times as high"):
        check_overlap(1.0, Overlap("brick", "the ground", 0.2, 0.4), 0.1)
    with pytest.raises(Diverged, match="about 2 times as high"):
        check_overlap(1.0, Overlap("brick", "the ground", 0.2, 0.11), 0.1)
    with pytest.raises(Diverged, match=r"joints\.closing_ratio about 4 times as high"):
        check_overlap(1.0, Overlap("brick", "the ground", 0.2, 0.4, joined=True), 0.1)
    check_overlap(1.0, None, 0.1)


@pytest.mark.parametrize("pressure", [5e4, -5e4])
def test_air_that_is_drawn_out_breaks_its_law_like_air_that_is_squeezed(pressure):
    class Air(SimpleNamespace):
        def __len__(self):
            return len(self.mean_pressure)

    water = SimpleNamespace(
        air=Air(mean_pressure=np.array([1e3, pressure])),
        pocket_bounds=lambda k: (np.full(3, float(k)), np.full(3, k + 1.0)),
        pocket_volumes=lambda: np.array([1.0, 2.0]),
    )
    check_air(0.5, water, 6e4)
    told = f"between (1, 1, 1) to (2, 2, 2) m, 2 m3, has {pressure:.4g} Pa"
    with pytest.raises(Diverged, match=re.escape(told)):
        check_air(0.5, water, 4e4)


@pytest.mark.parametrize("ends", [False, True])
def test_the_shortest_attempt_stays_where_it_is_better_in_one_thing_that_the_longest_breaks(ends):
    """The volume did not get better with the step, the defect did."""
    broken = frozenset({"defect", "volume"})
    longest = Attempt(0, {"defect": 0.4, "volume": 1.0}, broken, False)
    shortest = Attempt(3, {"defect": 0.1, "volume": 1.0}, broken, ends)
    assert attempt_to_keep([longest, shortest]) is shortest


def test_the_longest_attempt_stays_where_no_shorter_one_helps_or_only_the_shorter_one_ends_the_run():
    longest = Attempt(0, {"defect": 0.4}, frozenset({"defect"}), False)
    assert attempt_to_keep([longest, Attempt(3, {"defect": 0.3}, frozenset({"defect"}), True)]) is longest
    ends = Attempt(0, {"defect": 0.4}, frozenset({"defect"}), True)
    shortest = Attempt(3, {"defect": 0.3}, frozenset({"defect"}), False)
    assert attempt_to_keep([ends, shortest]) is shortest


@pytest.mark.parametrize(("retries", "kept"), [(1, 0.75), (2, 0.6), (3, 0.45)])
def test_what_helps_goes_by_how_often_the_step_was_halved(retries, kept):
    """Blocks of debris that hit each other: 0.75 in the whole step, 0.41 in a quarter, which was the shortest that
    there could be. What three halvings bring to a half, two bring to 0.63 and one to 0.79."""
    longest = Attempt(0, {"defect": 1.0}, frozenset({"defect"}), False)
    shorter = Attempt(retries, {"defect": kept}, frozenset({"defect"}), False)
    worse = Attempt(retries, {"defect": kept + 0.06}, frozenset({"defect"}), False)
    assert attempt_to_keep([longest, shorter]) is shorter
    assert attempt_to_keep([longest, worse]) is longest


@pytest.mark.parametrize(("passes", "defect", "advised"), [(1, 0.4, True), (2, 0.4, False), (1, 0.2, False)])
def test_a_run_that_ends_on_its_energy_names_a_single_pass_that_missed(passes, defect, advised):
    coupling = SimpleNamespace(
        water=None,
        structure=SimpleNamespace(names=["a", "b"]),
        defects=SimpleNamespace(too_large=lambda defect: defect > 0.3),
    )
    balance = SimpleNamespace(step_error=0.1, input_energy=249.0)
    record = SimpleNamespace(passes=passes, defect=defect, missed_work=np.array([1.0, -2.5]), balance=balance)
    found = worst_place(coupling, record)
    assert found.startswith("block 'b' missed 2.5 J of the water's work in this step")
    assert found.endswith("which had a single pass: raise coupling.passes") == advised
    balance.input_energy = 2501.0
    assert worst_place(coupling, record) == "", "what is a hundredth of the error is not its place"


@pytest.mark.parametrize(
    ("residuals", "told", "advised"),
    [
        ((-12.0, 1.0, 2.0, 3.0), "The water has gained 11 J, of 50 J put in.", "smaller tank.cell"),
        (
            (-12.0, 14.0, 0.1, 0.0),
            "are off by 0.1 J",
            "joints.damping",
        ),  # what left with the water is no gain
        (
            (12.0, 0.0, -4.0, 3.0),
            "blocks with their joints and contacts are off by 4 J, of 50 J",
            "joints.damping",
        ),
        ((0.0, 0.0, 2.0, -3.0), "the blocks received differ by 3 J, of 50 J", "joints.damping"),
    ],
)
def test_a_run_that_ends_on_its_energy_says_which_side_is_off_and_what_helps_there(residuals, told, advised):
    lost, left, structure, between = residuals
    balance = Balance(
        numerical_dissipation=lost,
        left=left,
        structure_residual=structure,
        work_given=between,
        input_energy=50.0,
    )
    coupling = SimpleNamespace(water=None, structure=None)
    found = energy_advice(coupling, SimpleNamespace(balance=balance, missed_work=np.zeros(0)))
    assert told in found
    assert advised in found


def test_steps_of_all_lengths_are_compared_by_the_second():
    """A step of 10 ms that loses 2e-5 of the volume and misses 1e-4 of the energy: 2e-3 and 1e-2 a second. The defect
    and the momentum are shares of what moved already."""
    water = SimpleNamespace(volume_error=lambda: -1e-4, fastest_place=lambda: (1.0, np.zeros(3)))
    coupling = SimpleNamespace(water=water, defects=SimpleNamespace(too_large=lambda defect: defect > 0.3))
    record = SimpleNamespace(
        time=1.0,
        dt=0.01,
        defect=0.2,
        wetted=True,
        retries=1,
        balance=SimpleNamespace(step_error=1e-4, energy_error=0.01),
        momentum=SimpleNamespace(error=1e-12),
        missed_work=np.zeros(0),
    )
    limits = Limits(volume_error=0.02, energy_error=0.05, cpu_seconds=None, momentum_error=1e-8)
    found = attempt_of(coupling, record, limits, -8e-5)
    assert found.measures == pytest.approx({"defect": 0.2, "volume": 2e-3, "energy": 0.01, "momentum": 1e-12})
    assert (found.broken, found.ends) == (frozenset(), False)
    record.balance.step_error = 1.01 * STEP_SHARE * limits.energy_error
    assert attempt_of(coupling, record, limits, 0.0).broken == {"energy"}
