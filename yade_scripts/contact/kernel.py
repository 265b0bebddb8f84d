"""The loop over pairs of blocks that are near: places and velocities of the blocks → contact forces and what they take.

A node of block a inside block b, behind its face f, is a contact: normal n out of f, depth δ = offset - n·y with y the
node in the frame of b. `contact_search` finds them, `contact_springs` says what they do; edges that cross are in
`contact_edges`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from kernel_decorators import inner, kernel, released
from yade_scripts.blocks.block import MARGIN
from yade_scripts.contact.arrays import CROSSINGS
from yade_scripts.contact.edges import pair_scratch
from yade_scripts.contact.ground import scan_ground
from yade_scripts.contact.search import (
    CROSSING,
    closing_bound,
    cross,
    deepest_of,
    lie_flat,
    planes_seen_from,
    scan,
    separation,
)
from yade_scripts.contact.springs import Mode, add_up, apply, set_dashpots

PAIR = 20
"""To look at a pair takes as long as so many rows of a loop."""
SUNK = 0.01
"""Overlap in radii of the smaller block up to which that is not asked: the search for edges costs more than nodes."""
SAME = 1.0 + 1e-6
"""Overlap of crossing edges over that of faces up to which edges carry where no node does: that of flat beams is the
same."""


def alone(kernel: Callable, count: int, *args, weight: int = 1) -> list:
    """kernel(0, count, *args) on this thread: what `contact_forces` does without others to share its work with."""
    return [kernel(0, count, *args)]


def contact_forces(share, shapes, bodies, law, pairs, slots, ground, x, v, R, dt, last_dt, rows, F):
    """Find the contacts at the present places and add their forces to F (n, 6).

    share: `alone`, or what runs ranges of the pairs on several threads: forces are added in the order of the pairs
    afterwards, so the bits are the same; a range of all pairs adds them as it finds them · ground: `Ground`,
    NO_GROUND without · dt [s]: substep to come, 0: only look · last_dt [s]: substep that led here
    Which contacts there are and what they hold does not depend on which pairs that do not touch are in the list.
    → (contacts, work of friction and of springs that were let go [J])
    """
    lost = np.zeros(len(pairs.a))
    state = (shapes, bodies, law, pairs, slots, ground, F, x, v, R, dt, last_dt, rows, lost)
    spans = np.array(share(_contacts, len(pairs.a), *state, weight=PAIR))
    return _added_up(spans, rows, lost, F)


@released
def _contacts(
    first_pair, last_pair, shapes, bodies, law, pairs, slots, ground, F, x, v, R, dt, last_dt, rows, lost
):
    """Contacts of a range of pairs, into the rows from the first slot of the first pair on → where they begin and end.

    F (n, 6): of the blocks, the other bodies are planes; the forces are added where the range holds all pairs ·
    lost (p,) [J]: what friction and springs that were let go took."""
    begins, n, S = pairs.start[first_pair], len(F), np.empty(3)
    all_pairs = first_pair == 0 and last_pair == len(pairs.a)
    count = begins
    most = 0
    for body in range(len(shapes.face_start) - 1):
        most = max(most, shapes.face_start[body + 1] - shapes.face_start[body])
    planes, scratch = np.empty((most, 4)), pair_scratch(shapes)
    for p in range(first_pair, last_pair):
        a, b, finds, taken = pairs.a[p], pairs.b[p], not pairs.found[p], 0.0
        pairs.found[p] = dt == 0.0
        if not finds and not pairs.touching[p]:
            continue
        if finds and pairs.calm[p] > 0.0:
            pairs.calm[p] -= last_dt * closing_bound(v, a, b, shapes.radius[a], shapes.radius[b])
            if pairs.calm[p] > 0.0:
                continue
        first, apart = count, -np.inf
        if b == ground.row:
            count, taken, apart = scan_ground(
                shapes, bodies, law.shear, slots, pairs.start[p], finds, pairs.fresh[p], a, ground, x, v, R, last_dt,
                rows, count, taken, scratch, planes[0],
            )  # fmt: skip
        for node_body, face_body in ((a, b), (b, a)):
            begin, end = shapes.node_start[node_body], shapes.node_start[node_body + 1]
            if begin == end or b == ground.row:
                continue
            faces = planes_seen_from(
                shapes.face_start, shapes.normal, shapes.offset, node_body, face_body, x, R, planes
            )
            margin = min(shapes.margin[node_body], shapes.margin[face_body])
            gap, nearest = separation(shapes.node, begin, shapes.vertex_end[node_body], planes, faces)
            apart = max(apart, gap)
            if gap <= margin or pairs.touching[p]:
                slot = pairs.start[p] if node_body == a else pairs.start[p + 1] - CROSSINGS - (end - begin)
                count, taken = scan(
                    shapes, bodies, law, slots, slot, finds, pairs.fresh[p], node_body, face_body, planes,
                    faces, nearest, margin, x, v, R, last_dt, rows, count, taken, scratch,
                )  # fmt: skip
        base, nodes = pairs.start[p + 1] - CROSSINGS, count
        known = False
        for s in range(base, base + CROSSINGS):
            known = known or slots.face[s] >= 0
        meets = finds and apart < 0.0 and b < n
        sunk = -apart > SUNK * min(shapes.radius[a], shapes.radius[b])
        bare = count == first or (sunk and deepest_of(slots, rows, first, count) < -CROSSING * apart)
        leads = meets and (bare or not pairs.touching[p])
        flat = meets and count > first and not known and lie_flat(shapes, slots, a, b, R, rows, first, count)
        if known or leads or flat:
            deepest = 0.0
            if leads:
                deepest = -SAME * apart if bare else -CROSSING * apart
            count, taken, parted = cross(
                shapes, bodies, law.shear, slots, base, finds, pairs.fresh[p], a, b, deepest, sunk, flat, x, v, R,
                last_dt, rows, first, count, taken, scratch,
            )  # fmt: skip
            apart = max(apart, parted)
        if finds:
            pairs.overlap[p] = max(0.0, -apart)
            if count > nodes:
                pairs.overlap[p] = min(pairs.overlap[p], deepest_of(slots, rows, first, count))
            pairs.fresh[p], pairs.touching[p] = 0.0, count > first
            pairs.calm[p] = apart - _overhang(shapes, a, b) if count == first else 0.0
        if count > first:
            yields, K = set_dashpots(bodies, law, a, b, R, rows, first, count, scratch)
            mode = Mode(law.zeta, np.sqrt(yields * K))
            taken += apply(slots, v, R, dt, last_dt, mode, a, rows, first, count, scratch)
            for c in range(first, count if all_pairs else first):
                add_up(rows, c, F, S)
        lost[p] = taken
    return begins, count


@kernel
def _added_up(spans, rows, lost, F):
    """The rows in `spans` (k, 2) one behind the other, and their forces on F, where one range has not added them
    already; → how many they are, Σ lost."""
    count, S = spans[0, 1] if len(spans) == 1 else 0, np.empty(3)
    for k in range(len(spans) if len(spans) > 1 else 0):
        for c in range(spans[k, 0], spans[k, 1]):
            if c != count:
                _move(rows, c, count)
            add_up(rows, count, F, S)
            count += 1
    total = 0.0
    for p in range(len(lost)):
        total += lost[p]
    return count, total


@inner
def _move(rows, c, to):
    """Row c to another, before it."""
    rows.a[to], rows.b[to], rows.slot[to] = rows.a[c], rows.b[c], rows.slot[c]
    rows.depth[to], rows.kn[to], rows.kt[to], rows.cn[to] = rows.depth[c], rows.kn[c], rows.kt[c], rows.cn[c]
    rows.ct[to], rows.mu[to], rows.push[to], rows.held[to] = (
        rows.ct[c],
        rows.mu[c],
        rows.push[c],
        rows.held[c],
    )
    for k in range(3):
        rows.point[to, k], rows.normal[to, k], rows.force[to, k] = (
            rows.point[c, k],
            rows.normal[c, k],
            rows.force[c, k],
        )
        rows.viscous[to, k], rows.shear[to, k] = rows.viscous[c, k], rows.shear[c, k]
        rows.arm_a[to, k], rows.arm_b[to, k], rows.shift[to, k] = (
            rows.arm_a[c, k],
            rows.arm_b[c, k],
            rows.shift[c, k],
        )
        rows.velocity[to, k] = rows.velocity[c, k]


@inner
def _overhang(shapes, a, b):
    """Bound of the distance at which nodes beside the faces of two blocks may count as on them [m]: planes that are
    moved out by `MARGIN` of the inner radius lie in the block made larger by that share."""
    other = shapes.radius[b] if shapes.radius[b] < np.inf else 0.0
    return MARGIN * max(shapes.radius[a], other)


@kernel
def carry_slots(old_pairs, old, new_index, old_index, start, new, shear):
    """Copy the memory of pairs old_index to pairs new_index; → energy of contacts in pairs that are no more [J]."""
    kept = np.zeros(len(old_pairs.a), np.bool_)
    for i in range(len(new_index)):
        p, q = new_index[i], old_index[i]
        kept[q] = True
        for s in range(start[p + 1] - start[p]):
            to, source = start[p] + s, old_pairs.start[q] + s
            new.face[to] = old.face[source]
            new.k[to] = old.k[source]
            new.rest[to] = old.rest[source]
            for c in range(3):  # a whole row at once takes numba two seconds to compile
                new.shear[to, c] = old.shear[source, c]
            new.spread[to] = old.spread[source]
            new.push[to] = old.push[source]
            new.speed[to] = old.speed[source]
    lost = 0.0
    for q in range(len(kept)):
        if not kept[q]:
            for s in range(old_pairs.start[q], old_pairs.start[q + 1]):
                if old.face[s] >= 0:
                    held = old.shear[s, 0] ** 2 + old.shear[s, 1] ** 2 + old.shear[s, 2] ** 2
                    lost += 0.5 * held / (shear * old.k[s])
    return lost
