"""A bonded wall under still water: the load is hydrostatic, block by block, and stays so; the wall stands and falls
where the strength of its base joint says (closed forms; joint strength: coh_joint_Mmax_vs_N.csv)."""

import numpy as np
import pytest

from coupler.scene.build import build
from tests.fakes import no_clock
from tests.physics.scenes import (
    RHO,
    SLICE,
    G,
    case,
    load_at_rest,
    moment_about_base,
    run,
    standing_wall,
)
from yade_scripts.dynamics.equilibrium import CannotStand

WALL = {"face": 1.1, "thickness": 0.2}
HOLDS = 0.981
"""Depth [m] that breaks the base joint of a 0.2 m wall, 2 m high, of 2000 kg/m³, 0.1 MPa, closing ratio 1."""


@pytest.fixture
def wall():
    made = []

    def make(*args, **kwargs):
        made.append(standing_wall(*args, **kwargs))
        return made[-1]

    yield make
    for coupling in made:
        coupling.structure.close()


def force_and_arm(low, high, depth):
    """Hydrostatic force [N] between two heights, and the height of its line of action above the middle [m]."""
    top = min(high, depth)
    if top <= low:
        return 0.0, 0.0
    weight = RHO * G * SLICE
    force = weight * (depth * (top - low) - 0.5 * (top**2 - low**2))
    first = weight * (0.5 * depth * (top**2 - low**2) - (top**3 - low**3) / 3.0)
    return force, first / force - 0.5 * (low + high)


@pytest.mark.parametrize(
    ("covers", "face", "thickness"), [("multiple", 1.1, 0.2), ("multiple", 1.0, 0.1), ("single", 1.0, 0.5)]
)
def test_every_block_carries_its_hydrostatic_force_and_moment(wall, covers, face, thickness):
    """Exact wherever the wall cuts the mesh, also when it is thinner than a cell, and when its faces lie in the faces
    of the mesh: there the fill must not end in a surface of zero pressure. Sealed joints hand a thousandth of a cell
    of face to the neighbour, so single blocks are exact to that."""
    coupling = wall(1.0, face=face, thickness=thickness, covers=covers, settled=False)
    load = load_at_rest(coupling.water)
    for row, centre in enumerate(coupling.structure.centre()):
        force, arm = force_and_arm(centre[2] - 0.125, centre[2] + 0.125, 1.0)
        strip = 2e-3 * 0.25 * RHO * G * SLICE * 1.0
        assert load[row, 0] == pytest.approx(force, abs=strip)
        assert load[row, 4] == pytest.approx(force * arm, abs=0.125 * strip)
    assert load[:, 0].sum() == pytest.approx(0.5 * RHO * G * SLICE, rel=1e-8)
    base = moment_about_base(coupling, load, face, thickness)
    assert base == pytest.approx(RHO * G * SLICE * 1.0**3 / 6.0, rel=1e-8)


def test_the_load_is_exact_for_a_level_between_nodes_too(wall):
    """The pressure on the wall ends at the surface, not with the hat functions of the last wet nodes."""
    for depth in (0.8, 0.9, 1.1):
        coupling = wall(depth, settled=False)
        found = load_at_rest(coupling.water)[:, 0].sum()
        assert found == pytest.approx(0.5 * RHO * G * SLICE * depth**2, rel=1e-8)
        coupling.structure.close()


def test_the_load_stays_hydrostatic_on_a_wall_that_gives_way_elastically(wall):
    """Half a second of coupled steps on a wall that started in equilibrium: force and base moment within 1 %, the wall
    within micrometres, volume and energy kept."""
    coupling = wall(1.0)
    place = coupling.structure.centre()
    force, moment, records = [], [], []

    def note(record):
        force.append(record.load[:, 0].sum() / (0.5 * RHO * G * SLICE))
        moment.append(moment_about_base(coupling, record.load, **WALL) / (RHO * G * SLICE / 6.0))
        records.append(record)

    run(coupling, 0.5, note)
    assert force == pytest.approx(np.ones(len(force)), abs=0.01)
    assert moment == pytest.approx(np.ones(len(moment)), abs=0.01)
    assert np.abs(coupling.structure.centre() - place).max() < 2e-5
    assert abs(coupling.water.volume_error()) < 1e-5
    assert records[-1].balance.energy_error < 1e-4


def test_the_base_joint_carries_the_moment_of_the_water(wall):
    """Joints and ground: what the base joint puts on the lowest block is the load above it, ρ g b h³/6."""
    coupling = wall(1.0)
    run(coupling, 0.1)
    s = coupling.structure
    base = int(np.argmin(s.centre()[:, 2]))
    above = np.arange(s.n) != base
    inner = s.internal_force(viscous=True)
    # all joints together act on the wall as the base joint does: the others are between blocks
    total = moment_about_base(coupling, inner, **WALL)
    weight = moment_about_base(coupling, s.gravity_force(), **WALL)
    assert above.any()
    assert -total == pytest.approx(RHO * G * SLICE / 6.0 + weight, rel=0.01)


def test_a_wall_stands_below_the_depth_that_its_base_joint_carries(wall):
    """0.93 of the critical depth: damaged, not broken, and still."""
    coupling = wall(0.93 * HOLDS, strength=1e5, opening=2e-4)
    place = coupling.structure.centre()
    run(coupling, 0.3)
    table = coupling.structure.joint_table()
    assert table.alive.all()
    assert 0.15 < table.damage.max() < 0.5
    assert np.abs(coupling.structure.centre() - place).max() < 1e-4


def test_no_wall_starts_settled_above_that_depth(wall):
    """1.07 of the critical depth: there is no equilibrium to start from, and the start says so."""
    with pytest.raises(CannotStand, match="cannot carry"):
        wall(1.07 * HOLDS, strength=1e5, opening=2e-4)


def test_a_wall_falls_above_that_depth(wall):
    """Let go all at once under 1.07 of the critical depth, the base opens through and the wall leans downstream."""
    coupling = wall(1.07 * HOLDS, strength=1e5, opening=1e-3, settled=False)
    top = coupling.structure.centre()[-1, 0]
    run(coupling, 0.6)
    assert coupling.structure.joint_table().damage.max() == pytest.approx(1.0, abs=1e-3)
    assert coupling.structure.centre()[:, 0].max() - top > 0.1


def test_a_stronger_wall_swings_and_comes_to_rest(wall):
    """The load comes on at once on a strong wall: no growth of the oscillation, no water across the wall, and the mean
    force is hydrostatic."""
    coupling = wall(1.0, settled=False)
    force, error = [], []

    def note(record):
        force.append(record.load[:, 0].sum() / (0.5 * RHO * G * SLICE))
        error.append(record.balance.energy_error)

    run(coupling, 0.6, note)
    early, late = np.std(force[:20]), np.std(force[-20:])
    assert late < early
    assert np.mean(force[-40:]) == pytest.approx(1.0, abs=0.03)
    assert max(error) < 0.01
    assert coupling.structure.joint_table().alive.all()


@pytest.mark.nightly
@pytest.mark.parametrize("passes", [1, 2])
def test_light_blocks_need_the_second_pass(wall, passes):
    """Blocks of half the density of water without any damping: one pass lets the swinging grow, two damp it."""
    coupling = wall(1.0, settled=False, density=500.0, damping=0.0, passes=passes)
    speed = []
    run(coupling, 1.0, lambda record: speed.append(np.abs(coupling.structure.velocity()[:, 0]).max()))
    growth = max(speed[-25:]) / max(speed[:25])
    assert growth < 0.6 if passes == 2 else growth > 0.9


def test_a_second_pass_takes_the_same_step_again(wall):
    """Time and energy accounts of the structure count the step once, and the pass removes the defect."""
    coupling = wall(1.0, settled=False)
    coupling.tolerance = 1e-3
    first = None
    for _ in range(4):
        record = coupling.step(0.01)
        assert coupling.structure.time == pytest.approx(coupling.time)
        assert record.defect < 0.02
        first = record if first is None else first
    assert first.passes == 2
    assert abs(record.balance.structure_residual) < 1e-9 * record.balance.input_energy


@pytest.mark.parametrize("covers", ["single", "multiple"])
@pytest.mark.parametrize("block", [[0.2, 0.4, 0.6], [0.2, 0.2, 0.3]])
def test_a_settled_wall_that_fits_its_flume_carries_still_water_from_the_first_step(covers, block):
    """Its weight moves its ends off the sides of the tank by micrometres. The water in these slits began with a surface
    at the face of the wall: 0.66 of the thrust in the first step, 1.3 in the second, and a force across the flume."""
    wall = {"name": "wall", "lower": [1.4, 0, 0], "size": [0.2, 0.8, 0.6], "block": block}
    coupling = build(
        case(
            time={"end": 1.0, "step_max": 0.02},
            tank={"lower": [0, 0, 0], "upper": [2.4, 0.8, 1.0], "cell": 0.1},
            water={"covers": covers, "fill": [{"lower": [0, 0, 0], "upper": [1.4, 0.8, 0.5]}]},
            structure={"density": 1800.0, "wall": [wall]},
            contact={"friction": 0.6},
            joints={"strength": 0.5e6, "opening_at_failure": 1e-3},
        ),
        no_clock,
    ).coupling
    try:
        for _ in range(4):
            load = coupling.step(0.02).load.sum(axis=0)
            assert load[0] == pytest.approx(0.5 * RHO * G * 0.5**2 * 0.8, rel=0.005)
            assert abs(load[1]) < 0.005 * load[0]
    finally:
        coupling.structure.close()
