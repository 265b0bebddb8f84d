"""Water that starts below a surface from a file, or a slope."""

import numpy as np
import pytest

from coupler.checks.case import problems
from coupler.run.forecast import forecast
from coupler.scene.build import build
from tests.coupler.water_cases import FILL, case, reported
from tests.fakes import no_clock


def surface_file(tmp_path, heights, x=(0.0, 1.0, 2.0)):
    path = tmp_path / "start.csv"
    rows = [f"{a},{b},{z}" for a, z in zip(x, heights) for b in (0.0, 0.2)]
    path.write_text("x,y,z\n" + "\n".join(rows) + "\n")
    return str(path)


def with_surface(**more):
    return {"fill": [FILL[0] | more]}


def test_water_starts_below_the_heights_of_a_file(tmp_path):
    """A ridge across the tank, between the nodes of the file straight: its volume is that below the lines."""
    path = surface_file(tmp_path, (0.3, 0.5, 0.3))
    found = case(with_surface(surface=path))
    assert problems(found) == []
    coupling = build(found, no_clock).coupling
    assert coupling.water.volume() == pytest.approx(2.0 * 0.2 * 0.4, rel=2e-3)
    assert forecast(found)["water"] == pytest.approx(
        2.0 * 0.2 * 0.4, rel=3e-3
    )  # summed over a raster of columns


def test_a_slope_turns_the_surface_about_the_middle_of_its_box():
    found = case(with_surface(slope=[0.1, 0.0]))
    assert problems(found) == []
    water = build(found, no_clock).coupling.water
    assert water.volume() == pytest.approx(2.0 * 0.2 * 0.5, rel=1e-12)
    nodes = water.domain.nodes
    wet = water.level_set < 0.0
    np.testing.assert_array_equal(wet, nodes[:, 2] < 0.5 + 0.1 * (nodes[:, 0] - 1.0) - 1e-12)


@pytest.mark.parametrize(
    ("heights", "x", "more", "message"),
    [
        ((0.3, 0.6, 0.3), (0, 1, 2), {}, "water.fill.0.surface: rises to z = 0.6 m"),
        (
            (-0.3, -0.2, 0.0),
            (0, 1, 2),
            {},
            "surface: lies at z = -0.3 to 0 m, below the box of water (z = 0 m)",
        ),
        ((0.3, 0.4, 0.3), (0, 0.5, 1), {}, "surface: has no height over 49.6%"),
        ((0.3, 0.4, 0.3), (0, 1, 2), {"slope": [0.1, 0]}, "slope: the surface is given by a file as well"),
    ],
)
def test_a_surface_that_does_not_fit_its_box_is_refused(heights, x, more, message, tmp_path):
    told = reported(with_surface(surface=surface_file(tmp_path, heights, x), **more))
    assert len(told) == 1
    assert message in told[0]


def test_slopes_that_leave_the_tank_and_files_that_are_none_are_refused(tmp_path):
    (told,) = reported(with_surface(slope=[0.6, 0.0]))
    assert told == "water.fill.0.slope: rises to z = 1.1 m at (2, 0) m, above the top of the tank (1 m)"
    (told,) = reported(with_surface(surface=str(tmp_path / "starts.csv")))
    assert told.endswith("no such file")
    (tmp_path / "bad.csv").write_text("x,y,z\n0,0,wet\n")
    (told,) = reported(with_surface(surface=str(tmp_path / "bad.csv")))
    assert "no three numbers x, y, z" in told
