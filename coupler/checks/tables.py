"""Checks of gauges whose results would be written to the same place: two columns or two tables of one name."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

import numpy as np

from coupler.case.case import Case
from coupler.case.toml_lines import shown
from coupler.case.types import KeyPath, Problem
from coupler.results.gauges import make_gauge


def table_problems(case: Case) -> Iterator[Problem]:
    """Names of gauges that differ in kind, but not in the columns or tables that are made of them."""
    taken: dict[str, KeyPath] = {}
    kinds: set[tuple[str, str]] = set()
    for i, gauge in enumerate(case.gauge):
        path = ("gauge", i)
        if (gauge.kind, gauge.name) in kinds:
            continue  # the same kind and name, which is reported as such
        kinds.add((gauge.kind, gauge.name))
        for place in _places(gauge):
            first = taken.setdefault(place, path)
            if first != path:
                yield (
                    (*path, "name"),
                    f"'{gauge.name}' of kind {gauge.kind} would fill {place}, which {shown(first)} fills; rename one",
                )
                break


def _places(gauge) -> list[str]:
    """Where the results of a gauge go: files of tables, or columns of the common one."""
    if gauge.kind == "loads":
        more = [f"history/loads_{gauge.name}_blocks.csv"] if gauge.each_block else []
        return [f"history/loads_{gauge.name}.csv", *more]
    return [f"the column {name} of history/gauges.csv" for name in column_names(gauge)]


def column_names(gauge) -> list[str]:
    """Columns of a gauge in the common table; they do not depend on its bodies."""
    if gauge.kind == "patch":  # its shape may still be wrong
        gauge = gauge.model_copy(update={"edges": None, "radius": 1.0, "normal": (0.0, 0.0, 1.0)})
    rows = defaultdict(lambda: np.zeros(1, int))
    return [name for name, _, _ in make_gauge(gauge, rows).columns]
