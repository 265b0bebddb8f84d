"""Joints between chosen pairs, each by its law, and random strengths."""

import numpy as np
import pytest

from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameterError, JointParameters
from yade_scripts.joints.rules import JointRules, PairJoints, Scatter

GLUE = JointParameters(1e6, 1e-3, damping=0.0)
BRITTLE = JointParameters(2e5, 5e-4, law="bilinear", damping=0.0)
STILL = (0.0, 0.0, 0.0)


def tower():
    """Three cubes on the ground; the upper two are of a group."""
    return [
        Block("low", (0, 0, 0.5), size=1.0),
        Block("middle", (0, 0, 1.5), size=1.0, group="upper", material="brick"),
        Block("top", (0, 0, 2.5), size=1.0, group="upper", driven=True, velocity=(0, 0, 0.01)),
    ]


def joined(rules):
    with Structure(tower(), ContactLaw(1e9), rules, ground=0.0, gravity=STILL) as s:
        return {(a, b): float(df) for a, b, df in zip(s.joints.a.tolist(), s.joints.b.tolist(), s.joints.df)}


def test_the_last_pair_that_fits_decides():
    rules = JointRules(GLUE, (PairJoints("upper", "upper", BRITTLE), PairJoints("ground", "low", None)))
    assert joined(rules) == {(0, 1): 1e-3, (1, 2): 5e-4}
    rules = JointRules(GLUE, (PairJoints("brick", "low", BRITTLE), PairJoints("middle", "low", GLUE)))
    assert joined(rules) == {(0, 1): 1e-3, (1, 2): 1e-3, (0, -1): 1e-3}


def test_a_pair_with_the_ground_counts_where_joints_ground_is_off():
    off = JointParameters(1e6, 1e-3, ground=False, damping=0.0)
    assert (0, -1) not in joined(JointRules(off))
    assert joined(JointRules(off, (PairJoints("low", "ground", BRITTLE),)))[0, -1] == 5e-4


def test_each_joint_takes_the_work_of_its_own_law():
    """Pulled up slowly, the weaker joint of another law breaks and takes its own G_c; damage and tangent go by the
    law of the joint."""
    rules = JointRules(GLUE, (PairJoints("top", "middle", BRITTLE),))
    with Structure(tower(), ContactLaw(1e9), rules, ground=0.0, gravity=STILL) as s:
        K = s.tangent()[0].toarray()
        s.advance(0.1)
        table = s.joint_table()
        broken = ~table.alive
        assert [(int(a), int(b)) for a, b in zip(table.a[broken], table.b[broken])] == [(1, 2)]
        assert table.dissipated[broken][0] == pytest.approx(BRITTLE.work_of_separation, rel=1e-9)
        assert s.law_dissipation() == pytest.approx(s.energies()["joint_dissipated"], rel=0.02)
    assert K[14, 14] == pytest.approx(
        BRITTLE.stiffness, rel=1e-6
    )  # the driven cube in z: nothing but this joint


@pytest.mark.parametrize("distribution", ["weibull", "lognormal"])
@pytest.mark.parametrize("variation", [0.1, 0.5])
def test_factors_have_the_mean_and_the_variation_asked_for(distribution, variation):
    f = Scatter(distribution, variation, 3).factors(40_000)
    assert f.min() > 0.0
    assert f.mean() == pytest.approx(1.0, abs=0.01)
    assert f.std() == pytest.approx(variation, rel=0.03)


def test_weibull_and_lognormal_have_their_own_tails():
    """Of the same mean and variation, a Weibull has its third moment below that of a log-normal."""
    drawn = [Scatter(name, 0.1, 1).factors(40_000) for name in ("weibull", "lognormal")]
    skew = [((f - 1.0) ** 3).mean() / f.std() ** 3 for f in drawn]
    assert skew[0] < -0.4
    assert skew[1] == pytest.approx(0.301, abs=0.1)  # 3 c + c^3


def test_the_same_seed_gives_the_same_strengths_and_another_seed_others():
    def strengths(seed):
        rules = JointRules(GLUE, (), Scatter("lognormal", 0.3, seed))
        with Structure(tower(), ContactLaw(), rules, ground=0.0, gravity=STILL) as s:
            return [law.strength for law in s.joints.laws], s.joints.k0 / s.joints.law[:, 0]

    (first, ratio), (again, _), (other, _) = strengths(1), strengths(1), strengths(2)
    assert first == again
    assert not set(first) & set(other)
    np.testing.assert_allclose(ratio, 27.0 / 4.0, rtol=1e-12)


def test_strengths_are_those_of_the_laws_times_the_factors():
    """Each joint of its own law: the strength scatters and the opening at failure stays, so that stiffness and work of
    separation scale with the strength."""
    scatter = Scatter("weibull", 0.4, 5)
    laws = JointRules(GLUE, (), scatter).scattered([GLUE, BRITTLE, GLUE])
    for law, of, f in zip(laws, (GLUE, BRITTLE, GLUE), scatter.factors(3)):
        assert law.strength == f * of.strength
        assert law.opening_at_failure == of.opening_at_failure
        assert law.work_of_separation == pytest.approx(f * of.work_of_separation)


@pytest.mark.parametrize(("distribution", "variation"), [("weibull", 0.0), ("weibull", 2.0), ("normal", 0.1)])
def test_impossible_scatter_is_refused(distribution, variation):
    with pytest.raises(JointParameterError, match=r"joints\."):
        Scatter(distribution, variation)
