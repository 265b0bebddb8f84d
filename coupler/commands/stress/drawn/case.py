"""A drawn scene as a case directory: case.toml and the files that it names."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from coupler.case import toml_text


def write(table: dict, files: dict[str, object], directory: Path) -> Path:
    """Make the directory with the case; the same scene makes the same bytes of case.toml."""
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "case.toml").write_text(toml_text.document(table), encoding="utf-8")
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
