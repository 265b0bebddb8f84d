"""The share of two faces that lies on one another, counted by their nodes, so that a pair of blocks has the stiffness
asked for.

A node of either face carries K/2n, both faces being in series and n nodes on each: K where equal faces lie on one
another. Of a small face on a large one only the small one's nodes are in contact, with half of that. So nodes carry

    k = K/2n · 2 max(s_a, s_b)/(s_a + s_b),   s: share of the nodes of a face that lie within the other one

which adds up to K times the larger share, and leaves equal faces as they are.
"""

from __future__ import annotations

from kernels.decorators import inner


@inner
def share_of_overlap(shapes, a, own, b, g, faces, state):
    """2 max(s_a, s_b)/(s_a + s_b) of the face `own` of a and the face g of b, of which each is looked at along its
    normal. faces: those of b in the frame of a. 1 for a plane, which has no nodes."""
    planes, margin = faces.planes, faces.margin
    if shapes.node_start[b] == shapes.node_end[b]:
        return 1.0
    on_a = on_b = 0
    for i in range(shapes.node_start[a], shapes.node_end[a]):
        if _holds(shapes, i, own):
            xi = shapes.node[i]
            d = planes[g, 3] - planes[g, 0] * xi[0] - planes[g, 1] * xi[1] - planes[g, 2] * xi[2]
            inside = True
            for h in range(faces.used):
                aside = planes[h, 3]
                for k in range(3):
                    aside -= planes[h, k] * (xi[k] + d * planes[g, k])
                inside = inside and (h == g or aside >= -margin)
            on_a += 1 if inside else 0
    first, end = shapes.face_start[a], shapes.face_end[a]
    for i in range(shapes.node_start[b], shapes.node_end[b]):
        if _holds(shapes, i, shapes.face_start[b] + g):
            y0, y1, y2 = _seen_from(shapes, i, a, b, state.x, state.R)
            n = shapes.normal[own]
            d = shapes.offset[own] - n[0] * y0 - n[1] * y1 - n[2] * y2
            inside = True
            for f in range(first, end):
                m = shapes.normal[f]
                aside = (
                    shapes.offset[f]
                    - m[0] * (y0 + d * n[0])
                    - m[1] * (y1 + d * n[1])
                    - m[2] * (y2 + d * n[2])
                )
                inside = inside and (f == own or aside >= -margin)
            on_b += 1 if inside else 0
    share_a = on_a / shapes.face_nodes[own]
    share_b = on_b / shapes.face_nodes[shapes.face_start[b] + g]
    return 2.0 * max(share_a, share_b) / (share_a + share_b) if on_a + on_b > 0 else 1.0


@inner
def _holds(shapes, i, face):
    """Whether node i lies on a face of its block."""
    found = False
    for at in range(shapes.of_start[i], shapes.of_start[i + 1]):
        found = found or shapes.of[at] == face
    return found


@inner
def _seen_from(shapes, i, a, b, x, R):
    """Node i of b in the frame of a."""
    w0, w1, w2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    for j in range(3):
        w0 += R[b, 0, j] * shapes.node[i, j]
        w1 += R[b, 1, j] * shapes.node[i, j]
        w2 += R[b, 2, j] * shapes.node[i, j]
    return (
        R[a, 0, 0] * w0 + R[a, 1, 0] * w1 + R[a, 2, 0] * w2,
        R[a, 0, 1] * w0 + R[a, 1, 1] * w1 + R[a, 2, 1] * w2,
        R[a, 0, 2] * w0 + R[a, 1, 2] * w1 + R[a, 2, 2] * w2,
    )
