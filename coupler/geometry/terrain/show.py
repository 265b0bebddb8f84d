"""`surgebreak terrain`: the content of a terrain file, its slopes, and its resolution by cells of a given size."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from coupler.geometry.terrain.grid import Grid, TerrainError
from coupler.geometry.terrain.grids import read_grid
from coupler.geometry.terrain.height_map import HeightMap
from coupler.program.terminal import Row

SIZES = 6
"""Cells that are tried, each twice the one before."""
MOST = 2e6
"""Points at which the difference is taken."""


def of_file(path: Path, more: dict) -> tuple[HeightMap, list[Row]]:
    """Height map of a terrain file with options of [terrain], and remarks on it. Raises TerrainError."""
    from coupler.case.terrain import Terrain
    from coupler.geometry.terrain.site import terrain_of

    grid = read_grid(path, more.get("variable"))
    rows = _file_rows(grid)
    spec = Terrain(path=str(path), **more)
    try:
        ground = terrain_of(spec)
    except TerrainError as error:
        refused = Row("as a terrain", "refused", "", str(error))
        return HeightMap(grid.x, grid.y, grid.z, reach=grid.reach), [*rows, refused]
    return ground, [*rows, *_ground_rows(ground)]


def _file_rows(grid: Grid) -> list[Row]:
    nx, ny = grid.z.shape
    dx, dy = grid.x[1] - grid.x[0], grid.y[1] - grid.y[0]
    crs = grid.crs[:60] if grid.crs else "none given"
    rows = [
        Row("points", f"{nx} x {ny}", "", f"every {dx:.6g} x {dy:.6g} units of the file"),
        *(
            Row(name, f"{low:.10g} to {high:.10g}", "", f"units of the file{_rim(rim)}")
            for name, (low, high), rim in zip("xy", grid.reach, grid.rim)
        ),
        Row(
            "coordinate system",
            crs,
            "",
            "heights: these files give no datum; z = 0 is what terrain.zero says",
        ),
        Row("without height", float(np.isnan(grid.z).mean() * 100), "%", "holes; terrain.fill closes them"),
    ]
    return rows + [Row("note", note) for note in grid.notes]


def _rim(rim: float) -> str:
    """Whether heights hold beyond the outermost points."""
    return ", with the outer halves of its outermost cells" if rim else ""


def _ground_rows(ground: HeightMap) -> list[Row]:
    z = ground.z[np.isfinite(ground.z)]
    slope = ground.slopes[np.isfinite(ground.slopes)]
    dx, dy = ground.spacing
    rows = [
        Row(
            "extent",
            " x ".join(f"{high - low:.6g}" for low, high in ground.covered),
            "m",
            f"a height every {dx:.4g} x {dy:.4g} m",
        ),
        Row(
            "heights",
            f"{z.min():.4g} to {z.max():.4g}",
            "m",
            f"half lie below {np.median(z):.4g} m, {(z < 0).mean():.0%} below z = 0",
        ),
    ]
    for share in (50, 90, 99, 100):
        steep = float(np.percentile(slope, share)) if len(slope) else 0.0
        rows.append(
            Row(
                f"slope, {share} %",
                steep,
                "",
                f"{np.degrees(np.arctan(steep)):.1f} degrees; this share of the ground is no steeper",
            )
        )
    return rows


def resolved(ground: HeightMap) -> list[Row]:
    """Root mean square and largest difference [m] between the ground and its form on a mesh of a given cell size:
    heights at the columns of its nodes, straight between them."""
    dx = max(ground.spacing)
    stride = max(1, int(np.sqrt(ground.z.size / MOST)))
    x, y = ground.x[::stride], ground.y[::stride]
    z = ground.z[::stride, ::stride]
    rows = []
    for k in range(1, SIZES + 1):
        cell = dx * 2.0**k
        if cell > 0.25 * min(np.ptp(ground.x), np.ptp(ground.y)):
            break
        coarse = _sampled(ground, cell)
        X, Y = np.meshgrid(x, y, indexing="ij")
        difference = coarse(X.ravel(), Y.ravel()) - z.ravel()
        difference = difference[np.isfinite(difference)]
        if not len(difference):
            continue
        rms, most = float(np.sqrt((difference**2).mean())), float(np.abs(difference).max())
        rows.append(
            Row(f"cells of {cell:.3g} m", rms, "m rms", f"{most:.3g} m at most is lost of the ground")
        )
    return rows


def _sampled(ground: HeightMap, cell: float) -> HeightMap:
    """The ground at the columns of cells of a size [m], in the coordinates of the file."""
    axes = [np.linspace(a[0], a[-1], max(2, round(np.ptp(a) / cell) + 1)) for a in (ground.x, ground.y)]
    plain = HeightMap(ground.x, ground.y, ground.z)
    X, Y = np.meshgrid(*axes, indexing="ij")
    return HeightMap(*axes, plain(X.ravel(), Y.ravel()).reshape(X.shape))
