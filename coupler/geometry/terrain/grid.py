"""A terrain as stored in its file, before it is placed in a tank."""

from __future__ import annotations

from dataclasses import dataclass

from array_types import Array
from coupler.program.errors import ExitCode, SurgebreakError


class TerrainError(SurgebreakError):
    """A terrain that cannot be used; the message names the file, its fault, and the remedy."""

    exit_code = ExitCode.BAD_CASE


@dataclass(frozen=True)
class Grid:
    """x (nx,), y (ny,), increasing and even · z (nx, ny), NaN where unknown; units of the file · crs: its coordinate
    system as text, "" if it says none · notes: what was found on the way, for people."""

    x: Array
    y: Array
    z: Array
    crs: str = ""
    notes: tuple[str, ...] = ()
