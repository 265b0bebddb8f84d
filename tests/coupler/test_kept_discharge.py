"""An inflow that keeps its discharge: the water in the tank sets its level."""

import numpy as np
import pytest

from coupler.checks.read_case import load
from coupler.run.clock import Clock
from coupler.scene.build import build
from fluid.readings.gauges import levels

STREAM = """
[case]
title = "a stream into a sea that absorbs"
[time]
end = "8 s"
step_max = "0.03 s"
[tank]
lower = [0, 0, 0]
upper = [2, 0.2, 0.8]
cell = "0.1 m"
[water]
[[water.fill]]
lower = [0, 0, 0]
upper = [2, 0.2, 0.4]
[[water.inflow]]
kind = "steady"
side = "x-"
level = 0.4
velocity = "0.2 m/s"
keeps = "KEEPS"
[[water.sea]]
side = "x+"
level = 0.4
absorbs = true
"""


def run(tmp_path, keeps):
    (tmp_path / "case.toml").write_text(STREAM.replace("KEEPS", keeps))
    coupling = build(load(tmp_path).case, Clock()).coupling
    while coupling.time < 8.0:
        record = coupling.step(min(coupling.water.stable_step(), 0.03))
    return coupling.water, record


def test_a_stream_takes_the_level_of_the_water_that_it_backs_up(tmp_path):
    """The sea lets out what a wave into still water would carry, at 0.4378 m (sqrt(g h) = sqrt(0.4 g) + u/2). An inflow
    that keeps its level has a step of 38 mm before it, and the water gains energy there, 0.4 % a second of what it
    holds above the sea."""
    water, record = run(tmp_path, "discharge")
    beside = levels(water, np.array([[0.1, 0.1], [0.3, 0.1]]))
    np.testing.assert_allclose(beside, 0.4378, atol=0.003)
    assert water.sides.entered == pytest.approx(0.08 * 0.2 * record.time, rel=1e-3)
    _, stands = run(tmp_path, "level")
    gained, before = (-r.balance.numerical_dissipation for r in (record, stands))
    assert gained < 0.3 * before
