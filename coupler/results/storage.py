"""Safe writing: refuse values that are not finite, and detect a full disk *before* a file is touched.

An HDF5 file whose write fails half way cannot be opened again, so the room for the next step is claimed first
(posix_fallocate past the end of the file, given back at once); a full disk, a quota or a file-size limit then
shows itself while everything written so far is still whole.
"""

import errno
import os
from pathlib import Path

import numpy as np

from coupler.program.errors import FULL


class DiskFull(OSError):
    """There is no room for the next write; `path` holds what was written before and stays readable."""

    def __init__(self, path, needed, readable, cause):
        self.path = Path(path)
        super().__init__(
            cause.errno or errno.ENOSPC,
            f"{path}: no room for the next {size_text(needed)} ({cause.strerror or cause}); "
            f"the file is readable {readable}; free some space or write less often (time.output_every)",
        )

    def __str__(self):
        return self.strerror


class NotFinite(FloatingPointError):
    """A field holds a NaN or an infinity: the computation went wrong before the output was reached."""


class WrongShape(ValueError):
    """An array handed to a writer does not have the number of rows that its name asks for."""


def size_text(size):
    """A number of bytes for people."""
    return f"{size / 1e6:.3g} MB" if size >= 1e5 else f"{size:.0f} bytes"


def finite(name, values, where):
    """Return `values` (n, ...) as they are; raise NotFinite with the first bad row otherwise.

    A NaN in a result file is found weeks later; here it still has a name, an index and a time.
    """
    values = np.asarray(values)
    if values.dtype.kind != "f" or np.isfinite(values).all():
        return values
    bad = np.argwhere(~np.isfinite(values))
    first = tuple(int(i) for i in bad[0])
    raise NotFinite(
        f"{where}: {name}{list(first)} is {values[first]} ({len(bad)} of {values.size} values are not finite); "
        "this step is not written; look at the steps before it, or reduce time.step_max"
    )


def rows(name, values, count, where):
    """Return `values` as an array; raise WrongShape unless its first axis has `count` items."""
    values = np.asarray(values)
    if values.ndim == 0 or len(values) != count:
        raise WrongShape(f"{where}: {name} has shape {values.shape}; expected {count} rows")
    return values


def reserve(path, needed, readable):
    """Raise DiskFull unless `needed` [bytes] more fit into the file at `path`, which is left as it was."""
    with open(path, "r+b") as file:
        size = os.fstat(file.fileno()).st_size
        try:
            os.posix_fallocate(file.fileno(), size, max(int(needed), 1))
        except OSError as error:
            if error.errno not in FULL:
                raise
            raise DiskFull(path, needed, readable, error) from None
        finally:
            os.ftruncate(file.fileno(), size)


def claim(path, needed):
    """Make an empty file at `path` if there is room for `needed` [bytes]; FileExistsError if it is there, DiskFull."""
    path = Path(path)
    path.touch(exist_ok=False)
    try:
        reserve(path, needed, "but empty")
    except DiskFull:
        path.unlink()
        raise
