"""A small building under a small wave: weak joints break and their blocks are carried off, strong ones hold.

The wave is the same, so the difference is the joints' alone; the ledger and the volume hold while it breaks.
"""

import numpy as np
import pytest

from coupler.case.case import Case
from coupler.scene.build import build
from tests.fakes import no_clock

SCENE = {
    "case": {"title": "a hut and a wave"},
    "time": {"end": 1.4, "step_max": 0.02},
    "tank": {"lower": [0, 0, 0], "upper": [20, 8, 7], "cell": 1.0},
    "water": {"covers": "multiple", "fill": [{"lower": [0, 0, 0], "upper": [7, 8, 5]}]},
    "structure": {
        "density": 1500.0,
        "ground": {"level": 0.0},
        "building": [
            {
                "name": "hut",
                "lower": [10, 2, 0],
                "size": [5, 4, 4],
                "wall_thickness": 0.5,
                "block": [1.5, 1.5],
                "roof": False,
                "opening": [{"wall": "x-", "lower": [1.5, 0], "size": [1.0, 1.5]}],
            }
        ],
    },
    "contact": {"restitution": 0.2, "friction": 0.5},
}


def run(strength):
    """The coupling after the wave has struck, and the largest errors of its ledger on the way."""
    joints = {"strength": strength, "opening_at_failure": 0.005}
    scene = build(Case.model_validate(SCENE | {"joints": joints}), no_clock)
    coupling, energy, volume = scene.coupling, 0.0, 0.0
    while coupling.time < SCENE["time"]["end"] - 1e-9:
        record = coupling.step(coupling.step_size(SCENE["time"]["end"] - coupling.time))
        energy = max(energy, record.balance.energy_error)
        volume = max(volume, abs(coupling.water.volume_error()))
    return coupling, energy, volume


def lowest_point(structure) -> float:
    """Height of the lowest corner of any block [m]."""
    places = zip(structure.shape_vertices, structure.rotation(), structure.centre())
    return min(float((v @ R.T + c)[:, 2].min()) for v, R, c in places)


@pytest.mark.parametrize(("strength", "breaks"), [(1e4, True), (6e5, False)])
def test_the_same_wave_breaks_weak_joints_and_not_strong_ones(strength, breaks):
    coupling, energy, volume = run(strength)
    structure = coupling.structure
    try:
        broken = int((~structure.joint_table().alive).sum())
        start = np.array([b.centre for b in structure.blocks])
        carried = (structure.centre() - start)[:, 0].max()
        assert (broken >= 10) == breaks
        assert broken == 0 or breaks
        assert (carried > 0.2) == breaks
        assert carried > -1e-9
        assert energy < 0.05
        assert volume < 0.01
        assert lowest_point(structure) > -0.02, "no block sinks into the ground"
    finally:
        structure.close()
