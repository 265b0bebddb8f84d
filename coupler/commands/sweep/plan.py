"""Every run of a sweep with its overrides, before the first of them is made.

The rows are the points of the grid (lists, grids, a table, all crossed), at each of them the samples, and for each of
these the repeats. What is drawn at a point depends on the seed and on that point alone: a longer list or a finer grid
leaves the other runs as they are. Rows with the same effective case share a run.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import numpy as np

from coupler.case.case import effective
from coupler.case.formula import BadFormula, evaluate
from coupler.case.materials import material_remarks
from coupler.case.paths import BadPath, place_of
from coupler.case.sweep import NEEDS, Sweep, Varied
from coupler.case.sweep_names import OWN, amount, design_problems, in_si, sweep_problems, unit, unit_of
from coupler.case.toml_lines import shown
from coupler.case.toml_text import inline
from coupler.checks.read_case import CaseFile, load, parse_path
from coupler.commands.study.plan import fingerprint, identity
from coupler.commands.sweep.draw import cube, distribution, quantiles, seed_of, whole_numbers
from coupler.commands.sweep.quantities import asked
from coupler.commands.sweep.table_in import InputTable, read_table
from coupler.commands.sweep.vary import varied
from coupler.geometry.tank_regions import ALL
from coupler.program.errors import BadCall, BadCase, UnitError

OFF = ("structure", "contact", "joints", "motion", "verdict")
"""Sections that are left out of the run without structure."""
OF_STRUCTURE = ("force", "loads", "reaction", "motion")
"""Kinds of gauges that are left out with them."""
MOST_ROWS = 1_000_000


@dataclass(frozen=True)
class Column:
    """Something in which runs differ: its name, what it is, its SI unit, the keys that it sets, and whether it is
    drawn from a distribution."""

    name: str
    what: str
    unit: str
    keys: tuple[str, ...]
    drawn: bool


@dataclass(frozen=True)
class Row:
    """One line of the table of results.

    values: of the columns, in SI or as text · seeds: of the keys that get other numbers · id: of the run that it is ·
    free: of its run without structure, or empty · wrong: why it is no case, or empty
    """

    number: int
    point: int
    sample: int
    repeat: int
    values: dict
    seeds: dict
    id: str
    free: str
    wrong: str


@dataclass(frozen=True)
class Plan:
    """runs: the overrides of each run by its id, the free field first; cases: their effective cases."""

    file: CaseFile
    sweep: Sweep
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    runs: dict[str, tuple[str, ...]]
    remarks: tuple[str, ...] = ()
    cases: dict[str, dict] = field(default_factory=dict, repr=False)


def make_plan(place: Path, vary: Iterable[str] = (), overrides: Iterable[str] = ()) -> Plan:
    """The plan of a case's [sweep] with what --vary adds or replaces; overrides: --set, of all runs.

    Raises BadCase with every mistake: nothing varied, names that are not there, rows none of which is a case.
    """
    overrides = tuple(overrides)
    file = load(place, overrides)
    vary = tuple(vary)
    sweep = _with(file.case.sweep or Sweep(), vary, overrides)
    if not (sweep.vary or sweep.table or sweep.repeats > 1):
        raise BadCase(
            [
                f"{file.path}: nothing is varied: write [[sweep.vary]] or [sweep] table = ..., or give --vary "
                "KEY=A,B,...; `surgebreak explain sweep` says how"
            ]
        )
    own = len(sweep.vary) - len(vary)
    wrong, of_call = [], 0
    for path, text in dict.fromkeys((*sweep_problems(sweep), *design_problems(sweep))):
        given = path[:2] == ("sweep", "vary") and len(path) > 2 and int(path[2]) >= own
        of_call += given
        wrong.append(
            f"--vary {vary[int(path[2]) - own]}: {text}" if given else f"{file.path}: {shown(path)}: {text}"
        )
    if wrong:
        raise (BadCall if of_call == len(wrong) else BadCase)(dict.fromkeys(wrong))
    return _Planner(file, sweep).plan()


def _with(sweep: Sweep, vary: Iterable[str], overrides: tuple[str, ...]) -> Sweep:
    """With the tables of --vary, which take the place of those of the same keys."""
    more = [varied(text) for text in vary]
    taken = {key for v in more for key in v.keys}
    kept = tuple(v for v in sweep.vary if not taken & set(v.keys))
    return sweep.model_copy(update={"vary": (*kept, *more), "set": (*sweep.set, *overrides)})


class _Planner:
    """Collects rows, runs and what is wrong with them; replaced: remarks on keys that materials replace, by key."""

    def __init__(self, file: CaseFile, sweep: Sweep):
        self.file, self.sweep = file, sweep
        self.table = self._table()
        self.base = effective(load(file.path, sweep.set).case)
        self.drawn = [v for v in sweep.vary if v.distribution]
        self.listed = [v for v in sweep.vary if not v.distribution]
        self.needs_free = any(q.source == "free field" for q in asked(sweep))
        self.runs: dict[str, tuple[str, ...]] = {}
        self.cases: dict[str, dict] = {}
        self.replaced: dict[str, str] = {}

    def _table(self) -> InputTable | None:
        if self.sweep.table is None:
            return None
        try:
            return read_table(place_of(self.sweep.table, self.file.directory))
        except BadPath as error:
            raise BadCase([f"{self.file.path}: sweep.table: {error}"]) from error

    def plan(self) -> Plan:
        """All rows; raises BadCase where not one of them is a case."""
        columns = tuple(self._columns())
        rows, wrong = [], []
        frozen = self._distributions()
        for values, overrides in self._points():
            for sample, drawn in enumerate(self._samples(values, frozen)):
                for repeat in range(self.sweep.repeats):
                    row = self._row(len(rows), values | drawn, overrides, sample, repeat)
                    rows.append(row)
                    wrong += [row.wrong] if row.wrong else []
                    if len(rows) > MOST_ROWS:
                        raise BadCase([f"{self.file.path}: [sweep] has more than {MOST_ROWS} rows"])
        if len(wrong) == len(rows):
            raise BadCase(list(dict.fromkeys(wrong))[:10])
        numbered = {}
        points = [numbered.setdefault(_point(row, self.drawn), len(numbered)) for row in rows]
        rows = [Row(**{**row.__dict__, "point": k}) for row, k in zip(rows, points)]
        return Plan(
            self.file, self.sweep, columns, tuple(rows), self.runs, tuple(self._remarks(rows)), self.cases
        )

    def _columns(self) -> Iterator[Column]:
        for v in self.sweep.vary:
            yield Column(
                v.column, v.what or v.column.replace("_", " "), unit(v), v.keys, bool(v.distribution)
            )
        names = {v.column for v in self.sweep.vary} | {q.name for q in asked(self.sweep)} | set(OWN)
        for head in self.table.heads if self.table else ():
            if head.name in names:
                raise BadCase(
                    [f"{self.sweep.table}: the name '{head.name}' is taken; name the column otherwise"]
                )
            what = head.name.replace("_", " ")
            yield Column(
                head.name,
                what,
                unit_of(head.key) if head.key else head.unit,
                (head.key,) if head.key else (),
                False,
            )

    def _points(self) -> Iterator[tuple[dict, tuple[str, ...]]]:
        """(values of lists and table, overrides) of every point of the grid."""
        lines = self.table.lines if self.table else ((),)
        heads = self.table.heads if self.table else ()
        for line, *chosen in product(lines, *(self._values(v) for v in self.listed)):
            values, overrides = {}, []
            for head, cell in zip(heads, line):
                values[head.name] = _number(cell, unit_of(head.key) if head.key else head.unit)
                overrides += [f"{head.key}={inline(cell)}"] if head.key else []
            for v, value in zip(self.listed, chosen):
                values[v.column] = _number(value, unit(v))
                overrides += [f"{key}={inline(value)}" for key in v.keys]
            yield values, tuple(overrides)

    def _values(self, v: Varied) -> list:
        """Values to be run through: as written for a list, in SI for a grid."""
        if v.values:
            return list(v.values)
        low, high = self._amount(v, "low"), self._amount(v, "high")
        if v.spacing == "log" and not min(low, high) > 0.0:
            raise BadCase(
                [f"{self.file.path}: sweep.vary {v.column}: a grid with equal ratios has ends above 0"]
            )
        found = (np.geomspace if v.spacing == "log" else np.linspace)(low, high, v.steps)
        found = [float(f"{value:.12g}") for value in found]  # 0.7, not 0.7000000000000001
        return [round(value) for value in found] if v.whole else found

    def _amount(self, v: Varied, name: str) -> float:
        try:
            return amount(v, name)
        except UnitError as error:
            raise BadCase([f"{self.file.path}: sweep.vary {v.column}: {name}: {error}"]) from error

    def _distributions(self) -> list[tuple]:
        """(frozen distribution, lower, upper) of what is drawn. Raises BadCase."""
        found = []
        for v in self.drawn:
            given = {
                n: self._amount(v, n)
                for pair in NEEDS[v.distribution]
                for n in pair
                if getattr(v, n) is not None
            }
            cuts = [None if getattr(v, n) is None else self._amount(v, n) for n in ("lower", "upper")]
            try:
                frozen = distribution(v.distribution, given)
                quantiles(frozen, np.array([0.5]), *cuts)
                if v.whole and v.distribution == "uniform":
                    frozen, cuts = whole_numbers(given, *cuts), [None, None]
            except ValueError as error:
                raise BadCase([f"{self.file.path}: sweep.vary {v.column}: {error}"]) from error
            found.append((frozen, *cuts))
        return found

    def _samples(self, point: dict, frozen: list[tuple]) -> Iterator[dict]:
        """Values of what is drawn at a point of the grid, sample by sample."""
        own = {k: str(value) for k, value in point.items()}
        names = [v.column for v in self.drawn]
        seed = seed_of(self.sweep.seed, self.sweep.sample, own, names)
        u = cube(self.sweep.sample, self.sweep.samples, len(names), seed)
        values = [quantiles(f, u[:, k], *cuts) for k, (f, *cuts) in enumerate(frozen)]
        for row in zip(*values) if values else [()] * len(u):
            yield {
                v.column: round(float(value)) if v.whole else float(value)
                for v, value in zip(self.drawn, row)
            }

    def _row(self, number: int, values: dict, overrides: tuple[str, ...], sample: int, repeat: int) -> Row:
        overrides = (*overrides, *(f"{key}={values[v.column]!r}" for v in self.drawn for key in v.keys))
        own = {k: str(value) for k, value in values.items()}
        seeds = {key: seed_of(self.sweep.seed, key, own, sample, repeat) for key in self.sweep.seeds}
        overrides += tuple(f"{key}={value}" for key, value in seeds.items())
        free, wrong = "", ""
        try:
            overrides += tuple(self._linked(values, overrides))
            id = self._add((*self.sweep.set, *overrides))
            if self.needs_free:
                free = self._add_free((*self.sweep.set, *overrides))
        except (BadCase, BadFormula) as error:
            lines = error.lines if isinstance(error, BadCase) else [str(error)]
            id, wrong = fingerprint({"case": self.base, "overrides": list(overrides)}), lines[0]
        return Row(number, 0, sample, repeat, values, seeds, id, free, wrong)

    def _linked(self, values: dict, overrides: tuple[str, ...]) -> Iterator[str]:
        """Overrides of the links, each on what was set before it."""
        if not self.sweep.link:
            return
        case = copy.deepcopy(self.base)
        for override in overrides:
            key, _, value = override.partition("=")
            _put(case, key, _number(_read(value), unit_of(key)))
        for link in self.sweep.link:
            value = evaluate(
                link.formula, case | {k: v for k, v in values.items() if isinstance(v, int | float)}
            )
            _put(case, link.key, value)
            yield f"{link.key}={value!r}"

    def _add(self, overrides: tuple[str, ...], first: bool = False) -> str:
        """The id of the run with these overrides. Raises BadCase where they are no case."""
        case = load(self.file.path, overrides).case
        for remark in material_remarks(case):
            self.replaced.setdefault(remark.split()[0], remark)
        content = effective(case)
        id = identity(content)
        if id not in self.runs:
            self.runs = {id: overrides, **self.runs} if first else {**self.runs, id: overrides}
            self.cases[id] = content
        return id

    def _add_free(self, overrides: tuple[str, ...]) -> str:
        """The id of the run without structure. Raises BadCase, which says that it is about that run."""
        try:
            return self._add((*overrides, *self._without_structure()), first=True)
        except BadCase as error:
            raise BadCase(
                f"{line} (in the run without structure; sweep.free_field may change it)"
                for line in error.lines
            ) from error

    def _without_structure(self) -> tuple[str, ...]:
        gauges = [k for k, gauge in enumerate(self.base.get("gauge", ())) if gauge["kind"] in OF_STRUCTURE]
        off = [f"gauge[{k}]=absent" for k in reversed(gauges)]
        if self.base.get("joints"):
            off.append("water.cracks=absent")
        return (*(f"{name}=absent" for name in OFF), *off, *self._refined(), *self.sweep.free_field)

    def _refined(self) -> Iterator[str]:
        """Without the blocks around which cells are finer; a region that has nothing else to be around is left out."""
        there = {*ALL, *(solid["name"] for solid in self.base.get("solid", ()))}
        for k, spec in reversed(list(enumerate(self.base.get("tank", {}).get("refine", ())))):
            around = spec.get("around") or ()
            kept = [name for name in around if name in there]
            if len(kept) < len(around):
                yield f"tank.refine[{k}].around={inline(kept)}" if kept else f"tank.refine[{k}]=absent"

    def _remarks(self, rows: list[Row]) -> Iterator[str]:
        refused = [row for row in rows if row.wrong]
        if refused:
            yield f"{len(refused)} of {len(rows)} rows are no case and are not run, the first: {refused[0].wrong}"
        n = self.sweep.samples
        if self.sweep.sample in ("sobol", "saltelli") and n & (n - 1):
            low = 1 << n.bit_length() - 1
            yield f"samples = {n}: Sobol points are even for powers of two ({low} or {2 * low})"
        if len(self.runs) < len({row.id for row in rows if not row.wrong}) and not self.needs_free:
            yield "rows with the same case share a run"
        keys = {key for v in self.sweep.vary for key in v.keys}
        keys |= {head.key for head in (self.table.heads if self.table else ()) if head.key}
        for key in sorted(keys & self.replaced.keys()):
            yield f"what is varied may have no effect: {self.replaced[key]}"


def _point(row: Row, drawn: list[Varied]) -> str:
    """A text that distinguishes one point of the grid from another."""
    names = {v.column for v in drawn}
    return repr([(k, v) for k, v in row.values.items() if k not in names])


def _number(value, unit: str):
    """A value in SI where it is one; names, switches and lists as they are."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return value
    try:
        return in_si(value, unit)
    except UnitError:
        return value


def _read(text: str):
    from coupler.commands.sweep.vary import plain

    return plain(text)


def _put(case: dict, key: str, value) -> None:
    """Set a value in an effective case. Missing sections are created; list entries must exist."""
    path = parse_path(key)
    holder = case
    for part in path[:-1]:
        holder = holder[part] if isinstance(part, int) else holder.setdefault(part, {})
    holder[path[-1]] = value
