"""Momentum that goes with the volume, and where it counts."""

import numpy as np
import pytest

from fluid.numerics.fields import places_of
from fluid.step.carried import carried_by_fluxes
from fluid.surface.volume import Shift
from fluid.transport.passed_on import _down, pass_on
from fluid.transport.volume_transport import carry_volume
from kernels import threads
from tests.fluid.scenes import advance, column, tank


def test_velocity_carried_with_the_volume_keeps_momentum_and_range():
    """Fast water on slow: Σ W u to round-off, and no component beyond the range of what was there."""
    water = tank([2, 0.25, 0.75], 0.125, column(0.6, 0.5))
    while water.time < 0.25:
        advance(water)
    before = water.velocity.copy()
    before[:, 0] += np.sin(9.0 * water.topology.nodes[:, 0])
    u = before.copy()
    volume, _ = carry_volume(water.flux.over(water.topology, water.stable_step()), water.stable_step(), u)
    assert volume @ u == pytest.approx(water.nodal_water @ before, rel=1e-10, abs=1e-12)
    wet = volume > 0.0
    assert np.all(u[wet] <= before.max(axis=0) + 1e-12)
    assert np.all(u[wet] >= before.min(axis=0) - 1e-12)


def test_momentum_counts_at_jumps_and_in_fast_water_only():
    """A low wave goes along the paths alone. In a front on a dry bed there is no jump, but water faster than the wave
    of a cell; where a dam breaks into two cells of water there is a jump."""
    wave = tank([2, 0.125, 1.0], 0.125, lambda x: x[:, 2] - 0.55 - 0.005 * np.cos(np.pi * x[:, 0]))
    dam = column(0.8, 0.8)
    dry = tank([2, 0.125, 1.0], 0.125, dam)
    bore = tank([2, 0.125, 1.0], 0.125, lambda x: np.minimum(dam(x), x[:, 2] - 0.25))
    for water in (wave, dry, bore):
        while water.time < 0.25:
            advance(water)
    dt = wave.stable_step()
    assert carried_by_fluxes(wave, dt, 0.6, wave.kick_factor()).weight is None
    front = carried_by_fluxes(dry, dt, 0.6, dry.kick_factor())
    assert front.weight.max() == 0.0
    assert front.fast.max() > 0.5
    slow = np.linalg.norm(dry.velocity, axis=1) < np.sqrt(9.81 * 0.125)
    assert front.fast[slow].max() == 0.0
    assert carried_by_fluxes(bore, dt, 0.6, bore.kick_factor()).weight.max() > 0.5


def test_a_thick_liquid_keeps_its_own_viscosity_however_fast_it_is():
    """A vortex between free-slip walls decays as e^(-2 π² ν t). Its liquid is far faster than the wave of a cell; the
    momentum of fast water, of first order, made it lose a tenth more."""
    viscosity, n = 0.01, 24
    water = tank(
        [1, 1 / n, 1], 1 / n, lambda x: x[:, 2] - 100.0,
        gravity=0.01, speed_limit=10.0, density=1.0, viscosity=viscosity,
    )  # fmt: skip
    x, z = np.pi * water.topology.nodes[:, [0, 2]].T
    water.velocity[:, 0], water.velocity[:, 2] = np.sin(x) * np.cos(z), -np.cos(x) * np.sin(z)
    water.set_cell_velocity(water.velocity[water.topology.cells].mean(axis=1))
    before = water.nodal_water @ (water.velocity**2).sum(axis=1)
    while water.time < 0.8 - 1e-9:
        advance(water, 0.02)
    left = water.nodal_water @ (water.velocity**2).sum(axis=1) / before
    assert left == pytest.approx(np.exp(-4.0 * np.pi**2 * viscosity * water.time), rel=0.02)


def gain_of_a_column(viscosity):
    """A column of 3.5 by 3.7 cells half a metre wide falls and spreads over the floor: the largest rise of its energy
    beyond the work of viscosity, and that work [J]."""
    cell = 0.504201
    water = tank([11 * cell, 2 * cell, 8 * cell], cell, column(1.74, 1.856), viscosity=viscosity)
    start, taken, rise = water.kinetic_energy() + water.potential_energy(), 0.0, 0.0
    while water.time < 0.83:
        advance(water, 0.0208)
        taken -= water.report.energy_change.get("viscosity and friction", 0.0)
        rise = max(rise, water.kinetic_energy() + water.potential_energy() + taken - start)
    return rise, taken


def test_a_column_of_a_thick_liquid_gains_no_more_than_one_of_water():
    """But for a tenth of what viscosity takes. Its tip is at |u| h/ν = 20 to 30: as long as it followed the paths up to
    100, it gained a quarter of that in excess; and a third as long as dry nodes changed on their own (`beyond`)."""
    (thin, _), (thick, taken) = gain_of_a_column(0.0), gain_of_a_column(102.0)
    assert thick - thin < 0.15 * taken


@pytest.mark.parametrize("wide", [1, 3])
def test_a_bore_over_thin_water_keeps_its_momentum(wide):
    """A dam of eight layers breaks over water 0.4 of a layer deep, on cubes and on cells three times as wide as high.
    The momentum is what the water at rest behind it pushes, ½ ρ g (h² - h₁²) a metre of width; 2.6 and 2.7 % are lost.
    With the velocity of the water below in the face of the bore, and momentum that goes with the linear equation of the
    correction of the level set alone, it was 4.2 and 10.5 %, and the bore 16 % too slow on the wide cells; with the
    first cured, 3.8 and 5.4 %."""
    depth, thin, layer = 0.15, 0.0075, 0.15 / 8
    size = layer * np.array([81, 2 * wide, 12])
    dam = 0.5 * size[0]
    level = lambda x: np.minimum(np.maximum(x[:, 0] - dam, x[:, 2] - depth), x[:, 2] - thin)  # noqa: E731
    water = tank(size, (wide * layer, wide * layer, layer), level)
    while water.time < 0.4:
        advance(water)
    found = water.nodal_water @ water.velocity[:, 0]
    pushed = 0.5 * 9.81 * (depth**2 - thin**2) * size[1] * water.time
    assert found == pytest.approx(pushed, rel=0.045)


def test_what_the_correction_moves_takes_its_momentum_along_even_past_a_node_without_room():
    """Volume that goes from a front to the water behind it takes Σ W u with it. A node whose room a body has taken
    meanwhile still holds the water that the fluxes brought; it took the run down by a division by zero."""
    water = tank([2, 0.125, 1.0], 0.125, lambda x: np.minimum(column(0.8, 0.8)(x), x[:, 2] - 0.25))
    while water.time < 0.25:
        advance(water)
    found = carried_by_fluxes(water, water.stable_step(), 0.6, water.kick_factor())
    t, u, holds = water.topology, found.velocity.copy(), found.water > 0.0
    band = np.flatnonzero(holds & t.active)
    front, behind = band[np.argmax(u[band, 0])], band[np.argmin(u[band, 0])]
    gained, volume = np.zeros(len(u)), 0.2 * min(found.water[front], found.water[behind])
    gained[front], gained[behind] = -volume, volume
    room = t.node_volume.copy()
    room[band[len(band) // 2]] = 0.0
    before = found.water @ u
    nothing = Shift(band, places_of(band, len(u)), np.zeros(len(band)), 5.0, t.node_size)
    graph, everywhere = water.graph_for(water.listed), np.ones(len(u))
    gains = (gained, np.zeros(len(u)), np.zeros(len(u)))
    pass_on(graph, nothing, gains, everywhere, found.water, room, u)
    assert np.isfinite(u).all()
    after = (found.water + gained) @ u
    assert after[0] == pytest.approx(before[0], rel=0.01)
    assert not np.array_equal(u, found.velocity)


def test_a_node_that_holds_next_to_nothing_hands_on_all_that_comes_to_it():
    """Volume runs down along a tank, past a layer of nodes that hold a millionth of what they could: Σ W and Σ W u stay
    to round-off, no velocity leaves the range of those before, and as much arrives below as without that layer. When a
    node gave no more than it held, next to nothing did, and its momentum stayed above the layer."""
    water = tank([2, 0.25, 0.5], 0.125, lambda x: x[:, 2] - 10.0)
    t = water.topology
    x, band = t.nodes[:, 0], np.flatnonzero(t.active)
    arrived = []
    for emptied in (0.0, 1.0):
        held, u = 0.5 * t.node_volume, np.zeros((len(x), 3))
        held[(np.abs(x - 1.0) < 0.01) & (emptied > 0.0)] *= 2e-6
        u[:, 0], u[:, 1] = np.where(x < 0.95, 1.0, 0.0), np.sin(5.0 * x)
        total, before, below = held.sum(), held @ u, held[x > 1.05].sum()
        height, edges = -0.02 * np.clip(x[band], 0.5, 1.5), water.graph_for(band).edges
        _down(band, places_of(band, len(x)), edges, height, t.node_size, t.node_volume, held, u)
        assert held.min() >= 0.0
        assert held.sum() == pytest.approx(total, rel=1e-12)
        np.testing.assert_allclose(held @ u, before, atol=1e-12 * total)
        assert u[:, 0].min() > -1e-12
        assert u[:, 0].max() < 1.0 + 1e-12
        arrived.append(held[x > 1.05].sum() - below)
    assert arrived[0] > 1e-4
    assert arrived[1] == pytest.approx(arrived[0], rel=1e-3)


def handed_on_one_by_one(band, edges, height, spacing, capacity, held, u):
    """The nodes of the band in order of falling height, each of which gives its share to those below: W and u after."""
    held, u, came = held.copy(), u.copy(), np.zeros((len(held), 4))
    level = dict(zip(band, height))
    for i in band[np.argsort(-height, kind="stable")]:
        left = held[i] + came[i, 3]
        before, held[i] = held[i], left
        if left <= 1e-9 * capacity[i]:
            continue
        u[i] = (before * u[i] + came[i, :3]) / left
        row = edges.row[i]
        below = []
        for s in range(edges.start[row], edges.start[row + 1]):
            j = edges.neighbour[s]
            if j in level and level[j] < level[i] and edges.stiffness[s] < 0.0:
                below.append(
                    (j, 0.5 * (spacing[i] + spacing[j]) * (level[i] - level[j]), -edges.stiffness[s])
                )
        total = sum(fall * conducts for _, fall, conducts in below)
        if total > 0.0:
            share = min(1.0, left / total)
            held[i] = max(left - share * total, 0.0)
            for j, fall, conducts in below:
                moved = share * fall * conducts
                came[j, 3] += moved
                came[j, :3] += moved * u[i]
    return held, u


@pytest.mark.parametrize("number", [1, 4])
def test_nodes_hand_on_from_the_highest_down_on_any_number_of_threads(number):
    """To the last bit what a list in order of falling height gives, with nodes of equal height and nodes that hold next
    to nothing: the sum of what comes to a node has an order, whichever thread hands on from there."""
    water = tank([2, 0.25, 0.5], 0.125, lambda x: x[:, 2] - 10.0)
    t, draw = water.topology, np.random.default_rng(3)
    band = np.flatnonzero(t.active)
    edges, height = water.graph_for(band).edges, np.round(2.0 * draw.normal(size=len(band)))
    held = t.node_volume * draw.choice([0.0, 1e-10, 0.01, 1.0], len(t.nodes))
    u = draw.normal(size=(len(held), 3))
    expected = handed_on_one_by_one(band, edges, height, t.node_size, t.node_volume, held, u)
    threads.use(number, least=1)
    try:
        for _ in range(5):
            found = held.copy(), u.copy()
            _down(band, places_of(band, len(held)), edges, height, t.node_size, t.node_volume, *found)
            np.testing.assert_array_equal(found[0], expected[0])
            np.testing.assert_array_equal(found[1], expected[1])
    finally:
        threads.use(1)
