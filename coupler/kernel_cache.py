"""Where compiled kernels are kept: one directory for each state of the sources.

Numba renews a cached kernel when its own file changes, but not when a function that it calls in another file does;
after an update of the checkout it would run old code. So the directory carries a checksum of all kernel sources.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from pathlib import Path

ROOMS = ("fluid", "yade_scripts")


def use_kernel_cache() -> None:
    """Point numba to the directory of the present sources, unless NUMBA_CACHE_DIR is set; before numba is imported."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    root = Path(__file__).resolve().parent.parent
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    base = home / "surgebreak" / hashlib.sha256(str(root).encode()).hexdigest()[:8]
    place = base / _checksum(root)
    if not place.exists():
        shutil.rmtree(base, ignore_errors=True)  # kernels of older sources
    os.environ["NUMBA_CACHE_DIR"] = str(place)


def _checksum(root: Path) -> str:
    digest = hashlib.sha256()
    for room in ROOMS:
        for source in sorted((root / room).rglob("*.py")):
            text = source.read_bytes()
            if b"numba" in text or b".jit import" in text:
                digest.update(text)
    return digest.hexdigest()[:16]
