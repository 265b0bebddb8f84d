"""The command: exit codes, messages and files, seen from outside."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from coupler.case.first_cases import text_of
from coupler.commands import cli
from coupler.program.provenance import ROOT, version

from .test_case_file import BLOCKS, WATER, write

COMMAND = Path(sys.executable).parent / "surgebreak"


def surgebreak(*arguments, **environment):
    return subprocess.run(
        [COMMAND, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
    )


def test_version():
    assert surgebreak("--version").stdout == f"surgebreak {version()}\n"


def test_ctrl_c_ends_any_command_with_a_word(monkeypatch, capsys):
    """The library under it would leave with 130 and say nothing; a study or a set of checks takes minutes."""

    def interrupted(key):
        raise KeyboardInterrupt

    monkeypatch.setattr("coupler.case.docs.explanation", interrupted)
    with pytest.raises(SystemExit) as left:
        cli.app(["explain"])
    assert left.value.code == 4
    assert "Ctrl-C" in capsys.readouterr().err


def test_help_names_every_command_and_loads_nothing_that_takes_time():
    done = surgebreak("--help", PYTHONPROFILEIMPORTTIME="1")
    reported, loaded = done.stdout, {line.split("|")[-1].strip() for line in done.stderr.splitlines()}
    assert "coupler.commands.cli" in loaded
    assert not loaded & {"numpy", "numba", "pydantic", "pint", "h5py", "skfem", "yade"}
    for command in ("run", "resume", "check", "render", "doctor", "explain", "init", "test"):
        assert f"\n  {command} " in reported


def test_a_bad_case_ends_with_two_and_one_line_for_each_mistake(tmp_path):
    write(tmp_path, WATER.replace("density", "densty").replace("2 s", "2 m"))
    done = surgebreak("run", tmp_path)
    assert done.returncode == 2
    assert done.stderr.splitlines() == [
        f"{tmp_path}/case.toml:4: time.end: '2 m' is a length, needs a time [s]",
        f"{tmp_path}/case.toml:10: water.densty: unknown name; did you mean 'density'?",
        "surgebreak: 2 mistakes in the case; nothing was run",
    ]
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["verify", "P999"], "P999: "),
        (["stress", "C999"], "C999: "),
        (["sweep", "CASE", "--plan", "--vary", "tank.cell"], "--vary tank.cell: write KEY=A,B,..."),
        (["sweep", "CASE", "--engine", "slurn"], "--engine slurn: there are "),
        (["benchmark", "--only", "joint"], "--only joint: choose one of "),
    ],
)
def test_a_mistake_in_the_call_is_not_said_to_be_in_a_case(words, line, tmp_path):
    write(tmp_path, WATER)
    done = surgebreak(*[tmp_path if word == "CASE" else word for word in words])
    assert done.returncode == 2
    told, count = done.stderr.splitlines()
    assert told.startswith(line)
    assert count == "surgebreak: 1 mistake in the call; nothing was run"


@pytest.mark.parametrize("words", [["check"], ["run", "--dry"]])
def test_a_case_is_read_and_checked_once(words, tmp_path, monkeypatch):
    """Twice or three times was the cost of a terrain or a drawing, which are read with it."""
    from coupler.checks import read_case

    write(tmp_path, WATER)
    seen, problems = [], read_case.problems
    monkeypatch.setattr(read_case, "problems", lambda *given: seen.append(given) or problems(*given))
    cli.app([*words, str(tmp_path)], standalone_mode=False)
    assert len(seen) == 1


def test_a_case_is_read_from_a_working_directory_that_was_removed(tmp_path):
    write(tmp_path, WATER)
    gone = tmp_path / "gone"
    gone.mkdir()
    code = (
        f"import os, sys; sys.path.insert(0, {str(ROOT)!r}); os.chdir({str(gone)!r}); os.rmdir({str(gone)!r});"
        "from coupler.checks.read_case import load; from pathlib import Path;"
        f"print(load(Path({str(tmp_path)!r})).case.time.end)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_set_and_end_are_checked_like_the_file(tmp_path):
    write(tmp_path, WATER)
    done = surgebreak("check", tmp_path, "--set", "water.density=-1")
    assert done.returncode == 2
    assert done.stderr.startswith("--set water.density=-1: water.density: -1 is out of range")
    assert surgebreak("run", tmp_path, "--end", "soon").stderr.startswith(
        "--set time.end=soon: time.end: 'soon' is no"
    )


def test_an_existing_output_is_refused(tmp_path):
    write(tmp_path, WATER)
    done = surgebreak("run", tmp_path, "--output", tmp_path)
    assert done.returncode == 2
    assert "results are never overwritten" in done.stderr


def test_an_unknown_option_is_refused(tmp_path):
    assert surgebreak("run", tmp_path, "--ouput", "x").returncode == 2


def test_explain_tells_unit_limits_and_example():
    reported = surgebreak("explain", "contact.pair.materials").stdout
    assert reported.startswith('contact.pair.materials (required; for instance ["brick", "ground"]): ')
    reported = surgebreak("explain", "joints.strength").stdout
    assert reported.startswith(
        'joints.strength [Pa] (> 0; for instance "0.5 MPa"): T_max, largest traction; needed unless the material'
    )


def test_explain_offers_the_nearest_name():
    done = surgebreak("explain", "joints.strenght")
    assert done.returncode == 2
    assert done.stderr == (
        "surgebreak: joints.strenght: no such name in a case file; did you mean 'joints.strength'?\n"
    )


def test_explain_lists_every_kind_of_a_name():
    reported = surgebreak("explain", "water.inflow.kind").stdout.splitlines()
    assert [line.split("(")[1].split(";")[0] for line in reported] == [
        "steady", "record", "bore", "solitary", "n-wave",
    ]  # fmt: skip
    assert len(surgebreak("explain", "tank.cell").stdout.splitlines()) == 1


def test_explain_of_a_command_names_its_help():
    done = surgebreak("explain", "render")
    assert done.returncode == 2
    assert done.stderr == (
        "surgebreak: render: a command, no name of a case file; `surgebreak render --help` explains it\n"
    )


def test_init_writes_a_case_that_passes_and_never_overwrites(tmp_path):
    place = tmp_path / "new" / "case"
    assert surgebreak("init", place).returncode == 0
    from coupler.checks.read_case import load

    assert load(place).case.structure.block[0].name == "box"
    (place / "case.toml").write_text("mine", encoding="utf-8")
    done = surgebreak("init", place)
    assert done.returncode == 1
    assert "exists and is left as it is" in done.stderr
    assert (place / "case.toml").read_text(encoding="utf-8") == "mine"


def test_without_the_optional_packages_the_way_to_get_them_is_reported(tmp_path):
    """Called past the launcher, nothing may be installed behind the user's back."""
    code = (
        "import sys, coupler.commands.cli as cli, coupler.program.extras as extras\n"
        "extras.EXTRAS['test'] = ('a_package_that_is_nowhere',)\n"
        "sys.argv = ['surgebreak', 'test']\n"
        "cli.main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "`./surgebreak test` of the checkout brings it" in done.stderr


def test_without_a_checkout_no_tests_of_other_packages_are_run(tmp_path):
    """pytest in site-packages collects what lies there, the tests of pip among them."""
    code = (
        "import sys, pathlib, coupler.commands.cli as cli, coupler.program.provenance as provenance\n"
        f"provenance.ROOT = pathlib.Path({str(tmp_path)!r})\n"
        "sys.argv = ['surgebreak', 'test']\n"
        "cli.main()"
    )
    (tmp_path / "test_of_another.py").write_text("def test_it():\n    pass\n", encoding="utf-8")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "no checkout, so there are no tests to run" in done.stderr
    assert "passed" not in done.stdout


def test_pytest_gets_its_words(tmp_path):
    """`test` passes options on and returns pytest's own code: 5 when nothing was collected."""
    done = surgebreak("test", "tests/coupler/test_cli.py", "--collect-only", "-k", "no_such_test")
    assert done.returncode == 5


FAKE_RUN = """
import sys
import types
import coupler.commands.cli as cli
fake = types.ModuleType("coupler.run.run")
def run(case, directory, tell, checkpoint=None, each=None):
    for k in range(1, 11):
        tell.step(case.time.end * k / 10, {{"dt": "1 ms"}})
    {then}
fake.run = run
sys.modules["coupler.run.run"] = fake
sys.argv = ["surgebreak", "run", {case!r}]
cli.main()
"""


@pytest.mark.parametrize(
    ("then", "code", "says"),
    [
        ("return 0", 0, "results in "),
        ("from coupler.step.limits import Diverged; raise Diverged('too much')", 3, "surgebreak: too much"),
        (
            "from coupler.step.limits import LimitReached; raise LimitReached('enough')",
            4,
            "surgebreak: enough",
        ),
        ("raise OSError(28, 'No space left on device')", 4, "no room for the results"),
        ("raise KeyError('x')", 1, "surgebreak: unexpected KeyError: 'x'"),
    ],
)
def test_exit_codes_of_runs(tmp_path, then, code, says):
    """Whatever the loop does, the shell sees the right code, the user a message, and the results stay."""
    write(tmp_path, WATER)
    done = subprocess.run(
        [sys.executable, "-c", FAKE_RUN.format(then=then, case=str(tmp_path))],
        capture_output=True, text=True, check=False, cwd=ROOT,
    )  # fmt: skip
    assert done.returncode == code, done.stderr
    assert says in done.stdout + done.stderr
    assert "on:  water" in done.stdout
    assert "inflow, structure, coupling" in done.stdout.partition("off: ")[2]
    (run,) = (tmp_path / "runs").iterdir()
    assert f"results {'' if code == 0 else 'so far '}in {run}" in done.stdout + done.stderr
    assert f'"exit_code": {code}' in (run / "run.json").read_text(encoding="utf-8")


def test_a_case_with_blocks_tells_its_modules(tmp_path):
    write(tmp_path, WATER + BLOCKS)
    done = subprocess.run(
        [sys.executable, "-c", FAKE_RUN.format(then="return 0", case=str(tmp_path))],
        capture_output=True, text=True, check=False, cwd=ROOT,
    )  # fmt: skip
    assert "on:  water, structure, coupling, contact" in done.stdout


def test_the_first_case_is_commented():
    assert text_of("tank").count("#") > 5


@pytest.mark.parametrize("words", [("explain",), ("verify", "--list"), ("check", "cases/joint_pulled")])
@pytest.mark.parametrize("held_back", [True, False])
def test_a_reader_who_has_enough_ends_a_command_quietly(words, held_back):
    """`| head` closes the pipe while the command still writes, or before what was held back is written at its end: no
    traceback, no word."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    environment |= {} if held_back else {"PYTHONUNBUFFERED": "1"}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen([COMMAND, *words], cwd=ROOT, env=environment, **pipes) as command:
        command.stdout.close()
        assert command.stderr.read() == ""
    assert command.returncode != 0


def test_a_run_that_nobody_reads_says_so_in_its_files(tmp_path):
    """It is stopped like any command in a broken pipe; its log holds the reason, not a traceback."""
    words = [COMMAND, "run", "cases/joint_pulled", "--output", tmp_path / "run"]
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as run:
        run.stdout.close()
        reported = run.stderr.read()
    log = (tmp_path / "run" / "log.txt").read_text(encoding="utf-8")
    assert "nobody reads the output any more" in log
    assert "Traceback" not in log + reported
    assert json.loads((tmp_path / "run" / "run.json").read_text(encoding="utf-8"))["exit_code"] == 4
