"""How far two boxes lie apart along their faces, from half edges and the nine cosines between their axes.

The lowest vertex of a box along a normal n is Σ h_i |n_i| below its centre, h_i half its edges. Rounding is the same
for either sign, so that this has the bits of the minimum over its eight vertices (`search.separation`), in a tenth of
the operations. The cosines between the axes of a and b serve the faces of both.
"""

from __future__ import annotations

import numpy as np

from kernels.decorators import inlined, inner

CLEAR = 1e-9
"""Share of the radii of two boxes by which all vertices of one lie in front of a face of the other, from which on none
of its nodes can be in contact with the other's faces. A node of a box that no face of its own turns towards a plane
(`search.ALIGNED`) lies almost half a box above the lowest vertex, far beyond the margin of faces."""


@inlined
def between_boxes(shapes, a, b, x, R, cosines, shift):
    """Faces in front of which the nodes of the other box lie farthest out.

    cosines (3, 3): set to R_aᵀ R_b · shift (2, 3): set to the centre of a seen from b along the axes of b, and to that
    of b seen from a along the axes of a   →   (distance of the nodes of a before a face of b, that face of b, distance
    of the nodes of b before a face of a, that face of a), [m], negative where they are behind every face"""
    for i in range(3):
        for j in range(3):
            cosines[i, j] = R[a, 0, i] * R[b, 0, j] + R[a, 1, i] * R[b, 1, j] + R[a, 2, i] * R[b, 2, j]
    d0, d1, d2 = x[a, 0] - x[b, 0], x[a, 1] - x[b, 1], x[a, 2] - x[b, 2]
    for k in range(3):
        shift[0, k] = R[b, 0, k] * d0 + R[b, 1, k] * d1 + R[b, 2, k] * d2
        shift[1, k] = R[a, 0, k] * -d0 + R[a, 1, k] * -d1 + R[a, 2, k] * -d2
    half_a, half_b = shapes.half[a], shapes.half[b]
    gap_a, gap_b, face_b, face_a = -np.inf, -np.inf, 0, 0
    for k in range(3):
        low = abs(cosines[0, k]) * half_a[0] + abs(cosines[1, k]) * half_a[1] + abs(cosines[2, k]) * half_a[2]
        gap_a, face_b = _farther(gap_a, face_b, low, half_b[k], shift[0, k], k)
        low = abs(cosines[k, 0]) * half_b[0] + abs(cosines[k, 1]) * half_b[1] + abs(cosines[k, 2]) * half_b[2]
        gap_b, face_a = _farther(gap_b, face_a, low, half_a[k], shift[1, k], k)
    return gap_a, face_b, gap_b, face_a


@inner
def _farther(gap, face, low, half, shift, axis):
    """The larger of a distance so far and those from both faces across an axis, and its face."""
    below, above = -low - (half + shift), -low - (half - shift)
    if below > gap:
        gap, face = below, 2 * axis
    if above > gap:
        gap, face = above, 2 * axis + 1
    return gap, face


@inlined
def planes_of_box(half, cosines, shift, turned, planes):
    """Write the faces of a box as `search.planes_seen_from` does. half (3,): of it · cosines, shift (3,): of
    `between_boxes` · turned: whether the box is the first of the pair → number of faces"""
    for k in range(3):
        for j in range(3):
            along = cosines[k, j] if turned else cosines[j, k]
            planes[2 * k, j], planes[2 * k + 1, j] = -along, along
        planes[2 * k, 3], planes[2 * k + 1, 3] = half[k] + shift[k], half[k] - shift[k]
    return 6
