"""Remarks on buildings that are full of water at the start."""

import pytest

from coupler.case.case import Case
from coupler.checks.insides import inside_remarks


def remarked(fills, **building):
    house = {
        "name": "house",
        "lower": [3, 0.5, 0],
        "size": [3, 3, 2],
        "wall_thickness": 0.25,
        "block": [1, 0.5],
    }
    table = {
        "case": {"title": "a house"},
        "time": {"end": 1.0},
        "tank": {"lower": [0, 0, 0], "upper": [9, 4, 3], "cell": 0.5},
        "water": {"fill": [{"lower": low, "upper": high} for low, high in fills]},
        "structure": {"building": [house | building]},
        "contact": {},
        "joints": {"strength": 2e5, "opening_at_failure": 2e-3},
    }
    return list(inside_remarks(Case.model_validate(table)))


def test_a_closed_house_that_a_box_of_water_covers_is_remarked_on():
    """Otherwise it stands in 1.5 m of water with a load of 1.7 N, for water inside it that nobody meant."""
    (said,) = remarked([([0, 0, 0], [9, 4, 1.5])])
    assert "water.fill[0] fills 'house' inside, too, 1.5 m deep" in said
    assert remarked([([0, 0, 0], [9, 4, 1.5])], turn=0.3)


@pytest.mark.parametrize(
    ("fills", "building"),
    [
        ([([0, 0, 0], [3, 4, 1.5]), ([6, 0, 0], [9, 4, 1.5]), ([3, 0, 0], [6, 0.5, 1.5])], {}),
        ([([0, 0, 0], [9, 4, 1.5])], {"opening": [{"wall": "x-", "lower": [1, 0], "size": [1, 1.5]}]}),
        ([([0, 0, 0], [9, 4, 1.5])], {"lower": [3, 0.5, 1.5], "size": [3, 3, 1.5]}),
    ],
)
def test_houses_beside_the_water_with_a_door_in_it_or_above_it_are_not(fills, building):
    assert remarked(fills, **building) == []
