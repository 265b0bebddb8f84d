"""The gauge of the motion of a block: centre, velocity, turn since the start, whatever way it stood then, and spin."""

import numpy as np
import pytest

from coupler.scene.build import build
from tests.fakes import no_clock
from tests.physics.scenes import case


def test_the_turn_of_a_block_that_stands_askew_is_counted_from_its_start():
    """A cube turned by 0.7 rad about x flies and spins about z without weight: centre v t, rotation vector ω t."""
    end, spin, velocity = 0.5, [0.0, 0.0, 1.2], [0.3, -0.2, 0.1]
    cube = {
        "name": "b",
        "size": [0.2, 0.2, 0.2],
        "centre": [0, 0, 1],
        "rotation": {"axis": [1, 0, 0], "angle": 0.7},
    }
    scene = build(
        case(
            case={"title": "a spinning cube", "gravity": 0.0},
            time={"end": end, "step_max": 0.05},
            structure={"block": [cube | {"velocity": velocity, "spin": spin}]},
            contact={"stiffness": 1e6},
            gauge=[{"kind": "motion", "name": "b", "of": "b"}],
        ),
        no_clock,
    )
    coupling = scene.coupling
    try:
        while coupling.time < end * (1 - 1e-9):
            record = coupling.step(coupling.step_size(end - coupling.time))
        read = scene.gauges[0].read(coupling, record)
    finally:
        coupling.structure.close()
    assert [read[f"b_velocity_{a}"] for a in "xyz"] == pytest.approx(velocity)
    moved = np.array([read[f"b_centre_{a}"] for a in "xyz"]) - [0, 0, 1]
    assert moved == pytest.approx(np.multiply(velocity, end), abs=1e-9)
    assert [read[f"b_tilt_{a}"] for a in "xyz"] == pytest.approx(np.multiply(spin, end), abs=1e-4)
    assert [read[f"b_spin_{a}"] for a in "xyz"] == pytest.approx(spin, abs=1e-4)
