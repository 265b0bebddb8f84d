"""What checkpoints are kept, what is done about damaged ones, and when there are none."""

import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

import coupler.run.checkpoint
from coupler.results.history import read_history
from coupler.results.storage import NotFinite
from coupler.run.checkpoint import FOLDER, Checkpoint, listed
from coupler.run.resume import CannotResume, prepare
from tests.coupler.resumed import DRY, begin, check_same, directory_of, go_on


def test_two_checkpoints_stay(dry):
    assert [Checkpoint.read(path).time for path in listed(dry / FOLDER)] == pytest.approx([0.1, 0.08])


def test_a_long_run_keeps_what_it_has_computed_in_any_ten_minutes(dry, tmp_path, monkeypatch):
    """A tenth of the end is hours where a run takes a day. An interval of the case is kept to."""
    monkeypatch.setattr(coupler.run.checkpoint, "LONGEST", 0.0)
    by_default = "\n".join(line for line in DRY.splitlines() if "checkpoint_every" not in line)
    often = begin(tmp_path / "often", by_default, tmp_path / "run")
    last = len(read_history(often / "history" / "structure.csv")["time"])
    assert [int(path.stem) for path in listed(often / FOLDER)] == [last, last - 1]
    listed(often / FOLDER)[0].unlink()
    go_on(often)
    check_same(dry, often)
    own = begin(tmp_path / "own", DRY, tmp_path / "own_run")
    assert [path.stem for path in listed(own / FOLDER)] == [path.stem for path in listed(dry / FOLDER)]


def damage_tear(path):
    path.write_bytes(path.read_bytes()[:-2000])


def damage_byte(path):
    """One bit of one number."""
    whole = bytearray(path.read_bytes())
    spot = whole.find(Checkpoint.read(path).arrays["structure/time"].tobytes())
    assert spot > 0
    whole[spot] ^= 1
    path.write_bytes(whole)


def damage_empty(path):
    path.write_bytes(b"")


@pytest.mark.parametrize("damage", [damage_tear, damage_byte, damage_empty])
def test_a_damaged_checkpoint_is_reported_and_the_older_one_taken(dry, copy, damage):
    newest, older = listed(copy / FOLDER)
    damage(newest)
    reported = []
    assert go_on(copy, reported=reported).checkpoint.path == older
    assert any(line.startswith("note: ") and newest.name in line and "left out" in line for line in reported)
    check_same(dry, copy)


def test_a_history_that_ends_before_the_checkpoint_sends_back_to_the_older_one(dry, copy):
    """A machine that lost power may have lost the last rows, though the checkpoint was forced to the disk."""
    table = copy / "history" / "energy.csv"
    table.write_bytes(table.read_bytes()[:-10])
    reported = []
    assert go_on(copy, reported=reported).checkpoint.time == pytest.approx(0.08)
    assert any("energy.csv ends before it" in line for line in reported)
    check_same(dry, copy)


def test_without_any_usable_checkpoint_nothing_is_touched(copy):
    for path in listed(copy / FOLDER):
        damage_tear(path)
    before = (copy / "run.json").read_bytes()
    with pytest.raises(CannotResume, match=r"no checkpoint can be used:\n.*\n.*\nRun the case again"):
        prepare(copy)
    assert (copy / "run.json").read_bytes() == before
    shutil.rmtree(copy / FOLDER)
    with pytest.raises(CannotResume, match="no checkpoint to go on from"):
        prepare(copy)


def test_a_state_that_is_not_finite_is_never_saved(tmp_path, monkeypatch):
    """The run ends with the name of the array; the checkpoint before stays."""
    from coupler.step.coupled_step import CoupledStepper

    honest = CoupledStepper.save

    def spoilt(self):
        found = honest(self)
        return found if self.time < 0.06 else found | {"defects": np.array([np.nan])}

    monkeypatch.setattr(CoupledStepper, "save", spoilt)
    with pytest.raises(NotFinite, match="coupling/defects"):
        begin(tmp_path / "case", DRY, tmp_path / "run")
    assert [Checkpoint.read(path).time for path in listed(tmp_path / "run" / FOLDER)] == pytest.approx([0.04])


NOTHING_LOADED = """
import sys
from pathlib import Path
from coupler.checks.read_case import load
from coupler.run.run import run
from coupler.run.directory import RunDirectory
from coupler.commands.warm_up import Silent
file = load(sys.argv[1], ["time.checkpoint_every=0", "time.end='10 ms'"])
with RunDirectory.create(file, Path(sys.argv[2])) as directory:
    run(file.case, directory, Silent())
print([x for x in ("coupler.run.checkpoint", "coupler.run.array_file", "fluid.step.state") if x in sys.modules])
"""


def test_a_run_without_checkpoints_loads_and_leaves_nothing_of_them(tmp_path):
    case = directory_of(tmp_path / "case", DRY)
    done = subprocess.run(
        [sys.executable, "-c", NOTHING_LOADED, case, tmp_path / "run"],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ,
    )
    assert done.stdout.strip().endswith("[]")
    assert not (tmp_path / "run" / FOLDER).exists()
