"""The section [study]: what `surgebreak study` varies and measures. It has no effect on a run of the case."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from coupler.case.types import Name, Number, PositiveTime, Section
from coupler.case.units import InSI

Value = bool | int | float | str | tuple[bool | int | float | str, ...]
Override = Annotated[str, Field(pattern=r"^[^=\s]+\s*=.*\S")]
Time = Annotated[float, InSI("s", ge=0)]
Count = Annotated[int, Field(strict=True, ge=1, le=100)]


class Quantity(Section):
    """A number of a run, and what it is compared with: an exact answer, a measurement, or the finest run."""

    name: Name = Field(description="of figures and tables", examples=["peak_force"])
    what: str = Field("", description="the same for people; absent: the name")
    unit: str = Field("", description="of the number, for tables")
    table: str | None = Field(
        None, description="history table in the run directory, with column", examples=["history/gauges.csv"]
    )
    column: str | None = Field(None, description="column of the table", examples=["box_force_x"])
    figure: str | None = Field(
        None,
        description="instead of table and column: a name under figures in run.json; dots lead into its tables",
        examples=["verdict.largest.force.value"],
    )
    take: Literal["last", "largest", "max", "min", "mean", "at", "integral", "period", "arrival", "curve"] = (
        Field(
            "last",
            description="number that the column gives: largest is by size with its sign, at and arrival need time and "
            "above, integral needs window; curve: root mean square distance from the reference curve",
        )
    )
    window: tuple[Time, Time] | None = Field(
        None, description="from and to when the column counts; absent: the whole run"
    )
    time: Time | None = Field(None, description="when, for take = at")
    above: Number | None = Field(
        None, description="value passed, for take = arrival; between two rows on a line"
    )
    compared: Literal["peak_force", "dissipated"] | None = Field(
        None, description="the same quantity in `surgebreak compare`, for ladders with laws"
    )
    against: Literal["exact", "measured", "finest"] = Field(
        description="what errors are against: exact (value or path), measured (value or path, with its band), finest "
        "(the last run of a ladder)"
    )
    value: float | str | None = Field(
        None,
        description="the reference: a number, or a formula of names of the case",
        examples=["9/16 * joints.strength * joints.opening_at_failure"],
    )
    path: str | None = Field(
        None,
        description="the reference: a CSV file, from the directory of the case or one of "
        "coupler/reference by its name; take is applied to it as well",
    )
    columns: tuple[str, str] | None = Field(None, description="time and value in that file")
    band: Number | None = Field(None, description="half the width of the scatter of the measurement")
    band_columns: tuple[str, str] | None = Field(
        None, description="instead of band: columns of the file with the lower and upper end"
    )
    scale: Number | None = Field(
        None, description="what errors are divided by; absent: the size of the reference"
    )
    ladder: Name | None = Field(
        None, description="ladder whose last run is the finest; absent: there is only one"
    )
    source: str = Field("", description="where the reference comes from")

    @model_validator(mode="after")
    def _whole(self) -> Self:
        wrong = [*_reading_problems(self), *_reference_problems(self)]
        if wrong:
            raise ValueError("; ".join(wrong))
        return self


def _reading_problems(q: Quantity) -> Iterator[str]:
    if (q.figure is None) == (q.table is None and q.column is None) or (q.table is None) != (
        q.column is None
    ):
        yield "give either table and column, or figure"
    needs = {"at": ("time", q.time), "arrival": ("above", q.above), "integral": ("window", q.window)}
    name, given = needs.get(q.take, ("", 0))
    if given is None:
        yield f"take = '{q.take}' needs {name}"
    if q.take == "curve" and q.path is None:
        yield "take = 'curve' needs a curve: path and columns"
    if q.figure is not None and q.take != "last":
        yield f"a figure of run.json is one number; take = '{q.take}' is for columns"


def _reference_problems(q: Quantity) -> Iterator[str]:
    """One kind of reference a quantity: an error against a measurement is none against an exact answer."""
    given = [n for n in ("value", "path") if getattr(q, n) is not None]
    scatter = [n for n in ("band", "band_columns") if getattr(q, n) is not None]
    if q.against == "finest" and (given or scatter):
        yield (
            f"against = 'finest' and {', '.join([*given, *scatter])}: references must be of one kind; leave "
            "them out, or say against = 'exact' or 'measured'"
        )
    if q.against != "finest" and len(given) != 1:
        yield f"against = '{q.against}' needs one of value and path"
    if q.against != "finest" and q.ladder is not None:
        yield (
            f"ladder is for against = 'finest'; against = '{q.against}' has its own: "
            "references must be of one kind"
        )
    if q.against == "exact" and scatter:
        yield f"{scatter[0]} is the scatter of a measurement; an exact answer has none: say against = 'measured'"
    if q.against == "measured" and len(scatter) != 1:
        yield "against = 'measured' needs the scatter of the measurement: band, or band_columns"
    if (q.path is None) != (q.columns is None):
        yield "path and columns go together"
    if q.band_columns is not None and q.path is None:
        yield "band_columns are columns of the file that path names"


class Ladder(Section):
    """Runs that differ in one respect, from coarse to fine: mesh, step, law, scheme."""

    name: Name = Field(description="for --ladder and the legend", examples=["h"])
    what: str = Field("", description="the same for people; absent: the name")
    key: str | tuple[str, ...] | None = Field(
        None,
        description="name of the case that changes, or several that change together",
        examples=["tank.cell"],
    )
    values: tuple[Value, ...] = Field(
        (), description="its values, from coarse to fine; with several names: a list for each run"
    )
    larger: tuple[Value, ...] = Field((), description="further values, run with --larger only")
    labels: tuple[str, ...] = Field(
        (), description="what the runs are called in figures; absent: their values"
    )
    sizes: tuple[Annotated[float, InSI("", gt=0)], ...] = Field(
        (),
        description="lengths, times or other measures of the runs for the order of convergence; absent: the values, "
        "where they have a unit",
    )
    across: Name | None = Field(
        None, description="another ladder: a curve for each of its values; that one has none of its own then"
    )
    set: tuple[Override, ...] = Field((), description="further changes of all runs of the ladder, KEY=VALUE")
    laws: tuple[str, ...] = Field(
        (), description="instead of key: laws of `surgebreak compare`, ours and YADE's own"
    )
    substeps: tuple[Count, ...] = Field(
        (), description="with laws: multiples of the case's own substep, from large to small"
    )

    @model_validator(mode="after")
    def _whole(self) -> Self:
        wrong = list(_law_problems(self) if self.laws or self.substeps else _ladder_problems(self))
        if wrong:
            raise ValueError("; ".join(wrong))
        return self


def _law_problems(ladder: Ladder) -> Iterator[str]:
    if not (ladder.laws and ladder.substeps):
        yield "laws and substeps go together"
    others = [n for n in ("key", "values", "larger", "labels", "sizes", "across") if getattr(ladder, n)]
    if others:
        yield f"laws and {', '.join(others)}: a ladder has either laws or a key"


def _ladder_problems(ladder: Ladder) -> Iterator[str]:
    if ladder.key is None or not ladder.values:
        yield "give key and values, or laws and substeps"
        return
    runs = [*ladder.values, *ladder.larger]
    for name in ("labels", "sizes"):
        given = getattr(ladder, name)
        if given and len(given) != len(runs):
            yield f"{len(given)} {name} for {len(runs)} values"
    if isinstance(ladder.key, tuple):
        width = len(ladder.key)
        if any(not isinstance(value, tuple) or len(value) != width for value in runs):
            yield f"with {width} names every value is a list of {width}"
    if ladder.across == ladder.name:
        yield "across is another ladder"


class Variant(Section):
    """The same case with a part of the program switched off: what that part costs."""

    name: Name = Field(description="the part that is off", examples=["viscosity"])
    set: tuple[Override, ...] = Field(
        min_length=1, description="what switches it off, KEY=VALUE", examples=[["joints=absent"]]
    )


class Study(Section):
    """What `surgebreak study` runs. A run of the case takes no notice of it."""

    note: str = Field("", description="what its figures show, for its page")
    set: tuple[Override, ...] = Field(
        (), description="changes of all runs of the study, KEY=VALUE", examples=[["time.end=1 s"]]
    )
    repeat: Count = Field(1, description="times that each run is made; its cost is that of the cheapest one")
    cpu_seconds: PositiveTime = Field(
        3600.0,
        description="processor time after which a run is given up and reported as failed; takes the place of "
        "limits.cpu_seconds",
    )
    quantity: tuple[Quantity, ...] = Field(min_length=1, description="what is measured")
    ladder: tuple[Ladder, ...] = Field(min_length=1, description="what is varied")
    off: tuple[Variant, ...] = Field((), description="parts switched off one by one, for their cost")
