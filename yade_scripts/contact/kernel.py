"""The loop over candidate pairs of blocks: from positions and velocities to contact forces and the energy they
dissipate.

A node of block a inside block b, behind its face f, is a contact: normal n out of f, depth δ = offset - n·y with y the
node in the frame of b. `search.py` finds the contacts, `springs.py` computes their forces, and `edges.py` treats edges
that cross.
"""

from __future__ import annotations

import numpy as np

from kernels.decorators import inner, kernel, plain, released
from yade_scripts.contact.arrays import CROSSINGS, ROOM, Direction, Faces
from yade_scripts.contact.boxes import CLEAR, between_boxes, planes_of_box
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
    sweeping_bound,
)
from yade_scripts.contact.springs import Mode, add_up, apply, set_dashpots, take_over

PAIR, PIECES = 20, 4
"""Cost of one pair, in rows of an ordinary loop, and ranges of pairs for each thread, since those that touch cost most:
they decide how pairs are divided among threads."""
STEADY = 0.1
"""Relative motion, in margins of the thinner block, within which the edges found last are taken to be the outermost
still. Each change of edges leaves at most about that overlap without force: blocks that roll and slide on their edges
would otherwise sink a little at each."""
REACH = 0.1
"""Relative motion, in radii of the smaller block, before which the nodes near the faces of the other are not sought
again: much more than blocks move in a substep, and less than most nodes are away from faces that they do not touch."""
BEYOND = 1.0 + 1e-6
"""Factor on a distance within which contact is looked for, for rounding."""
SAME = 1.0 + 1e-6
"""Largest ratio of the overlap of crossing edges to that of the faces at which edges carry where no node does. For
flat beams the two overlaps are equal."""


def contact_forces(share, shapes, bodies, law, pairs, slots, ground, state, rows, F):
    """Find the contacts at the present places and add their forces to F (n, 6).

    share: `kernels.ranges.alone`, or a function that runs ranges of the pairs on several threads. In that case the
    forces are added afterwards in the order of the pairs, so that the result has the same bits; a range of all pairs
    adds them as it finds them · ground: `Ground`, or NO_GROUND.
    Pairs in the list that do not touch change neither the contacts nor their forces.
    → (number of contacts, energy [J] taken by friction and by springs of contacts that ended)
    """
    lost = np.zeros(len(pairs.a))
    scene = (shapes, bodies, law, pairs, slots, ground, F, state, rows, lost)
    spans = share(_contacts, len(pairs.a), *scene, weight=PAIR, pieces=PIECES)
    if len(spans) == 1:
        return spans[0][1], _total(lost)
    return _added_up(np.array(spans), rows, F), _total(lost)


@released
def _contacts(first_pair, last_pair, shapes, bodies, law, pairs, slots, ground, F, state, rows, lost):
    """Write the contacts of a range of pairs into the rows from the first slot of the first pair on → first and last
    row.

    F (n, 6): forces on the blocks; bodies beyond n are planes. Forces are added here only if the range is all pairs ·
    lost (p,) [J]: energy taken by friction and by springs of contacts that ended."""
    x, v, R = state.x, state.v, state.R
    begins, n, S = pairs.start[first_pair], len(F), np.empty(3)
    all_pairs = first_pair == 0 and last_pair == len(pairs.a)
    count = begins
    most = 0
    for body in range(len(shapes.face_start)):
        most = max(most, shapes.face_end[body] - shapes.face_start[body])
    planes, scratch = np.empty((most, 4)), pair_scratch(shapes)
    cosines, shift, half = np.empty((3, 3)), np.empty((2, 3)), shapes.half
    for p in range(first_pair, last_pair):
        a, b = np.uint32(pairs.a[p]), np.uint32(pairs.b[p])
        finds, taken = not pairs.found[p], 0.0
        pairs.found[p] = state.dt == 0.0
        if not finds and not pairs.touching[p]:
            continue
        if finds and pairs.calm[p] > 0.0:
            pairs.calm[p] -= state.last_dt * closing_bound(v, a, b, shapes.radius[a], shapes.radius[b])
            if pairs.calm[p] > 0.0 and not pairs.touching[p]:
                pairs.left[p] = 0.0  # no longer counted
                continue
        reach = 0.0
        if finds:
            pairs.left[p] -= state.last_dt * sweeping_bound(v, a, b, shapes.radius[a], shapes.radius[b])
            if pairs.left[p] <= 0.0:
                pairs.left[p] = reach = REACH * min(shapes.radius[a], shapes.radius[b])
                pairs.near[p, 0, 0] = pairs.near[p, 1, 0] = ROOM + 1
        whole = pairs.force[p] > 0.0
        first, apart, forward = count, -np.inf, Direction(a, b, finds, whole)
        if b == ground.row:
            count, taken, apart = scan_ground(
                shapes, bodies, law.shear, slots, pairs.start[p], forward, ground, state,
                rows, count, taken, scratch, planes[0],
            )  # fmt: skip
        boxes = half[a, 0] > 0.0 and half[b, 0] > 0.0
        clear, gap_a, gap_b, face_a, face_b = 0.0, 0.0, 0.0, 0, 0
        if boxes:
            gap_a, face_b, gap_b, face_a = between_boxes(shapes, a, b, x, R, cosines, shift)
            clear = CLEAR * (shapes.radius[a] + shapes.radius[b])
        for node_body, face_body in ((a, b), (b, a)):
            begin, end = shapes.node_start[node_body], shapes.node_end[node_body]
            if begin == end or b == ground.row:
                continue
            if boxes and node_body == a:
                faces, gap, farthest = 6, gap_a, face_b
            elif boxes:
                faces, gap, farthest = 6, gap_b, face_a
            else:
                faces = planes_seen_from(shapes, node_body, face_body, x, R, planes)
                gap, farthest = separation(shapes.node, begin, shapes.vertex_end[node_body], planes, faces)
            margin = min(shapes.margin[node_body], shapes.margin[face_body])
            apart = max(apart, gap)
            if gap <= (clear if boxes else margin) or pairs.touching[p]:
                if boxes:
                    planes_of_box(
                        half[face_body], cosines, shift[0 if node_body == a else 1], node_body == b, planes
                    )
                slot = pairs.start[p] if node_body == a else pairs.start[p + 1] - CROSSINGS - (end - begin)
                count, taken = scan(
                    shapes, bodies, law, slots, slot, Direction(node_body, face_body, finds, whole),
                    Faces(planes, faces, farthest, margin), pairs, p, reach, state, rows, count, taken, scratch,
                )  # fmt: skip
        base, nodes = pairs.start[p + 1] - CROSSINGS, count
        known = False
        for s in range(base, base + CROSSINGS if pairs.touching[p] else base):
            known = known or slots.face[s] >= 0
        meets = finds and apart < 0.0 and b < n
        bare = count == first or deepest_of(slots, rows, first, count) < -CROSSING * apart
        due = count == first or not pairs.touching[p] or pairs.calm[p] <= 0.0
        leads = meets and due and (bare or not pairs.touching[p])
        flat = meets and count > first and not known and lie_flat(shapes, slots, a, b, R, rows, first, count)
        if known or leads or flat:
            share = 0.0
            if leads:
                share = SAME if bare else CROSSING
            count, taken, parted = cross(
                shapes, bodies, law.shear, slots, base, forward, -apart, share, flat, state, rows,
                first, count, taken, scratch,
            )  # fmt: skip
            apart = max(apart, parted)
        if finds:
            pairs.overlap[p] = max(0.0, -apart)
            if count > nodes:
                pairs.overlap[p] = min(pairs.overlap[p], deepest_of(slots, rows, first, count))
            pairs.touching[p] = count > first
            if whole and pairs.force[p] < np.inf:
                taken += take_over(slots, rows, first, count, pairs.force[p], pairs.held[p], state)
            pairs.force[p] = pairs.held[p] = 0.0
            if count == first:
                pairs.calm[p] = apart - _overhang(shapes, a, b)
            elif leads or not bare:
                pairs.calm[p] = STEADY * min(shapes.margin[a], shapes.margin[b]) if bare else 0.0
        if count > first:
            yields, K = set_dashpots(bodies, law, a, b, R, rows, first, count, scratch)
            mode = Mode(law.zeta, np.sqrt(yields * K))
            taken += apply(slots, state, mode, a, rows, first, nodes, count, scratch)
            for c in range(first, count if all_pairs else first):
                add_up(rows, c, F, S)
        lost[p] = taken
    return begins, count


@plain
def _total(lost):
    total = 0.0
    for p in range(len(lost)):
        total += lost[p]
    return total


@kernel
def _added_up(spans, rows, F):
    """Move the rows of several `spans` (k, 2) together and add their forces to F → number of rows."""
    count, S = 0, np.empty(3)
    for k in range(len(spans)):
        for c in range(spans[k, 0], spans[k, 1]):
            if c != count:
                _move(rows, c, count)
            add_up(rows, count, F, S)
            count += 1
    return count


@inner
def _move(rows, c, to):
    """Copy row c to an earlier row."""
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
    """Upper bound [m] of the distance at which nodes of one of two blocks may still count as on faces of the other,
    which extend beyond their edges by the smaller margin of the two."""
    return BEYOND * min(shapes.margin[a], shapes.margin[b]) * max(shapes.swell[a], shapes.swell[b])


@kernel
def carry_slots(old_pairs, old, new_index, old_index, start, new, shear):
    """Copy the history of the pairs old_index to the pairs new_index; → energy [J] in contacts of pairs that were
    dropped."""
    kept = np.zeros(len(old_pairs.a), np.bool_)
    for i in range(len(new_index)):
        p, q = new_index[i], old_index[i]
        kept[q] = True
        for s in range(start[p + 1] - start[p]):
            to, source = start[p] + s, old_pairs.start[q] + s
            new.face[to] = old.face[source]
            if old.face[source] < 0:
                continue
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
