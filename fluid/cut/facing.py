"""Surfaces opposite to wetted polygons across the water: other bodies, or the sides of the box around the mesh."""

from __future__ import annotations

import numpy as np

from kernels.decorators import kernel, ranged
from kernels.threads import over

WORK = 30
"""Cost of a polygon, in usual rows."""
ROUNDING = 1e-3
"""Share of the reach of a polygon by which a body must be beyond it to be passed by without looking at its planes."""


def facing(bodies, polygons, reach, bounds, loose):
    """(S,) bool: another surface lies within reach (S,) [m] in front of the polygon; plane (S,) of the polygon among
    those of all bodies.

    polygons: body (S,), centroid (S, 3) [m], normal (S, 3) out of the body · bounds (2, 3) [m] of the tank · loose
    (n_bodies,) bool: a polygon counts only if its own body or the one opposite is loose; sides of the tank are not
    loose."""
    body, box = polygons[0], bodies.bounds()
    near = near_bodies(box[:, 0], box[:, 1], loose, float(reach.max(initial=0.0)))
    in_film, plane = np.zeros(len(body), bool), np.empty(len(body), np.int64)
    over(
        _facing,
        len(body),
        polygons,
        bodies.planes(),
        box,
        loose,
        near,
        bounds,
        reach,
        in_film,
        plane,
        weight=WORK,
    )
    return in_film, plane


def near_bodies(low, high, loose, reach):
    """start (n + 1,), members, in order: bodies whose bounds low, high (n, 3) [m] come within reach [m] of those of
    each body; only pairs with at least one loose body. Bodies are passed through along the longest axis of them all, so
    that a town of houses far apart is not compared block by block."""
    if len(low) == 0:
        return np.zeros(1, np.int64), np.zeros(0, np.int64)
    axis = int(np.argmax(high.max(axis=0) - low.min(axis=0)))
    order = np.argsort(low[:, axis], kind="stable")
    one, other = _near_pairs(low, high, loose, reach, axis, order)
    first, second = np.concatenate([one, other]), np.concatenate([other, one])
    keys = np.sort(first * len(low) + second)
    start = np.concatenate([[0], np.cumsum(np.bincount(first, minlength=len(low)))])
    return start, keys % len(low)


@kernel
def _near_pairs(low, high, loose, reach, axis, order):
    """one (p,), other (p,): each pair of `near_bodies` once. order (n,): of the bodies by low[:, axis]."""
    n = low.shape[0]
    pairs, count = np.empty((2, 8 * n + 16), np.int64), 0
    for i in range(n):
        a = order[i]
        for j in range(i + 1, n):
            b = order[j]
            if low[b, axis] > high[a, axis] + reach:
                break
            if not (loose[a] or loose[b]):
                continue
            apart = False
            for k in range(3):
                apart = apart or low[a, k] > high[b, k] + reach or low[b, k] > high[a, k] + reach
            if not apart:
                if count == pairs.shape[1]:
                    pairs = np.concatenate((pairs, np.empty_like(pairs)), axis=1)
                pairs[0, count], pairs[1, count] = a, b
                count += 1
    return pairs[0, :count].copy(), pairs[1, :count].copy()


@ranged
def _facing(begin, end, polygons, planes, box, loose, near, bounds, reach, in_film, plane):
    """What `facing` returns for the polygons from `begin` to before `end`; box (n, 2, 3) around each body · near:
    (start, members) of `near_bodies`."""
    face_body, centroid, normal = polygons
    normals, offsets, plane_start = planes
    near_start, members = near
    for s in range(begin, end):
        b = face_body[s]
        best = -2.0
        for g in range(plane_start[b], plane_start[b + 1]):
            along = 0.0
            for k in range(3):
                along += normals[g, k] * normal[s, k]
            if along > best:
                best, plane[s] = along, g
        if loose[b]:
            for k in range(3):
                if normal[s, k] > 0.5:
                    in_film[s] |= (bounds[1, k] - centroid[s, k]) < reach[s] * normal[s, k]
                elif normal[s, k] < -0.5:
                    in_film[s] |= (centroid[s, k] - bounds[0, k]) < -reach[s] * normal[s, k]
        for t in range(near_start[b], near_start[b + 1]):
            if in_film[s]:
                break
            other, beyond = members[t], False
            for k in range(3):
                here, there = centroid[s, k], centroid[s, k] + reach[s] * normal[s, k]
                beyond = beyond or min(here, there) - ROUNDING * reach[s] > box[other, 1, k]
                beyond = beyond or max(here, there) + ROUNDING * reach[s] < box[other, 0, k]
            if beyond:
                continue
            first, last = 0.0, reach[s]
            for g in range(plane_start[other], plane_start[other + 1]):
                along, room = 0.0, offsets[g]
                for k in range(3):
                    along += normals[g, k] * normal[s, k]
                    room -= normals[g, k] * centroid[s, k]
                if along > 1e-12:
                    last = min(last, room / along)
                elif along < -1e-12:
                    first = max(first, room / along)
                elif room < 0.0:
                    last = -1.0
                if first > last:
                    break
            in_film[s] = first <= last
