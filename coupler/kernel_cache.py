"""Where compiled kernels are kept: one directory for each state of the sources.

Numba renews a cached kernel when its own file changes, but not when a function that it calls in another file does;
after an update of the checkout it would run old code. So the directory carries a checksum of all kernel sources.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from coupler.errors import SurgebreakError

ROOMS = ("fluid", "yade_scripts")


class NoCache(SurgebreakError):
    """There is no place for compiled kernels, without which numba does not compile them."""


def use_kernel_cache() -> None:
    """Point numba to the directory of the present sources, unless NUMBA_CACHE_DIR is set; before numba is imported.

    It is below XDG_CACHE_HOME or ~/.cache; where nothing can be written there, in a folder of the user's own among the
    temporary files, and that is told. Raises NoCache."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    root = Path(__file__).resolve().parent.parent
    checksum, name = _checksum(root), hashlib.sha256(str(root).encode()).hexdigest()[:8]
    tried = []
    for home in _homes():
        base = home / "surgebreak" / name
        place = base / checksum
        if not place.exists():
            shutil.rmtree(base, ignore_errors=True)  # kernels of older sources
        if _is_usable(place, home):
            if tried:
                _tell(f"note: nothing can be written in {tried[0]}; compiled kernels are kept in {home}")
            os.environ["NUMBA_CACHE_DIR"] = str(place)
            return
        tried.append(home)
    raise NoCache(
        f"compiled kernels can be kept nowhere (tried {', '.join(map(str, tried))}); name a folder that you may write "
        "to: XDG_CACHE_HOME=DIR"
    )


def _homes() -> Iterator[Path]:
    """Folders for caches, the usual one first."""
    given = os.environ.get("XDG_CACHE_HOME")
    if given:
        yield Path(given)
    else:
        with contextlib.suppress(RuntimeError):  # no home at all
            yield Path.home() / ".cache"
    yield Path(tempfile.gettempdir()) / f"surgebreak-{os.getuid()}"


def _is_usable(place: Path, home: Path) -> bool:
    """Whether a folder is there, or can be made, that this user may write to. Among the temporary files it must be the
    user's own as well: kernels are code, which is run as it is found."""
    try:
        if home.parent == Path(tempfile.gettempdir()):
            home.mkdir(exist_ok=True, mode=0o700)
            if home.stat().st_uid != os.getuid() or home.stat().st_mode & 0o022:
                return False
        place.mkdir(parents=True, exist_ok=True)
        return os.access(place, os.W_OK | os.X_OK)
    except OSError:
        return False


def _tell(text: str) -> None:
    print(f"surgebreak: {text}", file=sys.stderr, flush=True)


def _checksum(root: Path) -> str:
    digest = hashlib.sha256()
    for room in ROOMS:
        for source in sorted((root / room).rglob("*.py")):
            text = source.read_bytes()
            if b"numba" in text or b".jit import" in text:
                digest.update(text)
    return digest.hexdigest()[:16]
