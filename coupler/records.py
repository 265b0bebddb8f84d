"""Measured and exact records: tables of numbers in CSV files, of a case or among those that come with the program.

A file begins with comment lines (#) that name source and licence, then the names of the columns, then numbers.
"""

from __future__ import annotations

import csv
from functools import lru_cache
from pathlib import Path

import numpy as np

from coupler.errors import BadCase, did_you_mean

SHIPPED = Path(__file__).parent / "verify" / "reference"
"""The records that come with the program, each once."""


class NoSuchData(BadCase):
    """A case names a record or a column that is not there."""


def find_record(file: str | Path, directory: Path) -> Path:
    """The file, from the directory of the case; if there is none there, the one of that name among SHIPPED."""
    place = (directory / Path(file).expanduser()).resolve()
    shipped = SHIPPED / file
    return shipped if not place.exists() and shipped.is_file() else place


@lru_cache(maxsize=32)
def read_record(path: Path) -> dict[str, np.ndarray]:
    """Columns (n,) by their heading.  Raises NoSuchData for what is no such table."""
    if not path.exists():
        raise NoSuchData([f"{path}: no such file; those that come with the program are in {SHIPPED}"])
    try:
        text = path.read_text(encoding="utf-8")
        rows = list(csv.reader(line for line in text.splitlines() if line and not line.startswith("#")))
        values = np.array([[float(entry) for entry in row] for row in rows[1:]], float)
        return {name.strip(): values[:, k] for k, name in enumerate(rows[0])}
    except (OSError, ValueError, IndexError) as error:
        raise NoSuchData([f"{path}: no table of numbers under a line of names: {error}"]) from error


def column(table: dict[str, np.ndarray], name: str, file: str | Path) -> np.ndarray:
    """The column of that name.  Raises NoSuchData."""
    if name not in table:
        raise NoSuchData(
            [f"{file}: no column '{name}'{did_you_mean(name, table)}; there are {', '.join(table)}"]
        )
    return np.asarray(table[name], float)
