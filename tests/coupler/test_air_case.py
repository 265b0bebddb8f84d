"""Trapped air of a case: what is refused, what is measured, and that open air loads none of it."""

import os
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from coupler.checks.read_case import load
from coupler.results.gauges import Followed
from coupler.run.directory import RunDirectory
from coupler.run.execute import execute_case
from coupler.run.forecast import forecast
from coupler.run.summary import read_summary
from coupler.run.trapped_air import described_air, note_opened, opened_in_all
from coupler.scene.build import build
from coupler.step.limits import Diverged, check_air
from fluid.air.cushions import Opened
from fluid.air.gas import AIR_DENSITY
from tests.coupler.water_cases import FILL, case, reported, run
from tests.fakes import no_clock

CLOSED = {"lower": [0, 0, 0], "upper": [2, 0.2, 1], "cell": 0.1, "smooth": ["y-", "y+"], "open": []}
TRAPPED = {"air": {"model": "trapped"}}
SOLID = [{"centre": [1.0, 0.1, 0.5], "size": [0.2, 0.2, 0.2]}]


@pytest.mark.parametrize(
    ("water", "more", "message"),
    [
        (
            {"air": {"vent": [{"at": [1, 0.1, 0.9], "area": "1 cm2"}]}},
            {},
            "water.air.vent: open air needs no orifices",
        ),
        ({"air": {"gamma": 1.2}}, {}, "water.air.gamma: is for trapped air, of which open air has none"),
        ({"air": {"atmospheric": 9e4}}, {}, "water.air.atmospheric: is for trapped air"),
        ({"air": {"smallest": 2}}, {}, "water.air.smallest: is for trapped air"),
        (TRAPPED, {"solid": SOLID}, 'write water.covers = "multiple"'),
        (
            {"air": {"model": "trapped", "vent": [{"at": [1, 0.1, 1.9], "area": "1 cm2"}]}},
            {},
            "water.air.vent.0.at.2: z = 1.9 m lies outside of the tank (0 to 1 m)",
        ),
        (
            {"air": {"model": "trapped", "vent": [{"at": [1, 0.1, 0.9], "area": "1 cm2", "block": "roof"}]}},
            {},
            "there is no block 'roof'",
        ),
        (
            {},
            {"gauge": [{"kind": "air", "name": "a", "at": [1, 0.1, 0.9]}]},
            "an air gauge measures trapped air",
        ),
    ],
)
def test_wrong_air_is_refused_with_its_place(water, more, message):
    assert any(message in line for line in reported(water, **more)), reported(water, **more)


def test_a_gauge_reads_the_pocket_and_the_books_hold_its_energy():
    """A closed tank that water falls into: the air keeps its volume, for water has none to give, and its amount."""
    gauge = [{"kind": "air", "name": "above", "at": [1.5, 0.1, 0.9]}]
    fill = [{"lower": [0, 0, 0], "upper": [0.5, 0.2, 0.8]}]
    found = case(TRAPPED | {"fill": fill}, tank=CLOSED, gauge=gauge)
    coupling, record, rows = run(found, 0.3)
    volume = np.array([row["above_volume"] for row in rows])
    np.testing.assert_allclose(volume, 0.4 - 0.08, rtol=2e-5)
    assert np.abs([row["above_pressure"] for row in rows]).max() < 50.0
    assert abs(record.balance.air_energy) < 0.01
    assert record.balance.energy_error < 0.02
    assert record.momentum.error < 1e-10
    described = described_air(build(found, no_clock).coupling.water)
    assert "one pocket, 0.32 m3 in all: wholly under water they would lift 3.139 kN" in described
    row = next(row for row in forecast(found).rows if row.name == "trapped air")
    assert row.value == 1
    assert row.remark in described
    with pytest.raises(Diverged, match=r"a pocket of trapped air between .* \(limits.air_pressure\).*vent"):
        check_air(0.3, coupling.water, 1e-9)


@pytest.mark.parametrize("step", [0.005, 0.03])
@pytest.mark.parametrize("area", [1e-3, 2e-3, 1e-2])
def test_the_pressure_behind_a_vent_is_that_of_its_orifice_at_any_step(area, step):
    """A closed tank that 16 l/s flow into: what leaves through a vent of 10, 20 or 100 cm² takes 427, 107 or 4 Pa.
    The work of the inflow on the air is lost there, and is in the books."""
    tank = {"lower": [0, 0, 0], "upper": [2, 0.4, 1], "cell": 0.2, "open": []}
    vent = {"at": [1.5, 0.2, 0.85], "area": area}
    water = {
        "air": {"model": "trapped", "smallest": 1.0, "vent": [vent]},
        "fill": [{"lower": [0, 0, 0], "upper": [2, 0.4, 0.4]}],
        "inflow": [{"kind": "steady", "side": "x-", "level": 0.4, "velocity": 0.1}],
    }
    gauge = [{"kind": "air", "name": "above", "at": [1.0, 0.2, 0.85]}]
    end = 2.0 if area < 2e-3 else 0.5
    found = case(water, tank=tank, gauge=gauge, time={"end": end, "step_max": step})
    coupling, record, rows = run(found, end)
    rate = 0.016 / (0.6 * area)
    late = [row["above_pressure"] for row in rows[-5:]]
    np.testing.assert_allclose(late, 0.5 * AIR_DENSITY * rate**2, rtol=0.02)
    assert record.balance.energy_error < 0.01
    assert coupling.water.air.lost > 0.0


def test_a_gauge_reads_the_next_pocket_at_its_place_once_the_first_is_lost():
    fill = [{"lower": [0, 0, 0], "upper": [2, 0.2, 0.5]}]
    water = build(case(TRAPPED | {"fill": fill}, tank=CLOSED), no_clock).coupling.water
    gauge, place, first = Followed(), np.array([1.0, 0.1, 0.8]), water.air
    np.testing.assert_allclose(gauge.read(water, place), [0.0, 0.2], atol=1e-9)
    water.air = replace(first, name=np.array([2]), mean_pressure=np.array([50.0]))
    np.testing.assert_allclose(gauge.read(water, place), [50.0, 0.2])
    np.testing.assert_array_equal(gauge.read(water, [1.0, 0.1, 0.1]), [50.0, water.pocket_volumes()[0]])
    label, none = np.where(first.label > 0, 0, first.label), np.zeros(0)
    water.air = replace(first, label=label, name=none, mean_pressure=none, reference=none)
    assert np.isnan(gauge.read(water, place)).all()
    water.air = replace(first, name=np.array([3]))
    again = Followed()
    again.restore(gauge.save())
    assert again.read(water, place) == gauge.read(water, place) == (0.0, water.pocket_volumes()[0])


LIFTED = """
[case]
title = "a bell is lifted out of the water"
[time]
end = "0.2 s"
[tank]
lower = [0, 0, 0]
upper = [2, 0.2, 1.4]
cell = 0.1
[water]
covers = "multiple"
[water.air]
model = "trapped"
[[water.fill]]
lower = [0, 0, 0]
upper = [2, 0.2, 0.52]
[limits]
energy_error = 0.5
[contact]
stiffness = "40 MN/m"
[[structure.block]]
name = "left"
centre = [0.6, 0.1, 0.65]
size = [0.1, 0.2, 0.3]
[[structure.block]]
name = "right"
centre = [1.4, 0.1, 0.65]
size = [0.1, 0.2, 0.3]
[[structure.block]]
name = "roof"
centre = [1.0, 0.1, 0.85]
size = [0.9, 0.2, 0.1]
[[motion]]
block = "left"
velocity = [0, 0, 0.4]
[[motion]]
block = "right"
velocity = [0, 0, 0.4]
[[motion]]
block = "roof"
velocity = [0, 0, 0.4]
"""


def test_a_run_tells_where_a_pocket_opens_to_the_atmosphere(tmp_path):
    (tmp_path / "case.toml").write_text(LIFTED)
    file = load(tmp_path)
    run = RunDirectory.create(file, tmp_path / "run")
    assert execute_case(file, run, quiet=True) == 0
    log, figures = (run.path / "log.txt").read_text(), read_summary(run.path)["figures"]
    found = figures["air_opened"]
    assert found["number"] == 1
    assert 0.0 < found["time"] < 0.15
    np.testing.assert_allclose(found["place"], [1.0, 0.1, 0.7], atol=0.15)
    assert found["largest"] == pytest.approx(0.7 * 0.2 * 0.28, rel=0.4)
    assert f"note: {opened_in_all(found)}" in log
    assert f"but: {opened_in_all(found)}" in log
    assert figures["doubts"] == [opened_in_all(found)]
    assert "opened to the atmosphere and lost its air" in log
    assert "under a lip that is less than a cell (100 mm) under water" in log


def test_pockets_that_open_are_told_again_only_when_they_are_larger():
    figures, mesh = {}, SimpleNamespace(size_at=lambda points: np.array([0.1]))

    def told(time, *volumes):
        opened = tuple(Opened(np.array([1.0, 2.0, 3.0]), volume, 1500.0) for volume in volumes)
        air = SimpleNamespace(opened=opened)
        return note_opened(SimpleNamespace(air=air, mesh=mesh), time, figures)

    assert told(0.1) == ""
    assert figures == {}
    assert told(0.2, 0.01).startswith(
        "note: at t = 0.2 s a pocket of trapped air around (1, 2, 3) m, 0.01 m3 at 1.5 kPa"
    )
    assert told(0.3, 0.015, 0.005) == ""
    assert told(0.4, 0.03).startswith("note: at t = 0.4 s")
    assert opened_in_all(figures["air_opened"]).startswith(
        "4 times a pocket of trapped air opened to the atmosphere, 0.06 m3 in all. The largest: at t = 0.4 s"
    )


def test_open_air_loads_nothing_of_it():
    code = (
        "import sys\n"
        "from tests.coupler.water_cases import case, run\n"
        f"run(case({{'fill': {FILL!r}}}), 0.02)\n"
        "assert 'fluid.step.water' in sys.modules\n"
        "assert not [name for name in sys.modules if name.startswith('fluid.air')]\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=os.environ, check=False
    )
    assert done.returncode == 0, done.stderr
