"""A .glb for each stored time: the water as a surface coloured by speed, every block an object of its name; Blender
imports them with colours (File, Import, glTF), others too.

glTF has the y-axis up and metres; the importers of Blender and other programs rotate it back.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.commands.export.stored import Stored, keep_if, stored
from coupler.commands.view import palette
from coupler.commands.view.water_surface import shading_normals, skin
from coupler.program.extras import need
from coupler.results import vtkhdf

Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


def write_gltf(run: Path, to: Path, chosen: Callable[[float], bool]) -> Iterator[Path]:
    """The files of a run, one after the other. chosen: whether a time [s] is wanted. Raises NotInstalled."""
    need("drawing")
    water, blocks = (
        stored(run / f) if (run / f).exists() else None for f in ("fields.vtkhdf", "blocks.vtkhdf")
    )
    names = _names(run / "blocks.vtkhdf") if blocks else []
    times = (water or blocks).times if (water or blocks) else []
    top = _fastest(water) if water else 1.0
    keep_if(
        to, "fastest", top, ("scene_[0-9]*.glb",)
    )  # files of a run in progress had another scale of colours
    for k, time in enumerate(times):
        path = to / f"scene_{k:05d}.glb"
        if chosen(float(time)) and not path.exists():
            beside = path.with_name(f".{path.name}.part")
            beside.write_bytes(_scene(water, blocks, names, k, top))
            os.replace(beside, path)
            yield path


def _names(path: Path) -> list[str]:
    with vtkhdf.opened(path, "r") as file:
        return [name.decode() for name in file["scene/names"][:]]


def _fastest(water: Stored) -> float:
    """Speed [m/s] at the dark end of the colours: the largest of the stored steps."""
    found = 0.0
    for k in range(len(water.times)):
        _, data, _ = vtkhdf.read_step(water.path, k)
        wet = data["level_set"] < 0.0
        if wet.any():
            found = max(found, float(np.percentile(np.linalg.norm(data["velocity"][wet], axis=1), 99)))
    return found or 1.0


def _scene(water: Stored | None, blocks: Stored | None, names: list[str], k: int, top: float) -> bytes:
    import trimesh

    scene = trimesh.Scene()
    if water is not None:
        mesh = _water(water, k, top)
        if mesh is not None:
            scene.add_geometry(mesh, node_name="water", geom_name="water")
    if blocks is not None and k < len(blocks.times):
        for name, mesh in _blocks(blocks, k, names):
            scene.add_geometry(mesh, node_name=name, geom_name=name)
    scene.apply_transform(Y_UP)
    return scene.export(file_type="glb")


def _water(water: Stored, k: int, top: float):
    """The skin of the water with colours by speed; None of a dry tank."""
    import trimesh

    points, cells, data, _ = water.step(k)
    tetrahedra, level = cells[0][1], data["level_set"].astype(float)
    points = points.astype(float)
    found = skin(points, tetrahedra, level)
    corners = found.of(points)
    if not len(corners):
        return None
    speed = np.linalg.norm(found.of(data["velocity"].astype(float)), axis=2).ravel()
    return trimesh.Trimesh(
        corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), process=False,
        vertex_normals=shading_normals(found, points, tetrahedra, level).reshape(-1, 3),
        vertex_colors=_colours(speed / top, palette.WATER_ENDS, 200),
    )  # fmt: skip


def _blocks(blocks: Stored, k: int, names: list[str]) -> Iterator[tuple[str, object]]:
    """Name and mesh of each block, in the colour of its damage."""
    import trimesh

    points, cells, _, data = blocks.step(k)
    damage = data.get("damage", np.zeros(len(data["block"])))
    triangles, owner, tint = [], [], []
    for _, rows, order in cells:
        for i in range(1, rows.shape[1] - 1):
            triangles.append(rows[:, [0, i, i + 1]])
            owner.append(data["block"][order])
            tint.append(damage[order])
    triangles, owner, tint = np.concatenate(triangles), np.concatenate(owner), np.concatenate(tint)
    for number, name in enumerate(names):
        own = triangles[owner == number]
        used, rows = np.unique(own, return_inverse=True)
        colour = _colours(
            np.full(len(used), tint[owner == number].max(initial=0.0)), palette.DAMAGE_ENDS, 255
        )
        yield name, trimesh.Trimesh(points[used], rows.reshape(-1, 3), process=False, vertex_colors=colour)


def _colours(share: Array, ends, opacity: int) -> Array:
    """(n, 4) bytes of a scale of the palette."""
    scale = palette.scale(ends)
    rows = np.clip(share * (len(scale) - 1), 0, len(scale) - 1).astype(int)
    return np.column_stack([255 * scale[rows], np.full(len(rows), opacity)]).astype(np.uint8)
