"""The cohesive law against its closed forms: traction, work, history, mixed mode, fast opening."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.yade_scripts.reference import columns
from yade_scripts.cohesion import (
    JointParameterError,
    JointParameters,
    dissipated,
    secant_stiffness,
    step_stiffness,
    traction,
    work_of_opening,
)

LAW = JointParameters(strength=2e6, opening_at_failure=1e-3)
ratios = st.floats(1e-6, 2.0)


def test_traction_and_work_follow_equation_4():
    ref = columns("coh_mode1_law")
    delta = ref["r"] * LAW.opening_at_failure
    T = traction(delta, LAW.strength, LAW.opening_at_failure)
    np.testing.assert_allclose(T / LAW.strength, ref["T_over_Tmax"], rtol=0, atol=1e-8)
    W = work_of_opening(delta, LAW.stiffness, LAW.opening_at_failure)
    scale = LAW.strength * LAW.opening_at_failure
    np.testing.assert_allclose(W / scale, ref["work_over_Tmax_df"], rtol=0, atol=1e-8)


def test_secant_form_is_the_same_law_and_mixed_mode_uses_the_effective_opening():
    """k_s(λ) (u, v) with λ = sqrt(u² + v²) is T(λ) along (u, v)/λ."""
    ref = columns("coh_mixed_mode")
    ks = secant_stiffness(np.hypot(ref["u"], ref["v"]), 6.75, 1.0)
    np.testing.assert_allclose(ks * ref["u"], ref["eff_Tn"], rtol=0, atol=1e-6)
    np.testing.assert_allclose(ks * ref["v"], ref["eff_Tt"], rtol=0, atol=1e-6)


@given(ratios)
def test_dissipation_is_work_minus_what_unloading_gives_back(r):
    lam = r * LAW.opening_at_failure
    back = 0.5 * secant_stiffness(lam, LAW.stiffness, LAW.opening_at_failure) * lam**2
    expected = work_of_opening(lam, LAW.stiffness, LAW.opening_at_failure) - back
    found = dissipated(lam, LAW.stiffness, LAW.opening_at_failure)
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-12 * LAW.work_of_separation)
    assert 0.0 <= found <= LAW.work_of_separation * (1 + 1e-12)


@given(st.floats(0.0, 0.99), st.floats(1.0, 1e4))
def test_a_joint_torn_in_one_substep_still_takes_its_whole_energy(before, after):
    """Mean traction over the jump times the jump = G_c - W(before): the averaged stiffness, force at the end place."""
    df = LAW.opening_at_failure
    if (after - before) < 0.25:
        return
    ks = step_stiffness(before * df, after * df, LAW.stiffness, df)
    work = ks * after * df * (after - before) * df
    left = LAW.work_of_separation - work_of_opening(before * df, LAW.stiffness, df)
    assert work == pytest.approx(left, rel=1e-9, abs=1e-12 * LAW.work_of_separation)


def test_slow_opening_is_not_averaged():
    ks = step_stiffness(0.3e-3, 0.3e-3 + 1e-9, LAW.stiffness, LAW.opening_at_failure)
    assert ks == pytest.approx(secant_stiffness(0.3e-3, LAW.stiffness, 1e-3), rel=1e-5)


@pytest.mark.parametrize(
    "wrong",
    [
        {"strength": -1.0},
        {"opening_at_failure": 0.0},
        {"damping": 1.0},
        {"points": 0},
        {"closing_ratio": 0.0},
    ],
)
def test_impossible_parameters_are_refused_by_name(wrong):
    (name,) = wrong
    with pytest.raises(JointParameterError, match=name):
        JointParameters(**({"strength": 1e6, "opening_at_failure": 1e-3} | wrong))
