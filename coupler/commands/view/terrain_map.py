"""A map of a height map from a file: colours by height, shaded from the north-west, lines of equal height.

python -m coupler.commands.view.terrain_map GROUND.npz PICTURE.png TITLE
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

SEA, LAND = 0.17, 0.25
"""Where the colours of the map end for the sea, and begin for the land."""


def draw(place: Path, picture: Path, title: str) -> None:
    """The map of x, y, z and of what they cover, in a .npz file, as a PNG."""
    import matplotlib

    matplotlib.use("Agg")
    with np.load(place) as file:
        figure = map_of(file["x"], file["y"], file["z"], file["covered"], title)
    figure.savefig(picture, dpi=130)


def map_of(x, y, z, covered, title: str):
    """The map of heights z (nx, ny) [m] at x (nx,), y (ny,) [m]; covered (2, 2): lowest and highest x, and y, that they
    hold for, half a cell beyond the outermost of them where they are the middles of cells."""
    import matplotlib
    import matplotlib.pyplot as plt
    from matplotlib.colors import LightSource, TwoSlopeNorm
    from matplotlib.ticker import MaxNLocator

    low, high = float(np.nanmin(z)), float(np.nanmax(z))
    norm = TwoSlopeNorm(0.0, min(low, -1e-3), max(high, 1e-3))
    colours = plt.get_cmap("terrain")
    shown = matplotlib.colors.ListedColormap(
        np.concatenate([colours(np.linspace(0.0, SEA, 128)), colours(np.linspace(LAND, 1.0, 128))])
    )
    dx, dy = x[1] - x[0], y[1] - y[0]
    rise = 0.15 * max(np.ptp(x), np.ptp(y)) / max(high - low, 1e-9)
    light = LightSource(315, 45).hillshade(np.nan_to_num(z.T, nan=low), vert_exag=rise, dx=dx, dy=dy)
    figure, axes = plt.subplots(
        figsize=(9.0, 1.2 + 8.0 * min(1.4, np.ptp(y) / np.ptp(x))), layout="constrained"
    )
    extent = (x[0] - 0.5 * dx, x[-1] + 0.5 * dx, y[0] - 0.5 * dy, y[-1] + 0.5 * dy)  # of the pixels
    image = axes.imshow(z.T, origin="lower", extent=extent, cmap=shown, norm=norm, interpolation="bilinear")
    axes.imshow(light, origin="lower", extent=extent, cmap="gray", alpha=0.3, interpolation="bilinear")
    if high > low:
        lines = axes.contour(x, y, z.T, levels=12, colors="k", linewidths=0.4, alpha=0.6)
        axes.clabel(lines, fontsize=7, fmt="%g")
        if low < 0.0 < high:
            axes.contour(x, y, z.T, levels=[0.0], colors="navy", linewidths=1.4)
    axes.set(xlabel="x [m]", ylabel="y [m]", title=title, aspect="equal", xlim=covered[0], ylim=covered[1])
    axes.ticklabel_format(style="plain", useOffset=False)
    axes.xaxis.set_major_locator(MaxNLocator(6))
    figure.colorbar(image, ax=axes, label="height z [m]", shrink=0.8)
    return figure


if __name__ == "__main__":
    draw(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])
