"""Measured and exact records: tables of numbers in CSV files, of a case or among those that come with the program.

A file begins with comment lines (#) that name source and licence, then the names of the columns, then numbers.
"""

from __future__ import annotations

import csv
from functools import lru_cache
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.case.paths import BadPath, place_of, read_text
from coupler.program.errors import BadCase, did_you_mean

SHIPPED = Path(__file__).parent.parent / "reference"
"""The records that come with the program, each once."""


class NoSuchData(BadCase):
    """A case names a record or a column that does not exist."""


def find_record(file: str | Path, directory: Path) -> Path:
    """The file, from the directory of the case; if there is none there, the one of that name among SHIPPED.

    Raises BadPath."""
    place = place_of(file, directory)
    shipped = SHIPPED / file
    return shipped if not place.exists() and shipped.is_file() else place


@lru_cache(maxsize=32)
def read_record(path: Path) -> dict[str, Array]:
    """Columns (n,) by their heading.  Raises NoSuchData for what is no such table."""
    try:
        text = read_text(path)
        rows = list(csv.reader(line for line in text.splitlines() if line and not line.startswith("#")))
        names = [name.strip() for name in rows[0]]
        values = np.array([[float(entry) for entry in row] for row in rows[1:]], float)
        columns = {name: values[:, k] for k, name in enumerate(names)}
    except BadPath as error:
        raise NoSuchData([f"{path}: {error}; those that come with the program are in {SHIPPED}"]) from error
    except (ValueError, IndexError, csv.Error) as error:
        raise NoSuchData([f"{path}: no table of numbers under a line of names: {error}"]) from error
    twice = repeated(names)
    if twice:
        raise NoSuchData([f"{path}: the column '{twice}' is there twice; rename or remove one"])
    if not np.isfinite(values).all():
        raise NoSuchData([f"{path}: not all of its numbers are finite"])
    return columns


def repeated(names: list[str]) -> str | None:
    """The first name that is there twice."""
    return next((name for k, name in enumerate(names) if name in names[:k]), None)


def column(table: dict[str, Array], name: str, file: str | Path) -> Array:
    """The column of that name.  Raises NoSuchData."""
    if name not in table:
        raise NoSuchData(
            [f"{file}: no column '{name}'{did_you_mean(name, table)}; there are {', '.join(table)}"]
        )
    return np.asarray(table[name], float)
