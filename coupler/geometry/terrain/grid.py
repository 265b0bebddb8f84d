"""A terrain as stored in its file, before it is placed in a tank."""

from __future__ import annotations

from dataclasses import dataclass

from array_types import Array
from coupler.program.errors import ExitCode, SurgebreakError

Reach = tuple[tuple[float, float], tuple[float, float]]
"""Lowest and highest x, and lowest and highest y, that heights hold for."""


class TerrainError(SurgebreakError):
    """A terrain that cannot be used; the message names the file, its fault, and the remedy."""

    exit_code = ExitCode.BAD_CASE


@dataclass(frozen=True)
class Grid:
    """x (nx,), y (ny,), increasing and even · z (nx, ny), NaN where unknown; units of the file · crs: its coordinate
    system as text, "" if it says none · notes: what was found on the way, for people · rim: how far beyond the
    outermost points along x and y their heights hold, half a cell where the points are the middles of cells."""

    x: Array
    y: Array
    z: Array
    crs: str = ""
    notes: tuple[str, ...] = ()
    rim: tuple[float, float] = (0.0, 0.0)

    @property
    def reach(self) -> Reach:
        """What it covers."""
        (a, b), (x, y) = self.rim, (self.x, self.y)
        return (float(x[0] - a), float(x[-1] + a)), (float(y[0] - b), float(y[-1] + b))
