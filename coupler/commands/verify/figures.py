"""Reference figures of the package; each file names its source and licence in its header."""

from __future__ import annotations

import numpy as np

from coupler.case.records import SHIPPED, read_record


def columns(name: str) -> dict[str, np.ndarray]:
    """Columns of reference/<name>.csv by their heading; every entry a number."""
    return read_record(SHIPPED / f"{name}.csv")


def named_values(name: str) -> dict[str, float]:
    """Name → value of reference/<name>.csv with the columns name, value, unit, formula; names may hold commas."""
    rows = [row.rsplit(",", 3) for row in _lines(name)[1:]]
    return {row[0]: float(row[1]) for row in rows}


def _lines(name: str) -> list[str]:
    lines = (SHIPPED / f"{name}.csv").read_text(encoding="utf-8").splitlines()
    return [line for line in lines if not line.startswith("#")]
