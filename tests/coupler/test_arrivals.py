"""Waves that come after the end of the run, or do not reach the structure before it."""

import numpy as np
import pytest

from coupler.case.case import Case
from coupler.checks.arrivals import arrival_remarks
from coupler.checks.read_case import load

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


SHORE = """\
[case]
title = "a bore runs up a shore"
[time]
end = {end}
[tank]
lower = [0, 0, -4]
upper = [100, 10, 6]
cell = 1
open = {open}
[terrain]
path = "shore.csv"
[[water.fill]]
lower = [0, 0, -4]
upper = [100, 10, 0]
[[water.inflow]]
kind = "bore"
side = "{side}"
ahead = 0
level = 1
absorbs = {absorbs}
"""
POST = """
[structure]
[[structure.block]]
name = "box"
centre = [{place}, 5, 5]
size = [1, {width}, 2]
[contact]
stiffness = 1e8
"""


def on_shore(folder, end, more="", side="x-", absorbs="false", height=2.0):
    """A sea 4 m deep for 50 m, from there a slope of one in five up to `height` [m], 80 m from the side and on; seen
    from x+ it is mirrored."""
    heights = [(0, -4.0), (50, -4.0), (50 + 5 * (height + 4), height), (100, height)]
    places = [(100 - x if side == "x+" else x, z) for x in range(101) for z in [np.interp(x, *zip(*heights))]]
    (folder / "shore.csv").write_text(
        "x,y,z\n" + "".join(f"{x},{y},{z}\n" for x, z in places for y in (0, 5, 10))
    )
    open = f'["z+", "{"x-" if side == "x+" else "x+"}"]'
    text = SHORE.format(end=end, side=side, absorbs=absorbs, open=open) + more
    (folder / "case.toml").write_text(text)
    return load(folder / "case.toml").case


@pytest.mark.parametrize("side", ["x-", "x+"])
def test_a_bore_that_rising_ground_sends_back_is_remarked_on(tmp_path, side):
    """5 m over 4 m run at sqrt(g 5 9/8) = 7.43 m/s to the ground above their level, 75 m away, in 10.1 s; behind them
    1.49 m/s, which a wall makes 6.11 m deep, so that they come back at 1.49 5/1.11 = 6.7 m/s in 11.2 s."""
    (said,) = arrival_remarks(on_shore(tmp_path, 23.0, side=side))
    assert (
        f"what the rising ground sends back of the bore from {side} may be at {side} again from t = 21.3 s"
        in said
    )
    assert not list(arrival_remarks(on_shore(tmp_path, 21.0, side=side)))
    assert not list(arrival_remarks(on_shore(tmp_path, 23.0, side=side, absorbs="true")))


def test_land_that_a_bore_floods_sends_nothing_back(tmp_path):
    assert not list(arrival_remarks(on_shore(tmp_path, 40.0, height=0.5)))


def test_a_bore_over_terrain_that_comes_too_late_or_back_from_a_wide_structure_is_remarked_on(tmp_path):
    """29.5 m to the structure take 3.97 s, and 4.42 s back."""
    wide = POST.format(place=30, width=8)
    (said,) = arrival_remarks(on_shore(tmp_path, 3.0, wide))
    assert "before the bore from x- can reach 'box', at t = 3.97 s or later" in said
    (said,) = arrival_remarks(on_shore(tmp_path, 9.0, wide))
    assert "what 'box' sends back of the bore from x- may be at x- again from t = 8.39 s" in said
    assert not list(arrival_remarks(on_shore(tmp_path, 9.0, POST.format(place=30, width=1))))
