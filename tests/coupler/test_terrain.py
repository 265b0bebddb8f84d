"""Terrain files and what is done to them: every format gives the same ground, and what cannot be read is refused."""

import re

import numpy as np
import pytest

from coupler.case.terrain import Terrain
from coupler.checks.read_case import load
from coupler.geometry.tank_mesh import bed_along, mean_bed, mesh_remarks
from coupler.geometry.terrain.bed_mesh import fitted_of
from coupler.geometry.terrain.grid import Grid, TerrainError
from coupler.geometry.terrain.grids import read_grid
from coupler.geometry.terrain.height_map import HeightMap
from coupler.geometry.terrain.land import friction_of
from coupler.geometry.terrain.site import filled, flattened, smoothed, terrain_of
from coupler.program.errors import BadCase

X, Y = np.arange(100.0, 121.0), np.arange(50.0, 63.0)


def ground(x, y):
    """Quadratic, not symmetric in x and y: a raster that is turned or mirrored by mistake differs."""
    return 0.3 * (x - 108.0) + 0.01 * (x - 100.0) * (y - 50.0) - 0.05 * (y - 55.0)


Z = ground(*np.meshgrid(X, Y, indexing="ij"))


def write_esri(path, z=Z, more=""):
    rows = "\n".join(" ".join(f"{v:.6f}" for v in z[:, j]) for j in range(z.shape[1] - 1, -1, -1))
    path.write_text(
        f"# made by a test\nncols {len(z)}\nnrows {z.shape[1]}\nxllcenter 100\nyllcenter 50\ncellsize 1\n"
        f"NODATA_value -9999\n{more}{rows}\n"
    )


def write_csv(path):
    rows = [f"{y:g},{x:g},{ground(x, y):.6f}" for x in X[::-1] for y in Y]
    path.write_text("y,x,elevation\n" + "\n".join(rows) + "\n")


def write_xyz(path):
    """Scattered points with the corners of the raster among them."""
    rng = np.random.default_rng(2)
    points = np.concatenate(
        [rng.uniform((100, 50), (120, 62), (4000, 2)), [(x, y) for x in (100, 120) for y in (50, 62)]]
    )
    np.savetxt(path, np.column_stack([points, ground(*points.T)]))


def write_classic(path):
    from scipy.io import netcdf_file

    with netcdf_file(path, "w") as file:
        for name, values in (("x", X), ("y", Y)):
            file.createDimension(name, len(values))
            file.createVariable(name, "d", (name,))[:] = values
        file.createVariable("elevation", "d", ("y", "x"))[:] = Z.T


def write_hdf(path):
    import h5py

    with h5py.File(path, "w") as file:
        for name, values in (("x", X), ("y", Y[::-1])):
            file[name] = values
            file[name].make_scale(name)
        file["elevation"] = Z.T[::-1]
        for k, name in enumerate(("y", "x")):
            file["elevation"].dims[k].attach_scale(file[name])


def write_packed(path):
    """Whole centimetres above a datum along coordinates whose names say the directions only at their beginning; and
    they are written in the order x, y."""
    from scipy.io import netcdf_file

    with netcdf_file(path, "w") as file:
        for name, values in (("x_utm", X), ("y_utm", Y)):
            file.createDimension(name, len(values))
            file.createVariable(name, "h", (name,))[:] = 10 * values
            file.variables[name].scale_factor = 0.1
        packed = file.createVariable("elevation", "h", ("x_utm", "y_utm"))
        packed.scale_factor, packed.add_offset, packed._FillValue = 0.01, -20.0, np.int16(0)
        packed[:] = np.rint(100 * (Z + 20.0))


def write_stl(path):
    import meshio

    x, y = np.meshgrid(np.linspace(100, 120, 61), np.linspace(50, 62, 41), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), ground(x, y).ravel()])
    n = np.arange(61 * 41).reshape(61, 41)
    lower = np.stack([n[:-1, :-1], n[1:, :-1], n[1:, 1:]], axis=-1).reshape(-1, 3)
    upper = np.stack([n[:-1, :-1], n[1:, 1:], n[:-1, 1:]], axis=-1).reshape(-1, 3)
    meshio.write_points_cells(path, points, [("triangle", np.concatenate([lower, upper]))], binary=True)


FORMATS = {
    "g.asc": (write_esri, 1e-6),
    "g.csv": (write_csv, 1e-6),
    "g.xyz": (write_xyz, 5e-3),
    "classic.nc": (write_classic, 1e-9),
    "four.nc": (write_hdf, 1e-9),
    "packed.nc": (write_packed, 5.001e-3),
    "g.stl": (write_stl, 5e-3),
}


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_gives_the_same_ground(name, tmp_path):
    write, exact = FORMATS[name]
    write(tmp_path / name)
    found = terrain_of(Terrain(path=str(tmp_path / name), origin=(0, 0)))
    x, y = np.random.default_rng(1).uniform((100.5, 50.5), (119.5, 61.5), (200, 2)).T
    x, y = np.round(x), np.round(y)
    np.testing.assert_allclose(found(x, y), ground(x, y), atol=exact)
    assert np.isnan(found(np.array([99.0]), np.array([55.0]))).all()


def write_named(path, coordinates, heights=((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)), **more):
    """A NetCDF file of 2 x 3 heights whose dimensions are called as given, with their attributes."""
    from scipy.io import netcdf_file

    with netcdf_file(path, "w") as file:
        for (name, attributes), count in zip(coordinates.items(), (2, 3)):
            file.createDimension(name, count)
            file.createVariable(name, "d", (name,))[:] = np.arange(count)
            for key, value in attributes.items():
                setattr(file.variables[name], key, value)
        z = file.createVariable("z", "d", tuple(coordinates))
        z[:] = heights
        for key, value in more.items():
            setattr(z, key, value)


@pytest.mark.parametrize(
    ("first", "second", "turned"),
    [
        ({"y": {}}, {"x": {}}, False),
        ({"x_utm": {}}, {"y_utm": {}}, True),
        ({"Easting": {}}, {"Northing": {}}, True),
        ({"latitude": {}}, {"longitude": {}}, False),
        ({"a": {"axis": b"X"}}, {"b": {"axis": b"Y"}}, True),
        ({"a": {"standard_name": b"projection_y_coordinate"}}, {"b": {"axis": b"X"}}, False),
        ({"a": {"units": b"degrees_east"}}, {"b": {"units": b"degrees_north"}}, True),
    ],
)
def test_coordinates_say_which_of_them_is_x(tmp_path, first, second, turned):
    write_named(tmp_path / "g.nc", first | second)
    shape = read_grid(tmp_path / "g.nc").z.shape
    assert shape == ((2, 3) if turned else (3, 2))


def test_marks_of_missing_values_are_packed_numbers(tmp_path):
    """Height 2 is stored as 4 and marked as missing; height 4, stored as 8, is a height."""
    write_named(
        tmp_path / "g.nc", {"y": {}, "x": {}}, [[2.0, 4.0, 6.0], [8.0, 10.0, 12.0]],
        scale_factor=0.5, missing_value=np.array([4.0]),
    )  # fmt: skip
    np.testing.assert_array_equal(read_grid(tmp_path / "g.nc").z.T, [[1.0, np.nan, 3.0], [4.0, 5.0, 6.0]])


def cells_of_gmt(file, x, y, z):
    """GMT: 1 for cells, 0 for points."""
    file.node_offset = 1


def cells_by_range(file, x, y, z):
    for a in (x, y):
        a.actual_range = np.array([a[:].min() - 5.0, a[:].max() + 5.0])


def cells_of_gdal(file, x, y, z):
    """A grid mapping without a number, with the corner of the first cell, and the coordinate system."""
    mapping = file.createVariable("crs", "c", ())
    mapping.GeoTransform = b"95 10 0 75 0 -10 "
    mapping.spatial_ref = b'PROJCS["WGS 84 / UTM zone 54N"]'
    z.grid_mapping = b"crs"


def cells_by_bounds(file, x, y, z):
    """CF: a variable (n, 2) for each coordinate, which is no height."""
    file.createDimension("two", 2)
    for a, name in ((x, "x_bounds"), (y, "y_bounds")):
        a.bounds = name.encode()
        bounds = file.createVariable(name, "d", (*a.dimensions, "two"))
        bounds[:] = np.column_stack([a[:] - 5.0, a[:] + 5.0])


def points_of_gmt(file, x, y, z):
    file.node_offset = 0


@pytest.mark.parametrize(
    ("mark", "rim"),
    [(cells_of_gmt, 5), (cells_by_range, 5), (cells_of_gdal, 5), (cells_by_bounds, 5), (points_of_gmt, 0)],
)
def test_heights_of_cells_hold_to_their_rims_where_a_netcdf_file_says_that_it_has_cells(tmp_path, mark, rim):
    """As those of an .asc with xllcorner: three cells of 10 units cover 30, while three points cover 20."""
    from scipy.io import netcdf_file

    with netcdf_file(tmp_path / "g.nc", "w") as file:
        made = []
        for name, values in (("x", [100.0, 110.0, 120.0]), ("y", [70.0, 60.0])):
            file.createDimension(name, len(values))
            made.append(file.createVariable(name, "d", (name,)))
            made[-1][:] = values
        z = file.createVariable("z", "d", ("y", "x"))
        z[:] = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
        mark(file, *made, z)
    found = read_grid(tmp_path / "g.nc")
    assert found.reach == ((100 - rim, 120 + rim), (60 - rim, 70 + rim))
    np.testing.assert_array_equal(found.z, [[4, 1], [5, 2], [6, 3]])
    assert ("UTM zone 54N" in found.crs) == (mark is cells_of_gdal)
    placed = terrain_of(Terrain(path=str(tmp_path / "g.nc")))
    np.testing.assert_allclose(np.diff(placed.covered), [[20 + 2 * rim], [10 + 2 * rim]])
    if rim:
        assert placed(np.array([30.0]), np.array([0.0])) == 6.0


@pytest.mark.parametrize("write", [write_classic, write_hdf])
def test_a_damaged_netcdf_file_is_refused_or_read(tmp_path, write):
    """Cut off, or with other bytes in its head: never an error of scipy or h5py."""
    write(tmp_path / "whole.nc")
    whole, rng = (tmp_path / "whole.nc").read_bytes(), np.random.default_rng(3)
    refused = 0
    for k in range(60):
        damaged = bytearray(whole[: rng.integers(8, len(whole))] if k % 2 else whole)
        for place in rng.integers(4, min(len(damaged), 1200), 6):
            damaged[place] = rng.integers(256)
        (tmp_path / "g.nc").write_bytes(damaged)
        try:
            read_grid(tmp_path / "g.nc")
        except TerrainError:
            refused += 1
    assert refused > 30


def test_cells_of_a_netcdf_file_of_version_4_hold_to_their_rims_too(tmp_path):
    import h5py

    write_hdf(tmp_path / "g.nc")
    with h5py.File(tmp_path / "g.nc", "a") as file:
        file.attrs["node_offset"] = np.array([1], np.int32)
        file["crs"] = np.bytes_(b"")
    assert read_grid(tmp_path / "g.nc").reach == ((99.5, 120.5), (49.5, 62.5))


@pytest.mark.parametrize(
    ("coordinates", "more", "reported"),
    [
        ({"a": {}, "b": {}}, {}, "g.nc: of the coordinates 'b' and 'a' of 'z' one must be known as x"),
        ({"time": {}, "x": {}}, {}, "of the coordinates 'x' and 'time' of 'z' one must be known as x"),
        ({"x1": {}, "x2": {}}, {}, "one must be known as x, the other as y"),
        ({"y": {}, "x": {}}, {"scale_factor": 0.0}, "scale_factor = 0 of 'z'"),
        ({"y": {}, "x": {}}, {"add_offset": b"high"}, "add_offset of 'z' is no number"),
    ],
)
def test_what_a_file_leaves_open_is_refused(tmp_path, coordinates, more, reported):
    write_named(tmp_path / "g.nc", coordinates, **more)
    with pytest.raises(TerrainError, match=reported):
        read_grid(tmp_path / "g.nc")


def test_place_of_the_origin_turn_unit_and_datum(tmp_path):
    write_esri(tmp_path / "g.asc")
    options = {"origin": (104.0, 53.0), "turn": np.pi / 2, "offset": (7.0, 1.0, 0.25), "zero": 0.5}
    found = terrain_of(Terrain(path=str(tmp_path / "g.asc"), **options))
    place = found(
        np.array([7.0, 7.0, 5.0]), np.array([1.0, 4.0, 1.0])
    )  # the origin, 3 m along x, 2 m along y of the file
    there = ground(np.array([104.0, 107.0, 104.0]), np.array([53.0, 53.0, 55.0])) - 0.5 + 0.25
    np.testing.assert_allclose(place, there, atol=1e-6)
    feet = terrain_of(Terrain(path=str(tmp_path / "g.asc"), scale=0.3048, positive="down", origin=(0.0, 0.0)))
    x, y = np.array([110.0]), np.array([57.0])
    np.testing.assert_allclose(feet(0.3048 * x, 0.3048 * y), -0.3048 * ground(x, y), atol=1e-6)


def write_tile(path, head="xllcorner 500\nyllcorner 200"):
    """Four by three cells of 2 m."""
    path.write_text(f"ncols 4\nnrows 3\n{head}\ncellsize 2\n8 9 10 11\n4 5 6 7\n0 1 2 3\n")


def test_a_tile_of_cells_covers_its_cells_to_their_rims(tmp_path):
    """A tank of ncols times cellsize fits into it. Its heights belong to the middles of cells: the plane between them,
    and no height beyond those of the file in the outer halves of the outermost cells."""
    write_tile(tmp_path / "g.asc")
    found = terrain_of(Terrain(path=str(tmp_path / "g.asc")))
    np.testing.assert_allclose(found.outline, [[0, 0], [8, 0], [8, 6], [0, 6]], atol=1e-9)
    x, y = np.array([1.0, 4.0, 0.0, 0.5, 8.0]), np.array([1.0, 3.0, 0.0, 3.0, 6.0])
    np.testing.assert_allclose(found(x, y), [0.0, 5.5, 0.0, 4.0, 11.0], atol=1e-9)
    assert np.isnan(found(np.array([8.1, 4.0]), np.array([3.0, -0.1]))).all()
    inner = terrain_of(Terrain(path=str(tmp_path / "g.asc"), crop=((504, 200), (508, 203)), scale=0.5))
    assert inner.covered == ((251.5, 254.0), (100.0, 101.5)), (
        "cropped: from points that were kept, else to the rim"
    )
    write_tile(tmp_path / "p.asc", "xllcenter 500\nyllcenter 200")
    points = terrain_of(Terrain(path=str(tmp_path / "p.asc"), origin=(500, 200)))
    np.testing.assert_allclose(points.outline, [[0, 0], [6, 0], [6, 4], [0, 4]], atol=1e-9)


def test_a_tank_half_a_spacing_larger_than_a_file_of_points_is_told_of_cells(tmp_path):
    rows = [f"{x} {y} 0" for x in range(1, 60, 2) for y in range(1, 24, 2)]
    (tmp_path / "g.xyz").write_text("\n".join(rows))
    text = CASE.replace("g.asc", "g.xyz").replace('"g.xyz"', '"g.xyz"\norigin = [0, 0]')
    for upper, told in (("[60, 24, 3]", True), ("[63, 24, 3]", False)):
        (tmp_path / "case.toml").write_text(re.sub(r"upper = \[.*", f"upper = {upper}", text))
        with pytest.raises(BadCase) as found:
            load(tmp_path, ())
        assert ("middles of cells" in str(found.value)) == told


def test_holes_are_filled_harmonically_and_only_on_demand(tmp_path):
    """A plane with a hole is the plane again: it is harmonic. So is a saddle, if points that are nearer count more."""
    narrow = 0.5 * Y
    x, y = np.meshgrid(X, narrow, indexing="ij")
    saddle = x**2 - y**2
    holed = saddle.copy()
    holed[5:9, 3:8] = np.nan
    np.testing.assert_allclose(filled(holed, X, narrow), saddle, atol=1e-9)
    x, y = np.meshgrid(X, Y, indexing="ij")
    plane = 0.2 * x - 0.4 * y
    holed = plane.copy()
    holed[5:9, 3:8] = np.nan
    np.testing.assert_allclose(filled(holed, X, Y), plane, atol=1e-9)
    holed[np.isnan(holed)] = -9999
    write_esri(tmp_path / "g.asc", holed)
    found = terrain_of(Terrain(path=str(tmp_path / "g.asc")))
    assert np.isnan(found(np.array([6.0]), np.array([5.0]))).all()
    assert np.isfinite(found(np.array([4.0]), np.array([5.0]))).all(), "the edge of a hole is known"


@pytest.mark.parametrize("mark", [-9999.0, -32768.0, 99999.0, 9.96920996838687e36])
def test_marks_of_missing_heights_that_the_file_does_not_declare_are_no_ground(tmp_path, mark):
    """As ground 99999 made an island in the river, where the laser found water, and -9999 a pit. What is told to write
    makes them holes."""
    x, y = np.meshgrid(X, Y, indexing="ij")
    plane = 0.2 * x - 0.4 * y
    holed = plane.copy()
    holed[5:9, 3:8] = mark
    np.savetxt(tmp_path / "g.xyz", np.column_stack([x.ravel(), y.ravel(), holed.ravel()]))
    place = str(tmp_path / "g.xyz")
    side = "lowest" if mark < 0.0 else "highest"
    told = rf"its {side} points, 20 at .*; write no_data = {re.escape(f'{mark:.7g}')}, and fill = true"
    with pytest.raises(TerrainError, match=told):
        terrain_of(Terrain(path=place))
    found = terrain_of(Terrain(path=place, no_data=float(f"{mark:.7g}"), fill=True))
    np.testing.assert_allclose(found.z, plane, atol=1e-9)


def test_a_cliff_is_no_mark_of_missing_heights(tmp_path):
    write_esri(tmp_path / "g.asc", np.where(np.arange(len(X))[:, None] < 7, -3800.0, Z))
    assert terrain_of(Terrain(path=str(tmp_path / "g.asc"))).z.min() == -3800.0


def test_a_mark_in_single_precision_is_that_of_the_head(tmp_path):
    """GDAL writes it with 17 digits in the head, other programs with six among the heights."""
    holed = Z.copy()
    holed[5:9, 3:8] = -9999
    write_esri(tmp_path / "g.asc", holed)
    text = (tmp_path / "g.asc").read_text()
    text = text.replace("NODATA_value -9999", "NODATA_value -3.4028234663852886e+38")
    (tmp_path / "g.asc").write_text(text.replace("-9999.000000", "-3.40282e+38"))
    assert np.isnan(terrain_of(Terrain(path=str(tmp_path / "g.asc"))).z).sum() == 20


def test_smoothing_keeps_planes_and_wears_waves_down():
    x, y = np.meshgrid(np.arange(200.0), np.arange(20.0), indexing="ij")
    wave = smoothed(0.1 * x + np.cos(2 * np.pi * x / 10), x[:, 0], y[0], 3.0)
    inner = wave[60:140] - 0.1 * x[60:140]
    np.testing.assert_allclose(np.ptp(inner) / 2, np.exp(-0.5 * (2 * np.pi * 3.0 / 10) ** 2), rtol=0.01)


def test_smoothing_leaves_level_ground_beside_a_hole_level():
    """A hole has no weight; as ground at zero it would draw a plain at 7 m down to the sea."""
    z = np.full((30, 20), 7.0)
    z[10:15, 8:12] = np.nan
    found = smoothed(z, np.arange(30.0), np.arange(20.0), 3.0)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(z))
    np.testing.assert_allclose(found[np.isfinite(z)], 7.0)


def test_cliffs_are_cut_back_to_the_slope_and_nothing_else():
    x, y = np.arange(30.0), np.arange(8.0)
    z = np.where(x[:, None] < 15, 0.0, 10.0) + 0.0 * y
    cut = flattened(z, x, y, 2.0)
    assert np.abs(np.diff(cut, axis=0)).max() <= 2.0 + 1e-12
    np.testing.assert_array_equal(cut[:15], 0.0)
    np.testing.assert_array_equal(cut[20:], 10.0)


def test_a_pit_is_cut_back_alike_on_all_sides():
    """Along the rows and both diagonals of the raster."""
    x = np.arange(-6.0, 7.0)
    z = np.full((13, 13), 10.0)
    z[6, 6] = 0.0
    cut = flattened(z, x, x, 2.0)
    for turned in (cut[::-1], cut[:, ::-1], cut.T):
        np.testing.assert_array_equal(turned, cut)
    assert cut[6, 9] == 3 * 2.0
    assert cut[8, 8] == pytest.approx(2 * 2.0 * np.sqrt(2.0))


def test_points_written_with_a_few_digits_are_found_in_their_columns(tmp_path):
    """101.1 is by rounding a little less than two spacings of 0.2 from 100.7: the second column, not the first. Else
    they would be taken for scattered points, and the holes of a raster would be filled with triangles."""
    x, y = np.meshgrid(100.7 + 0.2 * np.arange(12), 0.1 * np.arange(9), indexing="ij")
    z = x - 2.0 * y
    np.savetxt(tmp_path / "g.xyz", np.column_stack([x.ravel(), y.ravel(), z.ravel()]), fmt="%.1f %.1f %.3f")
    grid = read_grid(tmp_path / "g.xyz")
    np.testing.assert_allclose(grid.z, z, atol=1e-9)
    assert grid.notes == ()


def test_a_place_in_the_file_and_in_the_tank_is_the_same_place():
    """A quarter turn counter-clockwise takes what lies east of the pivot north of the origin."""
    there = HeightMap(X, Y, Z, (3.0, 4.0), (10.0, 20.0), 0.5 * np.pi)
    np.testing.assert_allclose(there.in_tank(5.0, 4.0), (10.0, 22.0))
    skew = HeightMap(X, Y, Z, (3.0, 4.0), (10.0, 20.0), 0.3)
    np.testing.assert_allclose(skew.in_file(*skew.in_tank(X, X[::-1])), (X, X[::-1]))


@pytest.mark.parametrize(
    ("name", "text", "reported"),
    [
        ("g.asc", "ncols 3\nnrows 2\ncellsize 1\n1 2 3\n4 5\n", "5 heights, but its head says 3 x 2"),
        ("g.asc", "ncols 3\nnrows 2\n1 2 3\n", "no cellsize"),
        ("g.asc", "ncols 2\nnrows 2\ncellsize 1\n1 2\n3 x\n", "'x'.* among its heights"),
        ("g.csv", "x,y,depth\n1,2,3\n", "no column 'z' among x, y, depth"),
        ("g.csv", "1,2,3\n1,2\n", "row 2"),
        ("g.dem", "1", "no terrain is read from .dem"),
        ("g.nc", "1", "cannot be read as NetCDF"),
    ],
)
def test_files_that_are_no_terrain_are_refused_with_the_reason(name, text, reported, tmp_path):
    (tmp_path / name).write_text(text)
    with pytest.raises(TerrainError, match=reported):
        read_grid(tmp_path / name)


def test_feet_and_degrees_are_refused_until_they_are_said(tmp_path):
    write_esri(tmp_path / "g.asc")
    (tmp_path / "g.prj").write_text('PROJCS["x",GEOGCS["y"],UNIT["US survey foot",0.3048006096]]')
    with pytest.raises(TerrainError, match=r"counts in feet.*scale"):
        terrain_of(Terrain(path=str(tmp_path / "g.asc")))
    assert terrain_of(Terrain(path=str(tmp_path / "g.asc"), scale=0.3048006096)).spacing[0] == pytest.approx(
        0.3048006
    )
    (tmp_path / "g.prj").write_text('GEOGCS["WGS 84"]')
    with pytest.raises(TerrainError, match=r"degrees.*reproject.*EPSG:32"):
        terrain_of(Terrain(path=str(tmp_path / "g.asc"), smooth=1.0))


@pytest.mark.parametrize(
    "system",
    [
        'PROJCS["WGS 84 / Pseudo-Mercator",GEOGCS["WGS 84",DATUM["WGS_1984"]],UNIT["metre",1]]',
        'PROJCS["WGS_1984_Web_Mercator_Auxiliary_Sphere",GEOGCS["GCS_WGS_1984"],UNIT["Meter",1.0]]',
        "EPSG:3857",
    ],
)
def test_coordinates_of_web_maps_are_refused_until_they_are_said(tmp_path, system):
    """At 38.4 degrees north their metre is 1/cos = 1.28 m long: slopes were a quarter too flat, distances too long."""
    x, y = 15_553_570.0, 4_635_000.0
    rows = "\n".join(["0 1 2 3"] * 4)
    path = tmp_path / "web.asc"
    path.write_text(f"ncols 4\nnrows 4\nxllcenter {x}\nyllcenter {y}\ncellsize 5\n{rows}\n")
    path.with_suffix(".prj").write_text(system if "[" in system else "")
    crs = None if "[" in system else system
    with pytest.raises(
        TerrainError, match=r"1\.28 times too long .* reproject = 'EPSG:32654', or scale = 0\.78"
    ):
        terrain_of(Terrain(path=str(path), crs=crs))
    with pytest.raises(TerrainError, match="system of web maps"):
        terrain_of(Terrain(path=str(path), crs=crs, reproject="EPSG:3857"))
    found = terrain_of(Terrain(path=str(path), crs=crs, scale=0.784, height_scale=1.0))
    assert found.spacing == pytest.approx((3.92, 3.92))
    assert found.z.max() == 3.0


def test_a_site_is_not_scaled_again_after_it_was_reprojected(tmp_path, monkeypatch):
    """A change of the coordinate system makes metres; heights in feet have a key of their own."""

    def in_metres(name, grid, source, target):
        return Grid(0.3048 * grid.x, 0.3048 * grid.y, grid.z, target)

    monkeypatch.setattr("coupler.geometry.terrain.raster.reprojected", in_metres)
    write_esri(tmp_path / "g.asc")
    (tmp_path / "g.prj").write_text('PROJCS["x",GEOGCS["y"],UNIT["US survey foot",0.3048006096]]')
    spec = {"path": str(tmp_path / "g.asc"), "reproject": "EPSG:32654"}
    with pytest.raises(TerrainError, match=r"g.asc: terrain.scale: 0.3048 m beside reproject.*height_scale"):
        terrain_of(Terrain(**spec, scale="1 ft"))
    found = terrain_of(Terrain(**spec, height_scale="1 ft"))
    assert np.ptp(found.x) == pytest.approx(20 * 0.3048)
    np.testing.assert_allclose(found.z, 0.3048 * Z, atol=1e-6)
    with pytest.raises(BadCase) as error:
        made(tmp_path, "terrain.scale=1 ft", "terrain.reproject=EPSG:32654")
    (line,) = error.value.lines
    assert "terrain.scale: 0.3048 m beside reproject = 'EPSG:32654'" in line


CASE = """
[case]
title = "beach"
[time]
end = "1 s"
[tank]
lower = [0, 0, -3]
upper = [20, 12, 4]
cell = "1 m"
open = ["z+", "x+"]
[terrain]
path = "g.asc"
[water]
[[water.inflow]]
kind = "bore"
side = "x-"
level = 0.5
"""


def made(tmp_path, *sets, z=Z):
    write_esri(tmp_path / "g.asc", z)
    (tmp_path / "case.toml").write_text(CASE)
    return load(tmp_path, sets).case


def test_tank_ends_on_the_terrain(tmp_path):
    case = made(tmp_path)
    fitted = fitted_of(case.tank)
    on_bed = fitted.mesh.nodes[fitted.on_bed]
    on_bed = on_bed[
        on_bed[:, 2] < 2.99
    ]  # the bed of a column at the edge of land without cells is taken down
    np.testing.assert_allclose(on_bed[:, 2], ground(on_bed[:, 0] + 100.0, on_bed[:, 1] + 50.0), atol=1e-5)
    along = bed_along(case.tank, "x-")
    np.testing.assert_allclose(along[:, 1], ground(100.0, 50.0 + along[:, 0]), atol=1e-5)
    wet = 0.5 - ground(100.0, 50.0 + np.arange(13.0))
    assert 0.5 - mean_bed(case.tank, "x-", 0.5) == pytest.approx(np.trapezoid(wet) / 12, rel=1e-4)


def test_surge_onto_dry_ground_is_a_dam_break(tmp_path):
    """Behind a dam of depth H that vanished the depth at its place is 4/9 H, the velocity 2/3 sqrt(g H)."""
    from coupler.scene.build_water import bore_velocity

    case = made(tmp_path)
    depth = 0.5 - mean_bed(case.tank, "x-", 0.5)
    assert bore_velocity(case, case.water.inflow[0]) == pytest.approx(2 / 3 * np.sqrt(9.81 * 9 / 4 * depth))


@pytest.mark.parametrize(
    ("sets", "reported"),
    [
        (["tank.upper=[25, 12, 4]"], r"terrain: 19.9% of the tank lies beside it.*covers x 0 to 20"),
        (["terrain.height_scale=100"], r"falls to z = -275 m at \(0, 12\) m, below the floor of the tank"),
        (["terrain.offset=[0, 0, 50]"], r"nowhere a cell below the top of the tank \(4 m\).*datum"),
        (["tank.lower=[0, 0, -2]"], r"falls to z = -2.* m at .* below the floor of the tank \(-2 m\)"),
        (["terrain.crop=[[200, 50], [210, 60]]"], r"the file reaches from 100 to 120"),
        (["tank.mesh=x.vtu"], "tank.mesh: with .terrain. the mesh is made on it"),
        (["tank=absent"], "terrain: .*tank"),
        (["terrain.path=h.asc"], "no such file; did you mean 'g.asc'"),
        (["water.inflow[0].level=-2.8"], r"not between the floor \(-2.75 m\)"),
    ],
)  # fmt: skip
def test_terrain_that_does_not_fit_is_refused(sets, reported, tmp_path):
    with pytest.raises(BadCase) as error:
        made(tmp_path, *sets)
    assert re.search(reported, "\n".join(error.value.lines)), error.value.lines


def test_land_that_rises_through_the_top_is_remarked_with_the_height_that_water_may_reach(tmp_path):
    """Its rim has no full cell below the top; water there would find the bed cut down."""
    assert not list(mesh_remarks(made(tmp_path, "tank.upper=[20, 12, 9]").tank))
    case = made(tmp_path, "tank.upper=[20, 12, 1]", "water.inflow[0].level=0")
    (told,) = mesh_remarks(case.tank)
    assert "rises through the top of the tank: where it lies above z = 0.5" in told


def test_hole_under_the_tank_is_refused_with_its_place(tmp_path):
    z = Z.copy()
    z[8:10, 3:5] = -9999
    with pytest.raises(BadCase) as error:
        made(tmp_path, z=z)
    assert "holes (no data) under" in error.value.lines[0]
    assert made(tmp_path, "terrain.fill=true", z=z).tank.ground is not None


# ---------------------------------------------------------------- land


RUBBED = ('water.walls="friction"', "water.manning=0.02")
USES = "terrain.land={path='land.asc', use=[{code=1, manning=0.03}, {code=2, name='forest', manning=0.1}]}"


def with_land(tmp_path, codes, *sets):
    write_esri(tmp_path / "land.asc", codes)
    return made(tmp_path, *RUBBED, *sets)


def test_friction_of_the_ground_by_codes_of_land_use(tmp_path):
    """The nearest point of the map counts, moved with the terrain; in its holes the number of the water does."""
    codes = np.where(np.arange(Z.shape[0])[:, None] < 10, 1, 2) * np.ones(Z.shape)
    codes[:, 0] = -9999
    case = with_land(tmp_path, codes, USES)
    n = friction_of(case)["manning"]
    x, y = np.array([4.0, 9.4, 9.6, 15.0, 15.0, 300.0]), np.array([5.0, 5.0, 5.0, 5.0, 0.4, 5.0])
    np.testing.assert_allclose(n(x, y), [0.03, 0.03, 0.1, 0.1, 0.02, 0.02])
    moved = with_land(tmp_path, codes, USES, "terrain.origin=[101, 50]", "tank.upper=[18, 12, 4]")
    np.testing.assert_allclose(friction_of(moved)["manning"](x[:3] - 1.0, y[:3]), [0.03, 0.03, 0.1])


def test_friction_of_the_ground_reaches_the_water(tmp_path):
    from coupler.run.clock import Clock
    from coupler.scene.build import build

    case = with_land(tmp_path, np.where(Z > -2.0, 0.05, 0.02), "terrain.land={path='land.asc'}")
    friction = build(case, Clock()).coupling.water.viscous.friction
    assert set(np.unique(friction.manning(*np.meshgrid(np.arange(21.0), np.arange(13.0))))) == {0.02, 0.05}


@pytest.mark.parametrize(
    ("codes", "sets", "told"),
    [
        (Z, ["terrain.land={path='land.asc'}"], r"has -.* in the tank, but manning lies above 0 .*codes of land use"),
        (np.full(Z.shape, 7), [USES], r"land.asc has codes in the tank that no .*use.* has: 7"),
        (np.ones(Z.shape), [USES, "terrain.land.use[1].code=1"], r"1 is the code of use\[0\] already"),
        (np.ones(Z.shape), [USES, "terrain.land.use[0].manning=absent"], "manning: missing"),
        (np.ones(Z.shape), [USES, "terrain.land.use[0].roughness='1 cm'"], "leave roughness out"),
        (np.ones(Z.shape), [USES, "water.walls=slip", "water.manning=absent"], "land: is for friction"),
        (np.ones(Z.shape), [USES, "terrain.land.path='lend.asc'"], "did you mean 'land.asc'"),
    ],
)  # fmt: skip
def test_map_of_the_land_that_cannot_be_used_is_refused(codes, sets, told, tmp_path):
    with pytest.raises(BadCase) as error:
        with_land(tmp_path, codes, *sets)
    assert re.search(told, "\n".join(error.value.lines)), error.value.lines


def test_slopes_of_a_plane_whose_points_are_not_as_far_apart_along_as_across():
    x, y = np.arange(4.0), 2.5 * np.arange(3)
    plane = HeightMap(x, y, 3.0 * x[:, None] + 4.0 * y)
    np.testing.assert_allclose(plane.slopes, np.full((3, 2), 5.0))
