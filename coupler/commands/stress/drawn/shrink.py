"""Reducing a failed scene: sections and entries are removed and the run is shortened while it fails in the same way."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator

SPARED = ("case", "time", "limits")
"""Sections without which no scene runs, or that are shortened in a way of their own."""
LATER = 1.02
"""End of a shortened run over the time at which it failed."""


def shrunk(table: dict, fails_at: Callable[[dict], float | None], reached: float | None) -> dict:
    """The smallest table found that fails in the same way.

    fails_at(table) runs it: the time [s] at which it fails in the same way, None if it does not, or when nothing more
    is to be spent · reached [s]: when the table as it is failed, None if that is not known."""
    best = _shortened(table, reached)
    if best is not table and fails_at(best) is None:
        best = table
    going = True
    while going:
        going = False
        for smaller in list(_smaller(best)):
            at = fails_at(smaller)
            if at is None:
                continue
            best, going = smaller, True
            break
    return best


def _shortened(table: dict, reached: float | None) -> dict:
    end = table["time"]["end"]
    if reached is None or LATER * reached >= end:
        return table
    found = copy.deepcopy(table)
    found["time"]["end"] = float(f"{LATER * reached:.6g}")
    return found


def _smaller(table: dict) -> Iterator[dict]:
    """The table without one of its parts, for each part, large ones first: sections, list entries, single values."""
    for path in _parts(table, ()):
        found = copy.deepcopy(table)
        holder = found
        for step in path[:-1]:
            holder = holder[step]
        del holder[path[-1]]
        if isinstance(holder, list) and not holder:
            continue  # the list as a whole is tried as well
        yield found


def _parts(table: dict, path: tuple) -> Iterator[tuple]:
    """Paths of keys to leave out on trial; a case without a necessary key is refused and so fails in another way."""
    inner: list[tuple] = []
    for name, value in table.items():
        if not path and name in SPARED:
            continue
        yield (*path, name)
        if isinstance(value, dict):
            inner.append((*path, name))
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            if len(value) > 1:
                yield from ((*path, name, k) for k in reversed(range(len(value))))
            inner += [(*path, name, k) for k in range(len(value))]
    for below in inner:
        holder = table
        for step in below[len(path) :]:
            holder = holder[step]
        yield from _parts(holder, below)
