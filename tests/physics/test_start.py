"""A start that is refused leaves nothing behind."""

import pytest

from coupler.case.case import Case
from coupler.scene.build import build
from tests.fakes import no_clock
from yade_scripts.dynamics.equilibrium import CannotStand

CANTILEVER = {
    "case": {"title": "a beam out of a fixed block"},
    "time": {"end": 0.1},
    "structure": {
        "density": 2000.0,
        "block": [{"name": "root", "centre": [0, 0, 0], "size": [1, 1, 1], "fixed": True}],
        "wall": [{"name": "beam", "lower": [0.5, -0.5, -0.5], "size": [4, 1, 1], "block": [1, 1, 1]}],
    },
    "contact": {"restitution": 0.3, "friction": 0.5},
}


def test_a_refused_start_gives_the_scene_back_for_the_next():
    """YADE has one scene in a process: after a beam that cannot carry itself, a stronger one is built."""
    weak, strong = ({"strength": s, "opening_at_failure": 1e-3} for s in (1e4, 1e7))
    with pytest.raises(CannotStand, match="'root'"):
        build(Case.model_validate(CANTILEVER | {"joints": weak}), no_clock)
    build(Case.model_validate(CANTILEVER | {"joints": strong}), no_clock).coupling.structure.close()
