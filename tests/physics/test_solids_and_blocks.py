"""Fixed solids stop blocks: to the structure they are held blocks, to the water they are what they were."""

import numpy as np
import pytest

from coupler.case.case import Case
from coupler.scene.build import build
from tests.fakes import no_clock

G, MU = 9.81, 0.3
CRATE = {"name": "crate", "size": [0.5, 0.5, 0.5]}
BED = {"name": "bed", "centre": [2.0, 0.0, -0.5], "size": [8.0, 2.0, 1.0]}
PIER = {"name": "pier", "vertices": [[x, y, z] for x in (1.5, 2.5) for y in (-0.5, 0.5) for z in (0.0, 1.0)]}
RAMP = {"name": "ramp", "vertices": [[x, y, z] for y in (-1, 1) for x, z in ((0, 0), (4, 0), (4, 1))]}


def coupling_of(**sections):
    return build(Case.model_validate(sections), no_clock).coupling


def dry(blocks, solids, friction=MU, **more):
    return coupling_of(
        case={"title": "blocks and solids"},
        time={"end": 1.0},
        solid=solids,
        structure={"density": 2000.0, "block": blocks},
        contact={"stiffness": 1e7, "restitution": 0.5, "friction": friction} | more,
    )


def moved(coupling, time):
    """Velocity and place of the first block after `time` [s]."""
    with coupling.structure as s:
        s.advance(time)
        return s.velocity()[0], s.centre()[0]


def test_a_crate_slides_to_rest_on_a_solid_bed():
    """v = v0 - mu g t, and it stays on top; it starts as deep in the bed as its weight presses it."""
    block = CRATE | {"centre": [0, 0, 0.25 - 2000 * 0.125 * G / 1e7], "velocity": [1.0, 0, 0]}
    velocity, centre = moved(dry([block], [BED]), 0.2)
    assert velocity[0] == pytest.approx(1.0 - MU * G * 0.2, rel=1e-3)
    assert centre[2] == pytest.approx(0.25, abs=5e-4)


def test_a_pair_of_materials_may_name_the_solid():
    block = CRATE | {"centre": [0, 0, 0.25 - 2000 * 0.125 * G / 1e7], "velocity": [1.0, 0, 0]}
    ice = {"pair": [{"materials": ["block", "ice"], "friction": 0.0}]}
    velocity, _ = moved(dry([block], [BED | {"material": "ice"}], **ice), 0.2)
    assert velocity[0] == pytest.approx(1.0, rel=1e-6)


def test_a_crate_bounces_off_a_solid_pier():
    """Its face lands flat on the hull of points: the normal restitution asked for."""
    block = CRATE | {"centre": [1.2, 0, 0.5], "velocity": [2.0, 0, 0]}
    coupling = coupling_of(
        case={"title": "off a pier", "gravity": 0.0},
        time={"end": 1.0},
        solid=[PIER],
        structure={"density": 2000.0, "block": [block]},
        contact={"stiffness": 1e7, "restitution": 0.5, "friction": MU},
    )
    velocity, _ = moved(coupling, 0.2)
    assert velocity[0] == pytest.approx(-1.0, rel=1e-2)


@pytest.mark.parametrize(("friction", "holds"), [(0.35, True), (0.15, False)])
def test_a_ramp_holds_a_crate_up_to_the_angle_of_friction(friction, holds):
    """Slope 1 in 4."""
    slope = np.arctan2(1, 4)
    up = np.array([-np.sin(slope), 0, np.cos(slope)])
    place = np.array([2.0, 0, 0.5]) + 0.25 * up
    turn = {"axis": [0, -1, 0], "angle": float(slope)}
    velocity, _ = moved(dry([CRATE | {"centre": place.tolist(), "rotation": turn}], [RAMP], friction), 0.5)
    slides = 0.0 if holds else G * (np.sin(slope) - friction * np.cos(slope)) * 0.5
    assert np.linalg.norm(velocity[:3]) == pytest.approx(slides, rel=0.02, abs=0.02)


def test_joints_glue_a_wall_to_a_solid_foot():
    """A beam out of a solid carries itself, as out of a held block; the solid has its place behind the blocks."""
    coupling = coupling_of(
        case={"title": "a beam out of a solid"},
        time={"end": 0.1},
        solid=[{"name": "root", "centre": [0, 0, 0], "size": [1, 1, 1]}],
        structure={
            "density": 2000.0,
            "wall": [{"name": "beam", "lower": [0.5, -0.5, -0.5], "size": [2, 1, 1], "block": [1, 1, 1]}],
        },
        contact={"restitution": 0.3, "friction": 0.5},
        joints={"strength": 1e7, "opening_at_failure": 1e-3},
    )
    with coupling.structure as s:
        assert s.names[-1] == "root"
        assert len(s.joints) == 2
        held = s.reaction()[-1, 2]
    assert held == pytest.approx((2 * 2000 + 2400) * G, rel=1e-6), "the beam, and its own weight of concrete"


def test_the_water_loads_a_solid_alike_with_and_without_blocks():
    """A dry block far off changes nothing of the water: the solid as a held block carries what it carried."""
    scene = {
        "case": {"title": "a wave on a pier"},
        "time": {"end": 0.3},
        "tank": {"lower": [0, -0.5, 0], "upper": [4, 0.5, 2], "cell": 0.25},
        "water": {"fill": [{"lower": [0, -0.5, 0], "upper": [1.25, 0.5, 1.5]}]},
        "solid": [PIER],
    }
    away = {
        "structure": {"density": 2000.0, "block": [CRATE | {"centre": [3.5, 0, 1.2], "fixed": True}]},
        "contact": {"stiffness": 1e7, "restitution": 0.5, "friction": MU},
    }
    alone, with_block = (_pressed(scene | more) for more in ({}, away))
    assert alone[:, 0].max() > 100.0
    assert np.allclose(with_block, alone, rtol=1e-6, atol=1e-6 * np.abs(alone).max())


def _pressed(sections):
    """Force of the water on the solid, the last body, in each step (steps, 3) [N]."""
    coupling = coupling_of(**sections)
    found = []
    while coupling.time < 0.35:
        found.append(coupling.step(0.05).load[-1, :3].copy())
    if coupling.structure is not None:
        coupling.structure.close()
    return np.array(found)
