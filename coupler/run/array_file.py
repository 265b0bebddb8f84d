"""A file of named arrays and one text that is written atomically and in which damage is detected.

The file is written beside its place and renamed. It contains a digest of every name, type, shape and byte, which is
checked on reading.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import h5py
import numpy as np

from coupler.program.errors import FULL
from coupler.results.storage import DiskFull, claim, finite

LAYOUT = ("v110", "v110")
SMALL, FULL_FROM = 512, 0.5
"""Numbers below which an array is not worth compressing, and share of its entries that are not zero from which it is
not either: these are digits that nothing makes shorter, and compressing all of a state takes three times as long."""
HEADROOM = 1 << 16


class Damaged(ValueError):
    """The file is incomplete or was changed: its content cannot be trusted."""


def write_arrays(path: Path, arrays: dict[str, np.ndarray], text: str, unset=()) -> None:
    """Write arrays by name (slashes make groups) and a text. unset: names in which NaN means "not yet".

    Raises NotFinite before anything is written, and DiskFull; the file at `path` is then as it was before."""
    for name, array in arrays.items():
        if name not in unset:
            finite(name, array, path)
    part = path.with_name(f".{path.name}.part")
    part.unlink(missing_ok=True)
    size = sum(a.nbytes + 512 for a in arrays.values()) + len(text) + HEADROOM
    try:
        claim(part, size)
        _write(part, arrays, text)
        os.replace(part, path)
    except OSError as error:
        part.unlink(missing_ok=True)
        if error.errno not in FULL:
            raise
        why = OSError(error.errno, os.strerror(error.errno))
        raise DiskFull(path, size, "as it was before, if there was one", why) from None
    _flush_directory(path.parent)


def _write(path: Path, arrays: dict[str, np.ndarray], text: str) -> None:
    with h5py.File(path, "w", libver=LAYOUT, locking=False) as file:
        for name, array in arrays.items():
            file.create_dataset(name, data=array, **_packed(array))
        file["text"] = np.frombuffer(text.encode("utf-8"), np.uint8)
        file.attrs["digest"] = digest(arrays, text)
    with path.open("rb") as stream:
        os.fsync(stream.fileno())


def _packed(array: np.ndarray) -> dict:
    """How h5py is to store an array."""
    if array.size <= SMALL or np.count_nonzero(array) >= FULL_FROM * array.size:
        return {}
    return {"compression": "lzf", "shuffle": True, "chunks": array.shape}


def _flush_directory(path: Path) -> None:
    """Flush a directory, so that the new name survives a power failure."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def read_arrays(path: Path) -> tuple[dict[str, np.ndarray], str]:
    """Arrays by name and the text.  Raises Damaged."""
    arrays: dict[str, np.ndarray] = {}

    def take(name: str, item) -> None:
        if isinstance(item, h5py.Dataset):
            arrays[name] = np.asarray(item[()])

    try:
        with h5py.File(path, "r", locking=False) as file:
            file.visititems(take)
            wanted = file.attrs["digest"]
        text = arrays.pop("text").tobytes().decode("utf-8")
    except (OSError, KeyError, RuntimeError, ValueError, TypeError) as error:
        raise Damaged(f"{path} cannot be read: {str(error).splitlines()[0]}") from error
    if digest(arrays, text) != wanted:
        raise Damaged(f"{path} does not hold what was written into it (checksum)")
    return arrays, text


def digest(arrays: dict[str, np.ndarray], text: str) -> str:
    """Checksum of names, types, shapes, values and the text."""
    found = hashlib.blake2b(text.encode("utf-8"), digest_size=16)
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        found.update(f"{name} {array.dtype.str} {np.shape(arrays[name])} ".encode())
        found.update(array.tobytes())
    return found.hexdigest()
