"""Who may import whom: water and structure know nothing of each other, pictures are made from files alone."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from coupler.program.provenance import ROOT

ALLOWED = {
    "fluid": {"fluid"},
    "yade_scripts": {"yade_scripts", "yade"},
    "coupler": {"coupler", "fluid", "yade_scripts"},
    "coupler/commands/view": {"coupler"},
    "kernels": set(),
    "array_types.py": set(),
}
"""Packages of this project, and YADE, that each room, or a module beside them, may import."""


def imports(path):
    """(line, module) of every import of a file, at whatever depth."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, name.name) for name in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.lineno, node.module


def files(room):
    if room.endswith(".py"):
        return [ROOT / room]
    found = (ROOT / room).rglob("*.py")
    return [path for path in found if room != "coupler" or "view" not in path.relative_to(ROOT).parts]


@pytest.mark.parametrize("room", ALLOWED)
def test_imports_stay_within_the_rooms(room):
    watched = {"fluid", "yade_scripts", "coupler", "yade"}
    wrong = [
        f"{path.relative_to(ROOT)}:{line}: {module}"
        for path in files(room)
        for line, module in imports(path)
        if module.split(".")[0] in watched - ALLOWED[room]
    ]
    assert wrong == []


OWN_PROCESSES = {ROOT / "coupler" / "geometry" / "terrain" / "raster.py"}
"""Programs that import what crashes after YADE."""


def test_only_programs_of_their_own_know_vtk_and_gdal():
    """VTK or GDAL after YADE in one process is a segmentation fault, so no part of the solver may import them."""
    wrong = [
        f"{path.relative_to(ROOT)}:{line}: {module}"
        for room in ("fluid", "yade_scripts", "coupler", "kernels")
        for path in files(room)
        if path not in OWN_PROCESSES
        for line, module in imports(path)
        if module.split(".")[0] in {"vtk", "vtkmodules", "pyvista", "rasterio"}
    ]
    assert wrong == []


def test_the_contracts_of_pyproject_hold():
    """import-linter follows chains of imports, which the walk above does not."""
    done = subprocess.run(
        [Path(sys.executable).parent / "lint-imports", "--no-cache"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout


def test_no_module_imports_itself_by_way_of_others():
    """Contracts hold chapters apart; within one, two modules that need each other are one module, or need a third."""
    modules = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
        for room in ("fluid", "yade_scripts", "coupler", "kernels")
        for path in (ROOT / room).rglob("*.py")
    }
    below = {
        name: {m for m in named(path, modules) if m in modules and m != name}
        for name, path in modules.items()
    }
    while (
        True
    ):  # whatever imports nothing that is left, or is imported by nothing that is left, lies on no circle
        above = set().union(*below.values())
        on = {name for name, others in below.items() if others & below.keys() and name in above}
        if on == below.keys():
            break
        below = {name: below[name] & on for name in on}
    assert sorted(below) == []


def named(path, modules):
    """What a file imports of these modules, as a whole or a thing in it; names of types alone are no imports."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    tree.body = [
        n for n in tree.body if not (isinstance(n, ast.If) and ast.unparse(n.test) == "TYPE_CHECKING")
    ]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            inside = (f"{node.module}.{name.name}" for name in node.names)
            yield from (name if name in modules else node.module for name in inside)


def test_the_page_names_every_chapter():
    """Whoever looks for the place of a change starts there."""
    page = (ROOT / "docs" / "how_it_runs.md").read_text(encoding="utf-8")
    listed = page[page.index("## Packages and chapters") : page.index("## One run")]
    chapters = {
        f"`{init.parent.name}`"
        for room in ("fluid", "yade_scripts", "coupler")
        for init in (ROOT / room).glob("*/__init__.py")
    }
    assert {chapter for chapter in chapters if f"| {chapter} |" not in listed} == {"`cli`"}


HEAVY = {
    "yade",
    "yade_scripts",
    "skfem",
    "scipy",
    "numba",
    "vtk",
    "pyvista",
    "vtkmodules",
    "matplotlib",
    "pint",
    "h5py",
}


@pytest.mark.parametrize(
    ("command", "absent"),
    [
        ("--help", HEAVY | {"numpy", "pydantic"}),
        ("run --help", HEAVY | {"numpy"}),
        ("explain joints.strength", HEAVY | {"numpy"}),
    ],
)
def test_help_and_explanations_load_little(command, absent):
    """Help answers at once: nothing numerical is imported for it."""
    code = (
        "import sys; sys.argv = ['surgebreak', *sys.argv[1:]]\n"
        "from coupler.commands.cli import main\n"
        "try: main()\n"
        "except SystemExit as end: assert not end.code, end.code\n"
        "print(*sys.modules, file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *command.split()], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert {name.split(".")[0] for name in done.stderr.split()} & absent == set()
