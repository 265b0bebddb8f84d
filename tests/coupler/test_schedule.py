"""Times of outputs and checkpoints: a run that is stopped and extended meets the same ones."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coupler.case.schedule import Schedule, checkpoint_interval, first_part, next_multiple
from coupler.checks.case import problems
from coupler.run.forecast import _disk_remark
from tests.physics.scenes import case

TIMES = st.floats(1e-3, 1e5)
COUNTS = st.integers(1, 1000)


def timed(**time):
    return case(time=time)


@given(TIMES, COUNTS)
def test_outputs_come_one_by_one_and_end_with_the_run(end, count):
    """Also from times that rounding has left just before or behind an output."""
    schedule = Schedule(end, count, end)
    for k in {0, count // 2, count - 1}:
        for time in (end * k / count * (1 - 1e-13), end * k / count * (1 + 1e-13)):
            assert schedule.next_output(time) == pytest.approx(end * (k + 1) / count, rel=1e-9)
    assert schedule.next_output(end * (count - 0.5) / count) == end


def test_a_longer_end_keeps_the_interval():
    schedule = Schedule.of(timed(end=1.0)).until(1.5)
    assert schedule.next_output(0.995) == 1.0
    assert schedule.next_output(1.0) == pytest.approx(1.01)
    assert schedule.next_output(1.4999) == 1.5


@pytest.mark.parametrize("every", [0.1, 0.01, 0.007])
def test_a_run_that_is_extended_ends_first_at_an_output_of_the_longer_one(every):
    """3 x 0.1 s is 4e-17 s more than 0.3 s: the step after it had another last digit."""
    longer = Schedule.of(timed(end=100 * every, output_every=every))
    for k in range(1, 100):
        first = Schedule.of(timed(end=round(k * every, 3), output_every=every))
        assert first.next_output((k - 0.5) * every) == longer.next_output((k - 0.5) * every)


def test_the_interval_divides_the_first_end():
    assert Schedule.of(timed(end=1.0, output_every=0.3)) == Schedule(1.0, 3, 1.0)
    assert Schedule.of(timed(end=1.0, output_every=5.0)) == Schedule(1.0, 1, 1.0)
    short, long = (Schedule.of(timed(end=end, output_every=0.01)) for end in (0.06, 0.1))
    assert [short.next_output(0.01 * k) for k in range(5)] == [long.next_output(0.01 * k) for k in range(5)]


@pytest.mark.parametrize(
    "own", [{}, {"output_every": 0.4, "checkpoint_every": 0.5}, {"checkpoint_every": 0.0}]
)
def test_the_first_part_of_a_run_has_the_steps_of_the_whole(own):
    """By default its outputs were hundredths of the part, and each of them ended a step."""
    whole = timed(end=8.0, **own)
    words = dict(text.split("=") for text in first_part(whole, 0.02))
    part = timed(**{key.removeprefix("time."): float(value) for key, value in words.items()})
    assert part.time.end == 0.02
    assert Schedule.of(part).next_output(0.0) == min(0.02, Schedule.of(whole).interval)
    assert checkpoint_interval(part) == checkpoint_interval(whole)


def test_more_outputs_than_anybody_can_read_are_refused():
    """A step ends at each: a nanosecond for a millisecond would never come to an end, and fill the disk."""
    ((path, text),) = (p for p in problems(timed(end=1.0, output_every=1e-9)) if p[0][:1] == ("time",))
    assert path == ("time", "output_every")
    assert "1e+09 written states until 1 s, at most 100000; write 1e-05 s or more" in text
    assert not any(p[0][:1] == ("time",) for p in problems(timed(end=1.0, output_every=1e-5)))


def test_the_forecast_says_where_the_disk_is_too_small():
    assert _disk_remark(1e6, 2e6) == "about"
    assert "more than the 2 MB that are free: raise time.output_every" in _disk_remark(1e9, 2e6)


def test_how_often_checkpoints_are_written():
    """A tenth of the end unless the case says otherwise; zero means none."""
    assert checkpoint_interval(timed(end=4.0)) == 0.4
    assert checkpoint_interval(timed(end=4.0, checkpoint_every=1.5)) == 1.5
    assert checkpoint_interval(timed(end=4.0, checkpoint_every=0)) == 0.0


@given(TIMES, COUNTS)
def test_the_next_multiple_lies_ahead_by_at_most_one_interval(every, k):
    time = every * k
    assert next_multiple(time, every) == pytest.approx(time + every)
    assert next_multiple(time * (1 - 1e-13), every) == pytest.approx(time + every)
    assert next_multiple(0.999 * time, every) > 0.999 * time
