"""The plateau of Stoker's dam break beside the place of the gate."""

import numpy as np
import pytest
from scipy.optimize import brentq

from coupler.scene.build import build
from fluid.readings.gauges import levels
from tests.fakes import no_clock
from tests.physics.scenes import G, case

HIGH, LOW, GATE = 1.0, 0.3, 10.0


def plateau():
    """Depth [m] between the bore and the rarefaction by the shallow-water equations (Stoker 1957), 0.591 m."""

    def missing(depth):
        speed = 2.0 * (np.sqrt(G * HIGH) - np.sqrt(G * depth))
        bore = np.sqrt(G * depth * (depth + LOW) / (2.0 * LOW))
        return speed * depth - bore * (depth - LOW)

    return brentq(missing, LOW + 0.01, HIGH - 0.01)


def test_a_front_several_depths_long_leaves_no_dip_at_the_gate():
    """The front is half a cosine over 4 m. The shallow-water equations then hold at the gate, too. From a vertical face
    the level there is 0.52 m from 1.2 to 1.8 s, on cells of half the size as well: the sudden fall makes waves of one
    to two depths, of which those that run upstream as fast as the water flows (a length of 1.4 m) stay there."""
    cell, ramp = 0.1, np.arange(GATE - 2.0, GATE + 2.0, 0.1)
    heights = LOW + (HIGH - LOW) * 0.5 * (1.0 + np.cos(np.pi * (ramp + 0.05 - ramp[0]) / 4.0))
    steps = zip(ramp, ramp + 0.1, heights)
    boxes = [(0.0, ramp[0], HIGH), *steps, (ramp[-1] + 0.1, 18.0, LOW)]
    fill = [{"lower": [a, 0, 0], "upper": [b, cell, top]} for a, b, top in boxes]
    coupling = build(
        case(
            time={"end": 3.0},
            tank={"lower": [0, 0, 0], "upper": [18, cell, 1.2], "cell": cell, "smooth": ["y-", "y+"]},
            water={"fill": fill},
        ),
        no_clock,
    ).coupling
    found = []
    while coupling.time < 2.4:
        coupling.step(coupling.step_size(3.0))
        if coupling.time > 1.8:
            found.append(levels(coupling.water, np.array([[GATE, 0.5 * cell]]))[0])
    assert np.mean(found) == pytest.approx(plateau(), rel=0.02)
