"""Joints that let water between their faces: the pressure there, and the strength that it leaves."""

import numpy as np
import pytest

from coupler.scene.build import build
from fluid.pressure.partly_wet import PartlyWet
from tests.fakes import no_clock
from tests.physics.scenes import RHO, G, case, run
from yade_scripts.dynamics.equilibrium import CannotStand

DEPTH, EDGE, HEIGHT, CELL, PLACE = 0.6, 0.5, 0.25, 0.1, 0.537
AREA = EDGE**2
BELOW, ABOVE = RHO * G * DEPTH * AREA, RHO * G * (DEPTH - HEIGHT) * AREA
OPENING, PEAK = 2e-3, 1.0 / 3.0
"""Of the joints: opening at failure [m], and share of it at the largest traction."""


@pytest.fixture
def scene():
    made = []

    def make(blocks, joints=None, boxes=(((0, 0, 0), (1, 1, DEPTH)),), tank=(1, 1, 0.8), **sections):
        if joints is not None:
            sections["joints"] = {
                "opening_at_failure": OPENING,
                "pair": [{"between": ["block", "tank"]}],
            } | joints
        sections.setdefault("contact", {"stiffness": 1e9})
        made.append(
            build(
                case(
                    time={"end": 1.0, "step_max": 0.01},
                    tank={"lower": [0, 0, 0], "upper": tank, "cell": CELL},
                    water={"fill": [{"lower": low, "upper": high} for low, high in boxes]},
                    structure={"block": blocks},
                    **sections,
                ),
                no_clock,
            ).coupling
        )
        return made[-1]

    yield make
    for coupling in made:
        coupling.structure.close()


def block(density=2400.0):
    """On the bed, off the planes of the mesh."""
    centre = [PLACE, PLACE, HEIGHT / 2]
    return {"name": "block", "size": [EDGE, EDGE, HEIGHT], "centre": centre, "density": density}


@pytest.mark.parametrize(("uplift", "share"), [("none", 0.0), ("damage", 0.0), ("full", 1.0)])
def test_an_intact_joint_lets_the_pressure_between_its_faces_only_if_it_is_to(scene, uplift, share):
    coupling = scene([block()], {"strength": 1e6, "uplift": uplift})
    run(coupling, 0.05)
    assert coupling.step(0.01).load[0, 2] == pytest.approx(share * BELOW - ABOVE, abs=2e-4 * BELOW)


@pytest.mark.parametrize(
    ("uplift", "of_excess", "holds"),
    [("full", 1.02, True), ("full", 0.98, False), ("none", 0.1, True), ("damage", 0.1, True)],
)
def test_the_base_breaks_where_uplift_exceeds_weight_and_strength(scene, uplift, of_excess, holds):
    """p A - W' against f A, with the weight W' of the block and of the water on it. Where no water comes between, the
    water presses the block down, and any strength will do."""
    density = 500.0
    weight = density * G * HEIGHT * AREA + ABOVE
    joints = {"strength": of_excess * (BELOW - weight) / AREA, "uplift": uplift}
    if not holds:
        with pytest.raises(CannotStand, match="joint of 'block'"):
            scene([block(density)], joints)
        return
    coupling = scene([block(density)], joints)
    run(coupling, 0.2)
    assert coupling.structure.joints.alive.all()


def test_a_joint_pulled_apart_lets_the_pressure_in_as_its_traction_falls(scene):
    """Nothing up to the largest traction, then in proportion to the opening, all of it at failure and after."""
    speed = 0.005
    motion = [{"block": "block", "velocity": [0, 0, speed]}]
    coupling = scene([block()], {"strength": 1e4, "uplift": "damage"}, motion=motion)
    shares, expected = [], []

    def note(record):
        shares.append((record.load[0, 2] + ABOVE) / BELOW)

    while coupling.time < 1.2 * OPENING / speed:
        expected.append(np.clip((coupling.time * speed / OPENING - PEAK) / (1.0 - PEAK), 0.0, 1.0))
        note(coupling.step(0.04))
    assert not coupling.structure.joints.alive.any()
    np.testing.assert_allclose(shares[1:], expected[1:], atol=0.01)  # the first step sets it in motion
    assert expected[-1] == 1.0


def test_the_share_differs_from_place_to_place_of_a_face(scene):
    """One half of the lower face has the pressure, the other none: half of the force, at a quarter of the edge."""
    coupling = scene([block()], {"strength": 1e6, "uplift": "damage"})
    loose, _ = coupling.immersion.films()
    plane = coupling.immersion.films()[1].plane[0]
    at = np.array([[PLACE + x, PLACE, 0.0] for x in (-0.01, 0.01)])
    halves = PartlyWet(np.array([plane, plane]), at, np.array([0.0, 1.0]))
    coupling.immersion.films = lambda: (loose, halves)
    run(coupling, 0.02)
    load = coupling.step(0.01).load[0]
    # polygons of the mesh belong to one half or the other as a whole
    assert load[2] == pytest.approx(0.5 * BELOW - ABOVE, abs=0.5 * CELL / EDGE * BELOW)
    assert load[4] == pytest.approx(-0.5 * BELOW * 0.25 * EDGE, rel=0.2)


@pytest.mark.parametrize("kind", ["joint", "contact"])
@pytest.mark.parametrize("tail", [0.0, 0.4])
def test_under_a_dam_the_pressure_falls_from_one_side_to_the_other(scene, kind, tail):
    """The base of a dam, 10 cells wide, with water of 0.8 m before it and of `tail` behind it, which no box of the case
    puts under it: the mean of both pressures from the first step on, and the whole thrust. With films that filled as
    water ran in, the thrust of the first step was 0.39 of it, and the uplift after 0.3 s 0.29."""
    base, width, head, face = 1.0, 0.2, 0.8, 1.037
    dam = {
        "name": "block",
        "size": [base, width, 1.2],
        "centre": [face + base / 2, width / 2, 0.6],
        "density": 2400.0,
    }
    boxes = [((0, 0, 0), (face, width, head))]
    boxes += [((face + base, 0, 0), (3, width, tail))] if tail else []
    joints = {"strength": 1e6, "uplift": "full"} if kind == "joint" else None
    coupling = scene([dam], joints, boxes, (3, width, 1.4))
    thrust, uplift = RHO * G * (head**2 - tail**2) / 2 * width, RHO * G * (head + tail) / 2 * base * width
    errors = []

    def note(record):
        load = record.load[0]
        errors.append((load[0] / thrust - 1.0, load[2] / uplift - 1.0))

    run(coupling, 0.2, note)
    errors = np.abs(errors)
    assert errors[:, 0].max() < 0.01
    assert errors[:, 1].max() < CELL / base  # the film ends at a node
    assert abs(coupling.water.volume_error()) < 1e-6
