"""The friction of the ground by a map: Manning's n or a roughness at every place, from numbers or codes of land use."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.case.paths import stamp
from coupler.case.types import KeyPath, Problem
from coupler.geometry.terrain.grid import TerrainError
from coupler.geometry.terrain.grids import read_grid
from coupler.geometry.terrain.height_map import HeightMap

LAWS = ("manning", "roughness")
MOST_N = 1.0
"""Largest Manning's n [s/m^(1/3)]."""
SHOWN = 8
"""Codes that a message lists."""


@dataclass(frozen=True, eq=False)
class LandMap:
    """x (nx,), y (ny,) [m], even coordinates in the file · value (nx, ny), NaN where the map says nothing · otherwise:
    the value there and beside it · ground: where the file lies in the tank."""

    x: Array
    y: Array
    value: Array
    otherwise: float
    ground: HeightMap

    def __call__(self, x, y) -> Array:
        """n [s/m^(1/3)] or k_s [m] (n,) at places x, y (n,) [m] of the tank."""
        found, _ = self.looked_up(x, y)
        return np.where(np.isfinite(found), found, self.otherwise)

    def looked_up(self, x, y) -> tuple[Array, Array]:
        """Values (n,) of the map itself at the places, NaN where it has none, and whether they lie on it (n,) bool."""
        X, Y = self.ground.in_file(np.asarray(x, float), np.asarray(y, float))
        i, in_x = _nearest(X, self.x)
        j, in_y = _nearest(Y, self.y)
        return np.where(in_x & in_y, self.value[i, j], np.nan), in_x & in_y


def _nearest(place, axis):
    """Number of the nearest point of an even axis, and whether the place lies in the cell around it."""
    at = np.rint((place - axis[0]) / (axis[1] - axis[0]))
    return np.clip(at, 0, len(axis) - 1).astype(np.int64), (at >= 0) & (at < len(axis))


def friction_of(case) -> dict[str, float | LandMap | None]:
    """`manning` and `roughness` of the water of a case, the map in place of the number where there is one."""
    found = {law: getattr(case.water, law) for law in LAWS}
    if case.terrain is None or case.terrain.land is None:
        return found
    (law,) = [law for law in LAWS if found[law] is not None]
    return {**found, law: _map_of(case, law)}


def _map_of(case, law: str) -> LandMap:
    """Raises TerrainError."""
    land = case.terrain.land
    x, y, code = _read(land.path, land.variable, stamp(land.path) if Path(land.path).is_file() else None)
    value = code
    if land.use:
        value = np.full(code.shape, np.nan)
        for use in land.use:
            value[code == use.code] = getattr(use, law)
    scale = case.terrain.scale
    return LandMap(scale * x, scale * y, value, getattr(case.water, law), case.tank.ground)


@lru_cache(maxsize=2)
def _read(path: str, variable: str | None, _stamp) -> tuple[Array, Array, Array]:
    grid = read_grid(Path(path), variable)
    return grid.x, grid.y, grid.z


def land_problems(case) -> Iterator[Problem]:
    """A map without friction, tables of the wrong law, codes without a table, values that are not
    plausible for n, and a map that does not cover the tank."""
    land = case.terrain.land if case.terrain else None
    if land is None or case.tank is None or case.tank.ground is None:
        return
    above = ("terrain", "land")
    laws = [law for law in LAWS if case.water is not None and getattr(case.water, law) is not None]
    if case.water is None or case.water.walls != "friction" or len(laws) != 1:
        yield (
            above,
            'is for friction: write water.walls = "friction" and water.manning (or water.roughness), which hold '
            "beside the map",
        )
        return
    (law,) = laws
    wrong = list(_tables(above, land, law))
    yield from wrong
    if wrong:
        return
    try:
        yield from _values(case, above, land, law)
    except TerrainError as error:
        yield (*above, "path"), str(error)


def _tables(above: KeyPath, land, law: str) -> Iterator[Problem]:
    (other,) = [name for name in LAWS if name != law]
    seen: dict[int, int] = {}
    for k, use in enumerate(land.use):
        if getattr(use, law) is None:
            yield (
                (*above, "use", k),
                f"{law}: missing; the wall friction of this case is given by water.{law}",
            )
        elif getattr(use, other) is not None:
            yield (
                (*above, "use", k, other),
                f"the wall friction of this case is given by water.{law}; leave {other} out",
            )
        if use.code in seen:
            yield (*above, "use", k, "code"), f"{use.code} is the code of use[{seen[use.code]}] already"
        seen.setdefault(use.code, k)


def _values(case, above: KeyPath, land, law: str) -> Iterator[Problem]:
    there, found, name = _map_of(case, law), case.tank, Path(land.path).name
    x, y, code = _read(land.path, land.variable, stamp(land.path))
    sides = [np.linspace(found.lower[k], found.upper[k], 400) for k in (0, 1)]
    X, Y = (a.ravel() for a in np.meshgrid(*sides, indexing="ij"))
    value, on_map = there.looked_up(X, Y)
    if not on_map.any():
        low, high = (
            np.array(there.ground.in_tank(*(case.terrain.scale * np.array(end))))
            for end in ((x[0], y[0]), (x[-1], y[-1]))
        )
        yield (
            (*above, "path"),
            f"{name} lies beside the tank: it goes from ({low[0]:.6g}, {low[1]:.6g}) to ({high[0]:.6g}, "
            f"{high[1]:.6g}) m there; it must be in the coordinates of the terrain (terrain.origin)",
        )
    if not land.use:
        known = value[np.isfinite(value)]
        low, most = 0.0, MOST_N if law == "manning" else np.inf
        bad = known[(known <= low) | (known > most)]
        if len(bad):
            limit = "above 0 and at most 1 s/m^(1/3)" if law == "manning" else "above 0 m"
            yield (
                (*above, "path"),
                f"{name} has {bad[0]:g} in the tank, but {law} lies {limit}; if these are codes of land "
                "use, write a table [[terrain.land.use]] for each",
            )
        return
    codes = LandMap(there.x, there.y, code, np.nan, there.ground).looked_up(X, Y)[0]
    lost = np.unique(codes[np.isfinite(codes) & ~np.isin(codes, [use.code for use in land.use])])
    if len(lost):
        shown = ", ".join(f"{c:g}" for c in lost[:SHOWN]) + (", ..." if len(lost) > SHOWN else "")
        yield (
            (*above, "use"),
            f"{name} has codes in the tank that no [[terrain.land.use]] has: {shown}; write one for each",
        )
