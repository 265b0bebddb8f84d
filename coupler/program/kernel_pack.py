"""Compiled kernels as one file, for other machines: packed from the cache, and put into the cache of another one.

What numba keeps is valid for the same sources, the same packages, the same Python and the same instruction set
(`arithmetic.py` sets one for all processors that have it). The file names these, and one that differs is refused.
"""

from __future__ import annotations

import io
import json
import os
import platform
import re
import tarfile
from importlib.metadata import version
from pathlib import Path

from coupler.program.errors import ExitCode, SurgebreakError
from coupler.program.kernel_cache import ROOMS, folder_of
from coupler.program.provenance import ROOT

ABOUT = "surgebreak-kernels.json"
_MEMBER = re.compile(r"[A-Za-z_][\w.]*/[0-9a-f]{16}/[\w.<>-]+\.nb[ci]")
"""Module, state of its source, index or code."""


class BadPack(SurgebreakError):
    """A file of kernels that cannot be read or does not fit this installation."""

    exit_code = ExitCode.BAD_CASE


def compiled() -> dict[str, Path]:
    """Folder in the cache of each module that has kernels there for its present source."""
    place = _place()
    found = {}
    for room in ROOMS:
        for source in sorted((ROOT / room).rglob("*.py")):
            folder = folder_of(source, place)
            if folder is not None and any(folder.glob("*.nbi")):
                found[folder.parent.name] = folder
    return found


def pack(to: Path) -> int:
    """Write the kernels of the present sources into a file (tar, gzip); how many modules. Raises BadPack."""
    folders = compiled()
    if not folders:
        raise BadPack(f"no kernels of this version are in {_place()}; run a case first")
    place = _place()
    partial = to.with_name(f"{to.name}.partial")
    with tarfile.open(partial, "w:gz", compresslevel=6) as file:
        about = json.dumps(_conditions(), indent=1).encode()
        entry = tarfile.TarInfo(ABOUT)
        entry.size = len(about)
        file.addfile(entry, io.BytesIO(about))
        for folder in folders.values():
            for path in sorted(folder.glob("*.nb[ci]")):
                file.add(path, path.relative_to(place).as_posix())
    partial.replace(to)
    return len(folders)


def unpack(source: Path) -> int:
    """Put the kernels of a file into the cache; how many files are new there. Kernels are code: take them from places
    that you trust only. Raises BadPack for other files, and for kernels of other packages or another processor."""
    try:
        with tarfile.open(source, "r:gz") as file:
            _check(file, source)
            return sum(_put(file, entry) for entry in file if entry.name != ABOUT)
    except (OSError, EOFError, tarfile.TarError) as error:
        raise BadPack(
            f"{source}: not a file of kernels ({error}); `surgebreak kernels --pack` writes them"
        ) from error


def _check(file: tarfile.TarFile, source: Path) -> None:
    names = file.getnames()
    if not names or names[0] != ABOUT:
        raise BadPack(f"{source}: not a file of kernels; `surgebreak kernels --pack` writes them")
    wrong = [
        entry.name
        for entry in file
        if entry.name != ABOUT and not (entry.isreg() and _MEMBER.fullmatch(entry.name))
    ]
    if wrong:
        raise BadPack(f"{source}: {wrong[0]!r} is no kernel; nothing was unpacked")
    about = file.extractfile(ABOUT)
    theirs, ours = json.load(about) if about else {}, _conditions()
    differ = [
        f"{name} {theirs.get(name)} (here {value})"
        for name, value in ours.items()
        if theirs.get(name) != value
    ]
    if differ:
        raise BadPack(
            f"{source}: kernels of {', '.join(differ)}; nothing was unpacked, a run compiles its own"
        )


def _put(file: tarfile.TarFile, entry: tarfile.TarInfo) -> bool:
    """Write one kernel into the cache unless it is there, by renaming a complete file."""
    target = _place() / entry.name
    content = file.extractfile(entry)
    if target.exists() or content is None:
        return False
    target.parent.mkdir(parents=True, exist_ok=True)
    partial = target.with_name(f"{target.name}.{os.getpid()}")
    partial.write_bytes(content.read())
    partial.replace(target)
    return True


def _conditions() -> dict[str, str]:
    return {
        "python": platform.python_version(),
        "numba": version("numba"),
        "llvmlite": version("llvmlite"),
        "numpy": version("numpy"),
        "machine": platform.machine(),
        "instructions": os.environ.get("NUMBA_CPU_NAME", "native"),
    }


def _place() -> Path:
    return Path(os.environ["NUMBA_CACHE_DIR"])
