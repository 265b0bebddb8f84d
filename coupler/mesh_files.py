"""Mesh files of any format that meshio reads: points and cells, or a refusal that names the file."""

from __future__ import annotations

import contextlib
import io
import struct
import warnings
from pathlib import Path

import numpy as np

from coupler.errors import ExitCode, SurgebreakError, did_you_mean

Array = np.ndarray

UNREADABLE = (
    SystemExit,
    OSError,
    ValueError,
    KeyError,
    IndexError,
    TypeError,
    struct.error,
    SyntaxError,
    AssertionError,
)
"""What meshio's readers raise on a file that is not what its name says; one of them leaves the program."""


class MeshFileError(SurgebreakError):
    """A mesh file that cannot be used; the message names it, the place, and the remedy."""

    exit_code = ExitCode.BAD_CASE


def read_mesh(path: Path) -> tuple[Array, dict[str, Array], bool]:
    """Points (n, 3), cells by kind (m, k), and whether the file holds single precision. Raises MeshFileError."""
    import meshio

    if not path.is_file():
        near = (
            did_you_mean(path.name, [p.name for p in path.parent.iterdir()]) if path.parent.is_dir() else ""
        )
        raise MeshFileError(f"{path}: no such file{near}")
    told = io.StringIO()
    try:
        with contextlib.redirect_stdout(told), contextlib.redirect_stderr(told), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            mesh = meshio.read(path)
    except (*UNREADABLE, meshio.ReadError) as error:
        known = ", ".join(sorted(meshio.extension_to_filetypes))
        raise MeshFileError(
            f"{path.name}: meshio cannot read it ({_first_line(error, told)}); it reads {known}"
        ) from error
    if mesh.points.ndim != 2 or mesh.points.shape[1] != 3 or not np.isfinite(mesh.points).all():
        raise MeshFileError(f"{path.name}: its points are not rows of three finite coordinates")
    cells: dict[str, list] = {}
    for block in mesh.cells:
        rows = np.asarray(block.data)
        if rows.size and not 0 <= rows.min() <= rows.max() < len(mesh.points):
            raise MeshFileError(f"{path.name}: a cell names point {rows.max()} of {len(mesh.points)} points")
        kind = f"polygon{rows.shape[1]}" if block.type == "polygon" else block.type
        cells.setdefault(kind, []).append(rows)
    single = mesh.points.dtype == np.float32 or path.suffix.lower() == ".stl"
    return mesh.points.astype(float), {kind: np.concatenate(rows) for kind, rows in cells.items()}, single


def _first_line(error: BaseException, told: io.StringIO) -> str:
    text = " ".join((told.getvalue() or str(error) or type(error).__name__).split())
    return text[:120]
