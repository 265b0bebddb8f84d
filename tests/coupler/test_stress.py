"""Verdicts of the stress scenes, and how they are reported. The scenes themselves run by `surgebreak stress`."""

import json

import pytest

from coupler.commands.stress import page, report, runner
from coupler.commands.stress.one import outcome
from coupler.commands.stress.registry import GROUPS, Measure, Scene, scenes
from coupler.program.errors import BadCase, ExitCode
from yade_scripts.contact.law import ContactLaw


def made(run, refusal="never"):
    return Scene("X1", "structure", "made up", "S", refusal, run)


def good():
    yield Measure("gain", 0.5, 1.0)
    yield Measure("not judged", 9.0, None)


def bad():
    yield Measure("gain", float("nan"), 1.0)


def refuses():
    yield Measure("stiffness", ContactLaw(-1.0).stiffness, 1.0)


def test_every_scene_has_an_id_of_its_own_and_a_known_group():
    found = scenes()
    assert {s.group for s in found.values()} <= set(GROUPS)
    assert all(id == s.id for id, s in found.items())


def test_a_scene_passes_with_all_its_figures_and_fails_with_one_that_is_no_number():
    assert outcome(made(good)).verdict == "passed"
    assert outcome(made(bad)).verdict == "failed"
    assert outcome(made(lambda: iter(()))).verdict == "failed"


def test_a_refusal_counts_as_the_scene_says():
    """Ours, with a message; other errors are mistakes of the scene and end its process."""
    assert outcome(made(refuses)).verdict == "failed"
    for refusal in ("may", "must"):
        found = outcome(made(refuses, refusal))
        assert (found.verdict, "contact.stiffness" in found.message) == ("refused", True)
    assert outcome(made(good, "must")).verdict == "failed"
    with pytest.raises(ZeroDivisionError):
        outcome(made(lambda: iter([Measure("x", 1 / 0, None)])))


def test_scenes_are_chosen_by_id_group_and_cost():
    everything = runner.chosen([], quick=False)
    assert {s.cost for s in runner.chosen([], quick=True)} == {"S"}
    assert [s.id for s in runner.chosen(["s42"], quick=False)] == ["S42"]
    assert runner.chosen(["structure"], quick=False) == [s for s in everything if s.group == "structure"]
    slow = next(s.id for s in everything if s.cost == "M")
    with pytest.raises(BadCase, match=f"--quick leaves out {slow}"):
        runner.chosen([slow], quick=True)
    with pytest.raises(BadCase, match="unknown scene"):
        runner.chosen(["S999"], quick=False)


def test_a_scene_in_its_own_process(capsys):
    """The one that must be refused before it runs: verdict, message and exit code; as JSON too."""
    assert report.stress(["S43"], quick=False, as_json=True, only_list=False) == ExitCode.DONE
    row = json.loads(capsys.readouterr().out)
    assert (row["id"], row["verdict"]) == ("S43", "refused")
    assert "contact.stiffness = nan" in row["message"]


def test_a_failed_scene_fails_the_command(monkeypatch, capsys):
    monkeypatch.setattr(report, "chosen", lambda words, quick: [made(bad)])
    monkeypatch.setattr(report, "run", outcome)
    assert report.stress([], quick=False, as_json=False, only_list=False) == ExitCode.DIVERGED
    assert "not kept" in capsys.readouterr().out


def test_the_page_shows_groups_verdicts_and_what_was_missed():
    """A failed scene names the figure and its limit, a refused one its message; passed ones only their row."""
    rows = [outcome(made(run, refusal)).as_row() for run, refusal in ((good, "never"), (bad, "never"))]
    rows.append(outcome(made(refuses, "must")).as_row())
    shown = page.tables(rows)
    assert shown.startswith("### structure\n1 passed, 1 refused, 1 failed")
    assert "| X1 | made up | **failed** |" in shown
    assert "gain nan, limit 1" in shown
    assert "“contact.stiffness = -1 N/m; take" in shown


def test_scenes_of_all_groups_are_short_and_run_by_their_group():
    """Scenes with water are all of the short kind: a group must not take longer than a coffee."""
    for group in ("water", "coupling"):
        found = runner.chosen([group], quick=False)
        assert len(found) >= 14
        assert {s.cost for s in found} == {"S"}
