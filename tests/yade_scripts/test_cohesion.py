"""Parameters of the joints: what is refused."""

import pytest

from yade_scripts.joints.cohesion import JointParameterError, JointParameters


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


def test_the_description_tells_what_the_strength_depends_on():
    reported = JointParameters(
        1e6, 1e-3, closing_ratio=10.0, law="bilinear", peak=0.2, damping=0.0
    ).described()
    assert reported == (
        "bilinear law with its peak at 0.2 δ_f, mixed mode effective, kc/K0 10, 8 points an edge, G_c 500 J/m²"
    )
