"""A block that is told to swing in still water: what it feels is its added mass times its acceleration."""

import numpy as np
import pytest

from coupler.scene.build import build
from tests.fakes import no_clock
from tests.physics.scenes import case

PERIOD, AMPLITUDE = 0.25, 0.002
BLOCK = {"name": "block", "size": [0.8, 0.6, 0.6], "centre": [2.0, 0.8, 0.93]}


def steps(dt, end, **motion):
    """Time in the middle and at the end [s], force along x [N], place [m] and defect of every step."""
    coupling = build(
        case(
            time={"end": 10.0, "step_max": dt},
            tank={"lower": [0, 0, 0], "upper": [4, 1.6, 2.4], "cell": 0.2},
            water={"fill": [{"lower": [0, 0, 0], "upper": [4, 1.6, 2.0]}]},
            structure={"block": [BLOCK]},
            contact={"stiffness": 1e7},
            motion=[{"block": "block", **motion}],
        ),
        no_clock,
    ).coupling
    found = []
    with coupling.structure:
        while coupling.time < end - 1e-9:
            record = coupling.step(dt)
            place = coupling.structure.centre()[0, 0]
            found.append(
                (coupling.time - 0.5 * record.dt, coupling.time, record.load[0, 0], place, record.defect)
            )
    return np.array(found).T


@pytest.mark.parametrize("dt", [0.005, 0.01])
def test_the_force_on_a_block_that_swings_is_that_of_its_added_mass(dt):
    """Over the second period the force is in phase with the acceleration in the middle of each step, and its amplitude
    that of the added mass which the impulse of a sudden start gives on the same cells, 106.6 kg of the 288 kg that it
    displaces (a swing so fast makes no waves). The block moved as the pressure solve assumed. With the mean velocity of
    a step in place of that at its end, the force lagged by half a step: a part of 0.13 was in phase with the
    velocity."""
    omega, end = 2.0 * np.pi / PERIOD, 2.0 * PERIOD
    times = np.linspace(0.0, end, 201)
    velocity = AMPLITUDE * omega * np.sin(omega * times)
    middle, at, force, place, defect = steps(
        dt, end, times=times.tolist(), velocities=[[v, 0, 0] for v in velocity]
    )
    assert place - 2.0 == pytest.approx(AMPLITUDE * (1.0 - np.cos(omega * at)), abs=1e-3 * AMPLITUDE)
    assert defect.max() < 1e-6
    second = middle > PERIOD
    waves = np.column_stack([np.cos(omega * middle), np.sin(omega * middle)])[second]
    with_acceleration, with_velocity = np.linalg.lstsq(waves, force[second], rcond=None)[0]
    start = steps(1e-3, 1e-3, velocity=[0.1, 0, 0])[2, 0]
    added = -start * 1e-3 / 0.1
    assert -with_acceleration / (AMPLITUDE * omega**2) == pytest.approx(added, rel=0.01)
    assert abs(with_velocity) < 0.02 * abs(with_acceleration)


def test_a_step_is_no_longer_than_a_block_that_gains_speed_within_it_allows():
    """At rest at the start, and 20 m/s after 10 ms: half of a cell of 0.2 m in a step are 5 ms at that speed."""
    coupling = build(
        case(
            time={"end": 1.0, "step_max": 0.02},
            tank={"lower": [0, 0, 0], "upper": [4, 1.6, 2.4], "cell": 0.2},
            water={"fill": [{"lower": [0, 0, 0], "upper": [4, 1.6, 2.0]}]},
            structure={"block": [BLOCK]},
            contact={"stiffness": 1e7},
            motion=[{"block": "block", "times": [0, 0.01], "velocities": [[0, 0, 0], [20, 0, 0]]}],
        ),
        no_clock,
    ).coupling
    with coupling.structure:
        assert coupling.step_size(1.0) == pytest.approx(0.005)
