"""Parameters of the joints: what is refused."""

import pytest

from yade_scripts.cohesion import JointParameterError, JointParameters


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
