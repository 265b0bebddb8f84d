"""What a command starts must be the program that was called, or figures of another version would be reported."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from coupler.commands.benchmark import command
from coupler.program import extras, process, provenance
from coupler.program.provenance import ROOT

from .until import until

HERE = "print(__file__)\n"


def checkout(folder):
    """The least of a checkout that starts a child, with a module that tells where it stands."""
    (folder / "coupler" / "program").mkdir(parents=True)
    for name in (
        "__init__.py",
        *(
            f"program/{n}.py"
            for n in (
                "__init__",
                "arithmetic",
                "control_groups",
                "errors",
                "process",
                "provenance",
                "threads",
            )
        ),
    ):
        shutil.copy(ROOT / "coupler" / name, folder / "coupler" / name)
    shutil.copy(ROOT / "pyproject.toml", folder)
    (folder / "coupler" / "here.py").write_text(HERE, encoding="utf-8")
    return folder


def test_children_are_of_the_checkout_of_their_parent(tmp_path):
    """Called from within another checkout, in an environment where a third one is installed."""
    mine, other = checkout(tmp_path / "mine"), checkout(tmp_path / "other")
    code = "from coupler.program.process import run_module; run_module('coupler.here')"
    parent = os.environ | {"PYTHONPATH": str(mine), "PYTHONSAFEPATH": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=other, env=parent, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == str(mine / "coupler" / "here.py")


ASLEEP = "import os, time; open({place!r}, 'w').write(f'{{os.getpid()}}\\n'); time.sleep(300)"
"""A child that says which process it is and then takes long."""


@pytest.mark.parametrize(
    "start",
    [
        "from coupler.program.process import run_module\nrun_module('timeit', '-n1', '-r1', {child!r})",
        """
import sys
from pathlib import Path
from coupler.commands.sweep import local
class Spec: folder, threads = Path({folder!r}), 1
real = local.subprocess.Popen
local.subprocess.Popen = lambda words, **options: real([sys.executable, "-c", {child!r}], **options)
local.Local(Spec, 1).make(["a"], print)
""",
    ],
    ids=["a step of a command", "a run of a sweep"],
)
def test_a_child_ends_with_the_command_that_was_killed(tmp_path, start):
    """Else what nobody waits for any more goes on for hours, after `kill` and after the terminal was closed."""
    (tmp_path / "runs").mkdir()
    place = tmp_path / "child"
    code = start.format(child=ASLEEP.format(place=str(place)), folder=str(tmp_path))
    parent = subprocess.Popen([sys.executable, "-c", code], env=process.environment())
    try:
        until(lambda: place.exists() and place.read_text().endswith("\n"), "the child begins", 60.0)
        child = int(place.read_text())
    finally:
        parent.kill()
        parent.wait()
    until(lambda: not _lives(child), "the child ends", 20.0)


def _lives(number):
    """Whether a process is there and has not ended; one whose parent has not asked for its end is a zombie (Z)."""
    try:
        state = Path(f"/proc/{number}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


def test_the_path_that_the_user_gave_stays_behind_ours(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", f"/somewhere{os.pathsep}{ROOT}")
    assert process.environment()["PYTHONPATH"] == f"{ROOT}{os.pathsep}/somewhere"


def test_an_installed_program_needs_no_path(monkeypatch, tmp_path):
    """Its folder is that of all packages; ahead of the standard library it could hide parts of that."""
    monkeypatch.delenv("PYTHONPATH", raising=False)
    monkeypatch.setattr(process, "ROOT", tmp_path)
    assert "PYTHONPATH" not in process.environment()


@pytest.mark.skipif(shutil.which("git") is None, reason="needs git")
def test_the_commit_of_a_run_is_that_of_the_program_and_of_nothing_around_it(monkeypatch, tmp_path):
    """A virtual environment often lies in the repository of a user's own project."""

    def git(*words):
        who = ("-c", "user.name=nobody", "-c", "user.email=nobody@example.org", "-c", "commit.gpgsign=false")
        subprocess.run(["git", *who, *words], cwd=tmp_path, check=True, capture_output=True)

    git("init")
    git("commit", "--allow-empty", "-m", "a project of somebody else")
    installed = tmp_path / ".venv" / "site-packages"
    installed.mkdir(parents=True)
    monkeypatch.setattr(provenance, "ROOT", installed)
    assert provenance.git_state() is None
    monkeypatch.setattr(provenance, "ROOT", tmp_path)
    state = provenance.git_state()
    assert state is not None
    assert len(state["commit"]) == 40
    assert state["changed"] is False


def test_all_extras_are_here_and_are_those_of_pyproject():
    import tomllib

    declared = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert set(extras.COMMANDS) < set(extras.EXTRAS) == set(declared["optional-dependencies"])
    of_the_tests = ("view", "benchmark", "drawing", "pandas", "docs", "test")
    assert not any(extras.missing(extra) for extra in of_the_tests)


def test_a_benchmark_without_its_solvers_is_refused_before_it_measures(monkeypatch):
    """With the command that brings them; the other measurements do without."""
    monkeypatch.setitem(extras.EXTRAS, "benchmark", ("a_package_that_is_nowhere",))
    monkeypatch.setattr(command, "GROUPS", {"joints": lambda sizes: [], "solver": lambda sizes: []})
    with pytest.raises(extras.NotInstalled, match=r"nowhere is not installed.*\./surgebreak benchmark"):
        command.benchmark(quick=True, as_json=True)
    assert command.benchmark(quick=True, as_json=True, only="joints") == 0
