"""The histories of runs that are drawn over one another: those that the user names, or broken joints and gauges."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coupler.commands.diff.figures import LAST, Run
from coupler.program.errors import UnknownName, did_you_mean
from coupler.results.history import History

MOST = 12
"""Panels that are drawn unless the user names them."""
LITTLE = 0.1
"""Share of the largest component of a vector below which another one is not drawn."""


def chosen(runs: Sequence[Run], names: Sequence[str]) -> list[str]:
    """TABLE.COLUMN of the curves to draw. Raises UnknownName where no run has one that was asked for."""
    return [_known(runs, name) for name in names] if names else _usual(runs)


def _known(runs: Sequence[Run], name: str) -> str:
    table, _, column = name.partition(".")
    read = [found for run in runs if (found := run.history(table)) is not None]
    if not read:
        tables = sorted({path.stem for run in runs for path in (run.path / "history").glob("*.csv")})
        raise UnknownName(
            f"--curve {name}: no run has a history '{table}'{did_you_mean(table, tables) or '.'} There are "
            f"{', '.join(tables)}; write TABLE.COLUMN, for instance water.volume"
        )
    columns = dict.fromkeys(c.name for found in read for c in found.columns if c.unit and c.name != "time")
    if column not in columns:
        raise UnknownName(
            f"--curve {name}: the history '{table}' has no column '{column}'{did_you_mean(column, columns) or '.'} "
            f"It has {', '.join(columns)}"
        )
    return name


def _usual(runs: Sequence[Run]) -> list[str]:
    """Broken joints where any broke, and the gauges; of a vector the components that count."""
    found: dict[str, None] = {}
    if any(run.figures.get("joints_broken") for run in runs):
        found["structure.joints_broken"] = None
    for run in runs:
        gauges = run.history("gauges")
        if gauges is not None:
            found |= dict.fromkeys(f"gauges.{name}" for name in _that_count(gauges))
    return list(found)[:MOST]


def _that_count(gauges: History) -> list[str]:
    sizes = {c.name: float(np.nanmax(np.abs(gauges[c.name]), initial=0.0)) for c in gauges.columns}
    return [
        name
        for name in sizes
        if name != "time" and not name.endswith(LAST) and sizes[name] > LITTLE * _largest_beside(name, sizes)
    ]


def _largest_beside(name: str, sizes: dict[str, float]) -> float:
    """Largest size of the vector that a column is a component of; 0 for a number."""
    if name[-2:] not in ("_x", "_y", "_z"):
        return 0.0
    return max(sizes.get(f"{name[:-2]}_{axis}", 0.0) for axis in "xyz")
