"""A level gauge in a domain that changes."""

from types import SimpleNamespace

import pytest

from coupler.case.gauges import LevelGauge
from coupler.results.gauges import make_gauge
from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from tests.fluid.scenes import tank


def placed(x):
    return ConvexBodies.boxes([[x, 0.5, 0.1]], [[0.3, 0.3, 0.2]])


def test_its_line_is_sought_again_where_a_block_has_come():
    """What is known of the line stays only as long as the domain does."""
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.437, placed(0.2))
    gauge = make_gauge(LevelGauge(kind="level", name="here", at=(0.8, 0.5)), {})
    here = SimpleNamespace(water=water), SimpleNamespace(time=0.0, dt=0.1)
    assert gauge.read(*here)["here_level"] == pytest.approx(0.437, abs=1e-9)
    water.move_solids(cut_domain(water.mesh, placed(0.8), "single", previous=water.domain))
    assert gauge.read(*here)["here_level"] == pytest.approx(0.437 - 0.2, abs=1e-9)
