"""A polyhedral block under still water feels the weight of the water it displaces, and nothing sideways."""

import numpy as np
import pytest

from coupler.case.case import Case
from coupler.run.clock import Clock
from coupler.scene.build import build


def case(**block):
    return Case.model_validate(
        {
            "case": {"title": "a stone under water"},
            "time": {"end": 1.0},
            "tank": {"lower": [0, 0, 0], "upper": [1, 1, 1.25], "cell": 0.25},
            "water": {"fill": [{"lower": [0, 0, 0], "upper": [1, 1, 1]}]},
            "structure": {"block": [{"name": "stone", "fixed": True, "centre": [0.51, 0.47, 0.52], **block}]},
            "contact": {"stiffness": 1e6},
            "gauge": [{"kind": "force", "name": "stone", "on": "stone"}],
        }
    )


@pytest.mark.parametrize("corners", [4, 7, 12])
def test_archimedes_holds_for_any_convex_block(corners):
    """F = ρ g V upwards, with no force along x and y and no moment about the centre of volume: the hydrostatic field
    is linear, so elements cut by the block carry it exactly."""
    random = np.random.default_rng(corners)
    x = random.normal(size=(corners, 3))
    x *= 0.3 / np.linalg.norm(x, axis=1)[:, None]
    scene = build(case(vertices=x.tolist(), rotation={"axis": [1, 2, 3], "angle": 0.8}), Clock())
    structure = scene.coupling.structure
    try:
        record = scene.coupling.step(scene.coupling.step_size(1.0))
        lift = 1000.0 * 9.81 * structure.blocks[0].volume
        np.testing.assert_allclose(record.load[0, :3], [0.0, 0.0, lift], atol=1e-6 * lift)
        np.testing.assert_allclose(record.load[0, 3:], 0.0, atol=1e-6 * lift * 0.3)
    finally:
        structure.close()
