"""Reasons to doubt a verdict, and what it is not about."""

import numpy as np
import pytest

from coupler.verdict.judge import verdict
from coupler.verdict.trend import Trend
from coupler.verdict.words import sentences, still_rising, unsettled
from tests.coupler.verdict_scene import record, verdict_scene


@pytest.fixture
def scene():
    return verdict_scene()


def test_a_block_on_its_way_out_as_the_run_ends_is_doubted(scene):
    """30 mm of the 40 from which it has left its place, at 50 mm/s: after 0.2 s more it has. Blocks that vibrate or
    come back are no doubt, nor is a run of 0.1 s, which says nothing about so long."""
    s, watch, coupling = scene
    s.x = s.x + np.array([[0, 0, 0], [0.03, 0, 0], [0, 0, 0]])
    for speed, length, doubted in (
        (0.05, 1.0, True),
        (-0.05, 1.0, False),
        (0.0, 1.0, False),
        (0.05, 0.1, False),
    ):
        s.v[1, 0] = speed
        watch.step(coupling, record(length))
        reported = verdict(s, watch)
        assert reported["state"] == "stands"
        assert bool(unsettled(reported, length)) is doubted
        if doubted:
            assert "'wall-1' still moves as the run ends at t = 1 s: it is 30 mm from its place" in unsettled(
                reported, length
            )
            assert reported["leaving"]["within"] == pytest.approx(0.2)
    s.v[1, 0] = 0.05
    s.x[1, 0] -= 0.001  # it swings, and was farther out before
    assert verdict(s, watch)["leaving"] is None


@pytest.mark.parametrize(
    ("load", "grows"),
    [
        (lambda t: 100.0, False),
        (lambda t: 100.0 * t, True),
        (lambda t: 1000.0 * max(t - 3.9, 0.0), True),
        (lambda t: 100.0 * min(t, 2.0), False),
        (lambda t: 500.0 if 1.0 < t < 1.5 else 10.0 * t * t, False),
        (lambda t: 100.0 * (1.0 + 0.3 * np.sin(400.0 * t)), False),
    ],
    ids=(
        "still water",
        "rising",
        "the front just arrives",
        "a flood that stands",
        "after an impact",
        "trembling",
    ),
)
def test_a_load_that_still_grows_as_the_run_ends_is_doubted(scene, load, grows):
    """The peak may come later: a wall that the front had just reached stood without a word."""
    s, watch, coupling = scene
    for k in range(400):
        t = 0.01 * (k + 1)
        watch.step(coupling, record(t, load=[(load(t), 0, 0), (0, 0, 0), (0, 0, 0)]))
    found = verdict(s, watch)
    doubt = still_rising(found, 4.0)
    assert (doubt is not None) == grows
    if grows:
        assert "horizontal force of the water still grows as the run ends at t = 4 s" in doubt
        s.x = s.x + np.array([1.0, 0, 0])
        watch.step(coupling, record(4.01))
        assert still_rising(verdict(s, watch), 4.01) is None  # what has collapsed stays so


def test_a_load_that_is_nothing_beside_the_weight_is_not_doubted(scene):
    """A film of water beside a house of 90 t exerted 6 mN, more and more of them."""
    s, watch, coupling = scene
    weight = float(s.mass.sum() * np.linalg.norm(s.gravity))
    for k in range(400):
        push = 1e-8 * weight * 0.01 * (k + 1)
        watch.step(coupling, record(0.01 * (k + 1), load=[(push, 0, 0), (0, 0, 0), (0, 0, 0)]))
    assert verdict(s, watch)["rising"] is None


def test_uplift_that_still_grows_is_doubted_too(scene):
    s, watch, coupling = scene
    for k in range(400):
        watch.step(coupling, record(0.01 * (k + 1), load=[(10.0, 0, 100.0 * k), (0, 0, 0), (0, 0, 0)]))
    assert "the force of the water still grows" in still_rising(verdict(s, watch), 4.0)


def test_loose_blocks_beside_a_structure_with_joints_are_named(scene):
    """A quay wall of loose blocks below a house: the verdict is about the house, and said nothing of the wall."""
    s, watch, coupling = scene
    watch.step(coupling, record(0.1))
    last = "; verdict.on names what is judged, by default what has joints"
    assert f"not judged: crate (in place){last}" in list(sentences(verdict(s, watch)))
    s.x = s.x + np.array([[0, 0, 0], [0, 0, 0], [1.0, 0, 0]])
    watch.step(coupling, record(0.2))
    found = verdict(s, watch)
    assert found["state"] == "stands"
    assert f"not judged: crate (moved){last}" in list(sentences(found))


def test_the_means_of_a_load_that_does_not_change_are_that_load():
    """From the first step on, however long steps are: a mean that began below it would call the load rising."""
    trend, time = Trend.none(), 0.0
    for dt in (0.02, 0.001, 0.05, 0.3, 2.0):
        time += dt
        trend.take(np.array([3e4, 5e4]), time, dt)
        assert trend.array() == pytest.approx(np.tile([3e4, 5e4], (3, 1)), rel=1e-12)
        assert trend.rising(0.0) is None
