"""A body that swings in still water neither gains nor hides energy, at long steps and at any density."""

import numpy as np
import pytest

from coupler.scene.build import build
from tests.fakes import no_clock
from tests.physics.scenes import case, run

PERIOD = 0.92
"""Of the box of half the density of water [s], about."""


def let_go(density=500.0, lift=2e-3, step=0.02, passes=2, cell=0.05, pool_lowered=False):
    """A slice of a long box, two cells wide, let go `lift` [m] above its place of rest; draught 0.1 m at 500 kg/m3.
    pool_lowered: by what the box leaves of its room, so that it comes to rest where it would without the lift."""
    width = 2.0 * cell
    height, level = 0.2, 0.5
    centre = level - density / 1000.0 * height + 0.5 * height + lift
    level -= pool_lowered * lift * 0.3 / 0.7
    found = case(
        time={"end": 16.0, "step_max": step},
        tank={"lower": [0, 0, 0], "upper": [1, width, 0.8], "cell": cell},
        water={"fill": [{"lower": [0, 0, 0], "upper": [1, width, level]}]},
        structure={
            "density": density,
            "block": [{"name": "box", "centre": [0.5, cell, centre], "size": [0.3, width, height]}],
        },
        contact={"stiffness": 1e6, "friction": 0.0},
        coupling={"passes": passes},
    )
    return build(found, no_clock).coupling


def swing(end, **scene):
    """Time (n,) [s], height (n,) [m] of the centre, and the balances of every step."""
    coupling, time, height, balance = let_go(**scene), [], [], []

    def note(record):
        time.append(coupling.time)
        height.append(coupling.structure.centre()[0, 2])
        balance.append(record.balance)

    try:
        run(coupling, end, note)
    finally:
        coupling.structure.close()
    return np.array(time), np.array(height), balance


def sizes(time, height, period=PERIOD):
    """Half of the range of every period [m]."""
    number = (time / period).astype(int)
    return np.array([0.5 * np.ptp(height[number == k]) for k in range(int(time[-1] / period))])


@pytest.mark.parametrize("passes", [1, 2])
def test_a_small_swing_at_the_longest_step_does_not_grow(passes):
    """With the load of the place at the start of a step it grows by a tenth a period at 20 ms."""
    time, height, _ = swing(4.0, passes=passes)
    size = sizes(time, height)
    assert size[0] == pytest.approx(1.4e-3, rel=0.1)
    assert np.all(size[1:] < size[:-1])


def test_the_error_of_a_small_swing_is_measured_by_its_own_energy():
    """ρ g A z²/2 is 0.6 mJ in a tank of 120 J: the scale of the error is a millijoule."""
    _, _, balance = swing(1.5)
    assert 5e-4 < balance[-1].input_energy < 2e-3
    assert max(b.energy_error for b in balance) < 1e-3
    lost = np.array([b.numerical_dissipation for b in balance])
    assert np.ptp(lost[40:]) < 1e-4


@pytest.mark.parametrize("density", [20.0, 200.0, 900.0])
def test_no_density_swings_higher(density):
    """A plate of a tenth of a cell's draught, a light and a heavy box, 2 mm above their place."""
    time, height, _ = swing(2.0, density=density)
    late, early = (np.ptp(height[part]) for part in (time > 1.0, time <= 1.0))
    assert late < 1.05 * early


@pytest.mark.nightly
@pytest.mark.parametrize("step", [0.005, 0.01, 0.02])
def test_a_swing_dies_alike_at_any_step(step):
    """Over 17 periods, let go by 20 mm: the loss, 10 % a period, is that of cells and sharp edges, not of the step."""
    time, height, balance = swing(16.0, lift=0.02, step=step)
    size = sizes(time, height)
    assert (size[-1] / size[2]) ** (1.0 / (len(size) - 3)) == pytest.approx(0.90, abs=0.02)
    assert max(b.energy_error for b in balance) < 0.02


@pytest.mark.nightly
def test_what_a_large_swing_loses_at_its_edges_does_not_depend_on_the_cells():
    """In its second period a box let go by 20 mm loses a seventh of its energy at the edges of its bottom, as by drag,
    with four cells over its draught as with eight. Of a swing of 2 mm a fortieth goes: drag falls with the square."""

    def share(lift, cell):
        time, _, balance = swing(2.0 * PERIOD, lift=lift, step=0.01, cell=cell, pool_lowered=True)
        lost = np.array([b.numerical_dissipation for b in balance])
        energy = 0.5 * 1000.0 * 9.81 * 0.3 * 2.0 * cell * lift**2 / 0.7
        return (lost[-1] - np.interp(PERIOD, time, lost)) / energy

    coarse, fine = share(0.02, 0.025), share(0.02, 0.0125)
    assert coarse == pytest.approx(0.14, abs=0.02)
    assert fine == pytest.approx(coarse, rel=0.15)
    assert share(0.002, 0.025) < 0.3 * coarse
