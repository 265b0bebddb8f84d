"""`surgebreak.sweep`: what scripts read of a sweep.

table = surgebreak.sweep.open("cases/fragility_of_a_wall/runs/sweep")
table.attrs["units"]["depth"]                         # "m"
table[table.outcome == "done"].groupby("depth").broken.mean()
run = surgebreak.sweep.run("cases/fragility_of_a_wall/runs/sweep", 7)
"""

from __future__ import annotations

import builtins
import json
from pathlib import Path
from typing import TYPE_CHECKING

from coupler.api.run import Run
from coupler.commands.sweep.folder import read_spec
from coupler.commands.sweep.results import open_sweep as open
from coupler.program.errors import UnknownName

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["fragility", "open", "run"]


def run(folder: Path | str, row: int) -> Run:
    """The run of a row, as `surgebreak.open` gives it. Raises NoRun, UnknownName (no such row)."""
    spec = read_spec(Path(folder))
    if not 0 <= row < len(spec.rows):
        raise UnknownName(f"{folder}: there is no row {row}; there are 0 to {len(spec.rows) - 1}")
    return Run(spec.place(spec.rows[row].id))


def fragility(folder: Path | str, name: str) -> pd.DataFrame:
    """A curve of the sweep: intensity, and for each state its probability with the ends of the band (NAME, NAME_low,
    NAME_high). `attrs` has the medians [unit of the measure], the dispersion and the measure with its unit.

    Raises UnknownName where there is no such curve, with the reason.
    """
    import pandas as pd

    path = Path(folder) / "fragility.json"
    with builtins.open(path, encoding="utf-8") as file:
        found = {f["name"]: f for f in json.load(file)}
    if name not in found or found[name]["refused"]:
        why = found[name]["refused"] if name in found else f"there are {', '.join(found) or 'none'}"
        raise UnknownName(f"{path}: no curve '{name}': {why}")
    f = found[name]
    columns = {f["measure"]["name"]: f["curves"][0]["x"]}
    for curve in f["curves"]:
        columns[curve["state"]] = curve["p"]
        for end in ("low", "high"):
            if curve[end] is not None:
                columns[f"{curve['state']}_{end}"] = curve[end]
    frame = pd.DataFrame(columns)
    frame.attrs = {
        "measure": f["measure"],
        "median": {curve["state"]: curve["median"] for curve in f["curves"]},
        "dispersion": f["dispersion"],
    }
    return frame
