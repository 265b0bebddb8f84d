"""Checks of [sweep] that the schema cannot make: names that must exist, names that are already used, missing units."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from functools import lru_cache

from coupler.case.formula import BadFormula, names_used
from coupler.case.keys import keys
from coupler.case.study_names import limit_in_overrides, limit_problem, without_places
from coupler.case.sweep import PARAMETERS, Sweep, Varied
from coupler.case.types import KeyPath, Problem
from coupler.case.units import DIMENSIONS, to_si
from coupler.program.errors import UnitError, did_you_mean

OWN = (
    "run", "point", "sample", "repeat", "id", "outcome", "reason", "cpu_seconds", "wall_seconds", "memory", "attempts",
)  # fmt: skip
"""Columns of the table of every sweep, beside what is varied, seeds and quantities."""
NUMBERS = ("run", "point", "sample", "repeat")
"""Those of them that formulas may name."""
PLAIN = {
    "time": ("time that was reached", "s"),
    "joints": ("joints at the start", ""),
    "joints_broken": ("joints broken", ""),
    "weight_moved": ("share of the weight that left its place", ""),
    "weight_out": ("share of the weight that stays out of its place", ""),
    "largest_water_force": (
        "largest force of the water on blocks that can move (all bodies if none can)",
        "N",
    ),
}
"""Columns of a sweep whose [sweep] has no quantities, figures of run.json or of its verdict: what they are, unit."""
OF_THE_VERDICT = ("weight_moved", "weight_out")


def plain_figure(name: str) -> str:
    """Where run.json has the figure of a column in PLAIN."""
    return f"verdict.{name}" if name in OF_THE_VERDICT else name


def sweep_problems(sweep: Sweep) -> Iterator[Problem]:
    """(key path, message) of every name in [sweep] that does not exist, or is used twice."""
    yield from _keys(sweep)
    yield from limit_in_overrides(sweep.set, ("sweep", "set"), "sweep")
    yield from _amounts(sweep)
    yield from _columns(sweep)
    yield from _formulas(sweep)
    yield from _names_in_formulas(
        sweep, {key.rpartition(".")[2] for key in _settable()}
    )  # --vary may add these
    yield from _uses(sweep)


def design_problems(sweep: Sweep) -> Iterator[Problem]:
    """Combinations in [sweep] that are not allowed, checked after --vary has added to the section."""
    drawn = [v for v in sweep.vary if v.distribution]
    if sweep.samples > 1 and not drawn:
        yield (
            ("sweep", "samples"),
            "no distribution in sweep.vary to draw from; repeats makes a run several times",
        )
    if sweep.repeats > 1 and not sweep.seeds:
        yield ("sweep", "repeats"), "the same run each time; give seeds, the names that get other numbers"
    if sweep.sample == "saltelli" and (len(drawn) < 2 or len(drawn) < len(sweep.vary) or sweep.table):
        yield ("sweep", "sample"), "saltelli needs two distributions or more, and neither lists nor grids"
    if sweep.sensitivity and not drawn:
        yield ("sweep", "sensitivity"), "no distribution in sweep.vary whose share could be computed"
    yield from _names_in_formulas(sweep)


def _keys(sweep: Sweep) -> Iterator[Problem]:
    named: list[tuple[tuple[str | int, ...], str]] = [
        (("vary", i, "key"), key) for i, v in enumerate(sweep.vary) for key in v.keys
    ]
    named += [(("link", i, "key"), link.key) for i, link in enumerate(sweep.link)]
    named += [(("seeds", i), key) for i, key in enumerate(sweep.seeds)]
    seen: dict[str, tuple] = {}
    for place, name in named:
        wrong = key_problem(name)
        if wrong:
            yield ("sweep", *place), wrong
        if seen.setdefault(name, place) != place:
            yield ("sweep", *place), f"'{name}' is set by sweep.{seen[name][0]}[{seen[name][1]}] already"


def key_problem(name: str) -> str:
    """Why a name cannot be varied; empty where it can."""
    plain = ".".join(without_places(name))
    known = _settable()
    if plain not in known:
        return f"'{name}': no such name in a case file{did_you_mean(plain, known)}"
    if plain.partition(".")[0] in ("study", "sweep"):
        return f"'{name}': a run takes no notice of [{plain.partition('.')[0]}]"
    return limit_problem(plain, "sweep")


@lru_cache(maxsize=1)
def _settable() -> dict[str, str]:
    """Unit of every name of the case that holds a value."""
    return {key.path: key.unit for key in keys() if not key.sections}


def _amounts(sweep: Sweep) -> Iterator[Problem]:
    for i, v in enumerate(sweep.vary):
        for name in (*PARAMETERS, "lower", "upper"):
            if getattr(v, name) is not None:
                try:
                    amount(v, name)
                except UnitError as error:
                    yield ("sweep", "vary", i, name), str(error)


def _columns(sweep: Sweep) -> Iterator[Problem]:
    """Every column has a name of its own, that is none of a section or of a column that every table has."""
    from coupler.case.case import Case

    seen = dict.fromkeys(Case.model_fields, "a section of the case")
    seen |= dict.fromkeys(OWN, "a column of every table")
    for kind, tables in (("vary", sweep.vary), ("quantity", sweep.quantity)):
        for i, table in enumerate(tables):
            name = table.column if isinstance(table, Varied) else table.name  # type: ignore[attr-defined]
            if name in seen:
                yield ("sweep", kind, i, "name"), f"'{name}' is taken by {seen[name]}; give another name"
            seen.setdefault(name, f"sweep.{kind}[{i}]")
    yield from _twice(("sweep", "fragility"), [f.name for f in sweep.fragility])
    for k, f in enumerate(sweep.fragility):
        yield from _twice(("sweep", "fragility", k, "state"), [state.name for state in f.state])


def seed_column(key: str) -> str:
    """Name of the column of a seed."""
    return key.replace(".", "_").replace("[", "_").replace("]", "")


def _formulas(sweep: Sweep) -> Iterator[Problem]:
    """Formulas that are none, whatever their names stand for."""
    for i, link in enumerate(sweep.link):
        yield from _no_formula(("sweep", "link", i, "formula"), link.formula)
    for i, q in enumerate(sweep.quantity):
        if q.formula is not None:
            yield from _no_formula(("sweep", "quantity", i, "formula"), q.formula, q.table is not None)


def _no_formula(place: KeyPath, formula: str, of_columns: bool = False) -> Iterator[Problem]:
    try:
        names_used(formula, of_columns)
    except BadFormula as error:
        yield place, str(error)


def _names_in_formulas(sweep: Sweep, more: Collection[str] = ()) -> Iterator[Problem]:
    """Names in formulas of quantities that are neither columns, with `more` that there may be, nor names of the case;
    columns of histories are known only from a run, those of sweep.table from its file."""
    varied = [v.column for v in sweep.vary] + [seed_column(key) for key in sweep.seeds]
    known = [key.path for key in keys() if "." in key.path]
    for i, q in enumerate(sweep.quantity):
        place = ("sweep", "quantity", i, "formula")
        if q.formula is None or q.table is not None or any(_no_formula(place, q.formula)):
            continue
        columns = [*varied, *(above.name for above in sweep.quantity[:i]), *NUMBERS]
        for name in names_used(q.formula):
            plain = ".".join(without_places(name))
            may_be = "." not in plain and (sweep.table is not None or plain in more)
            if plain not in columns and plain not in known and not may_be:
                yield (
                    place,
                    f"'{q.formula}': there is no '{name}'{did_you_mean(plain, [*columns, *known])}; without table a "
                    f"formula takes names of the case, quantities above it and columns of the sweep, here: "
                    f"{', '.join(columns)}",
                )


def _twice(place: tuple, names: list[str]) -> Iterator[Problem]:
    for i, name in enumerate(names):
        if name in names[:i]:
            yield (*place, i, "name"), f"'{name}' is there twice"


def _uses(sweep: Sweep) -> Iterator[Problem]:
    """Names of columns in fragility and sensitivity."""
    quantities = [q.name for q in sweep.quantity] or list(PLAIN)
    columns = [v.column for v in sweep.vary] + quantities
    for i, f in enumerate(sweep.fragility):
        if sweep.table is None and f.measure not in columns:
            yield ("sweep", "fragility", i, "measure"), _nowhere(f.measure, columns)
        for k, state in enumerate(f.state):
            if state.quantity not in quantities:
                yield ("sweep", "fragility", i, "state", k, "quantity"), _nowhere(state.quantity, quantities)
    for i, name in enumerate(sweep.sensitivity):
        if name not in quantities:
            yield ("sweep", "sensitivity", i), _nowhere(name, quantities)


def _nowhere(name: str, known: list[str]) -> str:
    return f"there is no '{name}'{did_you_mean(name, known)}; there are {', '.join(known) or 'none'}"


# ---------------------------------------------------------------- numbers with units


def unit_of(key: str) -> str:
    """SI unit of a name of the case; empty where it has none."""
    return _settable().get(".".join(without_places(key)), "")


def unit(v: Varied) -> str:
    """SI unit of what is varied."""
    return unit_of(v.keys[0]) if v.keys else v.unit


def amount(v: Varied, name: str) -> float:
    """One of its numbers in SI. Raises UnitError."""
    value = getattr(v, name)
    pure = name in ("variation", "dispersion", "shape")
    return in_si(value, "" if pure else unit(v))


def in_si(value: object, unit: str) -> float:
    """A number, or text with a unit of that kind; of an unknown kind a plain number. Raises UnitError."""
    return to_si(value, unit if unit in DIMENSIONS else "")
