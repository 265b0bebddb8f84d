"""Repairs made by `surgebreak doctor --mend`: incomplete compiled kernels, folders of the user that are not writable,
and packages that are missing or damaged in the virtual environment.

Only the cache and the virtual environment are changed, never a system package or the results of a run.
"""

from __future__ import annotations

import os
import shutil
import stat
import subprocess
import sys
from collections.abc import Iterable, Iterator
from importlib import metadata
from pathlib import Path

from coupler.program.provenance import ROOT

KERNELS = (".nbi", ".nbc")
"""Numba's index of a function and its compiled code; both are pickles."""
STOP = b"."
"""Last byte of a whole pickle."""


def kernel_place() -> Path | None:
    """The folder of compiled kernels; None where none is set."""
    place = os.environ.get("NUMBA_CACHE_DIR")
    return Path(place) if place else None


def kernels(place: Path) -> Iterator[Path]:
    """All files of kernels below a folder."""
    return (path for path in place.rglob("*") if path.suffix in KERNELS)


def torn(place: Path) -> list[Path]:
    """Kernels that were cut off, by a full disk or a machine that lost power: loading them ends a run."""
    return sorted(path for path in kernels(place) if not _is_whole(path))


def _is_whole(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            file.seek(-1, os.SEEK_END)
            return file.read() == STOP
    except FileNotFoundError:  # replaced by another process just now
        return True
    except OSError:
        return False


def drop_torn(place: Path) -> str:
    """Remove the folders of modules with torn kernels, which are compiled again when they are needed."""
    folders = {path.parent for path in torn(place)}
    for folder in folders:
        shutil.rmtree(folder)
    return f"removed {len(folders)} folders; their kernels are compiled again by the next run"


def locked(place: Path) -> list[Path]:
    """Folders and files of this user below a folder, itself included, that this user may not read or write."""
    found = []
    for folder, _, files in os.walk(place):
        for path in (Path(folder), *(Path(folder) / name for name in files)):
            if _is_locked(path):
                found.append(path)
    return found


def _is_locked(path: Path) -> bool:
    try:
        about = path.lstat()
    except FileNotFoundError:
        return False
    return about.st_uid == os.getuid() and about.st_mode & _wanted(about.st_mode) != _wanted(about.st_mode)


def _wanted(mode: int) -> int:
    return stat.S_IRWXU if stat.S_ISDIR(mode) else stat.S_IRUSR | stat.S_IWUSR


def unlock(place: Path) -> str:
    """Restore this user's access to what `locked` finds; folders first, since the content of a locked one is hidden."""
    count = 0
    while found := locked(place):
        for path in found:
            mode = path.lstat().st_mode
            path.chmod(stat.S_IMODE(mode) | _wanted(mode))
        count += len(found)
    return f"{count} files and folders may be read and written again"


def can_install() -> bool:
    """Whether packages may be put into this Python: that of a virtual environment, never that of the system."""
    return sys.prefix != sys.base_prefix


def damaged() -> dict[str, str]:
    """Packages of the virtual environment with a file that is absent or has another size than the installer recorded,
    and the first such file of each."""
    found: dict[str, str] = {}
    inside = [place for place in sys.path if Path(place).is_relative_to(sys.prefix)]
    for package in metadata.distributions(path=inside):
        for file in package.files or ():
            if file.size is not None and _size(Path(str(file.locate()))) != file.size:
                found[package.metadata["Name"]] = str(file)
                break
    return found


def _size(path: Path) -> int | None:
    try:
        return path.stat().st_size
    except OSError:
        return None


def install(names: Iterable[str], again: bool = False) -> str:
    """Install packages with the pins of the checkout; again: also where pip takes them to be there.

    Raises OSError with the last line of pip where that fails."""
    command = [sys.executable, "-m", "pip", "install", "--quiet", *names]
    if again:
        command += ["--force-reinstall", "--no-deps"]
    pins = ROOT / "constraints.txt"
    if pins.is_file():
        command += ["-c", str(pins)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        last = (done.stderr or done.stdout).strip().splitlines()
        raise OSError(f"pip: {last[-1] if last else f'ended with {done.returncode}'}")
    return f"installed {', '.join(names)}"
