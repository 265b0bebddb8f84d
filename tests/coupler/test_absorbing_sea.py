"""A solitary wave runs out of an absorbing sea: what comes back is measured at a gauge on its way."""

import numpy as np
import pytest

from coupler.checks.read_case import load
from coupler.run.clock import Clock
from coupler.scene.build import build
from fluid.readings.gauges import levels

CASE = """
[case]
title = "solitary wave out of the tank"
[time]
end = "19 s"
step_max = "0.1 s"
[tank]
lower = [0, 0, 0]
upper = [24, 0.5, 1.5]
cell = "0.25 m"
[water]
[[water.fill]]
lower = [0, 0, 0]
upper = [24, 0.5, 1]
[[water.inflow]]
kind = "solitary"
side = "x-"
level = 1
height = 0.1
crest = "4 s"
absorbs = true
[[water.sea]]
side = "x+"
level = 1
absorbs = true
"""


@pytest.mark.nightly
def test_at_most_a_twentieth_of_a_solitary_wave_comes_back(tmp_path):
    """Measured 12 m before the side, where the wave and what it leaves behind have passed when that arrives."""
    (tmp_path / "case.toml").write_text(CASE)
    scene = build(load(tmp_path).case, Clock())
    c, found = scene.coupling, []
    while c.time < 19.0:
        c.step(min(c.water.stable_step(), 0.1))
        found.append((c.time, levels(c.water, [(12.0, 0.25)])[0] - 1.0))
    time, level = np.array(found).T
    crest = level[time < 11.0].max()
    assert crest > 0.09
    assert np.abs(level[time > 12.5]).max() < 0.05 * crest
