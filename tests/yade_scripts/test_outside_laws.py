"""Laws of users: taken from files, scripts and packages, examined, and named by cases, which never run code."""

import os
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

import surgebreak
from coupler.checks.read_case import load
from coupler.checks.remarks import remarks
from coupler.program.provenance import ROOT
from yade_scripts.joints import laws, outside_laws
from yade_scripts.joints.cohesion import CohesiveLaw, JointParameters
from yade_scripts.joints.forces import kernels_of

TRIANGLE = """
from numba import njit

from surgebreak import CohesiveLaw

LOWEST = {lowest}


@njit
def secant(r, peak):
    return 1.0 / peak if r <= peak else (1.0 - r) / ((1.0 - peak) * r)


@njit
def work(r, peak):
    return {scale} * (0.5 * r * r / peak if r <= peak else 0.5 - 0.5 * (1.0 - r) ** 2 / (1.0 - peak))


LAW = CohesiveLaw(secant, work, peak=0.2, lowest_peak=LOWEST, highest_peak=0.5)
"""


@pytest.fixture
def forgotten(monkeypatch):
    """Laws that a test gives are gone after it."""
    for name in ("_registered", "_origins", "_files"):
        monkeypatch.setattr(outside_laws, name, {})
    monkeypatch.setenv(outside_laws.VARIABLE, "")


def write(folder, name="triangle", lowest=0.01, scale=1.0):
    path = folder / f"{name}.py"
    path.write_text(TRIANGLE.format(lowest=lowest, scale=scale), encoding="utf-8")
    return path


def triangle(peak=0.2, secant=None, work=None):
    """The bilinear law as plain functions, or with one of them another."""

    def usual_secant(r, peak):
        return 1.0 / peak if r <= peak else (1.0 - r) / ((1.0 - peak) * r)

    def usual_work(r, peak):
        return 0.5 * r * r / peak if r <= peak else 0.5 - 0.5 * (1.0 - r) ** 2 / (1.0 - peak)

    return CohesiveLaw(secant or usual_secant, work or usual_work, peak, 0.01, 0.5)


def test_a_law_of_a_file_is_one_like_those_that_come_along(forgotten, tmp_path):
    assert surgebreak.register_law(write(tmp_path)) == "triangle"
    assert "triangle" in laws.names()
    assert "triangle" not in laws.shipped()
    own, ours = (
        JointParameters(2e6, 1e-3, law=name, peak=0.2, damping=0.0) for name in ("triangle", "bilinear")
    )
    assert own.work_of_separation == ours.work_of_separation == pytest.approx(1e3)
    assert own.stiffness == ours.stiffness
    assert kernels_of("triangle", "effective") is not kernels_of("bilinear", "effective")


def test_plain_functions_of_a_script_are_compiled(forgotten):
    surgebreak.register_law(triangle(), "mine")
    assert JointParameters(2e6, 1e-3, law="mine", damping=0.0).work_of_separation == pytest.approx(1e3)
    first = kernels_of("mine", "effective")
    surgebreak.register_law(triangle(peak=0.3), "mine")
    assert kernels_of("mine", "effective") is not first, "a law that was given anew ran with the old kernels"


@pytest.mark.parametrize(
    ("law", "reported"),
    [
        (triangle(secant=lambda r, peak: 1.0), "s r is 1 at most and 0.01 at the peak"),
        (triangle(secant=lambda r, peak: r), "secant rises at r = 0"),
        (triangle(secant=lambda r, peak: 1.0 / r), "cannot be evaluated"),
        (triangle(work=lambda r, peak: 0.4 * r), "work is no integral of s r"),
        (triangle(peak=0.6), "lowest_peak <= peak <= highest_peak"),
    ],
)
def test_a_law_that_the_solver_cannot_rely_on_is_refused(forgotten, law, reported):
    """Time step and pressure solve rely on a secant that only falls, the balance of energy on the work."""
    with pytest.raises(outside_laws.BadLaw, match=reported):
        surgebreak.register_law(law, "wrong")
    assert "wrong" not in laws.names()


def test_no_law_takes_the_name_of_one_that_comes_along(forgotten, tmp_path):
    with pytest.raises(outside_laws.BadLaw, match="comes with surgebreak"):
        surgebreak.register_law(write(tmp_path, "bilinear"))
    with pytest.raises(outside_laws.BadLaw, match="no Python file"):
        surgebreak.register_law(tmp_path / "nowhere.py")
    (tmp_path / "empty.py").write_text("", encoding="utf-8")
    with pytest.raises(outside_laws.BadLaw, match="offers no LAW"):
        surgebreak.register_law(tmp_path / "empty.py")
    (tmp_path / "torn.py").write_text("1 / 0", encoding="utf-8")
    with pytest.raises(outside_laws.BadLaw, match="ZeroDivisionError"):
        surgebreak.register_law(tmp_path / "torn.py")


def test_a_package_offers_laws_by_an_entry_point(forgotten, tmp_path, monkeypatch):
    """Its name is known before it is loaded, and loading happens only when a case wants it."""
    monkeypatch.syspath_prepend(tmp_path)
    write(tmp_path, "package_of_laws")
    point = EntryPoint("packaged", "package_of_laws:LAW", outside_laws.GROUP)
    monkeypatch.setattr(
        outside_laws, "entry_points", lambda group: [point] if group == outside_laws.GROUP else []
    )
    assert "packaged" in laws.names()
    assert "package_of_laws" not in sys.modules
    assert laws.find("packaged").peak == 0.2
    assert "package_of_laws" in outside_laws.origin("packaged")


def test_a_changed_file_has_another_checksum(forgotten, tmp_path):
    """Also where only what it calls changed: kernels and checkpoints of the old law are not taken for the new one's."""
    surgebreak.register_law(write(tmp_path))
    before = laws.identity("triangle")
    assert before["from"] == str(tmp_path / "triangle.py")
    outside_laws._files.clear()
    surgebreak.register_law(write(tmp_path, lowest=0.02))
    assert laws.identity("triangle")["checksum"] != before["checksum"]


CASE = """
[case]
title = "two blocks"
[time]
end = "8 ms"
step_max = "4 ms"
checkpoint_every = "1 ms"
[structure]
[[structure.block]]
name = "lower"
size = [1, 1, 1]
centre = [0, 0, 0.5]
[[structure.block]]
name = "upper"
size = [1, 1, 1]
centre = [0, 0, 1.5]
[contact]
[joints]
law = "triangle"
strength = "1 MPa"
opening_at_failure = "1 mm"
"""


def command(*words, **environment):
    return subprocess.run(
        [sys.executable, "-m", "coupler.commands.cli", *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
        env={**os.environ, **environment},
    )


def test_the_command_takes_a_law_that_the_user_names_and_a_case_alone_runs_nothing(tmp_path):
    """A file that leaves a mark when it is run lies beside the case: only --law runs it. A run goes on with the law it
    began with, and not without it or with another."""
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    law, run, mark = write(tmp_path), tmp_path / "run", tmp_path / "mark"
    law.write_text(law.read_text(encoding="utf-8") + f"open({str(mark)!r}, 'w').close()\n", encoding="utf-8")

    refused = command("run", tmp_path, "--dry")
    assert refused.returncode == 2
    assert "triangle" in refused.stderr
    assert not mark.exists(), "a case file ran code"

    done = command("run", tmp_path, "--law", law, "--output", run)
    assert done.returncode == 0, done.stderr
    assert f"law 'triangle': {law}" in done.stdout
    assert surgebreak.open(run).summary["laws"]["triangle"]["from"] == str(law)

    on = ("resume", run, "--end", "12 ms")
    without = command(*on)
    assert without.returncode == 2
    assert "--law" in without.stderr
    text = law.read_text(encoding="utf-8")
    law.write_text(text.replace("peak=0.2", "peak=0.3"), encoding="utf-8")
    other = command(*on, "--law", law)
    assert other.returncode == 2
    assert "not what it was" in other.stderr
    law.write_text(text, encoding="utf-8")
    went_on = command(*on, "--law", law)
    assert went_on.returncode == 0, went_on.stderr
    inherited = command("check", tmp_path, **{outside_laws.VARIABLE: str(law)})
    assert inherited.returncode == 0, inherited.stderr


def test_this_folder_holds_no_law_of_a_test():
    assert laws.shipped() == ["bilinear", "exponential", "polynomial"]
    assert Path(laws.__file__).parent.name == "laws"


def test_a_law_that_would_push_an_opening_joint_is_refused():
    def secant(r, peak):
        return 1.0 / peak if r <= peak else (1.0 - r / 0.9) / ((1.0 - peak / 0.9) * r)

    with pytest.raises(outside_laws.BadLaw, match="secant is negative at r = 1"):
        outside_laws.examined(triangle(secant=secant), "here")


def test_a_law_that_does_not_fall_to_zero_is_noted(forgotten, tmp_path):
    """T stays at half of its strength from the middle on, whatever the peak."""
    text = write(tmp_path, "half").read_text()
    text = text.replace("(1.0 - r) / ((1.0 - peak) * r)", "(1.0 - 0.5 * (r - peak) / (1.0 - peak)) / r")
    text = text.replace(
        "0.5 - 0.5 * (1.0 - r) ** 2 / (1.0 - peak)",
        "0.5 * peak + (r - peak) - 0.25 * (r - peak) ** 2 / (1.0 - peak)",
    )
    (tmp_path / "half.py").write_text(text)
    surgebreak.register_law(tmp_path / "half.py")
    (tmp_path / "case.toml").write_text(STANDING.replace('law = "bilinear"', 'law = "half"'))
    (line,) = remarks(load(tmp_path).case)
    assert line.startswith("law 'half' does not fall to zero: at opening_at_failure it still carries 50%")
    (tmp_path / "case.toml").write_text(STANDING)
    assert remarks(load(tmp_path).case) == []


TWO_BLOCKS = """
[case]
title = "two blocks"
[time]
end = "1 ms"
[structure]
block = [
    { name = "a", size = [1, 1, 1], centre = [0, 0, 0.5] },
    { name = "b", size = [1, 1, 1], centre = [0, 0, 1.5] },
]
[contact]
[joints]
strength = "1 MPa"
opening_at_failure = "1 mm"
law = "bilinear"
"""
STANDING = TWO_BLOCKS.replace("[structure]\n", "[structure]\nground = { level = 0 }\n")
