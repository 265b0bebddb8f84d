"""The cache of compiled kernels: for each module, one folder for each state of its code and of all that it imports.

Numba renews a cached kernel when its own file changes, but not when a function that it calls in another file does;
after an update of the checkout it would run old code. It also takes the path of a file as a part of the kernel's name,
so that every checkout would compile anew. Here the folder of a module is named by a checksum of its code and of the
code that it imports from the same packages, directly or not. An edit therefore compiles again what it can change and
nothing else, and checkouts share the rest. Comments and docstrings do not count as code: rewording them compiles
nothing. Numba's own key contains the processor.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from coupler.program.errors import SurgebreakError
from coupler.program.provenance import ROOT

ROOMS = ("fluid", "yade_scripts", "coupler", "kernels")
TESTS = "tests"
"""Kernels in tests call those of the program, so they too are kept by the content of all that they import; by numba's
own key, the file of the test, a test would go on with the code from before a change."""
KEPT = 8  # states of a module: those of the last few versions, or of checkouts side by side
NUMBA_S_OWN = "UserProvidedCacheLocator"  # for functions in other files, such as laws from elsewhere

_IMPORT = re.compile(
    r"^\s*(?:from\s+([\w.]+)\s+import\s+(?:\(([^)]*)\)|([^\n(]+))|import\s+([\w.]+))", re.MULTILINE
)
_TOKEN = re.compile(
    r"""("{3}|'{3})(?:\\.|(?!\1).)*\1|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'|\#[^\n]*|[()\[\]{}]""",
    re.DOTALL,
)
"""A string in triple quotes (group 1 holds the quotes), any other string, a comment, or a bracket."""


class NoCache(SurgebreakError):
    """No folder for compiled kernels can be written, and numba does not compile without one."""


def use_kernel_cache() -> None:
    """Have numba keep kernels by their content, unless NUMBA_CACHE_DIR is set; before numba is imported.

    The place is below XDG_CACHE_HOME or ~/.cache; where nothing can be written there, in a folder of the user's own
    among the temporary files, and a line says so. Raises NoCache."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    tried: list[Path] = []
    for home in _homes():
        place = home / "surgebreak" / "kernels"
        if _is_usable(place, home):
            if tried:
                _tell(f"note: nothing can be written in {tried[0]}; compiled kernels are kept in {home}")
            os.environ["NUMBA_CACHE_DIR"] = str(place)
            os.environ["NUMBA_CACHE_LOCATOR_CLASSES"] = f"{__name__}.{ByContent.__name__},{NUMBA_S_OWN}"
            return
        tried.append(home)
    raise NoCache(
        f"compiled kernels can be kept nowhere (tried {', '.join(map(str, tried))}); name a folder that you may write "
        "to: XDG_CACHE_HOME=DIR"
    )


class ByContent:
    """A cache locator of numba, which gives it the folder of a function's module."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    @classmethod
    def from_function(cls, py_func: object, py_file: str) -> ByContent | None:
        """The locator of a function that is defined in a file; None for a file outside of the packages of kernels."""
        folder = folder_of(Path(py_file), Path(os.environ["NUMBA_CACHE_DIR"]))
        return None if folder is None else cls(folder)

    def ensure_cache_path(self) -> None:
        """Make the folder. Raises OSError where that fails."""
        if not self._folder.is_dir():
            self._folder.mkdir(parents=True, exist_ok=True)
            _drop_oldest(self._folder.parent)

    def get_cache_path(self) -> str:
        """The folder, as numba wants it."""
        return str(self._folder)

    def get_source_stamp(self) -> str:
        """The state of the code from which a kernel in the folder was compiled: the folder's own name."""
        return self._folder.name

    def get_disambiguator(self) -> None:
        """None: no line number enters the name of a kernel's file, since functions of a module have different names."""


@functools.cache
def folder_of(py_file: Path, place: Path) -> Path | None:
    """Where kernels of a module are kept below a place; None for a file outside of the packages of kernels."""
    source = py_file.resolve()
    if not (source.is_relative_to(ROOT) and source.relative_to(ROOT).parts[0] in (*ROOMS, TESTS)):
        return None
    digest = hashlib.sha256()
    for path in sorted(_with_imports(source)):  # with names: numba imports the module of a kernel by its name
        digest.update(f"{path.relative_to(ROOT)}\0".encode())
        digest.update(_code(path).encode())
    name = ".".join(source.relative_to(ROOT).with_suffix("").parts)
    return place / name / digest.hexdigest()[:16]


def _with_imports(source: Path) -> set[Path]:
    """A module of the packages of kernels and all that it imports from them, directly or not."""
    found: set[Path] = set()
    ahead = [source]
    while ahead:
        path = ahead.pop()
        if path not in found:
            found.add(path)
            ahead.extend(_imports(path))
    return found


@functools.cache
def _code(path: Path) -> str:
    return without_words(path.read_text(encoding="utf-8"))


def without_words(source: str) -> str:
    """Python source without comments, blank lines and docstrings; the same program for every source that differs in
    these alone.

    A docstring is found as a statement of its own: a string in triple quotes, outside of brackets, that fills its
    lines. A string with a prefix, or in single quotes, is kept, which costs a needless compilation at worst. Blank
    lines are dropped from other strings too, which kernels do not print."""
    kept, last, depth = [], 0, 0
    for token in _TOKEN.finditer(source):
        start, end = token.span()
        depth += {"(": 1, "[": 1, "{": 1, ")": -1, "]": -1, "}": -1}.get(token[0], 0)
        if token[0][0] == "#" or (token[1] and depth == 0 and _fills_its_lines(source, start, end)):
            kept.append(source[last:start])
            last = end
    kept.append(source[last:])
    return "\n".join(line for line in map(str.rstrip, "".join(kept).split("\n")) if line)


def _fills_its_lines(source: str, start: int, end: int) -> bool:
    """Whether nothing but indentation stands before a part of the source, nothing after it on its last line, and the
    line before is not continued by a backslash."""
    line = source.rfind("\n", 0, start) + 1
    before, after = source[line:start], source[end : end + 1]
    return before.strip(" ") == "" and after in ("", "\n") and source[line - 2 : line - 1] != "\\"


@functools.cache
def _imports(path: Path) -> tuple[Path, ...]:
    files = []
    for module, within, listed, whole in _IMPORT.findall(_code(path)):
        dotted = module or whole
        if dotted.split(".")[0] in (*ROOMS, TESTS):
            base = ROOT.joinpath(*dotted.split("."))
            names = re.findall(r"\w+", within or listed)
            files += [base.with_suffix(".py"), base / "__init__.py"]
            files += [base / name / "__init__.py" for name in names] + [base / f"{name}.py" for name in names]
    return tuple(file for file in files if file.is_file())


def _drop_oldest(states: Path) -> None:
    """Leave the newest few of a module's folders."""
    with contextlib.suppress(OSError):
        by_age = sorted(states.iterdir(), key=lambda state: state.stat().st_mtime, reverse=True)
        for state in by_age[KEPT:]:
            shutil.rmtree(state, ignore_errors=True)


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
