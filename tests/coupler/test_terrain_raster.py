"""GeoTIFF, Shapefile and changes of the coordinate system: by the extra `terrain`, in processes of their own."""

import subprocess
import sys

import numpy as np
import pytest

from coupler.case.terrain import Terrain
from coupler.geometry.footprints import read_footprints
from coupler.geometry.terrain.grids import TerrainError
from coupler.geometry.terrain.site import KEPT, terrain_of
from coupler.program.extras import absent

pytestmark = pytest.mark.skipif(bool(absent("terrain")), reason="needs the extra terrain")

WRITE = """
import sys, numpy as np, rasterio
from rasterio.transform import from_origin
path, crs, x0, y0, step = sys.argv[1], sys.argv[2], *map(float, sys.argv[3:6])
x = x0 + step * (np.arange(30) + 0.5)
y = y0 - step * (np.arange(20) + 0.5)
z = (2.0 + 0.3 * np.arange(30)[None, :] - 0.2 * np.arange(20)[:, None]).astype("float32")
z[0, 0] = -9999
with rasterio.open(path, "w", driver="GTiff", width=30, height=20, count=1, dtype="float32", crs=crs,
                   transform=from_origin(x0, y0, step, step), nodata=-9999) as file:
    file.write(z, 1)
    file.scales, file.offsets = [float(sys.argv[6])], [float(sys.argv[7])]
"""


def write(path, crs, x0, y0, step, scale=1.0, offset=0.0):
    words = [sys.executable, "-c", WRITE, path, crs, *map(str, (x0, y0, step, scale, offset))]
    subprocess.run(words, check=True, capture_output=True)


def test_geotiff_is_read_once_and_kept_beside_it(tmp_path):
    write(tmp_path / "site.tif", "EPSG:32654", 388200.0, 4253000.0, 2.0)
    spec = Terrain(path=str(tmp_path / "site.tif"), origin=(388200.0, 4252960.0))
    found = terrain_of(spec)
    np.testing.assert_allclose(found(np.array([11.0]), np.array([39.0])), 2.0 + 0.3 * 5, atol=1e-6)
    np.testing.assert_allclose(found(np.array([3.0]), np.array([1.0])), 2.0 + 0.3 - 0.2 * 19, atol=1e-6)
    assert np.isnan(found(np.array([1.0]), np.array([39.0]))).all(), "no data"
    kept = list((tmp_path / KEPT).iterdir())
    assert len(kept) == 1
    kept[0].write_bytes(b"torn")
    again = terrain_of(Terrain(path=str(tmp_path / "site.tif"), origin=(388200.0, 4252960.0), turn=0.1))
    np.testing.assert_array_equal(again.z, found.z)


def test_a_tile_covers_its_pixels_to_their_rims_unless_they_are_points(tmp_path):
    write(tmp_path / "site.tif", "EPSG:32654", 388200.0, 4253000.0, 2.0)
    found = terrain_of(Terrain(path=str(tmp_path / "site.tif")))
    np.testing.assert_allclose(found.covered, [[388200, 388260], [4252960, 4253000]])
    np.testing.assert_allclose(found(np.array([60.0]), np.array([0.0])), 2.0 + 0.3 * 29 - 0.2 * 19, atol=1e-5)
    point = "import sys, rasterio; rasterio.open(sys.argv[1], 'r+').update_tags(AREA_OR_POINT='Point')"
    subprocess.run([sys.executable, "-c", point, tmp_path / "site.tif"], check=True, capture_output=True)
    np.testing.assert_allclose(
        terrain_of(Terrain(path=str(tmp_path / "site.tif"))).covered, [[388201, 388259], [4252961, 4252999]]
    )


def test_heights_stored_with_a_scale_and_an_offset(tmp_path):
    """As whole centimetres above a datum, for instance: height = scale times number + offset."""
    write(tmp_path / "site.tif", "EPSG:32654", 388200.0, 4253000.0, 2.0, scale=0.01, offset=7.5)
    found = terrain_of(Terrain(path=str(tmp_path / "site.tif"), origin=(388200.0, 4252960.0)))
    np.testing.assert_allclose(found(np.array([11.0]), np.array([39.0])), 7.5 + 0.01 * 3.5, atol=1e-6)


TURN_COLUMNS = """
import sys, rasterio
with rasterio.open(sys.argv[1]) as file:
    z, profile = file.read(1)[:, ::-1], file.profile
profile["transform"] *= rasterio.Affine.translation(30, 0) * rasterio.Affine.scale(-1, 1)
with rasterio.open(sys.argv[2], "w", **profile) as file:
    file.write(z, 1)
"""


def test_columns_from_east_to_west_are_read_from_west_to_east(tmp_path):
    write(tmp_path / "site.tif", "EPSG:32654", 388200.0, 4253000.0, 2.0)
    words = [sys.executable, "-c", TURN_COLUMNS, tmp_path / "site.tif", tmp_path / "turned.tif"]
    subprocess.run(words, check=True, capture_output=True)
    site, turned = (
        terrain_of(Terrain(path=str(tmp_path / name), origin=(388200.0, 4252960.0)))
        for name in ("site.tif", "turned.tif")
    )
    np.testing.assert_array_equal(turned.x, site.x)
    np.testing.assert_array_equal(turned.z, site.z)


def test_degrees_are_refused_and_reprojected(tmp_path):
    """0.0001 degrees of latitude are 11.1 m; a plane stays one."""
    write(tmp_path / "site.tif", "EPSG:4326", 141.7, 38.4, 1e-4)
    with pytest.raises(TerrainError, match=r"degrees.*EPSG:32654"):
        terrain_of(Terrain(path=str(tmp_path / "site.tif")))
    found = terrain_of(Terrain(path=str(tmp_path / "site.tif"), reproject="EPSG:32654"))
    assert found.spacing[0] == pytest.approx(9.9, abs=0.5)
    assert np.ptp(found.y) == pytest.approx(20 * 11.1, rel=0.06)
    inner = found.slopes[np.isfinite(found.slopes)]
    east, north = 0.3 / (1e-4 * 111320 * np.cos(np.radians(38.4))), 0.2 / (1e-4 * 110996)
    np.testing.assert_allclose(np.median(inner), np.hypot(east, north), rtol=0.02)


def test_a_system_in_feet_comes_out_in_metres(tmp_path):
    """California zone 3 counts in US survey feet; the points stay ten metres apart."""
    write(tmp_path / "site.tif", "EPSG:4326", -121.0, 37.5, 1e-4)
    found = terrain_of(Terrain(path=str(tmp_path / "site.tif"), reproject="EPSG:2227"))
    assert found.spacing[0] == pytest.approx(9.9, abs=0.5)
    assert np.ptp(found.y) == pytest.approx(20 * 11.1, rel=0.06)


def test_a_plane_stays_where_it_is_when_it_is_reprojected(tmp_path):
    """Into the system that it has: each height at its own place, not half a pixel beside it."""
    write(tmp_path / "site.tif", "EPSG:32654", 388200.0, 4253000.0, 2.0)
    spec = Terrain(path=str(tmp_path / "site.tif"), reproject="EPSG:32654", origin=(388200.0, 4252960.0))
    found = terrain_of(spec)
    np.testing.assert_allclose(found(np.array([11.0]), np.array([29.0])), 2.0 + 0.3 * 5 - 0.2 * 5, atol=0.02)


def test_unknown_system_is_reported_in_a_line(tmp_path):
    write(tmp_path / "site.tif", "EPSG:32654", 0.0, 0.0, 2.0)
    with pytest.raises(TerrainError, match=r"site.tif: no such coordinate system"):
        terrain_of(Terrain(path=str(tmp_path / "site.tif"), reproject="EPSG:999999"))


def test_footprints_of_a_geopackage_in_degrees(tmp_path):
    script = """
import sys, numpy as np, shapely, pyogrio.raw
ring = [[141.7, 38.4], [141.7002, 38.4], [141.7002, 38.4001], [141.7, 38.4001], [141.7, 38.4]]
pyogrio.raw.write(sys.argv[1], shapely.to_wkb(np.array([shapely.polygons(ring)])), [np.array([2])], ["levels"],
                  geometry_type="Polygon", crs="EPSG:4326", driver="GPKG")
"""
    subprocess.run([sys.executable, "-c", script, tmp_path / "h.gpkg"], check=True, capture_output=True)
    (house,) = read_footprints(tmp_path / "h.gpkg", ("EPSG:4326", "EPSG:32654"))
    assert house.attributes == {"levels": 2}
    assert house.area == pytest.approx(2e-4 * 111320 * np.cos(np.radians(38.4)) * 1e-4 * 110996, rel=0.01)
