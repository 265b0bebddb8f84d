"""Mesh files of any format that meshio reads: points and cells, or a refusal that names the file."""

from __future__ import annotations

import contextlib
import importlib.util
import io
import signal
import struct
import threading
import warnings
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.case.paths import BadPath, check_file
from coupler.case.units import MOST
from coupler.program.errors import ExitCode, SurgebreakError

UNREADABLE = (
    SystemExit,
    OSError,
    ValueError,
    LookupError,
    TypeError,
    ArithmeticError,
    AttributeError,
    RuntimeError,
    NameError,
    ImportError,
    MemoryError,
    EOFError,
    struct.error,
    zlib.error,
    SyntaxError,
    AssertionError,
)
"""Exceptions of meshio's readers for a file that is not of the format of its ending; one reader raises SystemExit."""
NEEDS_PACKAGE = {"exodus": "netCDF4", "cgns": "h5py", "h5m": "h5py", "hmf": "h5py", "med": "h5py"}
"""Formats whose reader needs a package that may be absent."""
PATIENCE, PER_MEGABYTE = 3.0, 10.0
"""Processor time [s] that reading may take, and more for each megabyte: torn files send some readers in circles."""


class MeshFileError(SurgebreakError):
    """A mesh file that cannot be used; the message names it, the place, and the remedy."""

    exit_code = ExitCode.BAD_CASE


def read_mesh(path: Path) -> tuple[Array, dict[str, Array], bool]:
    """Points (n, 3), cells by kind (m, k), and whether the file holds single precision. Raises MeshFileError."""
    import meshio

    try:
        check_file(path)
    except BadPath as error:
        raise MeshFileError(f"{path}: {error}") from error
    printed = io.StringIO()
    try:
        with (
            contextlib.redirect_stdout(printed),
            contextlib.redirect_stderr(printed),
            warnings.catch_warnings(),
            _patience(PATIENCE + PER_MEGABYTE * 1e-6 * path.stat().st_size),
        ):
            warnings.simplefilter("ignore")
            mesh = meshio.read(path)
    except (*UNREADABLE, meshio.ReadError) as error:
        raise MeshFileError(
            f"{path.name}: meshio cannot read it ({_first_line(error, printed)}); it reads {', '.join(readable())}"
        ) from error
    points = mesh.points
    if points.ndim != 2 or points.shape[1] != 3 or not len(points) or not np.isfinite(points).all():
        raise MeshFileError(f"{path.name}: its points are not rows of three finite coordinates")
    if np.abs(points).max() > MOST:
        raise MeshFileError(
            f"{path.name}: a coordinate of {np.abs(points).max():g}; at most {MOST:g} is read"
        )
    cells: dict[str, list] = {}
    for block in mesh.cells:
        rows = np.asarray(block.data)
        if not rows.size:
            continue
        if rows.ndim != 2 or rows.dtype.kind not in "iu":
            raise MeshFileError(
                f"{path.name}: its cells of kind '{block.type}' are not rows of numbers of points"
            )
        if not 0 <= rows.min() <= rows.max() < len(mesh.points):
            raise MeshFileError(f"{path.name}: a cell names point {rows.max()} of {len(mesh.points)} points")
        kind = f"polygon{rows.shape[1]}" if block.type == "polygon" else block.type
        cells.setdefault(kind, []).append(rows)
    single = mesh.points.dtype == np.float32 or path.suffix.lower() == ".stl"
    return mesh.points.astype(float), {kind: np.concatenate(rows) for kind, rows in cells.items()}, single


def readable() -> list[str]:
    """Endings of the files that can be read here."""
    import meshio
    from meshio._helpers import reader_map

    absent = {kind for kind, name in NEEDS_PACKAGE.items() if importlib.util.find_spec(name) is None}
    kinds = set(reader_map) - absent
    return sorted(end for end, types in meshio.extension_to_filetypes.items() if kinds & set(types))


@contextlib.contextmanager
def _patience(seconds: float) -> Iterator[None]:
    """End what takes more processor time [s] with a ValueError; in the main thread, which alone gets signals."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def enough(number: int, frame: object) -> None:
        raise ValueError(f"the reader did not finish within {seconds:.0f} s of processor time")

    before = signal.signal(signal.SIGPROF, enough)
    signal.setitimer(signal.ITIMER_PROF, seconds, 1.0)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def _first_line(error: BaseException, printed: io.StringIO) -> str:
    text = " ".join((printed.getvalue() or str(error) or type(error).__name__).split())
    return text[:120]
