"""Points of a grid from a CSV file: one line per point, one column per key of the case or name for formulas.

A head may carry a unit in brackets ("joints.strength [MPa]"), then its cells are plain numbers; without, a cell is what
stands behind --set NAME=... Lines that begin with # are comments.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

from coupler.case.paths import BadPath, read_text
from coupler.case.records import repeated
from coupler.case.sweep_names import key_problem
from coupler.commands.sweep.vary import plain
from coupler.program.errors import BadCase


@dataclass(frozen=True)
class Head:
    """A column of the file: its name in tables, the key that it sets ("" for formulas alone), the unit of its cells."""

    name: str
    key: str
    unit: str


@dataclass(frozen=True)
class InputTable:
    """heads, and a tuple of cells for each line."""

    heads: tuple[Head, ...]
    lines: tuple[tuple, ...]


def read_table(path: Path) -> InputTable:
    """The points of a file. Raises BadCase with every mistake."""
    try:
        text = read_text(path)
    except BadPath as error:
        raise BadCase([f"sweep.table: {path}: {error}"]) from error
    numbered = [
        (k, line) for k, line in enumerate(text.splitlines(), start=1) if line.strip() and line[0] != "#"
    ]
    rows = [
        (k, [cell.strip() for cell in row])
        for (k, _), row in zip(numbered, csv.reader(line for _, line in numbered))
    ]
    if len(rows) < 2:
        raise BadCase([f"{path}: a line of names and a line for each point of the grid are needed"])
    heads = tuple(_head(cell) for cell in rows[0][1])
    wrong = [f"{path}:{rows[0][0]}: {mistake}" for mistake in _wrong_heads(heads)]
    wrong += [
        f"{path}:{k}: {len(row)} cells under {len(heads)} names"
        for k, row in rows[1:]
        if len(row) != len(heads)
    ]
    wrong += [
        f"{path}:{k}: {head.name}: an empty cell"
        for k, row in rows[1:]
        for head, cell in zip(heads, row)
        if not cell
    ]
    if wrong:
        raise BadCase(wrong)
    return InputTable(heads, tuple(tuple(_cell(h, c) for h, c in zip(heads, row)) for _, row in rows[1:]))


def _head(text: str) -> Head:
    found = re.fullmatch(r"(.*?)(?:\s+\[([^\]]+)\])?", text)
    name, unit = found[1], found[2] or ""
    is_key = "." in name
    return Head(name.rpartition(".")[2].partition("[")[0] if is_key else name, name if is_key else "", unit)


def _wrong_heads(heads: tuple[Head, ...]):
    for head in heads:
        if head.key and key_problem(head.key):
            yield key_problem(head.key)
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", head.name):
            yield f"'{head.name}' is no name for a column"
    twice = repeated([head.name for head in heads])
    if twice:
        yield f"two columns are called '{twice}'; name one with sweep.vary instead"


def _cell(head: Head, cell: str) -> object:
    return f"{cell} {head.unit}" if head.unit else plain(cell)
