"""Films of water under blocks hand on the pressure of their rim, and have no inertia of their own."""

import numpy as np
import pytest

from coupler.case.case import Case
from coupler.scene.build import build
from fluid.pressure.films import _film_cells
from fluid.pressure.projection import inflow
from fluid.step.carried import carried_by_fluxes
from tests.fakes import no_clock
from tests.physics.scenes import RHO, G, case, run

DEPTH, EDGE, HEIGHT, CELL = 0.6, 0.5, 0.25, 0.1
AREA = EDGE**2
PLACE = 0.537
"""Off the planes of the mesh."""


@pytest.fixture
def scene():
    made = []

    def make(blocks, uplift=None, water=(), **sections):
        contact = {"stiffness": 1e9, "friction": 0.5} | ({} if uplift is None else uplift)
        made.append(
            build(
                case(
                    time={"end": 1.0, "step_max": 0.01},
                    tank={"lower": [0, 0, 0], "upper": [1, 1, 0.8], "cell": CELL},
                    water={"fill": [{"lower": [0, 0, 0], "upper": [1, 1, DEPTH]}]} | dict(water),
                    structure={"block": blocks},
                    contact=contact,
                    **sections,
                ),
                no_clock,
            ).coupling
        )
        return made[-1]

    yield make
    for coupling in made:
        coupling.structure.close()


def block(bottom=0.0, density=2400.0, name="block", **more):
    centre = [PLACE, PLACE, bottom + HEIGHT / 2]
    return {"name": name, "size": [EDGE, EDGE, HEIGHT], "centre": centre, "density": density} | more


@pytest.mark.parametrize(
    ("uplift", "share"),
    [
        (None, 1.0),
        ({"uplift": "full"}, 1.0),
        ({"uplift": "share", "uplift_share": 0.3}, 0.3),
        ({"uplift": "none"}, 0.0),
        ({"pair": [{"materials": ["block", "tank"], "uplift": "none"}]}, 0.0),
        ({"uplift": "none", "pair": [{"materials": ["block", "tank"], "uplift": "full"}]}, 1.0),
    ],
)
def test_a_block_on_the_bed_gets_the_share_of_the_pressure_below_that_is_asked_for(scene, uplift, share):
    """Pressure of the depth on its lower face times the share, less that on the upper one."""
    coupling = scene([block()], uplift)
    run(coupling, 0.2)
    below, above = RHO * G * DEPTH * AREA, RHO * G * (DEPTH - HEIGHT) * AREA
    load = coupling.step(0.01).load
    assert load[0, 2] == pytest.approx(share * below - above, abs=2e-4 * below)


def test_beside_blocks_at_rest_the_water_of_a_film_keeps_its_mass(scene):
    """A stream over a block that lies on the bed: the right hand side of the nodes in films is what the velocity before
    the pressure brings to them, as at any node. As long as it was that of the pressure of their rim, the cells of films
    were sources of water."""
    coupling = scene([block()])
    run(coupling, 0.02)
    water = coupling.water
    water.velocity[:] += [1.0, 0.3, 0.0]
    problem = water.predict(0.01)
    kept, found = problem.predicted, water.films.node[problem.dofs]
    brought = inflow(kept.wet_cells, kept.cell_star, water.topology.fluid_cells, len(kept.wet))[problem.dofs]
    assert found.sum() > 4
    np.testing.assert_allclose(problem.rhs, brought, rtol=0.0, atol=1e-12 * np.abs(brought).max())


def test_faces_of_edges_apart_keep_the_uplift(scene):
    """With multiple covers and openings that spare films."""
    coupling = scene([block()], water={"covers": "multiple", "openings": "edges"})
    run(coupling, 0.2)
    expected = RHO * G * HEIGHT * AREA
    assert coupling.step(0.01).load[0, 2] == pytest.approx(expected, abs=2e-4 * RHO * G * DEPTH * AREA)


@pytest.mark.parametrize(("uplift", "share"), [("full", 1.0), ("none", 0.0)])
def test_stacked_blocks_each_get_the_pressure_between_them(scene, uplift, share):
    """Both feel their buoyancy; without uplift the lower one gets nothing from the water, the upper one its weight."""
    coupling = scene([block(name="low"), block(HEIGHT, name="high")], {"uplift": uplift})
    run(coupling, 0.2)
    load = coupling.step(0.01).load[:, 2]
    pressure = RHO * G * AREA * (DEPTH - HEIGHT * np.arange(3))
    expected = [share * (pressure[0] - pressure[1]), share * pressure[1] - pressure[2]]
    assert load == pytest.approx(expected, abs=3e-4 * pressure[0])


def test_a_light_block_that_the_water_presses_to_the_bed_is_held_in_the_first_step(scene):
    """Sealed below, of a thirtieth of the density of water: its contact begins within the step. While the second pass
    answered as a free block, the water above it fell with it (defect 1, 7 % of the energy and more out of balance)."""
    coupling = scene([block(density=30.0)], {"uplift": "none"})
    record = coupling.step(0.01)
    assert record.retries == 0
    assert record.passes == 2
    assert record.defect < 1e-3
    assert record.load[0, 2] == pytest.approx(-RHO * G * (DEPTH - HEIGHT) * AREA, rel=1e-3)
    assert coupling.water.fastest() < 1e-3


def test_a_block_lighter_than_water_leaves_the_bed_at_once(scene):
    """It rises as it would elsewhere: slower than without any added mass, faster than with four times the water of its
    volume. A film with inertia would hold it there for a second. From the first step on it has its buoyancy: sealed
    until its contact began, it was pressed onto the bed by 1 kN and thrown off by the rebound."""
    density, time = 950.0, 0.3
    coupling = scene([block(density=density)], {"stiffness": 1e7})
    start = coupling.structure.centre()[0, 2]
    first = coupling.step(1e-3)
    assert first.load[0, 2] == pytest.approx(G * RHO * HEIGHT * AREA, rel=0.05)
    run(coupling, time)
    risen = coupling.structure.centre()[0, 2] - start
    drive = G * (RHO - density)
    assert 0.5 * drive / (density + 4.0 * RHO) * time**2 < risen < 0.5 * drive / density * time**2


def test_a_block_that_leaves_the_bed_of_a_full_tank_does_not_change_its_room(scene):
    """The water reaches up to the lid. As water of the scene, films made its room larger by a layer of 10 to 40 μm on
    the block while that touched the bed, and moved 0.1 J to and fro, as much as the scene put in."""
    full = {"fill": [{"lower": [0, 0, 0], "upper": [1, 1, 0.8]}]}
    coupling = scene([block(density=500.0)], {"stiffness": 1e7}, full)
    for _ in range(12):
        balance = coupling.step(1e-3).balance
        assert coupling.water.volume() == pytest.approx(coupling.water.conserved_volume, abs=2e-7)
        assert abs(balance.numerical_dissipation) < 0.02
    assert coupling.structure.overlaps()[0].size == 0


def test_without_uplift_a_light_block_stays_on_the_bed(scene):
    """The water on it presses it down, and none comes below."""
    coupling = scene([block(density=950.0)], {"stiffness": 1e7, "uplift": "none"})
    run(coupling, 0.1)
    assert coupling.structure.centre()[0, 2] == pytest.approx(HEIGHT / 2, abs=2e-3 * CELL)


def test_what_a_lifted_block_draws_in_stays_in_the_books(scene):
    """Volume to the tolerance of its correction, momentum to round-off, energy to what the structure takes."""
    coupling = scene([block(density=500.0)], {"stiffness": 1e7})
    errors, momentum = [], []

    def note(record):
        errors.append(abs(coupling.water.volume_error()))
        momentum.append(record.momentum.error)

    run(coupling, 0.15, note)
    assert coupling.structure.centre()[0, 2] - HEIGHT / 2 > 0.005
    assert coupling.water.films.node.any()
    assert max(errors) < 2e-6
    assert max(momentum) < 1e-9


@pytest.mark.parametrize("speed", [-0.2, 0.2])
def test_a_film_does_not_push_or_hold_a_block(scene, speed):
    """A plate driven towards the bed or away from it through a gap of 0.02 to 0.2 cells: once it has started, its load
    stays within half the pressure of the depth of buoyancy. The ideal squeeze, 0.035 rho A a^2 speed^2/gap^2, would be
    ten times that."""
    gap = 0.002 if speed > 0.0 else 0.02
    coupling = scene([block(gap, name="plate")], motion=[{"block": "plate", "velocity": [0, 0, speed]}])
    loads = []
    run(coupling, 0.08, lambda record: loads.append(record.load[0, 2]))
    buoyancy, most = RHO * G * AREA * HEIGHT, 0.5 * RHO * G * DEPTH * AREA
    assert 10.0 * most < 0.035 * RHO * AREA * EDGE**2 * speed**2 / 0.002**2
    assert np.abs(np.array(loads[2:]) - buoyancy).max() < most


@pytest.mark.parametrize("speed", [-0.02, 0.02])
def test_the_water_that_a_film_takes_up_comes_from_its_rim(scene, speed):
    """A plate moves away from the bed or towards it, 5 mm above: what is carried into its film is the room that it has
    at the end of the step, and the rim loses just that. Left out, the water would appear below the plate by the
    correction of the volume, which takes it from the whole surface. No cell beside the plate is filled by more than
    half of it, so that the nodes of the film hold no other water."""
    gap, dt, middle, width = 0.005, 0.01, 0.56, 0.54
    plate = block(gap, name="plate", size=[width, width, HEIGHT])
    plate["centre"][:2] = [middle, middle]
    coupling = scene([plate], motion=[{"block": "plate", "velocity": [0, 0, speed]}])
    water, start = coupling.water, coupling.water.nodal_water.copy()
    film = water.films.node
    for _ in range(4):
        coupling.step(dt)
    given = water.given_by_films
    assert given[film].sum() == pytest.approx(start[film].sum() * speed / gap, rel=1e-9)
    assert given.sum() == pytest.approx(0.0, abs=1e-12 * np.abs(given).sum())
    held = carried_by_fluxes(water, dt, 0.5, np.ones(len(film))).water[film].sum()
    assert held == pytest.approx(start[film].sum() * (1.0 + speed * (water.time + dt) / gap), rel=1e-3)


@pytest.mark.parametrize("degrees", [1.0, 5.0, 10.0])
def test_a_block_tilted_on_its_edge_has_the_pressure_of_the_depth_in_its_wedge(scene, degrees):
    """Held there: where the wedge is narrower than a quarter of a cell it is film, elsewhere resolved. Buoyancy of the
    whole block, no thrust and no moment."""
    angle = np.radians(degrees)
    centre = [PLACE, PLACE, 0.5 * (EDGE * np.sin(angle) + HEIGHT * np.cos(angle))]
    tilted = block() | {"centre": centre, "rotation": {"axis": [0, 1, 0], "angle": -angle}}
    coupling = scene([tilted], motion=[{"block": "block", "velocity": [0, 0, 0]}])
    for _ in range(3):
        load = coupling.step(0.01).load[0]
    buoyancy = RHO * G * HEIGHT * AREA
    assert load[:3] == pytest.approx([0.0, 0.0, buoyancy], abs=1e-6 * buoyancy)
    assert load[3:] == pytest.approx(np.zeros(3), abs=1e-6 * buoyancy * EDGE)


def test_uplift_and_its_share_go_together():
    """One without the other is refused, and so is a share above 1."""
    for contact in ({"uplift": "share"}, {"uplift_share": 0.5}, {"uplift": "share", "uplift_share": 1.5}):
        with pytest.raises(ValueError, match="uplift"):
            Case.model_validate(
                {
                    "case": {"title": "t"},
                    "time": {"end": 1.0},
                    "structure": {"block": [block()]},
                    "contact": contact,
                }
            )


def test_a_sheet_of_water_is_a_film_whatever_lies_before_it():
    """Where a film crosses a plane of nodes by a millionth of a cell, a part of it beside a gap has nothing opposite.
    Its water of 1e-8 cells was left to find a pressure of its own, 0.8 GPa, among the bricks of a loose wall."""
    cell, area = np.array([0, 1, 2, 3]), np.array([1.0, 1.0, 1.0, 1.0])
    in_film = np.array([True, False, False, True])
    volume, reach = np.array([0.2, 1e-8, 0.01, 0.3]), np.full(4, 0.25)
    films, thin = _film_cells(cell, area, in_film, volume, reach, 2.0, 0.004)
    assert films.tolist() == [True, True, False, False]
    assert thin.tolist() == [True, True, True, False]
