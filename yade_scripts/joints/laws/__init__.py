"""Cohesive laws, one file a law; the name of the file is the name of the law.

Each file defines `LAW`, a `CohesiveLaw`: dimensionless secant and work in pure opening. No other part of the program
contains the formula of a law. Laws of users are added by `outside_laws`.
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
    """Sorted names of all laws: those of this folder, which are not imported, and those from outside."""
    return sorted({*shipped(), *outside_laws.names()})


def shipped() -> list[str]:
    """Names of the laws of this folder."""
    return sorted(module.name for module in iter_modules(__path__))


def identity(name: str) -> dict[str, str]:
    """Origin of the law of that name, and a checksum of its source. Raises UnknownLaw."""
    from yade_scripts.joints.specialise import source_checksum

    law = find(name)
    where = outside_laws.origin(name) or "surgebreak"
    return {"from": where, "checksum": f"{source_checksum(law.secant, law.work):08x}"}


def unknown(name: str) -> str:
    """What to say of a law that does not exist: the nearest name, all there are, and how to add one."""
    near = difflib.get_close_matches(name, names(), n=1)
    meant = f"; did you mean '{near[0]}'?" if near else "."
    return f"there is no law '{name}'{meant} Laws: {', '.join(names())}; one of your own is named by --law FILE.py"


def find(name: str) -> CohesiveLaw:
    """The law of that name. Raises UnknownLaw, and BadLaw for the law of a package that does not meet the
    requirements."""
    if name not in shipped():
        found = outside_laws.find(name)
        if found is not None:
            return found
    if name not in names():
        raise UnknownLaw(f"joints.law: {unknown(name)}")
    return import_module(f"{__name__}.{name}").LAW
