"""Stock laws by name, and the scripts that run them."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np

LAWS = ("cohfrict", "jcfpm", "mortar", "cpm", "frict")
"""Files of this package that hold a law."""
FOLDER = Path(__file__).parent


class UnknownStockLaw(ValueError):
    """The name is no stock law, or the law has no such variant."""


@dataclass(frozen=True)
class StockLaw:
    """A law and one of its variants; name "cohfrict" or "cohfrict:energy"."""

    name: str
    variant: str
    module: ModuleType

    @property
    def title(self) -> str:
        """Title for display, with the variant unless it is the first."""
        first = next(iter(self.module.VARIANTS))
        return self.module.TITLE if self.variant == first else f"{self.module.TITLE}, {self.variant}"

    @property
    def not_matched(self) -> tuple[str, ...]:
        """Properties of the joints of a case that the law cannot reproduce."""
        return (*self.module.VARIANTS[self.variant], *self.module.NOT_MATCHED)

    @property
    def stem(self) -> str:
        """Stem of the names of its files."""
        return self.name.replace(":", "_")


def stock_law(name: str) -> StockLaw:
    """The law "file" or "file:variant". Raises UnknownStockLaw."""
    file, _, variant = name.partition(":")
    if file not in LAWS:
        raise UnknownStockLaw(f"'{name}' is no stock law; there are {', '.join(stock_names())}")
    module = import_module(f"yade_scripts.stock.{file}")
    variant = variant or next(iter(module.VARIANTS))
    if variant not in module.VARIANTS:
        raise UnknownStockLaw(
            f"'{name}': {file} has no variant '{variant}', but {', '.join(module.VARIANTS)}"
        )
    return StockLaw(name, variant, module)


def stock_names() -> list[str]:
    """All names of `stock_law`: the first variant of each law, then the others as law:variant."""
    names = []
    for file in LAWS:
        _, *others = import_module(f"yade_scripts.stock.{file}").VARIANTS
        names += [file, *(f"{file}:{variant}" for variant in others)]
    return names


def script_text(law: StockLaw, scene: dict) -> str:
    """A script that `yade -x -n` runs: the scene (`scene.timed`), the energy of linear springs, the file
    of the law, and the driver."""
    described = json.dumps(scene, indent=1)
    head = (
        f'"""{law.title} on the blocks of a case. Run with: yade -x -n {law.stem}.py\n\n'
        f"Writes {law.stem}.csv (a row a record) and {law.stem}.json. Not matched: {'; '.join(law.not_matched)}.\n"
        '"""\n'
        "from yade import O, utils\n"
        "from yade.minieigenHP import Quaternion, Vector3\n"
        "from yade.wrapper import (\n"
        "    Bo1_Sphere_Aabb, ForceResetter, InsertionSortCollider, InteractionLoop, NewtonIntegrator\n"
        ")\n"
    )
    data = described.replace("true", "True").replace("false", "False")
    parts = [head, f'LAW = "{law.stem}"\nSCENE = {data}\n']
    files = ("elastic", law.name.partition(":")[0], "driver")
    parts += [(FOLDER / f"{file}.py").read_text(encoding="utf-8") for file in files]
    return "\n\n".join(parts)


class NoYadeCommand(RuntimeError):
    """The command `yade` is not installed."""


class ScriptFailed(RuntimeError):
    """A stock script ended with an error."""


@dataclass(frozen=True)
class StockRun:
    """The results of a script: columns of its table by name, and its figures."""

    table: dict[str, np.ndarray]
    figures: dict


def run_script(law: StockLaw, scene: dict, folder: Path) -> StockRun:
    """Write the script of a law into a folder and run it with `yade`, in a separate process.

    Raises NoYadeCommand, ScriptFailed.
    """
    command = shutil.which("yade")
    if command is None:
        raise NoYadeCommand(
            "the command `yade` is not on the PATH; stock laws run in it (apt install yade); the scripts "
            "can be written and run elsewhere, with yade -x -n SCRIPT"
        )
    path = folder / f"{law.stem}.py"
    path.write_text(script_text(law, scene), encoding="utf-8")
    done = subprocess.run(
        [command, "-x", "-n", "-j1", path.name], cwd=folder, capture_output=True, text=True, check=False
    )
    figures = path.with_suffix(".json")
    if done.returncode != 0 or not figures.exists():
        last = " | ".join((done.stderr or done.stdout).strip().splitlines()[-3:])
        raise ScriptFailed(f"{path}: yade ended with {done.returncode}: {last}")
    return StockRun(read_table(path.with_suffix(".csv")), json.loads(figures.read_text(encoding="utf-8")))


def read_table(path: Path) -> dict[str, np.ndarray]:
    """Columns of a table with names in the first line."""
    names = path.read_text(encoding="utf-8").partition("\n")[0].split(",")
    return dict(zip(names, np.atleast_2d(np.loadtxt(path, delimiter=",", skiprows=1)).T))
