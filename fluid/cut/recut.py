"""Parts of an earlier cut that are kept, together with newly cut parts, in the order of the cells."""

from __future__ import annotations

import numpy as np

from fluid.cut.cut_arrays import Cuts
from kernels.decorators import kernel


def joined(old: Cuts, again, new: Cuts) -> Cuts:
    """Parts of `old` in cells that were not cut `again` (cells,) bool, with those of `new`, all of which were."""
    take, kept, fresh = _merged(old.part_cell, new.part_cell, again)
    if len(take) == len(new.part_cell):  # nothing of the old is left
        return new
    wet = _of_parts(kept, fresh, old.wet_part, new.wet_part)
    opened = _of_parts(kept, fresh, old.open_part, new.open_part)
    tets = _of_parts(kept, fresh, old.tet_part, new.tet_part)
    start, corner = _ragged(opened, old.open_start, new.open_start)
    return Cuts(
        part_cell=_rows(take, old.part_cell, new.part_cell),
        part_whole=_rows(take, old.part_whole, new.part_whole),
        moments=_rows(take, old.moments, new.moments),
        wet_part=_rows(wet, kept[old.wet_part], fresh[new.wet_part]),
        wet_body=_rows(wet, old.wet_body, new.wet_body),
        wet=_rows(wet, old.wet, new.wet),
        open_part=_rows(opened, kept[old.open_part], fresh[new.open_part]),
        open_face=_rows(opened, old.open_face, new.open_face),
        open_start=start,
        open_x=_rows(corner, old.open_x, new.open_x),
        tet_part=_rows(tets, kept[old.tet_part], fresh[new.tet_part]),
        tet_volume=_rows(tets, old.tet_volume, new.tet_volume),
        tet_corners=_rows(tets, old.tet_corners, new.tet_corners),
    )


@kernel
def _merged(old_cell, new_cell, again):
    """take (n,): row of `old`, or -1 - row of `new`, for every joined part; and the joined place of every part of old
    (-1: gone) and of new. Both are sorted by cell, and no cell is in both."""
    kept, fresh = np.full(len(old_cell), -1, np.int64), np.empty(len(new_cell), np.int64)
    take = np.empty(len(old_cell) + len(new_cell), np.int64)
    n, b = 0, 0
    for a in range(len(old_cell)):
        if again[old_cell[a]]:
            continue
        while b < len(new_cell) and new_cell[b] < old_cell[a]:
            take[n], fresh[b] = -1 - b, n
            n += 1
            b += 1
        take[n], kept[a] = a, n
        n += 1
    while b < len(new_cell):
        take[n], fresh[b] = -1 - b, n
        n += 1
        b += 1
    return take[:n].copy(), kept, fresh


@kernel
def _of_parts(kept, fresh, old_part, new_part):
    """`take` as of `_merged`, for rows that belong to parts old_part, new_part, sorted by part."""
    take = np.empty(len(old_part) + len(new_part), np.int64)
    n, b = 0, 0
    for a in range(len(old_part)):
        place = kept[old_part[a]]
        if place < 0:
            continue
        while b < len(new_part) and fresh[new_part[b]] < place:
            take[n] = -1 - b
            n += 1
            b += 1
        take[n] = a
        n += 1
    for rest in range(b, len(new_part)):
        take[n] = -1 - rest
        n += 1
    return take[:n].copy()


def _rows(take, a, b):
    """Rows of a (take ≥ 0) and of b."""
    if len(take) == 0:
        return b[:0].copy()
    return _numbers(take, a, b) if a.ndim == 1 else _table(take, a, b)


@kernel
def _numbers(take, a, b):
    out = np.empty(len(take), a.dtype)
    for s in range(len(take)):
        out[s] = a[take[s]] if take[s] >= 0 else b[-1 - take[s]]
    return out


@kernel
def _table(take, a, b):
    out = np.empty((len(take), a.shape[1]), a.dtype)
    for s in range(len(take)):
        source, row = (a, take[s]) if take[s] >= 0 else (b, -1 - take[s])
        for k in range(a.shape[1]):
            out[s, k] = source[row, k]
    return out


@kernel
def _ragged(take, old_start, new_start):
    """start (n + 1,) of the taken polygons, and where each of their corners comes from, as in `take`."""
    start = np.zeros(len(take) + 1, np.int64)
    for s in range(len(take)):
        t = take[s]
        length = old_start[t + 1] - old_start[t] if t >= 0 else new_start[-t] - new_start[-1 - t]
        start[s + 1] = start[s] + length
    corner = np.empty(start[-1], np.int64)
    for s in range(len(take)):
        t = take[s]
        for k in range(start[s + 1] - start[s]):
            corner[start[s] + k] = old_start[t] + k if t >= 0 else -1 - (new_start[-1 - t] + k)
    return start, corner
