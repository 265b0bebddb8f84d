"""Runs of water by its case: sides whose books must balance, solids, air, and what ends a run."""

import numpy as np
import pytest

from coupler.case.case import Case
from coupler.run.forecast import forecast
from coupler.scene.build import build
from coupler.step.limits import Diverged, check_pressure
from fluid.numerics import bounded
from fluid.numerics.solve import NotConverged
from tests.coupler.water_cases import FILL, TANK, case, run
from tests.fakes import no_clock


@pytest.mark.parametrize(
    "side",
    [
        {"inflow": [{"kind": "steady", "side": "x-", "level": 0.3, "velocity": 1.0}]},
        {"sea": [{"side": "x+", "level": 0.4}]},
    ],
)
def test_a_dry_start_keeps_its_books_from_the_first_step(side):
    """A film of water beside the side, as it was, lost half of its volume and could not balance its energy; errors of
    energy are shares of what the side can bring, not of what came in so far."""
    found = case({"fill": [], **side})
    assert "water" in [row.name for row in forecast(found).rows]
    coupling = build(found, no_clock).coupling
    strip = 0.1 * 0.2 * (0.3 if "inflow" in side else 0.4)
    assert coupling.water.volume() == pytest.approx(strip, rel=0.15)  # cells cut off its upper edge
    for _ in range(8):
        record = coupling.step(0.01)
        assert record.balance.energy_error < 0.02
        assert abs(coupling.water.volume_error()) < 1e-5
    assert coupling.water.sides.entered > 0.0


def test_water_at_rest_lifts_a_hull_and_a_box_of_one_shape_alike():
    """A wedge half under water as a hull of points: the force gauge gives its displaced weight and the moment about
    a point, whatever shape the table has."""
    low, high = np.array([0.8, 0.05, 0.2]), np.array([1.1, 0.15, 0.4])
    corners = [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    middle = 0.5 * (low + high)
    gauge = {"kind": "force", "name": "f", "on": "s", "about": [0, 0, 0]}
    tables = (
        {"name": "s", "vertices": [list(map(float, c)) for c in corners]},
        {"name": "s", "centre": list(middle), "size": list(high - low)},
    )
    weight = 1000 * 9.81 * np.prod(high - low)
    for solid in tables:
        _, _, rows = run(case(solid=[solid], gauge=[gauge]), 0.05)
        assert rows[-1]["f_force_z"] == pytest.approx(weight, rel=1e-6)
        assert rows[-1]["f_moment_x"] == pytest.approx(middle[1] * weight, rel=1e-5)
        assert rows[-1]["f_moment_y"] == pytest.approx(-middle[0] * weight, rel=1e-5)


def test_wave_onto_a_beach_keeps_its_books():
    """Solitary wave, rough beach from a hull, sea behind: volume to 1e-4 of what was handled, energy never gained."""
    beach = [[1, -1, 0], [2.5, -1, 0], [2.5, -1, 0.4], [1, 1, 0], [2.5, 1, 0], [2.5, 1, 0.4]]
    inflow = [{"kind": "solitary", "side": "x-", "level": 0.5, "height": 0.05, "crest": 1.6}]
    water = {
        "viscosity": "1 mPa s", "walls": "friction", "manning": 0.025,
        "inflow": inflow, "sea": [{"side": "x+", "level": 0.5}],
    }  # fmt: skip
    gauges = [
        {"kind": "flux", "name": "q", "at": [0.4, 0.1, 0.5], "edges": [[0, 0.2, 0], [0, 0, 1]]},
        {
            "kind": "patch",
            "name": "p",
            "at": [0.01, 0.1, 0.1],
            "edges": [[0, 0.1, 0], [0, 0, 0.1]],
            "mean_over": 0.1,
        },
    ]
    coupling, record, rows = run(case(water, solid=[{"name": "beach", "vertices": beach}], gauge=gauges), 2.1)
    assert coupling.water.sides.entered > 0.005
    assert abs(coupling.water.volume_error()) < 1e-4
    assert record.balance.energy_error < 0.02
    # the crest brings c H in a second over the width, give or take the coarse cells
    assert max(row["q_flux"] for row in rows) == pytest.approx(2.33 * 0.05 * 0.2, rel=0.25)
    # the first tenth of a second, in which inflow and sea set the still water moving at once, left out
    assert max(row["p_mean"] for row in rows[6:]) == pytest.approx(9810 * 0.45, rel=0.02)


def test_a_wave_pushes_still_water_only_where_it_begins_half_way():
    """The first step beside an inflow and a sea: a crest of a tenth of the depth 3.2 depths away has speed at once,
    which takes a push; one 8 depths away begins at rest, and the water stays still."""
    gauge = {"kind": "patch", "name": "p", "at": [0.01, 0.1, 0.1], "edges": [[0, 0.1, 0], [0, 0, 0.1]]}

    def first(crest):
        wave = {"kind": "solitary", "side": "x-", "level": 0.5, "height": 0.05, "crest": crest}
        sides = {"inflow": [wave], "sea": [{"side": "x+", "level": 0.5}]}
        return run(case(sides, gauge=[gauge]), 0.03)[2][0]["p_pressure"] / (9810 * 0.4)

    assert first(1.6) > 1.03
    assert first(4.0) == pytest.approx(1.0, abs=2e-3)


def test_a_stone_that_covers_gauges_leaves_their_cells_empty():
    """It sinks past them: before and behind it they read the water, inside it there is none, and the run goes on."""
    stone = {"name": "stone", "size": [0.12] * 3, "centre": [0.51, 0.1, 0.62], "velocity": [0, 0, -3.0]}
    windows = {"mean_over": 0.01, "impulse": [0, 1]}
    at = [0.51, 0.1, 0.4]
    found = Case.model_validate(
        {
            "case": {"title": "t"},
            "time": {"end": 1.0, "step_max": 0.01},
            "tank": TANK,
            "water": {"fill": FILL},
            "structure": {"density": 5000, "block": [stone]},
            "contact": {"stiffness": 1e6},
            "gauge": [
                {"kind": "pressure", "name": "point", "at": at, **windows},
                {"kind": "patch", "name": "disc", "at": at, "radius": 0.02, "normal": [1, 0, 0], **windows},
                {"kind": "velocity", "name": "u", "at": at, "mean_over": 0.01},
            ],
        }
    )
    coupling, _, rows = run(found, 0.16)
    coupling.structure.close()  # one scene of YADE a process
    empty, disc = ([row[f"{name}_pressure"] is None for row in rows] for name in ("point", "disc"))
    assert not empty[0]
    assert any(disc)
    assert not empty[-1]
    assert empty == [row["u_velocity_x"] is None for row in rows]
    assert disc == [row["disc_covered"] == 1.0 for row in rows]
    assert not any(whole and not middle for whole, middle in zip(disc, empty))
    assert any(0.0 < row["disc_covered"] < 1.0 for row in rows)
    impulse = np.array([row["point_impulse"] for row in rows])
    assert (np.diff(impulse)[empty[1:]] == 0.0).all()
    assert impulse[-1] > impulse[0] > 0.0


@pytest.mark.parametrize(
    ("water", "cause"),
    [
        ({}, "nothing moves or flows in, so look at the mesh"),
        ({"sea": [{"side": "x+", "level": 0.5}]}, "a full chamber that an inflow or a sea fills"),
    ],
)
def test_a_pressure_that_is_not_found_is_reported_with_its_place_and_cause(monkeypatch, water, cause):
    """The message once blamed moving solids where there are none."""
    coupling = build(case(water), no_clock).coupling

    def fails(problem, rtol):
        assert np.isfinite(problem.rhs).all()
        raise NotConverged("no way", np.ones(1), unknown=7)

    monkeypatch.setattr(bounded, "solve_pressure", fails)
    dofs = coupling.water.predict(1e-3).dofs
    place = ", ".join(f"{x:.3g}" for x in coupling.water.topology.nodes[dofs[7]])
    with pytest.raises(Diverged) as error:
        coupling.step(1e-3)
    assert f"no way Water has no room to go at ({place}) m" in str(error.value)
    assert cause in str(error.value)


def test_a_pressure_beyond_all_bounds_is_reported_with_its_place_and_cause():
    pressure, nodes = np.array([0.0, -2e9]), np.array([[0.0, 0, 0], [1.0, 2, 3.5]])
    never, most = (lambda: 0.0), (lambda: 3e9)
    check_pressure(1.0, pressure[:1], nodes, causes=(True, True, False), to_start=never)
    check_pressure(1.0, pressure, nodes, causes=(True, True, False), to_start=most)
    with pytest.raises(
        Diverged, match=r"-2e\+09 Pa .* at \(1, 2, 3.5\) m: .* a block closes or makes smaller or an inflow"
    ):
        check_pressure(1.0, pressure, nodes, causes=(True, True, False), to_start=never)
    with pytest.raises(Diverged, match=r'or take water.openings = "all"'):
        check_pressure(1.0, pressure, nodes, causes=(True, False, True), to_start=never)
    with pytest.raises(Diverged, match="slivers of water"):
        check_pressure(1.0, pressure, nodes, causes=(False, False, True), to_start=never)


def test_an_inflow_sets_the_water_going_in_a_step_however_short():
    """Half a metre of water at rest, an inflow of 1 m/s beside it, a step of 1 µs: 1000 kg/m³ · 1 m/s · 1 m / 1 µs
    is 1 GPa, what that takes, and no chamber without a way out. Steps of half the length need twice as much."""
    tables = {
        "case": {"title": "start"},
        "tank": {"lower": [0, 0, 0], "upper": [1, 0.5, 1], "cell": 0.125, "open": ["z+", "x+"]},
        "water": {
            "fill": [{"lower": [0, 0, 0], "upper": [1, 0.5, 0.5]}],
            "inflow": [{"kind": "steady", "side": "x-", "level": 0.5, "velocity": 1.0}],
        },
        "time": {"end": 1e-4},
    }
    coupling = build(Case.model_validate(tables), no_clock).coupling
    record = coupling.step(1e-6)
    assert record.retries == 0
    assert coupling.water.pressure.max() > 1e8
    for _ in range(3):
        coupling.step(1e-4)
    assert np.abs(coupling.water.pressure).max() < 1e7


@pytest.mark.parametrize(("level", "pockets"), [(0.3, 0), (0.8, 1)])
def test_air_leaves_through_a_sea_above_its_level(level, pockets):
    """A tank under a lid, half full: its air is trapped where the sea beside it stands up to the lid, and open air
    where it does not."""
    tables = {
        "case": {"title": "air"},
        "tank": {"lower": [0, 0, 0], "upper": [1, 0.5, 0.5], "cell": 0.125, "open": []},
        "water": {
            "fill": [{"lower": [0, 0, 0], "upper": [1, 0.5, 0.25]}],
            "sea": [{"side": "x+", "level": level}],
            "air": {"model": "trapped"},
        },
        "time": {"end": 0.1},
    }
    coupling = build(Case.model_validate(tables), no_clock).coupling
    assert len(coupling.water.air) == pockets
    for _ in range(3):
        coupling.step(0.01)
    assert len(coupling.water.air) == pockets
