"""Waves that come after the end of the run, or do not reach the structure before it."""

import pytest

from coupler.case.case import Case
from coupler.checks.arrivals import arrival_remarks

BOX = {
    "structure": {"block": [{"name": "box", "centre": [18, 1, 1], "size": [1, 1, 2]}]},
    "contact": {"stiffness": 1e8},
}


def made(end, inflow, still=1.5, sections=BOX):
    """A tank of 20 m whose water is `still` deep [m], with a box 17.5 m from x-, until this time [s]."""
    table = {
        "case": {"title": "a wave"},
        "time": {"end": end},
        "tank": {"lower": [0, 0, 0], "upper": [20, 2, 4], "cell": 0.25},
        "water": {
            "fill": [{"lower": [0, 0, 0], "upper": [20, 2, still]}],
            "inflow": [{"side": "x-", **inflow}],
        },
    }
    return Case.model_validate(table | sections)


@pytest.mark.parametrize(
    ("wave", "name"),
    [
        ({"kind": "solitary", "crest": 3.0}, "crest of the solitary wave"),
        ({"kind": "n-wave", "middle": 3.0}, "middle of the N-wave"),
    ],
)
def test_a_wave_that_the_run_does_not_wait_for_is_remarked_on(wave, name):
    """17.5 m at sqrt(g 1.8 m) = 4.2 m/s are 4.16 s after the 3 s at which it passes the side."""
    wave |= {"level": 1.5, "height": 0.3}
    (said,) = arrival_remarks(made(2.0, wave))
    assert f"the {name} passes x- at t = 3 s, and the run ends at 2 s" in said
    (said,) = arrival_remarks(made(7.0, wave))
    assert f"before the {name} from x- can reach 'box', at t = 7.16 s or later" in said
    assert not list(arrival_remarks(made(7.5, wave)))
    assert not list(arrival_remarks(made(7.0, wave, sections={})))


def test_a_bore_that_comes_back_to_a_side_that_reflects_is_remarked_on():
    """1 m over 0.5 m enters at 1.92 m/s, stands 1.68 m deep at a wall and so goes back at 1.92/0.68 = 2.8 m/s: 17.5 m
    in 6.2 s after the 4.56 s of its way there. A post of a tenth of the width sends nothing back that matters."""
    bore = {"kind": "bore", "ahead": 0.5, "level": 1.0}
    assert not list(arrival_remarks(made(10.0, bore, still=0.5)))
    (said,) = arrival_remarks(made(11.0, bore, still=0.5))
    assert "sends back of the bore from x- may be at x- again from t = 10.8 s on" in said
    assert "absorbs = true" in said
    assert not list(arrival_remarks(made(11.0, bore | {"absorbs": True}, still=0.5)))
    post = {"structure": {"block": [{"name": "post", "centre": [18, 1, 1], "size": [1, 0.2, 2]}]}}
    assert not list(arrival_remarks(made(11.0, bore, still=0.5, sections=BOX | post)))


def test_a_bore_that_the_run_does_not_wait_for_is_remarked_on():
    """Of 1 m over 0.5 m: its front runs at sqrt(g h₂ (h₁ + h₂)/(2 h₁)) = 3.84 m/s."""
    bore = {"kind": "bore", "ahead": 0.5, "level": 1.0}
    (said,) = arrival_remarks(made(4.0, bore, still=0.5))
    assert "before the bore from x- can reach 'box', at t = 4.56 s or later" in said
    assert not list(arrival_remarks(made(5.0, bore, still=0.5)))
