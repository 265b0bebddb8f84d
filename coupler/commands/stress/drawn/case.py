"""A drawn scene as a case directory: case.toml and the files that it names."""

from __future__ import annotations

from pathlib import Path

import numpy as np


def write(table: dict, files: dict[str, object], directory: Path) -> Path:
    """Make the directory with the case; the same scene makes the same bytes of case.toml."""
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "case.toml").write_text(toml(table), encoding="utf-8")
    for name, content in files.items():
        if isinstance(content, str):
            (directory / name).write_text(content, encoding="utf-8")
        else:
            _write_mesh(directory / name, *content)
    return directory


def _write_mesh(path: Path, points, kind: str, cells) -> None:
    import meshio

    if path.suffix == ".msh":
        tags = {name: [np.ones(len(cells), int)] for name in ("gmsh:physical", "gmsh:geometrical")}
        mesh = meshio.Mesh(np.asarray(points), [(kind, np.asarray(cells))], cell_data=tags)
        meshio.write(path, mesh, file_format="gmsh22", binary=False)
    else:
        meshio.write(path, meshio.Mesh(np.asarray(points), [(kind, np.asarray(cells))]))


def toml(table: dict) -> str:
    """Tables of plain data (numbers, text, booleans, lists, tables, lists of tables) as TOML."""
    return "\n".join(_lines(table, ())) + "\n"


def _lines(table: dict, path: tuple[str, ...]) -> list[str]:
    own = [f"{name} = {_value(value)}" for name, value in table.items() if not _is_table(value)]
    for name, value in table.items():
        below = (*path, name)
        if isinstance(value, dict):
            own += ["", f"[{'.'.join(below)}]", *_lines(value, below)]
        elif _is_table(value):
            for row in value:
                own += ["", f"[[{'.'.join(below)}]]", *_lines(row, below)]
    return own


def _is_table(value: object) -> bool:
    return isinstance(value, dict) or (
        isinstance(value, list) and bool(value) and all(isinstance(row, dict) for row in value)
    )


def _value(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    return repr(value.item() if hasattr(value, "item") else value)
