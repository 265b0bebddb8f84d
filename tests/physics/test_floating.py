"""Bodies that float: Archimedes, the heave period of potential flow, and bodies too light for a staggered coupling."""

import numpy as np
import pytest

from coupler.scene.build import build
from tests.fakes import no_clock
from tests.physics.scenes import RHO, G, case, run

BOX = {"name": "box", "size": [0.3, 0.1, 0.2]}


@pytest.fixture
def scene():
    made = []

    def make(**sections):
        made.append(build(case(**sections), no_clock).coupling)
        return made[-1]

    yield make
    for coupling in made:
        coupling.structure.close()


def floating_box(scene, centre_z, level, cell=0.025):
    """A slice of a long box of half the density of water, as wide as the tank in y; at rest its centre is at 0.5 m."""
    return scene(
        time={"end": 3.0, "step_max": 0.01},
        tank={"lower": [0, 0, 0], "upper": [1, 0.1, 0.8], "cell": cell},
        water={"fill": [{"lower": [0, 0, 0], "upper": [1, 0.1, level]}]},
        structure={"density": 500.0, "block": [{**BOX, "centre": [0.5, 0.05, centre_z]}]},
        contact={"stiffness": 1e6, "friction": 0.0},
    )


def floating_plate(scene, bottom, level, cell, middle=(1.0, 1.0), **water):
    """A timber plate, 1 m x 1 m x 20 mm, in a pool of 2 m x 2 m, with both of its sides apart: its draught is 15 mm."""
    return scene(
        time={"end": 3.0, "step_max": 0.02},
        tank={"lower": [0, 0, 0], "upper": [2, 2, 1.5], "cell": cell},
        water={"covers": "multiple", "fill": [{"lower": [0, 0, 0], "upper": [2, 2, level]}], **water},
        structure={
            "density": 750.0,
            "block": [{"name": "plate", "size": [1, 1, 0.02], "centre": [*middle, bottom + 0.01]}],
        },
        contact={"stiffness": 2e7, "friction": 0.5},
    )


def cube(scene, density, step=0.005, side=0.3):
    """A cube free in the middle of a pool, well under the surface."""
    return scene(
        time={"end": 1.0, "step_max": step},
        tank={"lower": [0, 0, 0], "upper": [1, 1, 1.5], "cell": 0.1},
        water={"fill": [{"lower": [0, 0, 0], "upper": [1, 1, 1]}]},
        structure={
            "density": density,
            "block": [{"name": "cube", "size": [side] * 3, "centre": [0.53, 0.47, 0.35]}],
        },
        contact={"stiffness": 1e5},
    )


def test_a_box_at_its_draught_stays(scene):
    """The load equals the weight at the start; after a second the box has moved by less than a hundredth of a cell."""
    coupling = floating_box(scene, 0.5, 0.5)
    lift = []
    run(coupling, 0.5, lambda record: lift.append(record.load[0, 2]))
    weight = coupling.structure.mass[0] * G
    centre = coupling.structure.centre()[0]
    assert lift[0] == pytest.approx(weight, rel=1e-4)
    assert lift == pytest.approx(np.full(len(lift), weight), rel=0.01)
    assert np.abs(centre - [0.5, 0.05, 0.5]).max() < 0.02 * 0.025
    assert np.abs(coupling.structure.velocity()).max() < 2e-3


@pytest.mark.nightly
def test_the_heave_period_is_that_of_potential_flow(scene):
    """Linear potential flow of body and surface in the closed tank: 0.92569 s; no growth of the motion."""
    coupling = floating_box(scene, 0.52, 0.4914)
    time, height, error = [], [], []

    def note(record):
        time.append(coupling.time)
        height.append(coupling.structure.centre()[0, 2])
        error.append(abs(coupling.water.volume_error()))

    run(coupling, 3.0, note)
    t, z = np.array(time), np.array(height) - np.mean(height)
    up = np.flatnonzero((z[:-1] < 0) & (z[1:] >= 0))
    crossing = t[up] - z[up] * (t[up + 1] - t[up]) / (z[up + 1] - z[up])
    assert np.diff(crossing).mean() == pytest.approx(0.92569, rel=0.03)
    assert np.mean(height) == pytest.approx(0.5, abs=0.002)
    assert np.abs(z).max() < 1.1 * 0.02
    assert max(error) < 1e-5


@pytest.mark.parametrize("density", [50.0, 300.0, 2400.0])
def test_momentum_of_a_free_block_is_the_impulse_of_water_and_weight(scene, density):
    """M ΔV = Σ dt (F + weight) in YADE to round-off of the exchange, rising, floating up or sinking."""
    coupling = cube(scene, density)
    s = coupling.structure
    for _ in range(10):
        before = s.velocity()[0, :3].copy()
        record = coupling.step(0.004)
        force = record.load[0, :3] + s.gravity_force()[0, :3]
        gained = s.mass[0] * (s.velocity()[0, :3] - before)
        assert gained == pytest.approx(
            record.dt * force, abs=1e-11 * record.dt * np.abs(record.load[0, :3]).max()
        )


@pytest.mark.parametrize("passes", [1, 2])
def test_a_body_of_a_twentieth_of_the_density_of_water_shoots_up_and_floats(scene, passes):
    """No blow-up at a density ratio far below the added mass: first acceleration as the added mass says (0.68 ± 30 % on
    three cells a side), speed below free rise, the energy and the volume in balance through the surface."""
    coupling = cube(scene, 50.0)
    coupling.passes = passes
    coupling.step(0.002)
    acceleration = coupling.structure.velocity()[0, 2] / 0.002
    added = G * 0.95 / acceleration - 0.05
    assert 0.3 < added < 0.75
    speed, error = [], []

    def note(record):
        speed.append(np.abs(coupling.structure.velocity()[0, :3]).max())
        error.append(record.balance.energy_error)

    run(coupling, 0.5, note)
    assert max(speed) < 3.5
    assert max(error) < 0.01
    assert abs(coupling.water.volume_error()) < 1e-5


def test_a_sinking_block_gives_the_water_what_it_loses(scene):
    """Buoyancy does work -ρ V g Δz on the way down, drag and added mass take the rest: bounded by these two."""
    coupling = cube(scene, 2400.0)
    s = coupling.structure
    start = s.centre()[0, 2]
    run(coupling, 0.15)
    fallen = start - s.centre()[0, 2]
    given = coupling.ledger.work_given
    assert fallen > 0.02
    assert given < -0.95 * RHO * s.volume[0] * G * fallen
    assert given > -s.mass[0] * G * fallen


def test_plates_that_joints_hold_stay_afloat_without_lifting_the_water(scene):
    """A ring of four plates, thinner than a cell and of half the density of water. Their joints open by nanometres at
    first: closed faces that grew by a step at that (all of each, of which the joint covers an eighth) lifted the water
    by a tenth of the energy that such a scene is measured by, and stopped it."""
    plates = {"west": (-0.19, 0, 0.02, 0.4), "east": (0.19, 0, 0.02, 0.4)}
    plates |= {"south": (0, -0.19, 0.36, 0.02), "north": (0, 0.19, 0.36, 0.02)}
    blocks = [
        {"name": name, "centre": [0.512 + x, 0.508 + y, 0.503], "size": [a, b, 0.2]}
        for name, (x, y, a, b) in plates.items()
    ]
    coupling = scene(
        time={"end": 0.01, "step_max": 1e-3},
        tank={"lower": [0, 0, 0], "upper": [1, 1, 0.7], "cell": 0.1},
        water={"covers": "multiple", "fill": [{"lower": [0, 0, 0], "upper": [1, 1, 0.503]}]},
        structure={"density": 500.0, "block": blocks},
        joints={"strength": 1e6, "opening_at_failure": 1e-4},
    )
    errors = []
    run(coupling, 0.01, lambda record: errors.append(record.balance.energy_error))
    assert coupling.structure.joint_damage()[0].max() < 1e-3
    assert max(errors) < 1e-3


@pytest.mark.parametrize(
    ("level", "cell", "openings"),
    [(0.95, 1 / 6, "all"), (0.95, 0.25, "edges"), (1.0, 1 / 6, "all"), (1.0, 1 / 6, "wide")],
    ids=["between nodes", "wide cells", "on nodes", "on nodes, wide openings"],
)
def test_a_plate_thinner_than_its_cells_at_its_draught_stays(scene, level, cell, openings):
    """It was lifted with 261 to 288 N instead of its weight of 147 N, and the run ended after 0.01 s."""
    coupling = floating_plate(scene, level - 0.015, level, cell, openings=openings)
    before, lift = coupling.structure.centre()[0], []
    run(coupling, 0.25, lambda record: lift.append(record.load[0, 2]))
    assert lift == pytest.approx(np.full(len(lift), 0.015 * RHO * G), rel=1e-6)
    assert np.abs(coupling.structure.centre()[0] - before).max() < 1e-8


@pytest.mark.parametrize(
    ("raised", "middle"),
    [(0.005, (1.04, 1.03)), (-0.003, (1.04, 1.03)), (-0.003, (1.0, 1.0))],
    ids=["raised", "pushed down", "pushed down, edges on planes of nodes"],
)
def test_a_thin_plate_comes_to_its_draught(scene, raised, middle):
    """Where its edges lie on planes of nodes, a drift of 1e-5 m splits nodes at its rim into copies: what water these
    shared came to lie on the plate, 0.6 l, and the run ended after 0.48 s with 1.1 times the energy put in."""
    coupling = floating_plate(scene, 0.935 + raised, 0.95, 1 / 6, middle)
    lift, errors = [], []

    def note(record):
        lift.append(record.load[0, 2])
        errors.append(record.balance.energy_error)

    run(coupling, 1.5, note)
    assert np.mean(lift[-30:]) == pytest.approx(0.015 * RHO * G, rel=0.01)
    assert coupling.structure.centre()[0, 2] == pytest.approx(0.945, abs=1e-3)
    assert np.abs(errors).max() < 0.04
