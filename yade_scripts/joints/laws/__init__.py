"""Cohesive laws, one file a law; the name of the file is the name of the law.

A file offers `LAW`, a `CohesiveLaw`: secant and work of a law in pure opening, without dimensions. Nothing
else in the program knows a law by its formula.
"""

from __future__ import annotations

import difflib
from importlib import import_module
from pkgutil import iter_modules

from yade_scripts.joints.law import CohesiveLaw


class UnknownLaw(ValueError):
    """No law of that name; the message gives the nearest one and all there are."""

    exit_code = 2


def names() -> list[str]:
    """Names of the laws, sorted. Imports none of them."""
    return sorted(module.name for module in iter_modules(__path__))


def find(name: str) -> CohesiveLaw:
    """The law of that name. Raises UnknownLaw."""
    known = names()
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1, cutoff=0.0)
        raise UnknownLaw(
            f"joints.law = '{name}': there is no such law; did you mean '{near[0]}'? Laws: {', '.join(known)}"
        )
    return import_module(f"{__name__}.{name}").LAW
