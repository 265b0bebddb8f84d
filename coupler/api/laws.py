"""Cohesive laws of the user: a file or an object is registered under the names that a case may use."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from yade_scripts.joints.cohesion import CohesiveLaw


def register_law(law: CohesiveLaw | Path | str, name: str | None = None) -> str:
    """Register a cohesive law, so that cases of this process may use it, `[joints] law = "NAME"`, and return its name.

    law: a file NAME.py that defines LAW and is executed, or a `CohesiveLaw`, for which `name` must be given. Processes
    started by this one know the law of a file, but not an object. Raises BadLaw for a law that is incomplete, and for
    the name of a law that surgebreak has.
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
