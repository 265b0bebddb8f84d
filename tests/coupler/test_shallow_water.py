"""The shallow-water equations that fronts over thin water are judged by, against Stoker's exact wave."""

import numpy as np
import pytest

from coupler.commands.verify.figures import named_values
from coupler.commands.verify.shallow_water import depths

G = 9.81
UPPER, LOWER = 0.15, 0.018
KNOWN = named_values("wave_closed_forms")
SPEED = KNOWN[f"stoker_h0={UPPER}_h1={LOWER}_bore_speed"]


def dam(rows, columns, cell, solid=None):
    x = (np.arange(rows) + 0.5) * cell
    depth = np.where(x < 0.5 * rows * cell, UPPER, LOWER)[:, None] * np.ones((1, columns))
    return depth, np.zeros(depth.shape, bool) if solid is None else solid


@pytest.mark.parametrize("cell", [0.05, 0.025])
def test_a_bore_into_still_water_has_the_speed_of_theory(cell):
    """Half-way up its face, over 1.5 m."""
    rows = round(5.0 / cell)
    places = {"near": (round(3.0 / cell), 1), "far": (round(4.5 / cell), 1)}
    found = depths(*dam(rows, 3, cell), cell, 1.9, places, 0.0, G)
    middle = 0.5 * (LOWER + found["near"][-1])
    arrival = [found["t"][np.argmax(found[name] > middle)] for name in places]
    assert 1.5 / (arrival[1] - arrival[0]) == pytest.approx(SPEED, rel=0.02)


def test_walls_keep_the_water_and_mirrored_basins_do_the_same():
    """A basin with a pillar: what is seen before the water reaches the open end is mirrored with the basin."""
    depth, solid = dam(60, 20, 0.05)
    solid[36:40, 4:10] = True
    seen = {f"{i},{j}": (i, j) for i in (28, 35, 41, 50) for j in (3, 7, 12)}
    mirrored = {name: (i, 19 - j) for name, (i, j) in seen.items()}
    one = depths(depth, solid, 0.05, 0.8, seen, 0.01, G)
    other = depths(depth[:, ::-1].copy(), solid[:, ::-1].copy(), 0.05, 0.8, mirrored, 0.01, G)
    for name in seen:
        np.testing.assert_allclose(other[name], one[name], rtol=1e-9, atol=1e-12)
    assert one["35,7"].max() > 1.3 * one["35,12"].max()  # before the pillar the water is held up


def test_water_at_rest_stays_at_rest_around_walls():
    depth, solid = np.full((30, 20), 0.2), np.zeros((30, 20), bool)
    solid[10:15, 5:9] = True
    found = depths(depth, solid, 0.1, 1.0, {"beside": (9, 6), "corner": (29, 19)}, 0.01, G)
    assert np.ptp(found["beside"]) == 0.0
    assert np.ptp(found["corner"]) == 0.0
