"""The section [sweep]: what `surgebreak sweep` varies and measures. It has no effect on a run of the case."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from coupler.case.study import Count, Override, Time, Value
from coupler.case.types import Length, Name, Number, PositiveTime, Section, Switch
from coupler.case.units import InSI

Amount = float | str
"""A number in SI or text with a unit; the key that it is for says which units fit."""
Many = Annotated[int, Field(strict=True, ge=1, le=1_000_000)]
Seed = Annotated[int, Field(strict=True, ge=0, le=2**31 - 1)]
Share = Annotated[float, InSI("", gt=0, lt=1)]

NEEDS = {
    "uniform": (("low", "high"),),
    "normal": (("mean", "deviation"), ("mean", "variation")),
    "lognormal": (("median", "dispersion"), ("mean", "variation")),
    "weibull": (("scale", "shape"), ("mean", "variation")),
}
"""What each distribution is given by: one of these pairs."""
PARAMETERS = tuple(dict.fromkeys(n for pairs in NEEDS.values() for pair in pairs for n in pair))


class Varied(Section):
    """Something in which the runs differ: a list, a grid from low to high, or a distribution. Lists and grids are
    crossed with one another; distributions are drawn together, `samples` times at each point of the grid."""

    name: Name | None = Field(None, description="of its column; absent: the last part of the key")
    key: str | tuple[str, ...] | None = Field(
        None,
        description="name of the case that it sets, or several that all get the value; absent: it stands in the "
        "formulas of sweep.link alone",
        examples=["water.fill[0].upper[2]"],
    )
    what: str = Field("", description="the same for people; absent: the name")
    unit: str = Field("", description="of a quantity without a key, for tables; a key has its own")
    values: tuple[Value, ...] = Field((), description="a list of values", examples=[["0.8 m", "1 m"]])
    low: Amount | None = Field(None, description="first value of a grid, or lower end of uniform")
    high: Amount | None = Field(None, description="last value of a grid, or upper end of uniform")
    steps: Annotated[int, Field(strict=True, ge=2, le=100_000)] | None = Field(
        None, description="values of a grid from low to high"
    )
    spacing: Literal["linear", "log"] = Field("linear", description="of a grid: equal steps, or equal ratios")
    distribution: Literal["uniform", "normal", "lognormal", "weibull"] | None = Field(
        None,
        description="uniform: low and high; normal: mean and deviation (or variation); lognormal: median and "
        "dispersion (or mean and variation); weibull: scale and shape (or mean and variation)",
    )
    mean: Amount | None = Field(None, description="mean")
    median: Amount | None = Field(None, description="value that half of the samples are below")
    deviation: Amount | None = Field(None, description="standard deviation")
    variation: Annotated[float, InSI("", gt=0)] | None = Field(
        None, description="standard deviation over the mean"
    )
    dispersion: Annotated[float, InSI("", gt=0)] | None = Field(
        None, description="standard deviation of the natural logarithm"
    )
    scale: Amount | None = Field(None, description="of weibull: value that 63 % of the samples are below")
    shape: Annotated[float, InSI("", gt=0)] | None = Field(None, description="of weibull: its exponent")
    lower: Amount | None = Field(None, description="the distribution is cut off below; absent: it is not")
    upper: Amount | None = Field(None, description="the distribution is cut off above; absent: it is not")
    whole: Switch = Field(
        False,
        description="true: whole numbers alone. Those of uniform, from low to high, are equally likely; samples of "
        "other distributions and values of a grid are rounded to the nearest, so that one at which a distribution is "
        "cut off has the samples of one side alone",
    )

    @model_validator(mode="after")
    def _whole(self) -> Self:
        wrong = list(_varied_problems(self))
        if wrong:
            raise ValueError("; ".join(wrong))
        return self

    @property
    def keys(self) -> tuple[str, ...]:
        """The names of the case that it sets."""
        return (self.key,) if isinstance(self.key, str) else (self.key or ())

    @property
    def column(self) -> str:
        """Its name in tables and formulas."""
        return self.name or self.keys[0].rpartition(".")[2].partition("[")[0]


def _varied_problems(v: Varied) -> Iterator[str]:
    if v.key is None and v.name is None:
        yield "give key, or the name by which formulas of sweep.link know it"
    if v.key is not None and v.unit:
        yield "unit is for a quantity without a key; a key has its own"
    kinds = {
        "values": bool(v.values),
        "steps": v.steps is not None,
        "distribution": v.distribution is not None,
    }
    given = [kind for kind, there in kinds.items() if there]
    if len(given) != 1:
        yield f"give one of values, steps (with low and high) and distribution{_both(given)}"
        return
    kind = given[0]
    set_here = [n for n in PARAMETERS if getattr(v, n) is not None]
    if kind == "distribution" and v.distribution is not None:
        pairs = NEEDS[v.distribution]
        if set(set_here) not in [set(pair) for pair in pairs]:
            ways = ", or ".join(" and ".join(pair) for pair in pairs)
            yield f"distribution = '{v.distribution}' is given by {ways}; here: {', '.join(set_here) or 'nothing'}"
        return
    cut = [n for n in ("lower", "upper") if getattr(v, n) is not None]
    wanted = ["low", "high"] if kind == "steps" else []
    if set(set_here) != set(wanted) or cut:
        here = ", ".join([*set_here, *cut]) or "nothing"
        yield f"{kind} goes with {' and '.join(wanted) or 'nothing else'}; here: {here}"


def _both(given: list[str]) -> str:
    return f"; here: {', '.join(given)}" if given else ""


class Link(Section):
    """A name of the case that follows from others, so that a run stays a case: a tank as high as its water needs."""

    key: str = Field(description="the name that is set", examples=["tank.upper[2]"])
    formula: str = Field(
        description="in SI, of columns of the sweep and of names of the case, in the order of the links",
        examples=["2 * depth"],
    )


class SweepQuantity(Section):
    """A number of every run: from a history, run.json, the joints, the way of the blocks, or other quantities."""

    name: Name = Field(description="of its column", examples=["depth"])
    what: str = Field("", description="the same for people; absent: the name")
    unit: str = Field("", description="of the number, for tables and figures; absent: that of the column")
    table: str | None = Field(
        None, description="history table in the run directory", examples=["history/gauges.csv"]
    )
    column: str | None = Field(None, description="column of the table", examples=["front_level"])
    figure: str | None = Field(
        None,
        description="instead: a name under figures in run.json; dots lead into its tables",
        examples=["verdict.weight_moved"],
    )
    formula: str | None = Field(
        None,
        description="with table: a formula of its columns, moment by moment, of which take is taken; without: of names "
        "of the case, columns of the sweep and quantities above",
        examples=["front_level * (flow_velocity_x**2 + flow_velocity_y**2)"],
    )
    take: Literal["last", "largest", "max", "min", "mean", "at", "integral", "period", "arrival"] = Field(
        "last", description="number that the column or formula gives, as in study.quantity"
    )
    window: tuple[Time, Time] | None = Field(None, description="from and to when it counts; absent: always")
    time: Time | None = Field(None, description="when, for take = at")
    above: Number | None = Field(
        None, description="value passed, for take = arrival; between two rows on a line"
    )
    damage: Literal["joints", "drift", "drop"] | None = Field(
        None,
        description="joints: share of the joints (of the group) that broke; drift: mean way sideways of the blocks "
        "that stood around upper, less that around lower (0 at level ground; below all blocks of a group that of the "
        "blocks under it), over upper - lower, the largest of all written states; "
        "drop: mean fall of the blocks that stood between lower and upper, over upper - lower, at the end: a storey "
        "that came down has 1",
    )
    of: Name | None = Field(None, description="group or block that damage counts; absent: all blocks")
    lower: Length | None = Field(None, description="height of the lower end, for drift and drop")
    upper: Length | None = Field(None, description="height of the upper end, for drift and drop")
    source: Literal["run", "free field"] = Field(
        "run",
        description="free field: from the run of the same water without structure, made once for all runs that "
        "differ in the structure alone",
    )

    @model_validator(mode="after")
    def _whole(self) -> Self:
        wrong = list(_quantity_problems(self))
        if wrong:
            raise ValueError("; ".join(wrong))
        return self


def _quantity_problems(q: SweepQuantity) -> Iterator[str]:
    of_table = q.table is not None and (q.column is not None) != (q.formula is not None)
    kinds = {
        "table with column or formula": of_table,
        "figure": q.figure is not None,
        "formula": q.formula is not None and q.table is None,
        "damage": q.damage is not None,
    }
    if sum(kinds.values()) != 1 or (q.column is not None and q.table is None):
        yield f"give one of {', '.join(kinds)}"
    needs = {"at": ("time", q.time), "arrival": ("above", q.above), "integral": ("window", q.window)}
    name, given = needs.get(q.take, ("", 0))
    if given is None:
        yield f"take = '{q.take}' needs {name}"
    if q.table is None and q.take != "last":
        yield f"take = '{q.take}' is for the columns of a table"
    heights = q.lower is not None and q.upper is not None and q.lower < q.upper
    if q.damage in ("drift", "drop") and not heights:
        yield f"damage = '{q.damage}' needs lower and upper, the lower one below"
    if q.damage not in ("drift", "drop") and (q.lower is not None or q.upper is not None):
        yield "lower and upper are for damage = 'drift' or 'drop'"
    if q.damage is None and q.of is not None:
        yield "of is for damage"


class DamageState(Section):
    """A state of damage: the runs in which a quantity is at least so large."""

    name: Name = Field(description="of the curve", examples=["collapsed"])
    what: str = Field("", description="the same for people; absent: the name")
    quantity: Name = Field(description="name of a quantity of the sweep")
    at_least: Number = Field(description="value from which a run is in the state, in SI")
    cannot_stand: Switch = Field(
        True,
        description="true: a run that cannot begin since its structure cannot carry weight and water at the start is "
        "in the state",
    )


class Fragility(Section):
    """Curves of the probability to reach each state of damage, log-normal in an intensity measure."""

    name: Name = Field(description="of its figure and tables", examples=["depth"])
    what: str = Field("", description="title of its figure; absent: none")
    measure: Name = Field(
        description="the intensity: a column of the sweep or a quantity, positive in every run",
        examples=["depth"],
    )
    state: tuple[DamageState, ...] = Field(
        min_length=1, description="states of damage, from light to heavy: each holds the runs of the next"
    )
    confidence: Share = Field(0.9, description="of the bands and bars")
    bootstrap: Annotated[int, Field(strict=True, ge=100, le=100_000)] = Field(
        1000, description="samples drawn from the runs for the bands"
    )
    exact: str | None = Field(
        None,
        description="a CSV file, from the directory of the case, of known probabilities to draw beside the curves: a "
        "column of the name of measure, and one for each state that is known",
        examples=["exact.csv"],
    )


class Sweep(Section):
    """What `surgebreak sweep` runs. A run of the case takes no notice of it."""

    note: str = Field("", description="what it shows, for its page")
    set: tuple[Override, ...] = Field(
        (), description="changes of all runs of the sweep, KEY=VALUE", examples=[["time.end=1 s"]]
    )
    cpu_seconds: PositiveTime = Field(
        3600.0,
        description="processor time after which a run is given up and reported as failed; takes the place of "
        "limits.cpu_seconds",
    )
    table: str | None = Field(
        None,
        description="a CSV file from the directory of the case, a line a point of the grid: heads are keys of the case "
        "or names for formulas, with a unit in brackets where the cells are plain numbers",
        examples=["runs.csv"],
    )
    vary: tuple[Varied, ...] = Field((), description="in what the runs differ")
    link: tuple[Link, ...] = Field((), description="names of the case that follow from others")
    sample: Literal["latin", "sobol", "random", "saltelli"] = Field(
        "latin",
        description="how distributions are drawn: Latin hypercube, scrambled Sobol points, random, or the pairs of "
        "sets that Sobol indices need (samples * (2 + number of distributions) runs); sobol and random keep their "
        "runs when samples grows",
    )
    samples: Many = Field(1, description="drawn at each point of the grid")
    repeats: Count = Field(1, description="times that each run is made with other seeds")
    seeds: tuple[str, ...] = Field(
        (),
        description="names of the case that get another whole number in every run",
        examples=[["joints.seed"]],
    )
    seed: Seed = Field(1, description="of everything that is drawn")
    keep: Literal["table", "histories", "all"] = Field(
        "histories",
        description="what stays of a run that is done: table: case, log and run.json; histories: these, the joints and "
        "the histories; all: everything",
    )
    quantity: tuple[SweepQuantity, ...] = Field(
        (),
        description="what is read from every run; absent: the plain figures of run.json, with "
        "the shares of the weight that left its place and that stays out of it",
    )
    free_field: tuple[Override, ...] = Field(
        (), description="further changes of the runs without structure, KEY=VALUE"
    )
    fragility: tuple[Fragility, ...] = Field((), description="fragility curves")
    sensitivity: tuple[Name, ...] = Field(
        (),
        description="quantities whose dependence on the distributions is reported: Sobol indices where sample is "
        "saltelli, else rank correlations",
    )
