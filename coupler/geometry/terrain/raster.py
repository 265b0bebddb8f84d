"""GeoTIFF and other rasters of GDAL, and changes of the coordinate system: by rasterio, in a separate process.

rasterio ends a process that has held YADE, so this module is also a program:

    python -m coupler.geometry.terrain.raster read IN OUT.npz            x, y, z, crs of the first band
    python -m coupler.geometry.terrain.raster reproject IN.npz OUT.npz FROM TO
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from coupler.geometry.terrain.grid import Grid, TerrainError
from coupler.program.extras import missing

ROTATED = 1e-9
"""Share of a pixel by which the rows of a raster may turn away from the axes."""


def read_in_own_process(path: Path) -> Grid:
    """The first band of a raster file. Raises TerrainError."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "grid.npz"
        _call(path.name, "read", str(path), str(out))
        return _loaded(out)


def reprojected(name: str, grid: Grid, source: str, target: str) -> Grid:
    """A raster in another coordinate system, as fine as it was. Raises TerrainError."""
    if not source:
        raise TerrainError(
            f"{name}: it does not say its coordinate system; write terrain.crs, for instance 'EPSG:4326'"
        )
    with tempfile.TemporaryDirectory() as folder:
        before, after = Path(folder) / "before.npz", Path(folder) / "after.npz"
        np.savez(before, x=grid.x, y=grid.y, z=grid.z, rim=np.array(grid.rim))
        _call(name, "reproject", str(before), str(after), source, target)
        return _loaded(after)


def _loaded(path: Path) -> Grid:
    with np.load(path) as file:
        notes, (a, b) = tuple(file["notes"].tolist()), file["rim"].tolist()
        return Grid(file["x"], file["y"], file["z"], str(file["crs"]), notes, (a, b))


def _call(name: str, *words: str) -> None:
    from coupler.program.process import run_module

    absent = missing("terrain")
    if absent:
        raise TerrainError(f"{name}: needs rasterio: {absent}")
    done = run_module("coupler.geometry.terrain.raster", *words, capture_output=True, text=True)
    if done.returncode != 0:
        last_line = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise TerrainError(f"{name}: {last_line}")


def _read(path: str, out: str) -> None:
    import rasterio

    with rasterio.open(path) as file:
        t = file.transform
        if max(abs(t.b), abs(t.d)) > ROTATED * abs(t.a):
            sys.exit("its rows are turned against its axes; gdalwarp it first")
        z = file.read(1, masked=True).astype(float).filled(np.nan)
        x = t.c + t.a * (np.arange(file.width) + 0.5)
        y = t.f + t.e * (np.arange(file.height) + 0.5)
        crs = file.crs.to_wkt() if file.crs else ""
        notes = [f"band 1 of {file.count}"] if file.count > 1 else []
        scale, offset = file.scales[0], file.offsets[0]
        points = file.tags().get("AREA_OR_POINT", "Area").lower() == "point"
    rim = np.zeros(2) if points else 0.5 * np.abs([t.a, t.e])
    z = (scale * z + offset).T
    if t.a < 0:
        x, z = x[::-1], z[::-1]
    if t.e < 0:
        y, z = y[::-1], z[:, ::-1]
    np.savez(out, x=x, y=y, z=z, crs=crs, notes=np.array(notes, str), rim=rim)


def _reproject(before: str, out: str, source: str, target: str) -> None:
    import rasterio.errors
    from rasterio.crs import CRS
    from rasterio.transform import from_origin
    from rasterio.warp import Resampling, calculate_default_transform, reproject

    try:
        old, new = CRS.from_user_input(source), CRS.from_user_input(target)
    except rasterio.errors.CRSError as error:
        sys.exit(f"no such coordinate system: {error}")
    if new.is_geographic:
        sys.exit(f"{target} counts in degrees; reproject to a metric system, for instance UTM")
    with np.load(before) as file:
        x, y, z, cells = file["x"], file["y"], file["z"], bool(file["rim"].all())
    dx, dy = x[1] - x[0], y[1] - y[0]
    place = from_origin(x[0] - dx / 2, y[-1] + dy / 2, dx, dy)
    bounds = (x[0] - dx / 2, y[0] - dy / 2, x[-1] + dx / 2, y[-1] + dy / 2)
    to, width, height = calculate_default_transform(old, new, len(x), len(y), *bounds)
    turned = np.full((height, width), np.nan)
    reproject(
        np.ascontiguousarray(z.T[::-1]), turned, src_transform=place, src_crs=old, src_nodata=np.nan,
        dst_transform=to, dst_crs=new, dst_nodata=np.nan, resampling=Resampling.bilinear,
    )  # fmt: skip
    x = to.c + to.a * (np.arange(width) + 0.5)
    y = (to.f + to.e * (np.arange(height) + 0.5))[::-1]
    factor = new.linear_units_factor[1]
    note = f"from {source} to {target}, {width} x {height} points every {to.a * factor:.3g} m"
    rim = 0.5 * factor * np.abs([to.a, to.e]) if cells else np.zeros(2)
    np.savez(
        out, x=x * factor, y=y * factor, z=turned[::-1].T, crs=new.to_wkt(), notes=np.array([note]), rim=rim
    )


if __name__ == "__main__":
    {"read": _read, "reproject": _reproject}[sys.argv[1]](*sys.argv[2:])
