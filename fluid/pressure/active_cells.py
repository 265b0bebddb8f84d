"""Which nodes and cells take part in the pressure of a step.

A node below the surface but inside a solid may have no water around it: on a gentle slope many cells beyond the water
line have such nodes, while their fluid part is air.  A cut cell whose fluid part lies above the surface is
void: it is left out of the matrix, the right hand side, the coupling to the solids and the correction alike.  Water at
rest stays at rest exactly, as its balance holds cell by cell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Bools, Floats, Ints
from fluid.domain.cell_vectors import places_among
from fluid.domain.moments import touching_among, wet_fraction
from fluid.numerics.fields import marks_of
from fluid.pressure.indefinite_cells import without_indefinite
from kernels.decorators import kernel, ranged
from kernels.threads import over

DRY = 1e-9
"""A fluid part that lies above φ = -DRY h holds no water."""


@dataclass(frozen=True)
class WetPart:
    """nodes (N,) bool with an unknown · cells (n,), share (n,) of each with φ < 0, 1 in wholly wet ones ·
    void (k,) cells left out: without water, or those that `indefinite_cells.py` drops."""

    nodes: Bools
    cells: Ints
    share: Floats
    void: Ints

    @classmethod
    def of(cls, topology, domain, phi, spacing: float) -> WetPart:
        """The wet part below the level set φ (N,) [m]; spacing [m] of the mesh."""
        t = topology
        below = np.empty(len(phi), bool)
        over(_below, len(phi), phi, t.active, below)
        cells = t.cells_around(below)
        holding = _holding(domain, t, phi, -DRY * spacing)
        cut = places_among(t.cut_cells, cells)
        dry = cut[~holding[domain.part[cells[cut]]]]
        if t.is_obtuse:
            holds = np.ones(len(cells), bool)
            holds[dry] = False
            holds[holds] = without_indefinite(t, cells[holds], below, phi)
            dry = np.flatnonzero(~holds)
        void = cells[dry]
        if len(void) > 0:
            cells = np.delete(cells, dry)
            left = marks_of(t.cells[void].reshape(-1), len(phi))
            left[t.cells[touching_among(cells, left, t.cells)]] = False
            below &= ~left
        return cls(below, cells, wet_fraction(cells, phi, t.parts), void)


@ranged
def _below(first, last, phi, active, found):
    for j in range(first, last):
        i = np.uint64(j)
        found[i] = phi[i] < 0.0 and active[i]


def _holding(d, t, phi, dry):
    """(K,) bool: cut cells, by their `part`, with φ < dry at a corner outside the solids, or at a corner of a wetted
    polygon.

    These are all corners of the fluid part, on which φ is linear; but not where thresholds of the covers part the water
    of a cell: a part may lie on no body there. The corners of such parts are those of the tetrahedra that fill them."""
    holds = np.zeros(len(t.share) - 1, bool)
    mesh = (d.part, t.nodes, t.cells, t.parent, t.gradients, t.covered)
    _lowest_below(d.face_cell, d.face_corners, *mesh, phi, dry, holds)
    if d.memory.connection is not None and d.memory.connection.face > 0.0:
        bare = d.is_cut.copy()
        bare[d.face_cell] = False
        _bare_below(np.flatnonzero(bare), d.part, t.cells, d.fan_start, d.fan_corners, phi, dry, holds)
    return holds


@kernel
def _bare_below(bare, part, cells, fan_start, corners, phi, dry, holds):
    """Set holds (K,) in place for the cells bare (n,) with φ < dry at a corner of a tetrahedron of theirs; corners
    (T, 4, 4): barycentric coordinates."""
    for e in bare:
        for s in range(fan_start[e], fan_start[e + 1]):
            for q in range(4):
                level = 0.0
                for a in range(4):
                    level += corners[s, q, a] * phi[cells[e, a]]
                holds[part[e]] = holds[part[e]] or level < dry


@kernel
def _lowest_below(face_cell, corners, part, nodes, cells, parent, g, covered, phi, dry, holds):
    slope = np.empty(3)
    for s in range(face_cell.shape[0]):
        e = face_cell[s]
        own = part[e]
        if own < 0 or holds[own]:  # a face on the border of cells that are whole has no part
            continue
        lowest = np.inf
        for a in range(4):
            i = cells[e, a]
            lowest = min(lowest, phi[i])
            if not covered[i] and phi[i] < dry:
                holds[own] = True
        if holds[own] or lowest >= dry:
            continue
        o = cells[e, 0]
        for k in range(3):
            slope[k] = 0.0
            for a in range(4):
                slope[k] += phi[cells[e, a]] * g[parent[e], a, k]
        for q in range(3):
            level = phi[o]
            for k in range(3):
                level += slope[k] * (corners[s, q, k] - nodes[o, k])
            holds[own] = holds[own] or level < dry
