"""Remarks on fronts that run over a dry bed with friction, on cells too high for the slow water below them."""

import pytest

from coupler.checks.remarks import remarks
from tests.coupler.water_cases import TANK, case

COLUMN = {"fill": [{"lower": [0, 0, 0], "upper": [0.8, 0.2, 0.8]}], "walls": "friction", "roughness": 3e-5}
SENSOR = [{"kind": "patch", "name": "P", "at": [1.999, 0.1, 0.05], "radius": 0.01, "normal": [-1, 0, 0]}]
LAYER = {"lower": [0.8, 0, 0], "upper": [2, 0.2, 0.1]}
WALL = {"solid": [{"name": "wall", "size": [0.1, 0.4, 1.2], "centre": [0.85, 0.1, 0.5]}]}


def told(water=None, tank=None, gauge=SENSOR, **more):
    found = case(COLUMN | (water or {}), tank=TANK | (tank or {}), gauge=gauge, **more)
    return [text for text in remarks(found) if "runs out over a dry bed" in text]


def test_a_dam_break_over_a_rough_dry_bed_is_told_of_flat_cells():
    """On cubes of an eighth of the depth the pressure at the foot of a wall is too high; with flat cells up to an
    eighth of the depth, as high as a 64th of it or a fourth of their length, it is right (P38)."""
    (found,) = told()
    assert "water.fill[0], 0.8 m deep" in found
    assert "cells 0.1 m high (1/8 of the depth)" in found
    assert '[[tank.stretch]] along = "z", upper = 0.1, cell = 0.025' in found
    finer = TANK | {"cell": 0.8 / 24}
    assert told(tank=finer)[0].endswith("upper = 0.1, cell = 0.013")


def test_what_the_remark_advises_silences_it():
    stretch = [{"along": "z", "upper": 0.1, "cell": 0.025}]
    assert told(tank={"stretch": stretch}) == []
    assert told(tank={"stretch": [{"along": "x", "upper": 0.5, "cell": 0.05}]})


@pytest.mark.parametrize(
    ("water", "more"),
    [
        ({"walls": "slip", "roughness": None}, {}),
        ({"viscosity": 1.0}, {}),
        ({"fill": [{"lower": [0, 0, 0], "upper": [2, 0.2, 0.8]}]}, {}),
        ({"fill": [{"lower": [0, 0, 0.2], "upper": [0.8, 0.2, 0.8]}]}, {}),
        ({"fill": [*COLUMN["fill"], LAYER]}, {}),
        ({"sea": [{"side": "x+", "level": 0.3}]}, {}),
        ({}, {"gauge": []}),
        ({}, WALL),
        ({}, {"tank": {"cell": 0.8 / 48}}),
    ],
    ids=["slip", "viscous", "still", "falls", "wet bed", "sea", "no loads", "held by a wall", "fine cells"],
)
def test_it_is_silent_where_flat_cells_are_no_help(water, more):
    assert told(water, **more) == []
