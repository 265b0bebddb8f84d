"""Packages that only some commands need: the extras of pyproject.toml, and the message where one is absent."""

from __future__ import annotations

from importlib import metadata

from coupler.program.errors import SurgebreakError

EXTRAS = {
    "view": ("pyvista", "matplotlib", "imageio-ffmpeg", "pillow"),
    "benchmark": ("pyamg",),
    "drawing": ("manifold3d", "trimesh"),
    "cad": ("gmsh",),
    "ifc": ("ifcopenshell",),
    "terrain": ("rasterio", "pyproj", "pyogrio", "shapely"),
    "offshore": ("anuga",),
    "sweep": ("matplotlib",),
    "parquet": ("pandas", "pyarrow"),
    "slurm": ("submitit",),
    "dask": ("dask-jobqueue",),
    "test": ("pytest", "hypothesis", "manifold3d", "trimesh", "pyamg", "statsmodels"),
    "pandas": ("pandas",),
    "docs": ("mkdocs-material", "latex2mathml"),
}
"""Packages of an extra; of those that tests need, without the tools that read the code."""
COMMANDS = {"view": "render", "benchmark": "benchmark", "sweep": "sweep", "test": "test", "docs": "docs"}
"""Command of the launcher that installs the extra; others are installed by pip."""


class NotInstalled(SurgebreakError):
    """A package of an extra is absent."""


def absent(extra: str) -> list[str]:
    """Packages of the extra that are not installed."""
    return [name for name in EXTRAS[extra] if not _is_there(name)]


def _is_there(name: str) -> bool:
    """Whether a package is installed, from the installer's records: the importer refuses VTK in a process with YADE."""
    try:
        metadata.distribution(name)
    except metadata.PackageNotFoundError:
        return False
    return True


def missing(extra: str) -> str:
    """The missing packages of an extra and how to install them; empty if none is missing."""
    names = absent(extra)
    if not names:
        return ""
    what = f"{', '.join(names)} {'is' if len(names) == 1 else 'are'} not installed"
    by_pip = f".venv/bin/pip install -c constraints.txt -e '.[{extra}]'"
    if extra not in COMMANDS:
        return f"{what} (the extra `{extra}`); in the checkout `{by_pip}` brings it"
    return (
        f"{what} (the extra `{extra}`); `./surgebreak {COMMANDS[extra]}` of the checkout brings it, "
        f"or there: {by_pip}"
    )


def need(extra: str) -> None:
    """Raise NotInstalled, with the remedy, where a package of the extra is absent."""
    message = missing(extra)
    if message:
        raise NotInstalled(message)
