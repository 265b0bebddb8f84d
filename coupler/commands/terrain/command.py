"""The command `surgebreak terrain`."""

from __future__ import annotations

import json
import tempfile
import tomllib
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from coupler.case.messages import explain_error
from coupler.case.terrain import Terrain
from coupler.geometry.terrain.grid import TerrainError
from coupler.geometry.terrain.show import of_file, resolved
from coupler.program import terminal
from coupler.program.errors import BadCase
from coupler.program.process import run_module, trouble
from coupler.results.maps import run_up


def show(place: Path, sets: list[str], picture: Path | None) -> None:
    """Tables about a terrain file or the terrain of a case, and a map; of a run the maps of its flood. Raises
    TerrainError, BadCase."""
    if (place / "maps").is_dir():
        _show_flood(place, picture)
        return
    path, options = (
        _of_case(place, sets) if place.is_dir() or place.suffix == ".toml" else (place, _options(sets))
    )
    ground, rows = of_file(path, options)
    terminal.table(str(path), rows)
    terminal.table("what a mesh makes of it", resolved(ground))
    if picture is not None:
        _draw(ground, path.name, picture)
        print(f"map: {picture}")


def _title(run: Path) -> str:
    """Title of the case of a run; the name of its directory where it has none to read."""
    try:
        return str(json.loads((run / "effective.json").read_text(encoding="utf-8"))["case"]["title"])
    except (OSError, ValueError, KeyError, TypeError):
        return run.name


def _show_flood(run: Path, picture: Path | None) -> None:
    """Names of the maps of a run, its run-up, and all of them in one picture, with the buildings by their state."""
    for path in sorted((run / "maps").glob("*.asc")):
        print(path)
    print(_run_up_in_words(run))
    if picture is not None:
        done = run_module(
            "coupler.commands.view.flood_map", run, picture, _title(run), capture_output=True, text=True
        )
        if done.returncode != 0:
            raise TerrainError(f"no map: {trouble(done.returncode, done.stderr)}")
        print(f"map: {picture}")


def _run_up_in_words(run: Path) -> str:
    """How high the water ran up the land. Raises TerrainError of maps that are not what a run writes."""
    try:
        found = run_up(run / "maps")
    except (OSError, ValueError, LookupError) as error:
        raise TerrainError(f"{run / 'maps'}: not what a run writes: {error}") from error
    if found is None:
        return "run-up: the water reached no ground that was dry at the start"
    return (
        f"run-up: z = {found.z:.3g} m, the highest ground that the water reached, at ({found.x:.8g}, {found.y:.8g}) in "
        f"the coordinates of {found.frame}, at t = {found.time:.4g} s; {found.area:.4g} m2 of dry ground were flooded "
        "(from a tenth of a cell of water on)"
    )


def _of_case(place: Path, sets: list[str]) -> tuple[Path, dict]:
    from coupler.checks.read_case import load

    case = load(place, sets).case
    if case.terrain is None:
        raise TerrainError(f"{place}: the case has no section [terrain]")
    spec = case.terrain
    return Path(spec.path), {name: getattr(spec, name) for name in spec.model_fields_set if name != "path"}


def _options(sets: list[str]) -> dict:
    """Options of [terrain] from KEY=VALUE, checked as in a case."""
    table: dict = {"path": "-"}
    for text in sets:
        key, _, value = text.partition("=")
        try:
            table[key.strip().removeprefix("terrain.")] = tomllib.loads(f"x = {value}")["x"]
        except tomllib.TOMLDecodeError:
            table[key.strip().removeprefix("terrain.")] = value.strip()
    try:
        spec = Terrain.model_validate(table)
    except ValidationError as error:
        mistakes = [explain_error(item | {"loc": ("terrain", *item["loc"])}) for item in error.errors()]
        raise BadCase([f"--set {'.'.join(map(str, path))}: {text}" for path, text in mistakes]) from error
    return {name: getattr(spec, name) for name in spec.model_fields_set if name != "path"}


def _draw(ground, title: str, picture: Path) -> None:
    with tempfile.TemporaryDirectory() as folder:
        there = Path(folder) / "ground.npz"
        np.savez(there, x=ground.x, y=ground.y, z=ground.z, covered=np.array(ground.covered))
        done = run_module(
            "coupler.commands.view.terrain_map", there, picture, title, capture_output=True, text=True
        )
    if done.returncode != 0:
        raise TerrainError(f"no map: {trouble(done.returncode, done.stderr)}")
