"""Cohesive laws of the user: a file or an object is registered under the names that a case may use."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from yade_scripts.joints.cohesion import CohesiveLaw


def register_law(law: CohesiveLaw | Path | str, name: str | None = None) -> str:
    """Make a cohesive law known, so that cases of this process may name it: `[joints] law = "NAME"`; its name.

    law: a file NAME.py that offers LAW, which is run, or a `CohesiveLaw`; then `name` must be given. Processes that
    this one starts take a file too, an object they do not. Raises BadLaw for what lacks what a law must hold, and for
    a name that surgebreak has a law of.
    """
    from yade_scripts.joints import outside_laws

    if isinstance(law, Path | str):
        if name is not None:
            raise TypeError("register_law: the law of a file has the name of the file; leave `name` out")
        return outside_laws.register_file(law)
    if name is None:
        raise TypeError("register_law: give the law of a script a name")
    outside_laws.register(name, law)
    return name
