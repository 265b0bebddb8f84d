"""Load YADE quietly, on one thread, without side effects on the rest of the process.

YADE's import prints, changes the dlopen flags, puts its package folder on sys.path (its modules `tests`, `plot`,
`config`, ... would then shadow others), defines names in builtins and leaves an empty temporary folder.
All of that is undone here. VTK and rasterio crash in a process that holds YADE: importing them afterwards is refused.
"""

from __future__ import annotations

import atexit
import builtins
import contextlib
import glob
import importlib
import importlib.util
import io
import os
import shutil
import sys
from dataclasses import dataclass
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

PACKAGED = (
    "/usr/lib/python3/dist-packages/yade",
    "/usr/lib/*/yade/py/yade",
    "/usr/lib/*/yade-double/py/yade",
)
"""Where the distribution keeps the package; the first is a link that some installations leave dangling."""
UNDECLARED = ("future", "IPython", "mpmath")
"""Packages that YADE imports without declaring them."""
REFUSED = ("vtk", "vtkmodules", "pyvista", "rasterio")


class YadeError(RuntimeError):
    """YADE cannot be used; the message says why and what to do."""


class YadeMissing(YadeError):
    """YADE is not installed."""


class WrongYade(YadeError):
    """A package called `yade` is installed that is not the discrete element code."""


class YadeNeedsPackage(YadeError):
    """A Python package that YADE needs is missing."""


class CrashesAfterYade(ImportError):
    """A package was imported that would crash a process holding YADE."""


class YadeImportFailed(YadeError):
    """YADE was found but does not load."""


@dataclass(frozen=True)
class Engine:
    """The parts of YADE that the structure uses: scene `O`, `utils`, C++ classes `wrapper`, and the vector types."""

    O: Any
    utils: ModuleType
    wrapper: ModuleType
    Vector3: type
    Quaternion: type
    version: str


_loaded: Engine | None = None


def load_yade(threads: int = 1) -> Engine:
    """Import YADE once and return its parts. One thread is the reproducible reference.

    threads counts only in the first call: OpenMP reads it when the library is loaded.
    Raises YadeMissing, WrongYade, YadeNeedsPackage, YadeImportFailed.
    """
    global _loaded
    if _loaded is None:
        folder = find_yade()
        require_packages()
        _refuse_present()
        os.environ["OMP_NUM_THREADS"] = str(threads)
        os.environ.setdefault("OMP_WAIT_POLICY", "passive")
        os.environ.setdefault("HOME", os.path.expanduser("~"))  # YADE does not load without it
        with _side_effects_undone():
            _loaded = _import_yade(folder)
        sys.meta_path.insert(0, RefuseAfterYade())
    return _loaded


def find_yade() -> Path:
    """Folder that contains the `yade` package: the one in SURGEBREAK_YADE if that is set, else the distribution's.

    Raises YadeMissing, WrongYade."""
    named = os.environ.get("SURGEBREAK_YADE")
    if named:
        if not _is_yade(Path(named)):
            raise YadeMissing(
                f"SURGEBREAK_YADE = {named} holds no YADE; "
                "name the folder .../py/yade of the unpacked package, or unset the variable"
            )
        return Path(named).resolve().parent
    for pattern in PACKAGED:
        for place in sorted(glob.glob(pattern)):
            if _is_yade(Path(place)):
                return Path(place).resolve().parent
    other = importlib.util.find_spec("yade")
    if other is not None:
        raise WrongYade(
            f"the Python package 'yade' at {_place(other)} is not the discrete element code YADE; "
            "remove it (pip uninstall yade) and install the real one (apt install yade)"
        )
    raise YadeMissing(
        f"YADE is not installed (looked for {', '.join(PACKAGED)}); install it with 'apt install yade' on Debian 12, "
        "or let ./surgebreak do it; water-only cases run without it"
    )


def _place(package: ModuleSpec | None) -> str:
    """The file of a package, or its folder where that has no `__init__.py`."""
    if package is None:
        return "an unknown place"
    return package.origin or next(iter(package.submodule_search_locations or ()), "an unknown place")


def _is_yade(package: Path) -> bool:
    return (
        (package / "wrapper").exists()
        or bool(list(package.glob("boot*.so")))
        or (package / "__init__.py").exists()
    )


def require_packages() -> None:
    """Raise YadeNeedsPackage where one of the packages that YADE uses undeclared is absent."""
    absent = [name for name in UNDECLARED if importlib.util.find_spec(name) is None]
    if absent:
        names = " ".join(name.lower() for name in absent)
        raise YadeNeedsPackage(f"YADE needs the Python package(s) {names}; install with: pip install {names}")


def _refuse_present() -> None:
    present = [name for name in REFUSED if name in sys.modules]
    if present:
        raise CrashesAfterYade(
            f"{', '.join(present)} is already imported; it and YADE crash in one process. "
            "Make pictures in a process of their own (surgebreak render RUN)"
        )


class RefuseAfterYade:
    """Import hook: a readable refusal instead of a segmentation fault."""

    def find_spec(self, name: str, path=None, target=None):
        if name.partition(".")[0] in REFUSED:
            raise CrashesAfterYade(
                f"'{name}' cannot be imported in a process that holds YADE (it would crash); "
                "make pictures in a process of their own (surgebreak render RUN)"
            )


def _import_yade(folder: Path) -> Engine:
    sys.path.insert(0, str(folder))
    package = None
    try:
        package = importlib.import_module("yade")
        place = _place(package.__spec__)
        if not Path(place).resolve().is_relative_to(folder):
            raise WrongYade(
                f"'yade' was imported from {place}, not from {folder}; remove it (pip uninstall yade)"
            )
        utils = importlib.import_module("yade.utils")
        wrapper = importlib.import_module("yade.wrapper")
        algebra = importlib.import_module("yade.minieigenHP")
        version = importlib.import_module("yade.config").version
    except ImportError as error:
        raise YadeImportFailed(
            f"YADE at {folder} does not load: {error}; it needs the system's Python (/usr/bin/python3) and the "
            "packages of 'apt install yade'; try 'apt install --reinstall yade python3-yade'"
        ) from error
    return Engine(package.O, utils, wrapper, algebra.Vector3, algebra.Quaternion, version)


@contextlib.contextmanager
def _side_effects_undone():
    flags, path, names = sys.getdlopenflags(), list(sys.path), set(dir(builtins))
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            yield
    finally:
        sys.setdlopenflags(flags)
        sys.path[:] = path
        clean_builtins(names)
    _remove_at_exit(Path(_loaded_tmp()).parent)


def _loaded_tmp() -> str:
    return sys.modules["yade"].O.tmpFilename()


def clean_builtins(keep: set[str]) -> None:
    """Remove the names that YADE defined in builtins (O, newton, collider, ...)."""
    for name in set(dir(builtins)) - keep:
        if name != "_":
            delattr(builtins, name)


def _remove_at_exit(folder: Path) -> None:
    if folder.name.startswith("yade-"):
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
