"""What of the impulses between blocks is told as a hit of debris."""

import numpy as np
import pytest

from coupler.verdict.judge import verdict
from coupler.verdict.watch import Watch
from tests.coupler.verdict_scene import record, verdict_scene

G = 9.81


@pytest.fixture
def scene():
    return verdict_scene()


def crate_hits(scene, contact):
    """The crate arrives at the wall with 3 m/s and stays there, given the impulses of contacts."""
    s, watch, coupling = scene
    s.v[2, 0] = 3.0
    s.x[2, 0] = 4.2
    watch.step(coupling, record(0.2))
    s.v = np.zeros((3, 6))
    watch.step(coupling, record(0.21, contact=contact))
    return verdict(s, watch)["hits"]


def test_debris_that_loses_its_speed_to_a_wall_has_hit_it(scene):
    J = 500.0 * 3.0
    (hit,) = crate_hits(scene, [[J, 0, 0], [0, 0, 0], [-J, 0, 0]])["list"]
    assert (hit["block"], hit["other"], hit["time"]) == ("crate", "wall-0", 0.21)
    assert (hit["speed"], hit["impulse"], hit["force"]) == pytest.approx((3.0, J, J / 0.01))


def test_debris_that_the_water_stops_beside_a_wall_it_only_touches_has_not_hit_it(scene):
    """It loses 3 m/s, of which the contact took a tenth of a metre per second."""
    J = 500.0 * 0.1
    assert crate_hits(scene, [[J, 0, 0], [0, 0, 0], [-J, 0, 0]])["pairs"] == 0


@pytest.mark.parametrize("shares", [(0.5, 0.5), (0.3, 0.7), (1.0, 0.0)])
def test_a_blow_that_the_end_of_a_step_divides_is_the_same_hit(scene, shares):
    """The crate is stopped from 0.55 m/s, more than the 0.44 of a fall from a hundredth of its height, wherever
    a step ends within the blow."""
    s, watch, coupling = scene
    s.x[2, 0], s.v[2, 0] = 4.2, 0.55
    watch.step(coupling, record(0.2))
    for time, share in zip((0.21, 0.22), shares):
        J = 500.0 * 0.55 * share
        s.v = s.v.copy()
        s.v[2, 0] -= 0.55 * share
        watch.step(coupling, record(time, contact=[[J, 0, 0], [0, 0, 0], [-J, 0, 0]]))
    (hit,) = verdict(s, watch)["hits"]["list"]
    assert (hit["block"], hit["other"]) == ("crate", "wall-0")
    assert (hit["speed"], hit["impulse"]) == pytest.approx((0.55, 500.0 * 0.55))


def test_a_slow_stop_over_many_steps_is_no_hit(scene):
    s, watch, coupling = scene
    s.x[2, 0], s.v[2, 0] = 4.2, 1.7
    J = 500.0 * 0.17
    for k in range(10):
        s.v = s.v.copy()
        s.v[2, 0] -= 0.17
        watch.step(coupling, record(0.2 + 0.01 * k, contact=[[J, 0, 0], [0, 0, 0], [-J, 0, 0]]))
    assert verdict(s, watch)["hits"]["pairs"] == 0


def test_a_blow_goes_on_after_a_restart(scene):
    s, watch, coupling = scene
    s.x[2, 0], s.v[2, 0] = 4.2, 1.7
    watch.step(coupling, record(0.2))
    J = 500.0 * 0.85
    saved = None
    for time in (0.21, 0.22):
        if saved is not None:
            watch.restore(saved)
        s.v = s.v.copy()
        s.v[2, 0] -= 0.85
        watch.step(coupling, record(time, contact=[[J, 0, 0], [0, 0, 0], [-J, 0, 0]]))
        saved = watch.save()
        watch._blow = None
    assert verdict(s, watch)["hits"]["pairs"] == 1


def test_what_the_water_stops_has_hit_nothing(scene):
    """It lost the speed, but no contact took it: only its own weight on the ground."""
    W = 500.0 * G * 0.01
    assert crate_hits(scene, [[0, 0, 0], [0, 0, 0], [0, 0, W]])["pairs"] == 0


def test_debris_that_something_else_stops_has_not_hit_what_it_grazes(scene):
    """The ground took its speed; the wall beside it felt a hundredth of that."""
    J = 500.0 * 3.0
    assert crate_hits(scene, [[0.01 * J, 0, 0], [0, 0, 0], [-J, 0, 0]])["pairs"] == 0


def test_rubble_of_a_wall_can_be_hit_by_another_body(scene):
    s, J = scene[0], 500.0 * 3.0
    s.x[0, 0] += 0.3  # out of its place
    (hit,) = crate_hits(scene, [[J, 0, 0], [0, 0, 0], [-J, 0, 0]])["list"]
    assert (hit["block"], hit["other"]) == ("crate", "wall-0")


def test_rubble_of_a_wall_that_tumbles_over_itself_hits_nothing(scene):
    s, watch, coupling = scene
    s.x[:2, 0] += 0.3
    s.v[1, 2] = -3.0
    watch.step(coupling, record(0.2))
    s.v = np.zeros((3, 6))
    J = s.mass[1] * 3.0
    watch.step(coupling, record(0.21, contact=[[0, 0, -J], [0, 0, J], [0, 0, 0]]))
    assert verdict(s, watch)["hits"]["pairs"] == 0


def test_a_press_without_a_change_of_speed_is_no_hit(scene):
    s, watch, coupling = scene
    s.x[2, 0] = 4.2
    J = 500.0 * 3.0
    watch.step(coupling, record(0.2, contact=[[J, 0, 0], [0, 0, 0], [-J, 0, 0]]))
    assert verdict(s, watch)["hits"]["pairs"] == 0


def test_a_run_that_goes_on_tells_the_same(scene):
    s, watch, _ = scene
    crate_hits(scene, [[1500.0, 0, 0], [0, 0, 0], [-1500.0, 0, 0]])
    other = Watch(s, watch.divisions, watch.rules, watch.judged)
    other.restore(watch.save())
    assert verdict(s, other) == verdict(s, watch)
    assert other.hits.tolist() == watch.hits.tolist()
