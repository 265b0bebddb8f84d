"""The schema of `expected.toml`: expected results ([[expect]]), figures that the README states ([[stated]]) and curves
over data ([[curve]]), checked before a run begins.

The entries are described where they are used: `results/expected.py`, `results/stated.py`, `view/over_data.py`,
`compare/outcome.py`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from coupler.case.paths import BadPath, read_text
from coupler.case.toml_lines import key_lines, line_of, shown
from coupler.program.errors import briefly

FILE_NAME = "expected.toml"
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Text = Annotated[str, Field(strict=True, min_length=1)]
Pair = tuple[Number, Number]
FIGURE = "{}"
"""Stands for the figure in the text of [[stated]]."""
NEEDS = {"at": ("time",), "integral": ("from", "to"), "arrival": ("above",)}
"""Names that a kind of `take` cannot do without."""


class _Entry(BaseModel):
    model_config = ConfigDict(extra="forbid", populate_by_name=True)


class _Taken(_Entry):
    """A number from a column of a history."""

    table: Text
    column: Text
    take: Literal["last", "largest", "max", "min", "mean", "at", "integral", "period", "arrival"]
    tolerance: Annotated[Number, Field(ge=0)] | None = None
    time: Number | None = None
    from_: Number | None = Field(None, alias="from")
    to: Number | None = None
    above: Number | None = None

    @model_validator(mode="after")
    def _takes(self) -> Self:
        given = self.model_dump(by_alias=True, exclude_none=True)
        missing = [name for name in NEEDS.get(self.take, ()) if name not in given]
        if missing:
            raise ValueError(f"take = '{self.take}' needs {' and '.join(missing)}")
        start, end = self.from_, self.to
        if (start is None) != (end is None):
            raise ValueError("from and to belong together")
        if start is not None and end is not None and not start < end:
            raise ValueError(f"from ({start:g}) must be less than to ({end:g})")
        return self


class Expect(_Taken):
    """One promise."""

    what: Text
    value: Number | None = None
    at_least: Number | None = None
    at_most: Number | None = None
    compare: Literal["peak_force", "dissipated"] | None = None
    source: str = ""

    @model_validator(mode="after")
    def _bounded(self) -> Self:
        bounds = self.at_least is not None or self.at_most is not None
        if (self.value is None) == (not bounds) or (self.value is None) != (self.tolerance is None):
            raise ValueError("give value and tolerance, or at_least, at_most or both of these")
        return self


class Stated(_Taken):
    """A figure of this program that the README of the case states."""

    text: Text
    scale: Number = 1.0

    @model_validator(mode="after")
    def _marked(self) -> Self:
        if self.text.count(FIGURE) != 1:
            raise ValueError(f"text must mark the place of the figure once, as {FIGURE}")
        return self


class Reference(_Entry):
    """A measured curve or band."""

    file: Text
    x: Text
    label: str
    y: Text | None = None
    low: Text | None = None
    high: Text | None = None
    x_scale: Number = 1.0
    y_scale: Number = 1.0

    @model_validator(mode="after")
    def _whole(self) -> Self:
        if (self.y is None) == (self.low is None) or (self.low is None) != (self.high is None):
            raise ValueError("give y, or low and high")
        return self


class Curve(_Entry):
    """A curve of the run over data."""

    figure: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]
    panel: str
    table: Text
    column: Text | None = None
    columns: tuple[Text, ...] | None = None
    places: tuple[Number, ...] | None = None
    above: Number | None = None
    label: str = "computed"
    x_label: str = "time [s]"
    x_scale: Number = 1.0
    y_scale: Number = 1.0
    x_range: Pair | None = None
    y_range: Pair | None = None
    references: tuple[Reference, ...] = ()

    @model_validator(mode="after")
    def _whole(self) -> Self:
        if (self.column is None) == (self.columns is None):
            raise ValueError("give column, or columns with places and above")
        if self.columns and (self.above is None or len(self.places or ()) != len(self.columns)):
            raise ValueError("columns need above, and places of the same number")
        return self


class Promises(_Entry):
    """The whole file."""

    expect: tuple[Expect, ...] = ()
    stated: tuple[Stated, ...] = ()
    curve: tuple[Curve, ...] = ()


def mistakes_in(directory: Path) -> list[str]:
    """One line for each mistake in the expected.toml of a case directory; none without the file."""
    path = directory / FILE_NAME
    try:
        if not path.exists():
            return []
        text = read_text(path)
        table = tomllib.loads(text)
        Promises.model_validate(table)
    except BadPath as error:
        return [f"{path}: {error}"]
    except ValidationError as error:
        lines = key_lines(text)
        return [_line(path, entry, lines) for entry in error.errors()]
    except (OSError, ValueError, RecursionError) as error:
        return [f"{path}: not valid TOML: {error}"]
    return []


def _line(path: Path, error: Mapping[str, Any], lines: dict) -> str:
    place = error["loc"]
    number = line_of(place, lines)
    where = f"{path}:{number}" if number else str(path)
    if error["type"] == "extra_forbidden":
        return f"{where}: {shown(place)}: unknown name"
    if error["type"] == "missing":
        return f"{where}: {shown(place)}: missing"
    if error["type"] == "value_error":
        return f"{where}: {shown(place)}: {error['ctx']['error']}"
    message = error["msg"]
    return f"{where}: {shown(place)}: {briefly(error['input'])}: {message[:1].lower()}{message[1:]}"
