"""A long step is left where the run is to end, and what stood before it is what the run goes on from."""

import pytest

from coupler.commands.warm_up import Silent
from coupler.run import within_step
from coupler.run.checkpoint import FOLDER, listed
from coupler.run.summary import read_summary
from coupler.run.within_step import LongSteps, StepLeft
from coupler.step.limits import LimitReached
from tests.coupler.resumed import DRY, begin, check_same, go_on
from tests.coupler.test_resume import COUPLED, STREAM

BREAKS = 12
"""Steps of DRY before the one in which its first joint breaks."""


@pytest.fixture
def impatient(monkeypatch):
    """Every step counts as a long one that has had its time."""
    for name in ("LONG", "PATIENCE", "INTERVAL"):
        monkeypatch.setattr(within_step, name, 0.0)


class StopWithin(Silent):
    """A user who wants the run to stop in the middle of the step that follows `steps`: at the question `asks` of it."""

    def __init__(self, steps, asks):
        self.steps, self.asks, self.done, self.asked = steps, asks, 0, 0

    def step(self, time, figures):
        self.done, self.asked = self.done + 1, -1  # the question at the end of a step is still to come

    def stop_requested(self):
        self.asked += 1
        return "stopped by the test" if self.done >= self.steps and self.asked >= self.asks else None


def left_and_gone_on(tmp_path, text, whole, steps, asks):
    """A run that left its step `steps` + 1 and went on."""
    output = tmp_path / "run"
    with pytest.raises(
        LimitReached, match=r"stopped by the test. The step under way was left; `surgebreak resume"
    ):
        begin(tmp_path / "case", text, output, reporter=StopWithin(steps, asks))
    assert int(listed(output / FOLDER)[0].stem) == steps
    assert go_on(output).checkpoint.path.stem == f"{steps:08d}"
    check_same(whole, output)


def test_a_dry_step_is_left_between_substeps(dry, tmp_path, impatient):
    left_and_gone_on(tmp_path, DRY, dry, steps=5, asks=3)


def test_the_verdict_of_a_step_that_was_left_is_that_of_the_last_complete_one(tmp_path, impatient):
    """Blocks that were under way have gone back: the run says what it would say had it ended before the step."""
    found = []
    for name, asks in (("left", 60), ("ended", 0)):
        with pytest.raises(LimitReached):
            begin(tmp_path / "case", DRY, tmp_path / name, reporter=StopWithin(BREAKS, asks))
        found.append(read_summary(tmp_path / name)["figures"]["verdict"])
    assert found[0] == found[1]


def test_a_coupled_step_is_left_between_passes_and_substeps(tmp_path, impatient):
    """The domain was cut anew and the blocks were under way: nothing of that is kept."""
    text = COUPLED.replace('end = "0.42 s"', 'end = "0.18 s"')
    whole = begin(tmp_path / "case", text, tmp_path / "whole")
    left_and_gone_on(tmp_path, text, whole, steps=7, asks=4)


def test_a_step_of_water_alone_is_left_before_its_pressure(tmp_path, impatient):
    text = STREAM.replace('end = "0.4 s"', 'end = "0.1 s"')
    whole = begin(tmp_path / "case", text, tmp_path / "whole")
    left_and_gone_on(tmp_path, text, whole, steps=3, asks=1)


def test_the_budget_counts_within_a_step(tmp_path, impatient):
    with pytest.raises(LimitReached, match=r"limits.cpu_seconds.*The step under way was left"):
        begin(tmp_path / "case", DRY, tmp_path / "run", "limits.cpu_seconds=1e-6", reporter=Silent())
    assert not listed(tmp_path / "run" / FOLDER)  # of the start there is none: the case says all of it


def test_a_run_without_checkpoints_is_left_too(tmp_path, impatient):
    with pytest.raises(LimitReached, match=r"The step under way was left$"):
        begin(tmp_path / "case", DRY, tmp_path / "run", "time.checkpoint_every=0", reporter=StopWithin(3, 2))


def test_short_steps_are_not_asked_and_nothing_is_held_for_them(monkeypatch):
    """They end by themselves in a moment."""
    held, asked = [], []
    long = LongSteps(lambda: asked.append(1) or "stop", lambda: held.append(1))
    monkeypatch.setattr(within_step, "PATIENCE", 0.0)
    long.around(lambda: None)  # the first one may be long
    assert len(held) == 1
    long.around(long)
    assert (len(held), asked) == (1, [])
    monkeypatch.setattr(within_step, "LONG", 0.0)
    with pytest.raises(StepLeft, match=r"stop\. The step under way was left"):
        long.around(long)
    assert len(held) == 2
