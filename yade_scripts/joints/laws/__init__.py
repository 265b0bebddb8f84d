"""Cohesive laws, one file a law; the name of the file is the name of the law.

A file offers `LAW`, a `CohesiveLaw`: secant and work of a law in pure opening, without dimensions. Nothing
else in the program knows a law by its formula. Laws of users come by `outside_laws`.
"""

from __future__ import annotations

import difflib
from importlib import import_module
from pkgutil import iter_modules

from yade_scripts.joints import outside_laws
from yade_scripts.joints.law import CohesiveLaw


class UnknownLaw(ValueError):
    """No law of that name; the message gives the nearest one and all there are."""

    exit_code = 2


def names() -> list[str]:
    """Names of all laws, sorted: those of this folder, and those from outside. Imports none of this folder."""
    return sorted({*shipped(), *outside_laws.names()})


def shipped() -> list[str]:
    """Names of the laws of this folder."""
    return sorted(module.name for module in iter_modules(__path__))


def identity(name: str) -> dict[str, str]:
    """Where the law of that name is from, and a checksum of its source. Raises UnknownLaw."""
    from yade_scripts.joints.specialise import source_checksum

    law = find(name)
    where = outside_laws.origin(name) or "surgebreak"
    return {"from": where, "checksum": f"{source_checksum(law.secant, law.work):08x}"}


def find(name: str) -> CohesiveLaw:
    """The law of that name. Raises UnknownLaw, and BadLaw for one of a package that does not hold what a law must."""
    if name not in shipped():
        found = outside_laws.find(name)
        if found is not None:
            return found
    known = names()
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1, cutoff=0.0)
        raise UnknownLaw(
            f"joints.law = '{name}': there is no such law; did you mean '{near[0]}'? Laws: {', '.join(known)}; "
            "one of your own is named by --law FILE.py"
        )
    return import_module(f"{__name__}.{name}").LAW
