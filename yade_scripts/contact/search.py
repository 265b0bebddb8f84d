"""The contacts of one pair: which nodes of a block are behind which faces of the other, and how deep.

A contact keeps its face until the node leaves b. Where a node enters deep behind a face (from the side, or past an
edge), its depth is measured from there, so that no contact begins with a force and contacts add no energy when they
begin.
"""

from __future__ import annotations

import numpy as np

from kernels.decorators import inlined, inner, plain
from yade_scripts.contact.arrays import BEGINS, CROSSINGS, ROOM
from yade_scripts.contact.edges import FLAT, PARALLEL, crossing, find_crossing, next_beside
from yade_scripts.contact.overlap import share_of_overlap
from yade_scripts.contact.springs import ARRIVED, release, stiffness_together, way_of

ALIGNED = 0.02
"""Least cosine between the normal of a face and the reversed normal of a face of the node: the node cannot have run
into other faces."""
CROSSING = 0.5
"""Two limits in one. Where the overlap of crossing edges is below this share of that of the faces, the edges carry the
contact together with nodes that touch. Where the depth of contacts is below this share of the overlap, they do not hold
the blocks apart: a corner may just touch the side of an edge that crosses the edges beside it."""
BESIDE = 2.0
"""Largest depth of edges that cross beside others, in overlaps along the faces: the far sides of two blocks that lie
side by side cross, too, a whole width deep."""
SHALLOW = 2.0
"""Depth, in margins, up to which a node just beside a face still counts as on it."""


@inner
def closing_bound(v, a, b, radius_a, radius_b):
    """Upper bound [m/s] of the speed at which points of two bodies approach each other; planes have radius inf and
    rest."""
    linear = turn_a = turn_b = 0.0
    for k in range(3):
        linear += (v[a, k] - v[b, k]) ** 2
        turn_a += v[a, 3 + k] ** 2
        turn_b += v[b, 3 + k] ** 2
    speed = np.sqrt(linear) + np.sqrt(turn_a) * radius_a
    return speed + np.sqrt(turn_b) * radius_b if turn_b > 0.0 else speed


@inner
def sweeping_bound(v, a, b, radius_a, radius_b):
    """Upper bound [m/s] of the speed of points of either of two blocks that are not apart against the planes of faces
    of the other, seen at most as far from its centre as the points are; planes have radius inf and rest."""
    linear = turn_a = turn_b = 0.0
    for k in range(3):
        linear += (v[a, k] - v[b, k]) ** 2
        turn_a += v[a, 3 + k] ** 2
        turn_b += v[b, 3 + k] ** 2
    speed, turn_a = np.sqrt(linear), np.sqrt(turn_a)
    if radius_b == np.inf:
        return speed + turn_a * radius_a
    return speed + turn_a * (radius_a + 2.0 * radius_b) + np.sqrt(turn_b) * (radius_b + 2.0 * radius_a)


@plain
def fastest(v, radius):
    """Upper bound of the speed of any point of the blocks [m/s]; v (n, 6), radius (n+m,) [m]."""
    most = 0.0
    for a in range(len(v)):
        linear = v[a, 0] ** 2 + v[a, 1] ** 2 + v[a, 2] ** 2
        turn = v[a, 3] ** 2 + v[a, 4] ** 2 + v[a, 5] ** 2
        most = max(most, np.sqrt(linear) + np.sqrt(turn) * radius[a])
    return most


@inner
def planes_seen_from(shapes, a, b, x, R, planes):
    """Face planes of b in the frame of a: depth of a point ξ of a behind face g is d - m·ξ, planes (g, 4) = (m, d).

    → number of faces"""
    first, normal, offset = shapes.face_start[b], shapes.normal, shapes.offset
    count = shapes.face_end[b] - first
    for g in range(count):
        n0, n1, n2 = normal[first + g, 0], normal[first + g, 1], normal[first + g, 2]
        w0 = R[b, 0, 0] * n0 + R[b, 0, 1] * n1 + R[b, 0, 2] * n2
        w1 = R[b, 1, 0] * n0 + R[b, 1, 1] * n1 + R[b, 1, 2] * n2
        w2 = R[b, 2, 0] * n0 + R[b, 2, 1] * n1 + R[b, 2, 2] * n2
        for j in range(3):
            planes[g, j] = R[a, 0, j] * w0 + R[a, 1, j] * w1 + R[a, 2, j] * w2
        between = w0 * (x[a, 0] - x[b, 0]) + w1 * (x[a, 1] - x[b, 1]) + w2 * (x[a, 2] - x[b, 2])
        planes[g, 3] = offset[first + g] - between
    return count


@inlined
def separation(node, begin, end, planes, faces):
    """The plane in front of which all nodes begin .. end lie farthest out, and their distance [m] from it, by which the
    two bodies are at least apart. It is enough to pass the vertices. → (distance, plane)"""
    best, witness = -np.inf, 0
    for g in range(faces):
        m0, m1, m2 = planes[g, 0], planes[g, 1], planes[g, 2]
        nearest = np.inf
        for i in range(begin, end):
            nearest = min(nearest, m0 * node[i, 0] + m1 * node[i, 1] + m2 * node[i, 2])
        if nearest - planes[g, 3] > best:
            best, witness = nearest - planes[g, 3], g
    return best, witness


@inlined
def scan(shapes, bodies, law, slots, slot, side, faces, pairs, p, reach, state, rows, count, lost, scratch):
    """Contacts of the nodes of a with the faces of b, which `slots` remembers from `slot` on; the energy of springs
    whose contacts end is added to `lost`. → (contacts, lost [J])

    Most nodes lie outside of the face `farthest`, which is therefore looked at first. The pair p lists nodes that may
    come into contact, and the others are passed by · reach [m]: the list is made anew of those that may before the
    bodies have moved so far against each other, 0: it is not."""
    a, b, planes, margin = side.a, side.b, faces.planes, faces.margin
    begin, base, way = shapes.node_start[a], shapes.face_number[b], scratch[6:8]
    d = 0 if a == pairs.a[p] else 1
    listed, kept = reach == 0.0 and pairs.left[p] > 0.0 and pairs.near[p, d, 0] <= ROOM, 0
    visits = np.int64(pairs.near[p, d, 0]) if listed else shapes.node_end[a] - begin
    for visit in range(visits):
        number = np.int64(pairs.near[p, d, 1 + visit]) if listed else visit
        i, s = begin + number, np.uint32(slot + number)
        xi0, xi1, xi2 = shapes.node[i, 0], shapes.node[i, 1], shapes.node[i, 2]
        nearest = faces.farthest
        smallest = _behind(planes, nearest, xi0, xi1, xi2)
        for g in range(faces.used):
            if smallest < -margin:
                break
            depth = _behind(planes, g, xi0, xi1, xi2)
            if depth < smallest:
                smallest, nearest = depth, g
        if reach > 0.0 and smallest > -margin - reach:
            if kept < ROOM and number < 256:
                pairs.near[p, d, 1 + kept] = number
            kept += 1 if number < 256 else ROOM + 1
        g = slots.face[s] - base if slots.face[s] >= 0 else -1
        if g >= 0:
            depth = _behind(planes, g, xi0, xi1, xi2)
            if depth <= 0.0 or smallest < -margin:
                way_of(state, a, b, xi0, xi1, xi2, planes[g], scratch, way)
                lost += release(slots, s, law.shear, depth, way, state.R, b)
                continue
        elif smallest < -margin or not side.begins:
            continue
        elif smallest <= 0.0 and _faces(shapes, i, planes, nearest):
            continue  # still in front of a face that it can run into: `_entered` would find as much
        else:
            g, own = _entered(shapes, i, xi0, xi1, xi2, faces, smallest)
            if g < 0:
                continue
            depth = _behind(planes, g, xi0, xi1, xi2)
            slots.face[s] = base + g
            slots.k[s] = stiffness_together(bodies.stiffness[a], bodies.stiffness[b]) / shapes.face_nodes[own]
            if law.whole:
                slots.k[s] *= share_of_overlap(shapes, a, own, b, g, faces, state)
            slots.spread[s] = shapes.face_spread[own]
            slots.shear[s, 0] = slots.shear[s, 1] = slots.shear[s, 2] = 0.0
            slots.push[s], slots.speed[s] = BEGINS, 0.0
            way_of(state, a, b, xi0, xi1, xi2, planes[g], scratch, way)
            came = ARRIVED * max(way[1, 0], 0.0)
            slots.rest[s] = 0.0 if side.whole else max(0.0, depth - came)
        slots.rest[s] = min(slots.rest[s], depth)
        write_row(rows, count, side, s, planes[g], depth, xi0, xi1, xi2, state)
        rows.depth[count], rows.kn[count] = depth - slots.rest[s], slots.k[s]
        count += 1
    if reach > 0.0:
        pairs.near[p, d, 0] = min(kept, ROOM + 1)
    return count, lost


@inlined
def cross(
    shapes, bodies, shear, slots, base, side, overlap, share, flat, state, rows, first, count, lost, scratch
):  # fmt: skip
    """Contacts of edges of a with edges of b, both known and new. → (contacts, lost [J], distance [m] by which the
    blocks are found to be apart, if positive)

    Known contacts fill the first slots, in the order in which they began.
    rows first .. count: contacts of nodes of the pair · overlap [m] along the faces · share: edges begin a contact
    where they overlap by less than that share of it, 0: none begins. They do so beside known ones, too, since others
    become the outermost as the blocks turn and slide · flat: whether edges may cross in the faces of these nodes."""
    a, b, x, R = side.a, side.b, state.x, state.R
    nodes, parted, leading, to, most = count - first, -1.0, -1, base, BESIDE * max(overlap, 0.0)
    plane, xi, way, n = scratch[4], scratch[5], scratch[6:8], scratch[8]
    for s in range(base, base + CROSSINGS):
        if slots.face[s] >= 0:
            depth, within = crossing(shapes, a, b, slots.face[s], state, plane, xi, scratch)
            if within < 0.0 or depth <= 0.0:
                way_of(state, a, b, xi[0], xi[1], xi[2], plane, scratch, way)
                lost += release(slots, s, shear, depth, way, R, b)
            else:
                _move_slot(slots, s, to)
                count = _write_crossing(slots, to, side, plane, depth, xi, state, rows, count)
                to += 1
    if not side.begins:
        return count, lost, parted
    if share > 0.0:
        leading, parted = find_crossing(shapes, a, b, x, R, share * overlap, scratch)
    if leading >= 0:
        crossing(shapes, a, b, leading, state, plane, xi, scratch)
        for k in range(3):
            n[k] = R[a, k, 0] * plane[0] + R[a, k, 1] * plane[1] + R[a, k, 2] * plane[2]
    elif count - first > nodes or flat:
        for k in range(3):
            n[k] = rows.normal[count - 1, k] if rows.a[count - 1] == a else -rows.normal[count - 1, k]
    else:
        return count, lost, parted
    level = _has_face(shapes, a, n, R) and _has_face(shapes, b, n, R)
    if leading < 0 and not level:
        return count, lost, -1.0
    k, number = 0.0, -1
    while True:
        number, depth = next_beside(shapes, side, n, number, leading, level, most, state, plane, xi, scratch)
        if number < 0:
            return count, lost, -1.0
        s = _free_slot(slots, base, number)
        if depth > 0.0 and s >= 0:
            if k == 0.0:
                k = _stiffness_of_edges(shapes, bodies, side, n, leading, level, most, nodes, state, scratch)
                crossing(shapes, a, b, number, state, plane, xi, scratch)
            slots.face[s], slots.k[s], slots.spread[s] = number, k, 1.0
            slots.shear[s, 0] = slots.shear[s, 1] = slots.shear[s, 2] = 0.0
            slots.push[s], slots.speed[s] = BEGINS, 0.0
            way_of(state, a, b, xi[0], xi[1], xi[2], plane, scratch, way)
            came = ARRIVED * max(way[1, 0], 0.0)
            slots.rest[s] = 0.0 if side.whole else max(0.0, depth - came)
            count = _write_crossing(slots, s, side, plane, depth, xi, state, rows, count)


@inner
def _stiffness_of_edges(shapes, bodies, side, n, leading, level, most, nodes, state, scratch):
    """Stiffness [N/m] of each of the edges that cross beside one another, with `nodes` contacts of nodes."""
    there, number = 0, -1
    while True:
        number, _ = next_beside(
            shapes, side, n, number, leading, level, most, state, scratch[4], scratch[5], scratch
        )
        if number < 0:
            break
        there += 1
    return (
        2.0 * stiffness_together(bodies.stiffness[side.a], bodies.stiffness[side.b]) / (max(there, 2) + nodes)
    )


@inner
def deepest_of(slots, rows, first, count):
    """Largest depth [m] of the contacts first .. count, the depth at which they began included."""
    deepest = 0.0
    for c in range(first, count):
        deepest = max(deepest, rows.depth[c] + slots.rest[rows.slot[c]])
    return deepest


@inner
def _free_slot(slots, base, number):
    """Slot for the history of a pair of edges; -1 if it has one already or all are in use."""
    free = -1
    for s in range(base, base + CROSSINGS):
        if slots.face[s] == number:
            return -1
        if slots.face[s] < 0 and free < 0:
            free = s
    return free


@inner
def _move_slot(slots, s, to):
    """Move the history in slot s to slot `to`."""
    if s == to:
        return
    slots.face[to], slots.k[to], slots.rest[to] = slots.face[s], slots.k[s], slots.rest[s]
    slots.spread[to], slots.push[to], slots.speed[to] = slots.spread[s], slots.push[s], slots.speed[s]
    for k in range(3):
        slots.shear[to, k] = slots.shear[s, k]
    slots.face[s], slots.rest[s] = -1, 0.0


@inner
def _write_crossing(slots, s, side, plane, depth, xi, state, rows, count):
    """Write the row of a contact of edges; → number of rows."""
    slots.rest[s] = min(slots.rest[s], depth)
    write_row(rows, count, side, s, plane, depth, xi[0], xi[1], xi[2], state)
    rows.depth[count], rows.kn[count] = depth - slots.rest[s], slots.k[s]
    return count + 1


@inner
def lie_flat(shapes, slots, a, b, R, rows, first, count):
    """Whether the nodes of a pair have just come into contact along one line only while the faces are nearly flat on
    one another: crossed beams would rock about that line."""
    begins = False
    for c in range(first, count):
        begins = begins or slots.push[rows.slot[c]] == BEGINS
    if not begins:
        return False
    longest, u0, u1, u2 = 0.0, 0.0, 0.0, 0.0
    for c in range(first + 1, count):
        d0, d1, d2 = _apart(rows, first, c)
        if d0 * d0 + d1 * d1 + d2 * d2 > longest:
            longest, u0, u1, u2 = d0 * d0 + d1 * d1 + d2 * d2, d0, d1, d2
    for c in range(first + 1, count):
        d0, d1, d2 = _apart(rows, first, c)
        along = d0 * u0 + d1 * u1 + d2 * u2
        if (d0 * d0 + d1 * d1 + d2 * d2) * longest - along * along > (PARALLEL * longest) ** 2:
            return False
    return _has_face(shapes, a, rows.normal[first], R) and _has_face(shapes, b, rows.normal[first], R)


@inner
def _apart(rows, first, c):
    """Vector from one contact to another, as three floats."""
    return (
        rows.point[c, 0] - rows.point[first, 0],
        rows.point[c, 1] - rows.point[first, 1],
        rows.point[c, 2] - rows.point[first, 2],
    )


@inner
def _has_face(shapes, a, n, R):
    """Whether a face of a is nearly perpendicular to n (3,)."""
    for f in range(shapes.face_start[a], shapes.face_end[a]):
        along = 0.0
        for j in range(3):
            along += shapes.normal[f, j] * (R[a, 0, j] * n[0] + R[a, 1, j] * n[1] + R[a, 2, j] * n[2])
        if abs(along) > FLAT:
            return True
    return False


@inner
def _behind(planes, g, xi0, xi1, xi2):
    """Depth of the point ξ behind a plane [m]."""
    return planes[g, 3] - planes[g, 0] * xi0 - planes[g, 1] * xi1 - planes[g, 2] * xi2


@inner
def _faces(shapes, i, planes, g):
    """Whether node i of a can have run into face g of b: a face of it looks the other way."""
    for at in range(shapes.of_start[i], shapes.of_start[i + 1]):
        f = shapes.of[at]
        m0, m1, m2 = shapes.normal[f, 0], shapes.normal[f, 1], shapes.normal[f, 2]
        if -(planes[g, 0] * m0 + planes[g, 1] * m1 + planes[g, 2] * m2) > ALIGNED:
            return True
    return False


@inner
def _entered(shapes, i, xi0, xi1, xi2, faces, smallest):
    """Face g of b that node i of a has entered, and the face of a opposite to it; -1, -1 if the node is outside.

    It is the nearest of the faces that the node can have run into; if the node is still in front of that one, it is
    outside."""
    planes, normal = faces.planes, shapes.normal
    face, own, best = -1, -1, np.inf
    for g in range(faces.used):
        depth = _behind(planes, g, xi0, xi1, xi2)
        if depth >= best:
            continue
        cosine = ALIGNED
        for at in range(shapes.of_start[i], shapes.of_start[i + 1]):
            f = shapes.of[at]
            c = -(planes[g, 0] * normal[f, 0] + planes[g, 1] * normal[f, 1] + planes[g, 2] * normal[f, 2])
            if c > cosine:
                cosine, face, own, best = c, g, f, depth
    if best <= 0.0 or (smallest < 0.0 and best > SHALLOW * faces.margin):
        return -1, -1
    return face, own


@inner
def write_row(rows, c, side, s, plane, depth, xi0, xi1, xi2, state):
    """Write the geometry of a contact; its point is half way between the node ξ and the face."""
    a, b, x, R = side.a, side.b, state.x, state.R
    rows.a[c], rows.b[c], rows.slot[c] = a, b, s
    for k in range(3):
        n = R[a, k, 0] * plane[0] + R[a, k, 1] * plane[1] + R[a, k, 2] * plane[2]
        arm = R[a, k, 0] * xi0 + R[a, k, 1] * xi1 + R[a, k, 2] * xi2 + 0.5 * depth * n
        rows.normal[c, k], rows.arm_a[c, k] = n, arm
        rows.point[c, k] = x[a, k] + arm
        rows.arm_b[c, k] = rows.point[c, k] - x[b, k]
