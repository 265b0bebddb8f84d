"""Tetrahedra clipped by half spaces: the part in which a linear function is negative, again as tetrahedra; their
sections with planes, as triangles; and triangles clipped in the same way.

Points may carry further linear values behind their coordinates; these are interpolated along with them.
"""

from __future__ import annotations

import numpy as np

CORNERS = ((0, 1, 2, 3), (1, 0, 2, 3), (2, 0, 1, 3), (3, 0, 1, 2))
PAIRS = ((0, 1, 2, 3), (0, 2, 1, 3), (0, 3, 1, 2), (1, 2, 0, 3), (1, 3, 0, 2), (2, 3, 0, 1))


def clipped(tets, values):
    """Tetrahedra (n, 4, m) with corner values (n, 4) → those (k, 4, m) that fill the part where the value is negative.

    One corner inside gives one, two or three inside give three (a prism in three parts)."""
    inside = values < 0.0
    found = [tets[inside.all(axis=1)]]
    for a, b, c, d in CORNERS:
        others = inside[:, [b, c, d]]
        alone, without = inside[:, a] & ~others.any(axis=1), ~inside[:, a] & others.all(axis=1)
        for at in (alone, without):
            cut = [_crossing(tets, values, at, a, k) for k in (b, c, d)]
            if at is alone:
                found.append(np.stack([tets[at, a], *cut], axis=1))
            else:
                found += _prism(cut, [tets[at, k] for k in (b, c, d)])
    for a, b, c, d in PAIRS:
        at = inside[:, a] & inside[:, b] & ~inside[:, c] & ~inside[:, d]
        ends = ([tets[at, k], *(_crossing(tets, values, at, k, o) for o in (c, d))] for k in (a, b))
        found += _prism(*ends)
    return np.concatenate(found)


def sections(tets, values):
    """Triangles (k, 3, m) of the tetrahedra (n, 4, m) on which a linear function with corner values (n, 4) is zero.

    A face on which it is zero belongs to the tetrahedron in which it is negative."""
    inside = values < 0.0
    found = []
    for a, b, c, d in CORNERS:
        others = inside[:, [b, c, d]]
        at = np.where(inside[:, a], ~others.any(axis=1), others.all(axis=1))
        found.append(np.stack([_crossing(tets, values, at, a, k) for k in (b, c, d)], axis=1))
    for a, b, c, d in PAIRS:
        at = inside[:, a] & inside[:, b] & ~inside[:, c] & ~inside[:, d]
        ac, ad, bc, bd = (_crossing(tets, values, at, k, o) for k in (a, b) for o in (c, d))
        found += [np.stack([ac, ad, bc], axis=1), np.stack([ad, bc, bd], axis=1)]
    return np.concatenate(found)


def clipped_triangles(triangles, values):
    """Triangles (n, 3, m) with corner values (n, 3) → those (k, 3, m) that fill the part where it is negative."""
    inside = values < 0.0
    found = [triangles[inside.all(axis=1)]]
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        alone = inside[:, a] & ~inside[:, b] & ~inside[:, c]
        cut = [_crossing(triangles, values, alone, a, k) for k in (b, c)]
        found.append(np.stack([triangles[alone, a], *cut], axis=1))
        without = ~inside[:, a] & inside[:, b] & inside[:, c]
        ab, ac = (_crossing(triangles, values, without, a, k) for k in (b, c))
        found += [
            np.stack([ab, triangles[without, b], triangles[without, c]], axis=1),
            np.stack([ab, triangles[without, c], ac], axis=1),
        ]
    return np.concatenate(found)


def volumes(tets):
    """Volumes (n,) [m³] of tetrahedra (n, 4, m ≥ 3), coordinates first."""
    x = tets[:, :, :3]
    return np.abs(np.linalg.det(x[:, 1:] - x[:, :1])) / 6.0


def _crossing(tets, values, at, a, b):
    """Point of the edges ab of the tetrahedra or triangles `at` (n,) bool where the value is zero."""
    t = (values[at, a] / (values[at, a] - values[at, b]))[:, None]
    return (1.0 - t) * tets[at, a] + t * tets[at, b]


def _prism(one, other):
    """Three tetrahedra that fill the prism between the triangles `one` and `other`, three arrays of points each."""
    a, b, c = one
    d, e, f = other
    return [np.stack(corners, axis=1) for corners in ((a, b, c, f), (a, b, e, f), (a, d, e, f))]
