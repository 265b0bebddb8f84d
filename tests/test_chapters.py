"""Docstrings of the chapters: whoever looks for a module starts from the list in `__init__.py` (how_it_runs.md)."""

import ast
import re

import pytest

from coupler.program.provenance import ROOT

ROOMS = ("fluid", "yade_scripts", "coupler")
COMMANDS = ("benchmark", "compare", "offshore", "stress", "study", "sweep")
"""Commands whose docstring is such a list; those of other commands say in a sentence what they do."""
NO_LISTS = {"coupler/api", "coupler/cli"}
"""Chapters whose docstring is no list of modules."""

LISTED = sorted(
    {
        *ROOMS,
        *(f"{room}/{init.parent.name}" for room in ROOMS for init in (ROOT / room).glob("*/__init__.py")),
        *(f"coupler/commands/{name}" for name in COMMANDS),
    }
    - NO_LISTS
)


@pytest.mark.parametrize("chapter", LISTED)
def test_the_docstring_of_a_chapter_names_all_that_it_contains(chapter):
    """A module that is not named there is found by a search at best, and is written a second time at worst."""
    folder = ROOT / chapter
    docstring = ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8"))) or ""
    contents = {path.stem for path in folder.glob("*.py") if not path.stem.startswith("__")}
    contents |= {init.parent.name for init in folder.glob("*/__init__.py")}
    assert sorted(contents - set(re.findall(r"\w+", docstring))) == []
