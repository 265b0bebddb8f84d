"""Maps of a flood over terrain: exact for level water, kept over a restart, readable as terrain."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from scipy.io import netcdf_file

from coupler.checks.read_case import load
from coupler.commands.export.netcdf import write_netcdf
from coupler.commands.view.flood_map import draw, in_tank
from coupler.commands.view.footprints import of_blocks, of_solids
from coupler.geometry.terrain.bed_mesh import fitted_of
from coupler.geometry.terrain.grids import read_grid
from coupler.results.even_raster import even_raster
from coupler.results.fields import BlockWriter, write_solids
from coupler.results.maps import NEVER, Maps, read_map, run_up
from coupler.scene.build_water import water_of
from tests.coupler.synthetic_run import BOX_FACES, box_vertices

CASE = """
[case]
title = "flood"
[time]
end = "1 s"
[tank]
lower = [0, 0, -3]
upper = [20, 8, 3]
cell = "1 m"
[terrain]
path = "ground.csv"
origin = [500, 700]
[water]
[[water.fill]]
lower = [0, 0, -3]
upper = [20, 8, 0.3]
"""


@pytest.fixture
def flood(tmp_path):
    rows = [f"{500 + x},{700 + y},{0.2 * (x - 10) + 0.1 * np.sin(y)}" for x in range(21) for y in range(9)]
    (tmp_path / "ground.csv").write_text("x,y,z\n" + "\n".join(rows) + "\n")
    (tmp_path / "case.toml").write_text(CASE)
    case = load(tmp_path).case
    water, _ = water_of(case, None, [])
    return water, Maps(water, fitted_of(case.tank), case.tank.ground)


def test_a_picture_of_a_map_is_in_the_coordinates_of_the_tank(flood, tmp_path):
    """So are the buildings in it; a tank that began at 30 m had its houses 30 m from their places."""
    _, maps = flood
    maps.write(tmp_path)
    (tmp_path / "effective.json").write_text('{"tank": {"lower": [30.0, -5.0, -3.0]}}')
    x, y = in_tank(tmp_path, read_map(tmp_path / "bed.asc"))
    np.testing.assert_allclose(x, np.linspace(30.0, 50.0, 21))
    np.testing.assert_allclose(y, np.linspace(-5.0, 3.0, 9))


def test_depth_of_level_water_is_that_over_the_bed(flood):
    water, maps = flood
    maps.step(water, 0.0)
    bed = maps.fitted.bed
    wanted = np.maximum(0.3 - bed, 0.0)
    deep = wanted > 1.0  # in the cells that the water line cuts the level set is no plane
    np.testing.assert_allclose(maps.depth.reshape(bed.shape)[deep], wanted[deep], atol=1e-9)
    assert (maps.arrival == NEVER).all()
    np.testing.assert_allclose(maps.speed, 0.0, atol=1e-12)


def test_arrival_speed_and_flux_of_water_that_rises_and_runs(flood):
    water, maps = flood
    maps.step(water, 0.5)
    water.level_set[:] = water.topology.nodes[:, 2] - 0.9
    water.velocity[:] = (3.0, -4.0, 1.0)
    maps.step(water, 0.75)
    bed = maps.fitted.bed
    newly = (bed > 0.45) & (bed < 0.75)
    assert newly.sum() > 8
    np.testing.assert_array_equal(maps.arrival.reshape(bed.shape)[newly], 0.75)
    assert (maps.arrival.reshape(bed.shape)[bed < 0.1] == NEVER).all(), "it was wet before"
    deep = bed < -0.5
    np.testing.assert_allclose(maps.speed.reshape(bed.shape)[deep], 5.0)
    np.testing.assert_allclose(maps.flux.reshape(bed.shape)[deep], 25.0 * maps.depth.reshape(bed.shape)[deep])


def test_what_was_gathered_goes_into_checkpoints_and_files(flood, tmp_path):
    water, maps = flood
    water.level_set[:] = water.topology.nodes[:, 2] - 0.9
    maps.step(water, 0.75)
    again = Maps(water, maps.fitted, maps.ground)
    again.restore(maps.save())
    for name, array in maps.save().items():
        np.testing.assert_array_equal(again.save()[name], array)
        assert np.isfinite(array).all(), "a checkpoint refuses what is not finite"
    maps.write(tmp_path / "maps")
    assert sorted(p.name for p in Path(tmp_path / "maps").iterdir()) == [
        "arrival.asc", "bed.asc", "depth.asc", "flux.asc", "speed.asc",
    ]  # fmt: skip
    grid = read_grid(tmp_path / "maps" / "bed.asc")
    np.testing.assert_allclose(grid.x, 500.0 + maps.fitted.column_x)
    np.testing.assert_allclose(grid.z, maps.fitted.bed, rtol=1e-6, atol=1e-9)
    head = (tmp_path / "maps" / "bed.asc").read_text(encoding="utf-8").split("NODATA_value")[0]
    assert "cellsize 1\n" in head  # not every program knows dx and dy


def test_run_up_is_the_highest_ground_that_was_dry_and_got_wet(flood, tmp_path):
    """The land rises by 0.2 a metre along x from 0 at x = 10 m, and the water stands at 0.3 m; then at 0.9 m."""
    water, maps = flood
    maps.step(water, 0.0)
    maps.write(tmp_path / "maps")
    assert run_up(tmp_path / "maps") is None
    with pytest.raises(FileNotFoundError):
        run_up(tmp_path)
    water.level_set[:] = water.topology.nodes[:, 2] - 0.9
    maps.step(water, 0.75)
    maps.write(tmp_path / "maps")
    found = run_up(tmp_path / "maps")
    assert found.time == 0.75
    assert found.z == pytest.approx(0.9 - maps.film.max(), abs=0.11)
    assert (found.x - 500.0 - 10.0) * 0.2 == pytest.approx(found.z, abs=0.11)
    assert found.area == pytest.approx(8.0 * 3.0, rel=0.35)


def test_heights_far_above_the_zero_of_the_map_keep_their_millimetres(flood, tmp_path):
    """A bed at 1523.4 m was written as 1523, so that level plus depth was off by half a metre."""
    _, maps = flood
    maps.fitted = replace(maps.fitted, bed=maps.fitted.bed + 1523.4)
    maps.write(tmp_path / "maps")
    np.testing.assert_allclose(read_map(tmp_path / "maps" / "bed.asc").z.T, maps.fitted.bed, atol=1e-3)


@pytest.fixture
def stretched(tmp_path):
    """The flood on columns that are twice as far apart along the first half of the tank."""
    rows = [f"{500 + x},{700 + y},{0.2 * (x - 10)}" for x in range(21) for y in range(9)]
    (tmp_path / "ground.csv").write_text("x,y,z\n" + "\n".join(rows) + "\n")
    stretch = '[[tank.stretch]]\nalong = "x"\nupper = 10\ncell = 2\n'
    (tmp_path / "case.toml").write_text(CASE.replace("[terrain]", f"{stretch}[terrain]"))
    case = load(tmp_path).case
    water, _ = water_of(case, None, [])
    return water, Maps(water, fitted_of(case.tank), case.tank.ground)


def test_maps_of_stretched_columns_have_their_places(stretched, tmp_path):
    """A plane bed and level water are linear in x, so each point of the map has the value of its own place."""
    water, maps = stretched
    maps.step(water, 0.75)
    spacing = np.diff(maps.fitted.column_x)
    assert spacing.max() > 1.7 * spacing.min()
    maps.write(tmp_path / "maps")
    bed, depth = (read_grid(tmp_path / "maps" / f"{name}.asc") for name in ("bed", "depth"))
    assert (bed.x[0], bed.x[-1]) == pytest.approx((500.0, 520.0))
    assert np.diff(bed.x).max() <= spacing.min() * (1.0 + 1e-6)
    np.testing.assert_allclose(bed.y, np.linspace(700.0, 708.0, 9))
    np.testing.assert_allclose(bed.z, np.tile(0.2 * (bed.x - 510.0), (9, 1)).T, rtol=1e-3, atol=1e-3)
    deep = bed.z < -0.7
    np.testing.assert_allclose(depth.z[deep], 0.3 - bed.z[deep], rtol=2e-3)
    assert not np.isfinite(depth.z[bed.x > 513.0]).any()


def test_a_map_without_the_size_of_its_cells_is_refused(tmp_path):
    """As every other file that is no map of a run: callers catch LookupError, not TypeError."""
    path = tmp_path / "depth.asc"
    path.write_text("ncols 2\nnrows 1\nxllcenter 0\nyllcenter 0\nnodata_value -9999\n1 2\n")
    with pytest.raises(LookupError, match="cellsize"):
        read_map(path)


def test_values_end_half_way_to_a_column_without_one():
    z = np.array([[1.0, 1.0], [3.0, 3.0], [np.nan, np.nan]])
    x, y, (even,) = even_raster(np.array([0.0, 4.0, 5.0]), np.arange(2.0), z)
    np.testing.assert_allclose(x, np.arange(6.0))
    np.testing.assert_allclose(even[:, 0], [1.0, 1.5, 2.0, 2.5, 3.0, np.nan])
    x, _, (even,) = even_raster(np.array([0.0, 1.0, 5.0]), np.arange(2.0), z)
    np.testing.assert_allclose(even[:, 1], [1.0, 3.0, 3.0, np.nan, np.nan, np.nan])
    assert y.tolist() == [0.0, 1.0]


def test_maps_stay_small_where_a_few_columns_are_very_fine(monkeypatch):
    monkeypatch.setattr("coupler.results.even_raster.MOST_POINTS", 1000)
    fine = np.concatenate([np.arange(0.0, 100.0, 10.0), np.arange(100.0, 101.0, 0.1)])
    x, y, _ = even_raster(fine, np.arange(10.0))
    assert len(x) * len(y) <= 1010
    assert (x[0], x[-1]) == (fine[0], fine[-1])


def test_the_flood_around_a_building_comes_from_the_columns_beside_it(stretched):
    """Near the far end columns are a metre apart, and what lies 1.6 m away is not beside the building."""
    from types import SimpleNamespace

    from coupler.results.buildings_table import _around

    _, maps = stretched
    facts = SimpleNamespace(lower=np.array([[16.0, 3.0, 0.0]]), upper=np.array([[18.0, 5.0, 2.0]]))
    X, Y = maps.fitted.column_x, maps.fitted.column_y
    maps.depth[:] = np.broadcast_to(np.where(X < 14.4, 9.0, 1.0)[:, None], (len(X), len(Y))).ravel()
    depth, *_ = _around(maps, SimpleNamespace(facts=facts), np.array([0]))
    assert depth == 1.0


def test_maps_as_netcdf_hold_their_place_units_and_holes(flood, tmp_path):
    """What xarray needs: coordinates named as the dimensions, units, and _FillValue where nothing came."""
    water, maps = flood
    water.level_set[:] = water.topology.nodes[:, 2] - 0.9
    maps.step(water, 0.75)
    maps.write(tmp_path / "maps")
    (made,) = write_netcdf(tmp_path, tmp_path, "a flood")
    assert made == tmp_path / "maps.nc"
    with netcdf_file(made, mmap=False) as file:
        np.testing.assert_allclose(file.variables["x"][:], 500.0 + maps.fitted.column_x)
        np.testing.assert_allclose(file.variables["y"][:], 700.0 + maps.fitted.column_y)
        assert file.comment == b"coordinates of the terrain file, in metres"
        for name, unit in (("depth", b"m"), ("arrival", b"s"), ("flux", b"m3 s-2")):
            variable = file.variables[name]
            assert (variable.dimensions, variable.units) == (("y", "x"), unit)
            shown = np.where(variable[:] == variable._FillValue, np.nan, variable[:])
            np.testing.assert_array_equal(shown, read_map(tmp_path / "maps" / f"{name}.asc").z)
        depth = file.variables["depth"][:]
        wet = maps.film < maps.depth.reshape(maps.fitted.bed.shape).T
        np.testing.assert_array_equal(depth < 1e30, wet)
        np.testing.assert_allclose(depth[wet], maps.depth.reshape(maps.fitted.bed.shape).T[wet], rtol=1e-3)


def test_row_of_a_building_has_the_flood_around_it_and_its_walls_in_the_order_of_their_breaks(flood):
    from types import SimpleNamespace

    from coupler.results.buildings_table import _around, _walls

    water, maps = flood
    water.level_set[:] = water.topology.nodes[:, 2] - 0.9
    water.velocity[:] = (2.0, 0.0, 0.0)
    maps.step(water, 0.75)
    facts = SimpleNamespace(lower=np.array([[11.2, 3.2, 0.0]]), upper=np.array([[12.8, 4.8, 2.0]]))
    depth, speed, flux, arrival = _around(maps, SimpleNamespace(facts=facts), np.array([0]))
    X, Y = maps.fitted.column_x, maps.fitted.column_y
    near = ((X > 9.6) & (X < 14.4))[:, None] & ((Y > 1.6) & (Y < 6.4))
    assert depth == maps.depth.reshape(near.shape)[near].max()
    assert (speed, arrival) == (pytest.approx(2.0), 0.75)
    assert flux == pytest.approx(4.0 * depth)
    broken = [("h-wall0x-", 2, 3.0), ("h-roof0", 1, 1.5), ("h-wall0y+", 0, 9.0), ("h-annex-wall0x-", 5, 0.1)]
    members = [{"name": n, "joints": 7, "joints_broken": k, "first_break": {"time": t}} for n, k, t in broken]
    assert _walls("h", members, ("h-wall0x-", "h-roof0", "h-wall0y+")) == "roof0 1/7 wall0x- 2/7"
    assert _walls("pier", [members[0] | {"name": "pier"}], ("pier",)) == ""


@pytest.fixture
def drawn(monkeypatch):
    """The figures that are saved, instead of files."""
    import matplotlib.figure

    found = []
    monkeypatch.setattr(matplotlib.figure.Figure, "savefig", lambda self, *_, **__: found.append(self))
    return found


def small_maps(run, arrival="-9999 -9999 -9999"):
    """Maps of three by three points from (0, 0) to (2, 2) m."""
    (run / "maps").mkdir()
    (run / "effective.json").write_text('{"tank": {"lower": [0, 0, 0]}}', encoding="utf-8")
    for name in ("bed", "depth", "speed", "flux", "arrival"):
        rows = "\n".join([arrival if name == "arrival" else "1 2 3"] * 3)
        head = "ncols 3\nnrows 3\nxllcenter 0\nyllcenter 0\ncellsize 1\nNODATA_value -9999\n"
        (run / "maps" / f"{name}.asc").write_text(f"{head}{rows}\n", encoding="utf-8")


def test_a_map_without_a_value_says_so_and_has_no_scale(tmp_path, drawn):
    """Where no dry ground was reached, the arrival had a scale from 0 to 1 s."""
    small_maps(tmp_path)
    draw(tmp_path, tmp_path / "map.png", "a site")
    said = [text.get_text() for axis in drawn[0].axes for text in axis.texts]
    assert said == ["no dry ground was reached"]
    assert len(drawn[0].axes) == 4 + 3  # three have a scale
    assert not drawn[0].legends


def test_every_map_shows_solids_and_blocks_in_their_places(tmp_path, drawn):
    """Without them nobody sees what the water stood against; a quay was not in the map at all."""
    small_maps(tmp_path)
    box = box_vertices((0.5, 0.2, 1.0))
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    writer = BlockWriter(tmp_path / "blocks.vtkhdf", [box] * 2, [BOX_FACES] * 2, ["a", "b"], ["", ""])
    centres = np.array([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5]])
    writer.append(0.0, centres, np.array([np.eye(3), turn]), {})
    writer.append(1.0, centres + 1.0, np.array([np.eye(3), turn]), {})
    write_solids(tmp_path / "solids.vtkhdf", [box + np.array([1.0, 1.5, 0.5])], [BOX_FACES])
    blocks, solids = of_blocks(tmp_path), of_solids(tmp_path)
    for outline, middle, half in zip(
        [*blocks, *solids], [(0.5, 0.5), (1.5, 0.5), (1.0, 1.5)], [(0.25, 0.1), (0.1, 0.25), (0.25, 0.1)]
    ):
        np.testing.assert_allclose(outline.min(axis=0), np.subtract(middle, half), atol=1e-6)
        np.testing.assert_allclose(outline.max(axis=0), np.add(middle, half), atol=1e-6)
    draw(tmp_path, tmp_path / "map.png", "a site")
    for axis in drawn[0].axes[:4]:
        shown = [len(c.get_paths()) for c in axis.collections if isinstance(c, PolyCollection)]
        assert [n for n in shown if n] == [1, 1, 2, 2]
    (legend,) = drawn[0].legends
    assert [text.get_text() for text in legend.get_texts()] == ["fixed solids", "blocks at the start"]


def test_the_map_of_the_depth_names_the_buildings(tmp_path, drawn):
    """Five squares without names could not be found in the table of buildings; hundreds of names would hide the map."""
    small_maps(tmp_path)
    rows = ["name,x,y,state", *(f"H{k},{0.2 * k},1,stands" for k in range(5))]
    (tmp_path / "buildings.csv").write_text("\n".join(rows), encoding="utf-8")
    draw(tmp_path, tmp_path / "map.png", "a site")
    named = [[t.get_text() for t in axis.texts if t.get_text()[0] == "H"] for axis in drawn[0].axes[:4]]
    assert named == [[f"H{k}" for k in range(5)], [], [], []]
    (tmp_path / "buildings.csv").write_text("\n".join(rows[:1] + rows[1:] * 20), encoding="utf-8")
    draw(tmp_path, tmp_path / "map.png", "a site")
    assert not drawn[1].axes[0].texts
