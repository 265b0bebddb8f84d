"""Cohesive laws: what every one must hold, closed forms of the shipped ones, and a law of one's own."""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from coupler.commands.verify.figures import columns
from yade_scripts.joints import laws
from yade_scripts.joints.cohesion import JointParameterError, JointParameters

PEAKS = [
    ("polynomial", None),
    ("bilinear", None),
    ("bilinear", 0.02),
    ("bilinear", 0.6),
    ("exponential", None),
    ("exponential", 0.2),
]
ALL = pytest.mark.parametrize(("name", "peak"), PEAKS)
STRENGTH, FAILURE = 2e6, 1e-3


def parameters(name, peak=None, strength=STRENGTH, failure=FAILURE):
    return JointParameters(strength, failure, law=name, peak=peak, damping=0.0)


def test_polynomial_law_follows_equation_4():
    ref, law = columns("coh_mode1_law"), parameters("polynomial")
    delta = ref["r"] * FAILURE
    np.testing.assert_allclose(law.traction(delta) / STRENGTH, ref["T_over_Tmax"], rtol=0, atol=1e-8)
    W = law.work_of_opening(delta) / (STRENGTH * FAILURE)
    np.testing.assert_allclose(W, ref["work_over_Tmax_df"], rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    ("name", "peak", "energy", "stiffness"),
    [
        ("polynomial", None, 9 / 16, 27 / 4),
        ("bilinear", 0.1, 0.5, 10.0),
        ("bilinear", 0.5, 0.5, 2.0),
        ("exponential", 0.1, np.e * 0.1 * (1 - 11 * np.exp(-10)), 10 * np.e),
    ],
)
def test_energy_and_first_stiffness_are_those_of_the_closed_forms(name, peak, energy, stiffness):
    law = parameters(name, peak)
    assert law.work_of_separation == pytest.approx(energy * STRENGTH * FAILURE, rel=1e-12)
    assert law.stiffness == pytest.approx(stiffness * STRENGTH / FAILURE, rel=1e-12)


@ALL
@pytest.mark.parametrize(("strength", "failure"), [(1e3, 0.1), (1e8, 1e-8), (2e6, 1e-3)])
def test_the_peak_is_the_strength_at_the_stated_opening(name, peak, strength, failure):
    law = parameters(name, peak, strength, failure)
    r = np.linspace(0.0, 1.0, 2001)
    T = law.traction(r * failure)
    assert T.max() <= strength * (1 + 1e-12)
    assert law.traction(law.peak_share * failure) == pytest.approx(strength, rel=1e-12)
    assert (law.traction(np.array([1.0, 1.5, 1e9]) * failure) == 0.0).all()


@ALL
@given(st.floats(1e-3, 0.999))
def test_work_is_the_area_under_the_traction(name, peak, r):
    law = parameters(name, peak)
    breaks = [law.peak_share] if law.peak_share < r else None
    area = quad(lambda q: float(law.traction(q * FAILURE)) / STRENGTH, 0.0, r, points=breaks, epsabs=1e-12)[0]
    assert law.work_of_opening(r * FAILURE) / (STRENGTH * FAILURE) == pytest.approx(area, rel=1e-9, abs=1e-11)


@ALL
def test_damage_only_softens_and_only_dissipates(name, peak):
    """k_s never rises: time step and pressure solve rely on the first stiffness. D never falls, ends at G_c."""
    law = parameters(name, peak)
    lam = np.linspace(0.0, 1.2, 5001) * FAILURE
    ks, lost = law.secant_stiffness(lam), law.dissipated(lam)
    assert ks[0] == law.stiffness
    assert (np.diff(ks) <= 1e-12 * law.stiffness).all()
    assert (np.diff(lost) >= -1e-12 * law.work_of_separation).all()
    assert lost[-1] == pytest.approx(law.work_of_separation, rel=1e-12)


def test_a_bilinear_joint_loses_nothing_before_its_peak():
    law = parameters("bilinear", 0.3)
    assert np.abs(law.dissipated(np.linspace(0.0, 0.3, 50) * FAILURE)).max() < 1e-12 * law.work_of_separation


def test_the_cut_of_the_exponential_tail_is_small_and_counted():
    """What the last spring holds at δ_f is lost at the cut: 0.25 % of G_c at p = 0.1, and it is part of G_c."""
    law = parameters("exponential")
    last = law.secant_stiffness(FAILURE * (1 - 1e-12)) * FAILURE
    assert last / STRENGTH == pytest.approx(10 * np.exp(-9.0), rel=1e-6)
    jump = law.dissipated(FAILURE) - law.dissipated(FAILURE * (1 - 1e-12))
    assert jump == pytest.approx(0.5 * last * FAILURE, rel=1e-6)
    assert jump < 0.0025 * law.work_of_separation


def test_an_unknown_law_is_refused_with_the_nearest_one():
    with pytest.raises(
        laws.UnknownLaw, match=r"'bilineer'.*did you mean 'bilinear'.*exponential, polynomial"
    ):
        parameters("bilineer").stiffness  # noqa: B018


@pytest.mark.parametrize(
    ("wrong", "reported"),
    [
        ({"law": "polynomial", "peak": 0.2}, "joints.peak = 0.2.*0.3333 δ_f, leave it out"),
        ({"law": "exponential", "peak": 0.5}, "joints.peak = 0.5.*0.01 to 0.2 δ_f"),
        ({"law": "bilinear", "mixed_mode": "needleman"}, "needleman.*'bilinear'.*polynomial"),
        ({"points": 40}, "joints.points = 40.*'auto' or lie in 1..12"),
    ],
)
def test_what_a_law_cannot_do_is_refused_by_name(wrong, reported):
    with pytest.raises(JointParameterError, match=reported):
        JointParameters(1e6, 1e-3, damping=0.0, **wrong)


def test_an_unknown_mixed_mode_is_refused_with_the_nearest_one():
    with pytest.raises(ValueError, match=r"'needelman'.*did you mean 'needleman'"):
        JointParameters(1e6, 1e-3, mixed_mode="needelman", damping=0.0)


# ---- a law of one's own, as docs/add_a_law.md has it -------------------------------------------------------------

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "add_a_law.md"


def law_of_the_page():
    """The file that the page shows."""
    found = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    (source,) = (text for text in found if "LAW = " in text)
    return source


TORN = """
import sys
import numpy as np
from yade_scripts.joints import laws
laws.__path__.append(sys.argv[1])
from yade_scripts.blocks.block import Block
from yade_scripts.joints.cohesion import JointParameters
from yade_scripts.blocks.faces import touching_faces
from yade_scripts.joints.joints import Joints
blocks = [Block("held", (0, 0, 0), size=1.0), Block("moved", (0, 0, 1), size=1.0)]
joints = Joints(blocks, touching_faces(blocks), JointParameters(1e6, 1e-3, law="trapezoidal", peak=0.05))
x, v, R, force = np.array([b.centre for b in blocks], float), np.zeros((2, 6)), np.array([np.eye(3)] * 2), []
for _ in range(2001):
    F = np.zeros((2, 6))
    joints.forces(x, v, R, F, advance=True)
    force.append(F[0, 2])
    x[1, 2] += 0.5e-6
print(max(force) / 1e6, sum(force) * 0.5e-6 / 1e3, len(joints.broken_now()))
stats = joints.families[0][0].joint_forces.stats
print(sum(stats.cache_misses.values()))
print(stats.cache_path)
"""


def test_the_law_of_the_page_runs_from_its_one_file_and_is_compiled_once(tmp_path):
    """Peak T_max, work G_c = (3/2 - 0.05)/2 T_max δ_f, joint broken. The second process compiles nothing anew; a
    changed file does not get the kernels of the old one."""
    source = law_of_the_page()
    source += f"# of the test run {os.getpid()} at {time.time_ns()}: its kernels are not yet on disk\n"

    def torn(text):
        (tmp_path / "trapezoidal.py").write_text(text, encoding="utf-8")
        command = [sys.executable, "-c", TORN, str(tmp_path)]
        ran = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=True)
        figures, compiled, kept = ran.stdout.splitlines()[-3:]
        return [*map(float, figures.split()), int(compiled)], Path(kept)

    kept = tmp_path
    try:
        for compiled in (1, 0):
            figures, kept = torn(source)
            assert figures == [pytest.approx(1.0, rel=1e-6), pytest.approx(0.725, rel=1e-3), 1.0, compiled]
        weaker = source.replace("min(1.0, 2.0 * (1.0 - r))", "min(0.5, 2.0 * (1.0 - r))")
        assert torn(weaker)[0][3] == 1
    finally:
        for file in kept.glob("*trapezoidal*"):
            file.unlink()


def test_the_law_of_the_page_holds_what_a_law_must(tmp_path, monkeypatch):
    source = law_of_the_page()
    (tmp_path / "trapezoidal.py").write_text(source, encoding="utf-8")
    monkeypatch.setattr(laws, "__path__", [*laws.__path__, str(tmp_path)])
    try:
        assert "trapezoidal" in laws.names()
        test_the_peak_is_the_strength_at_the_stated_opening("trapezoidal", 0.2, 2e6, 1e-3)
        test_damage_only_softens_and_only_dissipates("trapezoidal", 0.2)
        law = parameters("trapezoidal", 0.2)
        assert law.work_of_separation == pytest.approx(0.65 * STRENGTH * FAILURE, rel=1e-12)
        assert law.stiffness == pytest.approx(5.0 * STRENGTH / FAILURE, rel=1e-12)
    finally:
        sys.modules.pop("yade_scripts.joints.laws.trapezoidal", None)
