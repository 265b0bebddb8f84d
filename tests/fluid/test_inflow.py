"""Water that comes in and goes out: exact states stay, volumes add up, waves run as theory says."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from fluid.air.gas import Gas
from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.readings import gauges
from fluid.sides import waves
from fluid.sides.absorbing import Absorber
from fluid.sides.inflow import Side, Sides, wet_shares
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from tests.fluid.scenes import advance, load

G = 9.81


def left(normal, _):
    return normal[:, 0] < -0.5


def right(normal, _):
    return normal[:, 0] > 0.5


def tank(size, cell, fill, inflow=None, sea=None, bodies=None, gas=None, **parameters):
    """A tank with an inflow (Flow) at x- and a sea of a level at x+, either None: a smooth wall."""
    mesh = box_mesh(np.zeros(3), size, cell)
    domain = cut_domain(mesh, ConvexBodies.empty() if bodies is None else bodies)
    sides = [] if inflow is None else [Side.of(mesh, left, inflow)]
    if sea is not None:
        sides.append(Side.of(mesh, right, level=lambda time: sea))
    return Water(mesh, domain, fill, WaterParameters(**parameters), sides=Sides(sides), gas=gas)


@pytest.mark.parametrize("gas", [None, Gas()])
@pytest.mark.parametrize("level", [0.501, 0.537, 0.58])
def test_still_water_beside_a_sea_of_its_level_stays(level, gas):
    """The pressure held on the side is continued above the level, so that rest is exact; that continuation is none of
    air, also where trapped air is computed.  (A surface less than 1e-4 of a cell above a layer of nodes hums beside the
    sea with some mm/s.)"""
    box = ConvexBodies.boxes(np.array([[1.0, 0.1, 0.4]]), np.array([[0.3, 0.4, 0.25]]))
    water = tank([2, 0.2, 1], 0.1, lambda x: x[:, 2] - level, sea=level, bodies=box, gas=gas)
    start = water.volume()
    for _ in range(50):
        advance(water, 0.02)
    assert np.abs(water.velocity).max() < 1e-8
    assert water.volume() == pytest.approx(start, abs=1e-9)


def test_still_water_in_the_corner_of_an_inflow_and_a_sea_stays():
    """An inflow that brings nothing yet meets a sea along an upright edge: at its nodes the pressure is sought, since
    the inflow fixes the velocity there. Held by the sea as well, it would count twice, and push the water."""
    mesh, level = box_mesh(np.zeros(3), [0.6, 0.6, 0.8], 0.1), 0.537
    sides = [Side.of(mesh, left, waves.steady([1, 0, 0], level, 0.0))]
    sides.append(Side.of(mesh, lambda normal, _: normal[:, 1] > 0.5, level=lambda time: level))
    domain = cut_domain(mesh, ConvexBodies.empty())
    water = Water(mesh, domain, lambda x: x[:, 2] - level, WaterParameters(), sides=Sides(sides))
    inflow, sea = water.sides.now
    shared = np.intersect1d(inflow.nodes, sea.nodes)
    assert (water.level_set[shared] < 0.0).sum() > 3
    for _ in range(3):
        advance(water, 0.02)
    assert np.abs(water.velocity).max() < 1e-8
    deep = water.level_set < 0.0
    depth = level - water.topology.nodes[deep, 2]
    np.testing.assert_allclose(water.pressure[deep], 1000.0 * G * depth, atol=1e-4)


@pytest.mark.parametrize("level", [0.502, 0.537, 0.58])
def test_a_stream_of_one_velocity_passes_the_sides_as_it_is(level):
    """An exact state, with the surface anywhere between layers of nodes.  The mass balance of the pressure takes cells
    that the surface cuts whole; with the wet part of their faces alone the side that it leaves through dammed it up at
    its surface, by 0.22 m/s, and what it then gained was as much as what left.  The pressure that drives it out ends at
    the surface: with that at the uppermost wet nodes alone it takes up to 0.3 J with it that it never had."""
    mesh = box_mesh(np.zeros(3), [1, 0.2, 1], 0.1)
    sides = Sides(
        [
            Side.of(mesh, left, waves.steady([1, 0, 0], level, 0.5)),
            Side.of(mesh, right, waves.steady([-1, 0, 0], level, -0.5)),
        ]
    )
    speed = np.tile([0.5, 0.0, 0.0], (len(mesh.nodes), 1))
    domain = cut_domain(mesh, ConvexBodies.empty())
    water = Water(mesh, domain, lambda x: x[:, 2] - level, WaterParameters(), sides=sides, velocity=speed)
    start = water.kinetic_energy() + water.potential_energy()
    for _ in range(30):
        advance(water, 0.02)
    in_water = water.velocity[water.level_set < 0.0]
    np.testing.assert_allclose(in_water, np.tile(speed[0], (len(in_water), 1)), atol=1e-9)
    assert water.kinetic_energy() + water.potential_energy() == pytest.approx(start, rel=1e-9)
    assert abs(sides.energy) < 1e-6


@given(st.floats(0.05, 0.95), st.floats(-1.0, 1.0))
def test_no_air_comes_with_the_water_of_a_side(level, lean):
    """The mass balance of the pressure takes faces whole; less what of them lies in the air it is the water alone,
    which is what a pocket of trapped air loses. It stands at dry nodes."""
    mesh = box_mesh(np.zeros(3), [0.4, 0.4, 1.0], 0.2)
    side = Side.of(mesh, left, waves.steady([1, 0, 0], level, 0.5))
    phi = mesh.nodes[:, 2] - level + lean * (mesh.nodes[:, 1] - 0.2)
    u = np.tile([0.5, 0.0, 0.0], (len(phi), 1))
    none = np.zeros(0, np.int64)
    of_air = side.drive_of_air(phi, u, none)
    assert side.drive(u, none).sum() - of_air.sum() == pytest.approx(side.rate(phi, u).sum(), abs=1e-13)
    assert (of_air >= 0.0).all()
    assert not of_air[phi < 0.0].any()


@pytest.mark.parametrize("step", [np.inf, 0.02])
def test_water_that_runs_out_through_a_side_that_absorbs_does_not_gain(step):
    """1.1 m of water beside a side with 0.68 m, once the stream is steady there: what is left in the channel is what
    was there less what the side has taken, but for what a stream loses.  It gained 1.4 % of what left, and 3.1 % in
    steps of a third."""
    cell = 0.38
    mesh = box_mesh(np.zeros(3), np.array([52, 1, 4]) * cell, cell)
    absorber = Absorber(
        waves.steady([-1, 0, 0], 0.68, 0.0), -np.eye(3)[0], np.array([[51, 0.5]]) * cell, np.zeros(1), G
    )
    sides = Sides([Side.of(mesh, right, absorber.as_flow())])
    domain = cut_domain(mesh, ConvexBodies.empty())
    water = Water(mesh, domain, lambda x: x[:, 2] - 1.1, WaterParameters(), sides=sides)
    while water.time < 2.0:
        advance(water, min(step, water.stable_step()))
    start, left_before = water.kinetic_energy() + water.potential_energy(), sides.energy
    while water.time < 3.0:
        advance(water, min(step, water.stable_step()))
    left_now = left_before - sides.energy
    kept = water.kinetic_energy() + water.potential_energy() - start + left_now
    assert left_now > 1000.0
    assert -0.01 * left_now < kept < 0.001 * left_now


@pytest.mark.parametrize("covers", ["single", "multiple"])
@pytest.mark.parametrize(("foot", "width"), [(0.0, 2.0), (-0.03, 2.0), (-0.2, 0.15), (-0.2, 2.0)])
def test_what_comes_in_comes_through_what_solids_leave_open(covers, foot, width):
    """A sill of 0.37 m that stands in the side, also in part of its width or with its foot in cells: water of 0.6 m
    enters above and beside it only. Through its faces it went into cells without room, at 1e21 Pa."""
    sill = ConvexBodies.boxes(
        np.array([[0.0, 0.0, foot + (0.37 - foot) / 2]]), np.array([[0.5, width, 0.37 - foot]])
    )
    mesh = box_mesh(np.zeros(3), [1, 0.2, 1], 0.1)
    side = Side.of(mesh, left, waves.steady([1, 0, 0], 0.6, 0.5))
    domain = cut_domain(mesh, sill, covers)
    water = Water(mesh, domain, lambda x: x[:, 2] - 0.6, WaterParameters(), sides=Sides([side]))
    (side,) = water.sides.now
    covered = min(0.2, width / 2) * 0.37
    u = np.tile([0.5, 0.0, 0.0], (len(water.velocity), 1))
    rate = side.rate(water.topology.nodes[:, 2] - 0.6, u)
    assert rate.sum() == pytest.approx(0.5 * (0.2 * 0.6 - covered), rel=1e-9)
    assert np.abs(rate[water.topology.node_volume == 0.0]).max(initial=0.0) == 0.0
    assert np.linalg.norm(side.area.sum(axis=0)) == pytest.approx(0.2 - covered, rel=1e-9)


def test_a_sea_gives_water_that_comes_in_its_speed():
    """What comes in was at rest: Bernoulli takes half ρ u² off the weight of the water above, and it comes in straight;
    what goes out meets the weight alone."""
    water = tank([1, 0.2, 1], 0.1, lambda x: x[:, 2] - 0.6, sea=0.6)
    (side,) = water.sides.now
    z = side.place[:, 2]
    for speed, taken in ((-2.0, 0.5 * 1000.0 * 2.0**2), (2.0, 0.0)):
        u = np.tile([speed, 0.5, 0.0], (len(water.velocity), 1))
        assert side.pressure(1000.0, 9.81, u, 0.0) == pytest.approx(9810.0 * (0.6 - z) - taken)
        side.hold(u, 0.0, 9.81)
        assert (u[side.nodes] == [speed, 0.0 if taken else 0.5, 0.0]).all()


@pytest.mark.parametrize("covers", ["single", "multiple"])
@pytest.mark.parametrize(("place", "height"), [(0.93, 0.3), (0.93, 0.8), (1.0, 0.4), (0.86, 0.8)])
def test_a_solid_within_a_cell_of_a_sea_has_the_load_of_still_water(place, height, covers):
    """Nodes of the sea have a given pressure and no unknown: without it a box beside a sea was pushed at it with half
    of the weight of the water on its other side, and a block took 2.4 MJ out of nothing in a quarter of a second."""
    size = np.array([0.17, 0.13, height])
    box = ConvexBodies.boxes(np.array([[place, 0.1, 0.1 + 0.5 * height]]), size[None])
    mesh = box_mesh(np.zeros(3), [1, 0.2, 1], 0.1)
    water = Water(
        mesh,
        cut_domain(mesh, box, covers),
        lambda x: x[:, 2] - 0.56,
        WaterParameters(),
        sides=Sides([Side.of(mesh, right, level=lambda time: 0.56)]),
    )
    inside = min(place + 0.5 * size[0], 1.0) - (place - 0.5 * size[0])
    under = min(height, 0.46)
    lift = 9810.0 * inside * size[1] * under
    pushed = 0.0  # where it sticks out through the side, nothing pushes back
    if place + 0.5 * size[0] > 1.0:
        pushed = 9810.0 * size[1] * 0.5 * (0.46**2 - (0.46 - under) ** 2)
    for _ in range(3):
        problem, x = advance(water, 0.01, rtol=1e-12)
        force = load(problem, x)[0, :3]
        assert force == pytest.approx([pushed, 0.0, lift], abs=1e-6 * lift)
    assert np.abs(water.velocity).max() < 1e-8


def test_water_comes_in_from_a_sea_no_faster_than_by_a_fall():
    """Through the depth of the sea, where there is none not at all; what goes out is free."""
    water = tank([1, 0.2, 1], 0.1, lambda x: x[:, 2] - 0.6, sea=0.6)
    (side,) = water.sides.now
    for speed, level, kept in (
        (-9.0, 0.6, -np.sqrt(2 * 9.81 * 0.6)),
        (-3.0, 0.6, -3.0),
        (9.0, 0.6, 9.0),
        (-9.0, -0.1, 0.0),
    ):
        u = np.tile([speed, 0.0, 0.0], (len(water.velocity), 1))
        replace(side, level=lambda time, level=level: level).hold(u, 0.0, 9.81)
        assert u[side.nodes, 0] == pytest.approx(kept)


@pytest.mark.parametrize(("cell", "taken"), [(0.05, 0.19), (0.025, 0.085)])
def test_a_sea_beside_a_dry_floor_balances_in_every_step(cell, taken):
    """Water on a strip of a floor, and a sea along all of a side as high as the strip.

    Its first step made a thin sheet there 2.3 times (on cells of half the size 2.8) as fast as a fall through the
    depth; met by a suction as strong, the sheet went to and fro at the limit of the speed, and the balance missed as
    much as had come in. With that fall as the bound, what the numerics take is 0.23 and 0.15 of what came in (without
    it 0.63 and 0.42; 0.21 on the coarse cells while the front slowed down before the walls). They give back 0.18 J at
    most in a step: the third, in which the surface begins to move with the velocity half a step ahead, after 1.5 J
    that the first two have taken."""
    water = tank(
        [0.15, 1.0, 0.3], cell, lambda x: np.maximum(x[:, 2] - 0.15, x[:, 1] - 0.17), sea=0.149, courant=0.5
    )
    start = water.kinetic_energy() + water.potential_energy()
    lost, clipped = [0.0], 0
    fall = np.sqrt(2 * 9.81 * 0.149)
    while water.time < 0.1:
        advance(water, rtol=1e-8)
        now = water.kinetic_energy() + water.potential_energy()
        lost.append(water.energy_through_sides() - (now - start))
        clipped += water.report.clipped
        (side,) = water.sides.now
        inwards = -np.einsum("nk,nk->n", water.velocity[side.nodes], side.normal)
        assert inwards.max() <= fall * (1.0 + 1e-12)
    assert clipped == 0 or cell < 0.05
    assert np.diff(lost).min() > -taken
    assert lost[-1] < 0.24 * water.energy_through_sides()


def test_tank_fills_to_the_level_of_the_sea():
    """From a third, in swings about that level that must not grow (with the static pressure on the side they end above
    the top of the tank); what came in is what is there."""
    water = tank([0.5, 0.2, 1], 0.1, lambda x: x[:, 2] - 0.2, sea=0.6)
    level = []
    while water.time < 6.0:
        advance(water, rtol=1e-7)
        level.append((water.time, gauges.level(water, (0.25, 0.1))))
    t, level = np.array(level).T
    assert np.trapezoid(level[t > 2], t[t > 2]) / np.ptp(t[t > 2]) == pytest.approx(0.6, abs=0.03)
    assert level[t > 4].max() < 0.85
    through = water.sides.entered - water.sides.left
    assert water.volume() == pytest.approx(water.initial_volume + through, rel=1e-3)
    assert abs(water.volume_error()) < 1e-4


@pytest.mark.parametrize("sea", [0.0425, 0.18])
def test_a_sea_that_stands_lower_or_higher_puts_no_energy_in(sea):
    """A pool of 0.11 m beside a sea a cell and a third lower, or higher: what the level of the sea takes off the water
    beside it, or adds, goes through the side. Lifted onto the rest of the pool (lower) it brought 24 % of what the
    step in the level holds, on cells of a half and a quarter too."""
    water = tank([0.45, 0.1, 0.25], 0.05, lambda x: x[:, 2] - 0.11, sea=sea)
    held = 0.5 * 1000.0 * 9.81 * 0.1 * max(sea, 0.11) * (0.11 - sea) ** 2
    start = water.kinetic_energy() + water.potential_energy()
    lost = []
    while water.time < 0.25:
        advance(water, rtol=1e-8)
        now = water.kinetic_energy() + water.potential_energy()
        lost.append((water.energy_through_sides() - (now - start)) / held)
    assert min(lost) > -0.01
    assert max(lost) < 1.0
    assert abs(water.volume_error()) < 1e-5


def test_uniform_stream_from_inflow_to_sea():
    """A stream of 0.5 m/s, Froude 0.23, stays uniform and the books agree."""
    depth, speed = 0.5, 0.5
    flow = waves.steady([1, 0, 0], depth, speed)
    water = tank([2, 0.1, 1], 0.1, lambda x: x[:, 2] - depth, inflow=flow, sea=depth)
    water.velocity[:, 0] = speed * (water.level_set < 0.3)
    water.set_cell_velocity(np.tile([speed, 0.0, 0.0], (len(water.topology.cells), 1)))
    while water.time < 4.0:
        advance(water, rtol=1e-8)
    wet = water.level_set < 0.0
    assert np.abs(water.velocity[wet, 0] - speed).max() < 0.06
    assert water.volume() == pytest.approx(0.1, rel=0.02)
    assert water.sides.entered == pytest.approx(speed * depth * 0.1 * 4.0, rel=0.02)
    balance = 0.1 + water.sides.entered - water.sides.left
    assert water.volume() == pytest.approx(balance, rel=1e-3)


def test_inflow_on_a_dry_bed_brings_what_it_says():
    """No water at the start: the volume is level times width times speed times time; errors are shares of that."""
    water = tank([2, 0.1, 1], 0.1, lambda x: x[:, 2] + 1.0, inflow=waves.steady([1, 0, 0], 0.3, 1.0))
    assert water.volume() == pytest.approx(0.0, abs=2e-3)
    while water.time < 0.999:
        advance(water, 0.02, rtol=1e-8)
    assert water.sides.entered == pytest.approx(0.3 * 0.1 * 1.0 * water.time, rel=1e-6)
    assert abs(water.volume_error()) < 1e-5


def test_bore_runs_with_the_speed_of_the_jump():
    """0.3 m into 0.2 m of still water: mass and momentum across the jump; 3 % on cells of 5 cm."""
    ahead, behind, h = 0.2, 0.3, 0.05
    front, speed = waves.bore_speed(ahead, behind, G)
    water = tank([4, h, 0.5], h, lambda x: x[:, 2] - ahead, inflow=waves.steady([1, 0, 0], behind, speed))
    at = []
    while water.time < 1.8:
        advance(water, rtol=1e-7)
        x = np.arange(0.05, 3.95, 0.05)
        level = np.array([gauges.level(water, (a, h / 2)) for a in x])
        at.append((water.time, x[np.argmax(level < 0.5 * (ahead + behind))]))
    t, x = np.array(at)[len(at) // 3 :].T
    assert np.polyfit(t, x, 1)[0] == pytest.approx(front, rel=0.03)


@pytest.mark.parametrize(("order", "allowed"), [(1, 1e-12), (3, 1e-3)])
def test_solitary_wave_carries_its_volume(order, allowed):
    """c η = ∫ u dz below the surface: exactly for the mean velocity, to the fourth order for Grimshaw's."""
    wave = waves.SolitaryWave(2.0, 0.2, G, 0.0, order)
    for time in np.linspace(-2, 2, 21):
        eta = wave.elevation(time)
        z = np.linspace(0.0, 2.0 + eta, 2001)
        flux = np.trapezoid(wave.speed_at(z, time), z)
        assert flux == pytest.approx(wave.speed * eta, abs=allowed * wave.speed * 0.2)
    assert wave.elevation(0.0) == pytest.approx(0.2)


def test_the_tail_of_a_solitary_wave_falls_off_at_the_rate_of_its_celerity():
    """Far from the crest η ~ exp(-k x) is a wave of potential theory, c² = g tan(k d)/k (Stokes), with k twice the rate
    in sech². Rate and celerity of third order hold it to the fourth."""
    for e in (0.01, 0.02):
        wave = waves.SolitaryWave(2.0, 2.0 * e, G, 0.0)
        k = 2.0 * wave.rate
        assert wave.speed**2 / (G * 2.0) == pytest.approx(np.tan(2.0 * k) / (2.0 * k), abs=0.03 * e**3)


def test_solitary_wave_keeps_height_and_speed():
    """Sent in through a side, H/d = 0.2: from 8 to 13 depths on its height and its celerity, to the coarse cells d/10:
    it is 5 % too high and 0.7 % too slow. (On its first five depths it is 3 % too slow, on cells d/20 as well: it has
    yet to form.)"""
    depth, height = 1.0, 0.2
    wave = waves.SolitaryWave(depth, height, G, 1.5)
    water = tank(
        [16, 0.1, 1.4], 0.1, lambda x: x[:, 2] - depth, inflow=wave.flow([1, 0, 0], 0.0), density=1000.0
    )
    places, rows = (8.0, 13.0), []
    while water.time < 6.0:
        advance(water, rtol=1e-7)
        rows.append([water.time, *(gauges.level(water, (x, 0.05)) - depth for x in places)])
    t, first, second = np.array(rows).T
    half = [np.interp(0.5 * height, eta[: eta.argmax()], t[: eta.argmax()]) for eta in (first, second)]
    assert second.max() == pytest.approx(height, rel=0.12)
    assert 5.0 / (half[1] - half[0]) == pytest.approx(wave.speed, rel=0.01)


@given(hnp.arrays(float, (1, 3), elements=st.floats(-1, 1).filter(lambda v: abs(v) > 1e-6)))
def test_wet_shares_of_a_triangle(phi):
    """Wet and dry side make up the triangle, and the share is that of 10 000 points in it."""
    wet, dry = wet_shares(phi), wet_shares(-phi)
    np.testing.assert_allclose(wet + dry, 1 / 3, atol=1e-12)
    s, t = np.meshgrid((np.arange(200) + 0.5) / 200, (np.arange(200) + 0.5) / 200)
    inside = s + t < 1
    corner = np.column_stack([(1 - s - t)[inside], s[inside], t[inside]])
    under = (corner @ phi[0] < 0.0)[:, None]
    np.testing.assert_allclose(wet[0], (under * corner).mean(axis=0), atol=0.015)


def test_records_are_straight_lines_between_their_times():
    flow = waves.record([0, -1, 0], [0.0, 2.0], [1.0, 3.0], [0.0, 4.0])
    assert flow.level(0.5) == 1.5
    np.testing.assert_allclose(flow.velocity(np.zeros((2, 3)), 1.0), [[0, -2, 0]] * 2)
    assert flow.level(9.0) == 3.0


def pulse(place, time, height=0.002, depth=0.25, length=6.0, angle=0.5):
    """Level over the still water and velocity (n, 3) of a long wave of one crest that runs at an angle to x."""
    c = np.sqrt(9.81 * depth)
    way = np.array([np.cos(angle), np.sin(angle)])
    phase = (
        place[:, :2] @ way + 0.5 * length - c * time
    ) / length  # 0 to 1 from the end of the crest to its head
    level = np.where((phase > -1.0) & (phase < 0.0), height * np.sin(np.pi * phase) ** 2, 0.0)
    return level, np.column_stack([(c * level / (depth + level))[:, None] * way, np.zeros(len(place))])


def test_wave_that_comes_through_four_sides_at_an_angle_is_the_same_inside():
    """As from a model of the sea around: a record along each side, whose places say when the crest is where."""
    size, times = 6.0, np.linspace(0.0, 9.0, 361)
    mesh = box_mesh(np.zeros(3), [size, size, 0.375], [0.5, 0.5, 0.125])
    places, sides = np.linspace(0.0, size, 13), []
    for axis in (0, 1):
        for end, sign in ((0.0, 1.0), (size, -1.0)):
            points = np.zeros((len(places), 3))
            points[:, axis], points[:, 1 - axis] = end, places
            inward = sign * np.eye(3)[axis]
            told = [pulse(points, t) for t in times]
            level = np.array([a for a, _ in told]) + 0.25
            speed, sideways = (np.array([u[:, k] for _, u in told]) for k in (axis, 1 - axis))
            flow = waves.record_along(inward, times, places, level, sign * speed, sideways)
            sides.append(Side.of(mesh, lambda n, _, inward=inward: n @ inward < -0.5, flow))
    water = Water(
        mesh,
        cut_domain(mesh, ConvexBodies.empty()),
        lambda x: x[:, 2] - 0.25,
        WaterParameters(),
        lambda n, _: n[:, 2] > 0.5,
        None,
        Sides(sides),
    )
    middle, rows = np.array([[3.0, 3.0, 0.1]]), []
    while water.time < 6.8:
        advance(water, min(water.stable_step(), 0.1), rtol=1e-6)
        (u, v, _), level = gauges.velocity(water, middle)[0], gauges.level(water, middle[0, :2])
        rows.append((water.time, level - 0.25, pulse(middle, water.time)[0][0], np.arctan2(v, u)))
    time, found, wanted, angle = np.array(rows).T
    crest = found.argmax()
    assert found[crest] == pytest.approx(wanted.max(), rel=0.1)
    assert time[crest] == pytest.approx(time[wanted.argmax()], abs=0.2)
    assert angle[crest] == pytest.approx(0.5, abs=0.05)


def test_the_start_of_an_inflow_is_in_the_books():
    """Its nodes are given their velocity at once and without a force, half a cell of water, and the pressure that sets
    the rest in motion acts over half of the way: what the water gains, less what damping takes of it again."""
    water = tank([2, 1, 1], 0.25, lambda x: x[:, 2] - 0.5, waves.steady(np.array([1.0, 0, 0]), 0.5, 0.8))
    advance(water, 1e-4)
    change = dict(water.report.energy_change)
    lost = -change.pop("damping and limit")
    assert lost > 0.0
    assert sum(change.values()) > 40.0
    assert water.energy_through_sides() == pytest.approx(sum(change.values()), rel=0.02)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_crest_and_trough_of_an_n_wave_have_its_height_and_pass_as_far_apart_as_in_theory(sign):
    """η ~ sech²θ tanh θ is largest at tanh²θ = 1/3, and θ = γ c t with γ d = 3/2 (3/4)^(1/4) sqrt(H/d) (Tadepalli and
    Synolakis 1994): steeper waves are shorter with the root of their height."""
    depth, height, gravity, middle = 2.0, 0.1, 9.81, 5.0
    flow = waves.n_wave([1.0, 0.0, 0.0], -0.5, depth, height, gravity, middle, sign)
    times = np.linspace(0.0, 10.0, 20_001)
    elevation = np.array([flow.level(time) for time in times]) - (-0.5 + depth)
    assert elevation.max() == pytest.approx(height, rel=1e-6)
    assert elevation.min() == pytest.approx(-height, rel=1e-6)
    apart = times[np.argmax(elevation)] - times[np.argmin(elevation)]
    rate = 1.5 * 0.75**0.25 * np.sqrt(height / depth) * np.sqrt(gravity * depth) / depth
    assert apart == pytest.approx(sign * 2.0 * np.arctanh(np.sqrt(1.0 / 3.0)) / rate, abs=2e-3)
    speed = flow.velocity(np.zeros((1, 3)), times[np.argmax(elevation)])[0, 0]
    assert speed * (depth + elevation.max()) == pytest.approx(np.sqrt(gravity * depth) * height)
