"""Histories: one CSV table for each subject, with a row for each step.

Lines that begin with '#' give name, unit and meaning (with the sign) of every column; then the names; then rows
with as many digits as tell two floats apart. A row is in the file as soon as it is written, and a row that a killed
run left unfinished is not read.
"""

import csv
import io
import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupler.case.paths import BadPath, read_text
from coupler.program.errors import FULL, ExitCode, SurgebreakError, did_you_mean
from coupler.results.storage import DiskFull, NotFinite, WrongShape


@dataclass(frozen=True)
class Column:
    """name · unit ("1" for a pure number, "" for text) · meaning, with that of a positive sign."""

    name: str
    unit: str
    meaning: str


class BadTable(SurgebreakError):
    """A file that is not a table of a run, or that was changed since; the message names it."""

    exit_code = ExitCode.BAD_CASE


QUOTED = ('"', "\n", "\r")
"""What, beside a comma, puts a cell into quotes."""
MOST_BYTES = 4_000_000_000
"""Size of a table that is read: millions of steps."""


@dataclass(frozen=True)
class History:
    """A history table: columns as declared, values by name (float (rows,), NaN where empty, or text)."""

    title: str
    columns: tuple
    values: dict

    def __getitem__(self, name):
        """The values of a column. Raises BadTable where there is none of that name."""
        if name not in self.values:
            hint = did_you_mean(name, self.values) or f". It has {', '.join(self.values)}"
            raise BadTable(f"the table '{self.title}' has no column '{name}'{hint}")
        return self.values[name]


@dataclass(frozen=True)
class ByBlock:
    """A table with a row for each block at each time, as arrays: label, the column that names blocks · times (t,) ·
    names (n,) · values (t, n) by column, NaN where a row is missing."""

    label: str
    times: np.ndarray
    names: list
    values: dict


def by_block(history):
    """The ByBlock of a table with a column of text; None for one with a row for each time."""
    label = next((c.name for c in history.columns if c.unit == ""), None)
    if label is None or "time" not in history.values:
        return None
    times, at = np.unique(history["time"], return_inverse=True)
    names = list(dict.fromkeys(history[label].tolist()))
    of = np.array([names.index(name) for name in history[label].tolist()], int)
    values = {}
    for column in history.columns:
        if column.name not in ("time", label):
            values[column.name] = np.full((len(times), len(names)), np.nan)
            values[column.name][at, of] = history[column.name]
    return ByBlock(label, times, names, values)


class CannotContinue(SurgebreakError):
    """A result file is not as the run left it, so it cannot be continued."""


class HistoryTable:
    """A growing CSV table; columns: Column or (name, unit, meaning).

    keep: `place` at which an existing table is continued; later rows are cut off. Raises CannotContinue.
    """

    def __init__(self, path, columns, title=None, keep=None):
        self.path = Path(path)
        self.columns = tuple(c if isinstance(c, Column) else Column(*c) for c in columns)
        self._names = [c.name for c in self.columns]
        self._known = set(self._names)
        self._title = title or self.path.stem
        self._rows = 0
        mode = "x" if keep is None else "r+"
        if keep is not None:
            self._check_kept(keep)
        self._file = open(self.path, mode, newline="", encoding="utf-8")  # noqa: SIM115 (lives as long as the run)
        self._size = 0
        if keep is None:
            self._write(header(self._title, self.columns))
        else:
            self._rows, self._size = keep
            self._file.truncate(self._size)
            self._file.seek(self._size)

    def _check_kept(self, keep):
        """Check that the table exists, has these columns, and is at least as long as it was."""
        if not self.path.exists() or self.path.stat().st_size < keep[1]:
            raise CannotContinue(f"{self.path} is shorter than it was when the checkpoint was written")
        with open(self.path, newline="", encoding="utf-8") as file:
            wanted = header(self._title, self.columns)
            if file.read(len(wanted)) != wanted:
                raise CannotContinue(f"{self.path} has other columns than this version of the program writes")

    @property
    def place(self):
        """Rows and bytes written so far."""
        return self._rows, self._size

    def append(self, **row):
        """Write one row, every column by its name; None leaves a cell empty, NaN and infinity are refused.

        Raises NotFinite, WrongShape (missing or unknown names), DiskFull.
        """
        names = self._names
        if row.keys() != self._known:
            missing, unknown = sorted(set(names) - set(row)), sorted(set(row) - set(names))
            raise WrongShape(
                f"{self.path}, row {self._rows}: missing columns {missing}, unknown columns {unknown}"
            )
        self._write(line([self._cell(name, row[name]) for name in names]))
        self._rows += 1

    def _cell(self, name, value):
        if type(value) is not float:
            if value is None or isinstance(value, str):
                return value or ""
            value = value.item() if hasattr(value, "item") else value
        if not math.isfinite(value):
            raise NotFinite(f"{self.path}: {name} is {value} in row {self._rows}; None leaves a cell empty")
        return repr(value) if type(value) is float else number(value)

    def _write(self, text):
        """Write and flush; if the disk is full, the incomplete line is removed."""
        try:
            self._file.write(text)
            self._file.flush()
        except OSError as error:
            if error.errno not in FULL:
                raise
            self._abandon(self._size)
            raise DiskFull(self.path, len(text), f"and holds {self._rows} rows", error) from None
        self._size += len(text.encode("utf-8"))

    def _abandon(self, whole):
        """Cut the file back to its last complete row and discard what Python has buffered."""
        descriptor = os.dup(self._file.fileno())
        try:
            self._file.close()
        except OSError:  # the same full disk, again: closing tries to write the rest
            pass
        finally:
            os.ftruncate(descriptor, whole)
            os.close(descriptor)

    def close(self):
        """Close the file; rows are in it already."""
        self._file.close()

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.close()


def header(title, columns):
    """The '#' lines and the line of names."""
    lines = [f"# {title}"] + [f"# {c.name} [{c.unit}]: {c.meaning}" for c in columns]
    return "\n".join(lines) + "\n" + line([c.name for c in columns])


def line(cells):
    """One CSV line."""
    text = ",".join(cells)
    if text.count(",") == len(cells) - 1 > 0 and not any(mark in text for mark in QUOTED):
        return text + "\n"
    return _quoted(cells)


def _quoted(cells):
    """One CSV line, some cells of which stand in quotes."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue()


def number(value):
    """The shortest text that reads back as the same number."""
    value = value.item() if hasattr(value, "item") else value
    return str(int(value)) if isinstance(value, (bool, int)) else repr(float(value))


def read_history(path):
    """Read a table written by HistoryTable or write_cracks, also while it grows; an unfinished last row is left out.

    Raises BadTable for what is no such table."""
    try:
        whole = read_text(Path(path), most=MOST_BYTES).rpartition("\n")[0].splitlines()
        about = [text[2:] for text in whole if text.startswith("# ")]
        records = list(csv.reader(text for text in whole if not text.startswith("#")))
        columns = tuple(_declared(text) for text in about[1:])
        _check_whole(columns, records)
        cells = list(zip(*records[1:])) or [()] * len(columns)
        values = {c.name: _values(c, given) for c, given in zip(columns, cells)}
    except BadPath as error:
        raise BadTable(f"{path}: {error}") from error
    except (ValueError, csv.Error) as error:
        raise BadTable(f"{path}: not a table as a run writes it: {error}") from error
    return History(about[0], columns, values)


def _check_whole(columns, records):
    """Check that the line of names agrees with the header, without repeats, and that every row has a value for each."""
    names = [c.name for c in columns]
    if not records or records[0] != names or len(set(names)) < len(names):
        raise ValueError("its columns are not those that its head declares")
    bad = next((k for k, row in enumerate(records[1:]) if len(row) != len(names)), None)
    if bad is not None:
        raise ValueError(f"row {bad} has {len(records[bad + 1])} values, there are {len(names)} columns")


def _declared(text):
    name, _, rest = text.partition(" [")
    unit, _, meaning = rest.partition("]: ")
    return Column(name, unit, meaning)


def _values(column, cells):
    if column.unit == "":
        return np.array(cells, dtype=str)
    return np.array([float(c) if c else np.nan for c in cells])


def write_table(path, title, columns, arrays):
    """Write a whole table: columns of Column, arrays (n,) of numbers or texts; a value that is not finite leaves its
    cell empty.

    The file is written under another name and renamed, so a killed run leaves either the old or the new table. Raises
    DiskFull."""
    body = io.StringIO()
    csv.writer(body, lineterminator="\n").writerows(zip(*(_table_cells(values) for values in arrays)))
    _replace(Path(path), header(title, columns) + body.getvalue())


def _table_cells(values):
    """The texts of a column: an array (n,) of numbers, or a list of numbers and texts."""
    return [_table_cell(value) for value in (values.tolist() if isinstance(values, np.ndarray) else values)]


def _table_cell(value):
    if isinstance(value, float):
        return float.__repr__(value) if math.isfinite(value) else ""
    return value if isinstance(value, str) else str(int(value))


def _replace(path, text):
    beside = path.with_name(path.name + ".new")
    try:
        beside.write_text(text, encoding="utf-8")
        os.replace(beside, path)
    except OSError as error:
        if error.errno not in FULL:
            raise
        beside.unlink(missing_ok=True)
        raise DiskFull(path, len(text), "as it was before", error) from None
