"""The ledger: what counts as an error of energy, and what is only shown."""

import pytest

from coupler.balance.energy import DISSIPATED, STORED, Ledger

NOTHING = dict.fromkeys((*STORED, *DISSIPATED, "load_work", "driving_work"), 0.0)


def started(available=100.0):
    """A ledger at rest, with 100 J of water to fall."""
    ledger = Ledger(available=available)
    ledger.start((0.0, available), NOTHING)
    return ledger


def test_energy_that_goes_from_the_water_into_blocks_and_joints_balances():
    ledger = started()
    ledger.give(30.0)
    blocks = NOTHING | {"kinetic": 20.0, "joint_stored": 4.0, "joint_dissipated": 6.0, "load_work": 30.0}
    found = ledger.balance((50.0, 20.0), blocks)
    assert found.energy_error == 0.0
    assert found.numerical_dissipation == 0.0


def test_what_the_water_loses_by_the_numerics_is_shown_and_what_it_gains_is_an_error():
    assert started().balance((50.0, 30.0), NOTHING).numerical_dissipation == pytest.approx(20.0)
    assert started().balance((50.0, 30.0), NOTHING).energy_error == 0.0
    assert started().balance((50.0, 60.0), NOTHING).energy_error == pytest.approx(0.1)


def test_work_that_does_not_arrive_is_an_error():
    ledger = started()
    ledger.give(30.0)
    found = ledger.balance((50.0, 20.0), NOTHING | {"kinetic": 25.0, "load_work": 25.0})
    assert found.interface_residual == pytest.approx(5.0)
    assert found.energy_error == pytest.approx(0.05)


def test_shear_and_outflow_are_not_numerical_dissipation():
    """What viscosity took and what fell out through open sides are lines of their own: only the rest is the numerics',
    and a gain that friction would hide shows."""
    ledger = started()
    ledger.shear, ledger.left = 6.0, 10.0
    found = ledger.balance((50.0, 30.0), NOTHING)
    assert (found.shear_dissipation, found.left) == (6.0, 10.0)
    assert found.numerical_dissipation == pytest.approx(4.0)
    ledger.shear, ledger.left = 26.0, 0.0
    assert ledger.balance((50.0, 30.0), NOTHING).energy_error == pytest.approx(0.06)


def test_water_at_perfect_rest_is_not_out_of_balance_by_its_round_off():
    """Nothing is put in, and the last digit of a large potential energy comes and goes: no share of nothing."""
    ledger = Ledger(available=0.0)
    ledger.start((0.0, -3421.0), None)
    assert ledger.balance((1e-20, -3421.0 + 5e-13), None).energy_error < 1e-6


def test_what_falling_blocks_release_is_the_scale_of_a_structure_alone():
    """60 J fallen, 30 J of them moving: 3 J that are missing are 5 %."""
    ledger = Ledger()
    ledger.start(None, NOTHING | {"gravity": 100.0})
    found = ledger.balance(None, NOTHING | {"gravity": 40.0, "kinetic": 30.0, "dashpot": 27.0})
    assert found.input_energy == 60.0
    assert found.energy_error == pytest.approx(0.05)


def test_a_gain_of_water_counts_only_beyond_what_fell_out():
    """10 J left through open sides: water that holds 6 J more than it should is within them, 16 J more are 6 J of an
    error."""
    ledger = started()
    ledger.left = 10.0
    assert ledger.balance((50.0, 46.0), NOTHING).energy_error == 0.0
    assert ledger.balance((50.0, 56.0), NOTHING).energy_error == pytest.approx(0.06)


def test_the_work_of_imposed_motions_is_a_scale_of_its_own():
    """A machine that put 50 J into joints, of which 1 J is nowhere: 2 %, however little moves or falls."""
    ledger = Ledger()
    ledger.start(None, NOTHING)
    found = ledger.balance(None, NOTHING | {"driving_work": 50.0, "joint_stored": 49.0})
    assert found.input_energy == 50.0
    assert found.energy_error == pytest.approx(0.02)


def test_a_motion_that_takes_energy_out_is_as_much_of_a_scale():
    """A brake that took 50 J out of joints, which hold 51 J less: 1 J is nowhere, 2 %."""
    ledger = Ledger()
    ledger.start(None, NOTHING | {"joint_stored": 60.0})
    found = ledger.balance(None, NOTHING | {"joint_stored": 9.0, "driving_work": -50.0})
    assert found.input_energy == 50.0
    assert found.energy_error == pytest.approx(0.02)


def test_work_on_vapour_and_what_comes_through_sides_are_not_the_numerics():
    """100 J, 8 J that came in with an inflow, 5 J spent on tearing off against the pressure of vapour: of the 103 J
    that are left the numerics took 3 where there are 100, and 6 J are an error where there are 109."""
    ledger = started()
    ledger.parting, ledger.entered = 5.0, 8.0
    found = ledger.balance((50.0, 50.0), NOTHING)
    assert (found.parting_work, found.entered) == (5.0, 8.0)
    assert found.numerical_dissipation == pytest.approx(3.0)
    assert ledger.balance((50.0, 59.0), NOTHING).energy_error == pytest.approx(0.06)


def test_what_the_blocks_count_half_a_substep_late_has_arrived():
    ledger = started()
    ledger.give(30.0, behind=2.0)
    found = ledger.balance((50.0, 20.0), NOTHING | {"kinetic": 28.0, "load_work": 28.0})
    assert found.work_received == 30.0
    assert found.energy_error == 0.0


def test_what_trapped_air_holds_is_not_numerical_dissipation():
    """It is shown in a line of its own, and water that gains what the air had lost is in balance."""
    ledger = started()
    ledger.air = 8.0
    found = ledger.balance((50.0, 42.0), NOTHING)
    assert (found.air_energy, found.numerical_dissipation) == (8.0, 0.0)
    ledger.air = -8.0
    assert ledger.balance((50.0, 58.0), NOTHING).energy_error == 0.0
    assert ledger.balance((50.0, 64.0), NOTHING).energy_error == pytest.approx(0.06)
