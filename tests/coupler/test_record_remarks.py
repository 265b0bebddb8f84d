"""Remarks on records of inflows, and on sides whose water stands at another level at the start."""

import numpy as np
import pytest

from coupler.case.case import Case
from coupler.checks.water import water_remarks

TIME = np.linspace(0.0, 40.0, 81)
RISE = 0.2 * np.sin(TIME / 3.0) ** 2


@pytest.fixture
def remarked(tmp_path):
    """Remarks on a tank of still water 1.5 m deep, beside a record of a wave of 0.2 m, of which some are changed."""

    def made(time=TIME, level=1.5 + RISE, velocity=2.6 * RISE, **more):
        path = tmp_path / "w.csv"
        np.savetxt(
            path,
            np.column_stack([time, level, velocity]),
            delimiter=",",
            header="time,level,velocity",
            comments="",
        )
        return of({"inflow": [{"side": "x-", "kind": "record", "path": str(path), **more}]})

    return made


def of(water, fill=None):
    still = {"lower": [0, 0, 0], "upper": [20, 2, 1.5], **(fill or {})}
    table = {
        "case": {"title": "a record"},
        "time": {"end": 20.0},
        "tank": {"lower": [0, 0, 0], "upper": [20, 2, 3], "cell": 0.25, "open": ["z+", "x+"]},
        "water": {"fill": [still], **water},
    }
    return list(water_remarks(Case.model_validate(table)))


def test_a_record_that_fits_is_not_remarked_on(remarked):
    assert remarked() == []


def test_a_record_that_begins_at_another_level_than_the_water_is_remarked_on(remarked):
    """Half a metre of datum; a step of it collapsed in the first step."""
    (said,) = remarked(level=2.0 + RISE)
    assert "w.csv begins at z = 2 m, but [[water.fill]] reaches z = 1.5 m beside it at x-" in said
    assert remarked(level=2.0 + RISE, zero=0.5) == []


def test_a_record_whose_wave_does_not_come_in_is_remarked_on(remarked):
    """Milliseconds for seconds, or a tsunami that arrives after half an hour; start puts it right."""
    (said,) = remarked(time=1000.0 * TIME)
    assert "changes by 0.00022 m during the run (0 to 20 s), by 0.2 m in all" in said
    waiting = np.append(0.0, 1800.0 + TIME)
    level, velocity = np.append(1.5, 1.5 + RISE), np.append(0.0, 2.6 * RISE)
    (said,) = remarked(time=waiting, level=level, velocity=velocity)
    assert "most at 1833 s of the run" in said
    assert remarked(time=waiting, level=level, velocity=velocity, start=1800.0) == []


def test_velocities_in_centimetres_a_second_are_remarked_on(remarked):
    (said,) = remarked(velocity=260.0 * RISE)
    assert "velocities of 52 m/s, 13 times sqrt(g h) of its largest depth (1.7 m)" in said


def test_a_sea_at_another_level_than_the_water_is_remarked_on():
    sea = {"sea": [{"side": "x+", "level": 1.0}]}
    assert "the sea stands at z = 1 m, but [[water.fill]] reaches z = 1.5 m beside it at x+" in of(sea)[0]
    assert of({"sea": [{"side": "x+", "level": 1.5}]}) == []
    assert of(sea, {"upper": [10, 2, 1.5]}) == []  # a dam before the sea
    assert of(sea, {"slope": [0.02, 0.0]}) == []
