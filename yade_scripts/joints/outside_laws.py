"""Cohesive laws from outside the program: from a file that the user names, from an object made by a script, or from an
installed package with an entry point in the group `surgebreak.laws`.

A case file names laws and never runs code. The laws here were named by the user: on the command line, in a script, in
the variable SURGEBREAK_LAWS (which passes the files on to processes started by this one), or by installing a package.
A law is checked when it is registered; docs/add_a_law.md lists the requirements.
"""

from __future__ import annotations

import importlib.util
import os
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

import numpy as np

from yade_scripts.joints.law import CohesiveLaw
from yade_scripts.joints.specialise import in_python

GROUP = "surgebreak.laws"
VARIABLE = "SURGEBREAK_LAWS"
SHIPPED = Path(__file__).parent / "laws"
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
POINTS = 401
"""Openings at which a law is examined."""
SLACK = 1e-6
"""Of tractions and works without dimensions; what the trapezoidal rule leaves of a work is judged by its own error."""

_registered: dict[str, CohesiveLaw] = {}
_origins: dict[str, str] = {}
_files: dict[Path, str] = {}


class BadLaw(ValueError):
    """A law from outside cannot be used; the message names its origin and the requirement that it misses."""

    exit_code = 2


def register(name: str, law: CohesiveLaw, origin: str = "a script") -> None:
    """Register a law under a name that case files may then use: `[joints] law = "NAME"`.

    It replaces a law of this name from an earlier script or file. Raises BadLaw.
    """
    if not NAME.fullmatch(name):
        raise BadLaw(f"{origin}: '{name}' cannot name a law; letters, digits, _ and -, a letter first")
    if (SHIPPED / f"{name}.py").exists():
        raise BadLaw(f"{origin}: a law called '{name}' comes with surgebreak; give yours another name")
    _registered[name], _origins[name] = examined(law, f"{origin}: law '{name}'"), origin


def register_file(path: Path | str) -> str:
    """Run a Python file that defines LAW, register this under the name of the file, and return the name. Raises BadLaw.

    Processes that are started later take the file too.
    """
    path = Path(path).resolve()
    if path in _files:
        return _files[path]
    if path.suffix != ".py" or not path.is_file():
        raise BadLaw(f"{path}: no Python file; a law is a file NAME.py that offers LAW (docs/add_a_law.md)")
    spec = importlib.util.spec_from_file_location(f"surgebreak_law_{path.stem}", path)
    assert spec is not None  # the name ends in .py
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # numba looks its functions up there
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise BadLaw(f"{path}: cannot be run: {type(error).__name__}: {error}") from error
    register(path.stem, _offered(module, str(path)), str(path))
    _files[path] = path.stem
    os.environ[VARIABLE] = os.pathsep.join(map(str, _files))
    return path.stem


def names() -> list[str]:
    """Names of all laws from outside; packages that offer them are listed without being loaded."""
    _take_files()
    return sorted({*_registered, *_packaged()})


def find(name: str) -> CohesiveLaw | None:
    """The law of that name, or None. Raises BadLaw if a package declares it and cannot provide it."""
    _take_files()
    if name not in _registered and name in _packaged():
        point = _packaged()[name]
        origin = f"{point.value} (package {point.dist.name if point.dist else 'unknown'})"
        try:
            found = point.load()
        except Exception as error:
            raise BadLaw(f"{origin}: cannot be loaded: {type(error).__name__}: {error}") from error
        register(name, _offered(found, origin), origin)
    return _registered.get(name)


def origin(name: str) -> str | None:
    """Origin of the law of that name; None for those that come with surgebreak."""
    return _origins.get(name)


def _take_files() -> None:
    for place in filter(None, os.environ.get(VARIABLE, "").split(os.pathsep)):
        register_file(place)


def _packaged() -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=GROUP)}


def _offered(found: Any, origin: str) -> CohesiveLaw:
    """The law itself, or LAW of a module."""
    law = getattr(found, "LAW", found)
    if not isinstance(law, CohesiveLaw):
        raise BadLaw(f"{origin}: offers no LAW = CohesiveLaw(secant, work, ...)")
    return law


# ---------------------------------------------------------------- examination


def examined(law: CohesiveLaw, place: str) -> CohesiveLaw:
    """The law, its functions compiled by numba if they were not, if it holds what the solver relies on. Raises BadLaw.

    At the lowest, the usual and the highest peak: s finite at 0, never negative and never rising, s r at most 1 and
    1 at the peak, w the integral of s r, w - s r²/2 never falling.
    """
    from numba import njit

    if not 0.0 < law.lowest_peak <= law.peak <= law.highest_peak < 1.0:
        raise BadLaw(f"{place}: needs 0 < lowest_peak <= peak <= highest_peak < 1")
    law = replace(law, secant=_compiled(law.secant, njit), work=_compiled(law.work, njit))
    for peak in sorted({law.lowest_peak, law.peak, law.highest_peak}):
        problem = _problem(law, peak)
        if problem:
            raise BadLaw(f"{place}, peak = {peak:g}: {problem}")
    return law


def carried_at_failure(law: CohesiveLaw, peak: float | None) -> float:
    """T/T_max that a joint of this law still carries when it reaches opening_at_failure and fails."""
    return float(law.secant(1.0, law.peak if peak is None else peak))


def _compiled(function: Callable, njit: Callable) -> Callable:
    return function if hasattr(function, "py_func") else njit(function)


def _problem(law: CohesiveLaw, peak: float) -> str:
    """The requirement that the law misses for this peak; empty if it meets all."""
    r = np.unique(np.append(np.linspace(0.0, 1.0, POINTS), peak))
    try:
        secant = np.array([float(in_python(law.secant)(q, peak)) for q in r.tolist()])
        work = np.array([float(in_python(law.work)(q, peak)) for q in r.tolist()])
    except (ArithmeticError, TypeError, ValueError) as error:
        return f"cannot be evaluated for 0 <= r <= 1: {error}"
    T = secant * r
    at = int(np.searchsorted(r, peak))
    if not (np.isfinite(secant).all() and np.isfinite(work).all()):
        return "secant and work must be finite for 0 <= r <= 1"
    if secant.min() < -SLACK * secant[0]:
        return f"secant is negative at r = {r[int(secant.argmin())]:.3g}: an opening joint would push"
    rising = np.diff(secant)
    if (rising > SLACK * secant[0]).any():
        return f"secant rises at r = {r[int(rising.argmax())]:.3g}; it may only fall (damage softens)"
    if T.max() > 1.0 + SLACK or abs(T[at] - 1.0) > SLACK:
        return f"s r is {T.max():.6g} at most and {T[at]:.6g} at the peak; both must be 1 (T_max)"
    wrong = abs(work[0]) + np.abs(np.diff(work) - 0.5 * (T[1:] + T[:-1]) * np.diff(r))
    allowed = SLACK + 0.5 * np.abs(np.diff(T)) * np.diff(r)  # of the trapezoidal rule where T is monotonic
    if (wrong > allowed).any():
        k = int((wrong - allowed).argmax())
        return (
            f"work is no integral of s r from 0: between r = {r[k]:.4g} and {r[k + 1]:.4g} it grows by "
            f"{work[k + 1] - work[k]:.4g}, the area is {0.5 * (T[k] + T[k + 1]) * (r[k + 1] - r[k]):.4g}"
        )
    lost = np.diff(work - 0.5 * T * r)
    if (lost < -SLACK).any():
        return f"w - s r²/2 falls at r = {r[int(lost.argmin())]:.3g}: the joint would give lost energy back"
    return ""
