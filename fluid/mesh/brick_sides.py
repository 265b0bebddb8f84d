"""Which edges of a cell are sides of bricks.

The cells of a brick that is split along its diagonals have three sides of the brick among their edges, which connect
their four corners.  What flows through a corner of the brick and out of each corner of the cell, -|e| ∇N_a·u, then
goes along these three edges in one way only: what leaves the corners on one side of an edge passes along it.  In right
bricks these are the fluxes (1) of `surface/volume.py`; in bricks that follow a bed, which are sheared, a stream along
their layers still passes from no layer to another.  Which edges they are is seen in the lattice that a mesh was made
from, where bricks are cubes.
"""

from __future__ import annotations

import numpy as np

from array_types import Array
from fluid.mesh.gradients import gradients, products_of
from fluid.numerics.cube_root import cube_root
from fluid.numerics.spans import spans

PAIRS = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))
"""Corners of the edges of a cell, in the order of `Background.products`."""
NONE, ALL = 0, 63
"""Codes of cells of which no sides are known, and of those whose fluxes are (1) along all edges. The code of another
cell has the bit k set if its edge k is a side of a brick."""
FLAT = 1e-9
"""Product of gradients in cells of volume 1/6 that counts as zero."""


def sides_of(lattice, cells) -> Array:
    """Codes (M,) uint8 of cells (M, 4), by the places of their corners in bricks of edge 1, lattice (N, 3); NONE for
    those that are not what is left of a brick which is split."""
    code = np.zeros(len(cells), np.uint8)
    for some in spans(len(code)):
        g, volume = gradients(lattice, cells[some])
        products = products_of(g) * (cube_root(6.0 * np.abs(volume)) ** 2)[:, None]
        edges = products < -FLAT
        mask = (edges << np.arange(6)).sum(axis=1)
        right = (products <= FLAT).all(axis=1) & (np.abs(volume) > FLAT) & (BEYOND[mask].any(axis=(1, 2)))
        code[some] = np.where(right, mask, NONE)
    return code


def _beyond():
    """(64, 4, 4) uint8: for a code and the corners a, b of one of its edges the corners, as bits, that are on a's side
    of the edge; zero for other pairs, and for codes whose edges do not connect the corners in one way."""
    out = np.zeros((64, 4, 4), np.uint8)
    for code in range(64):
        edges = [pair for k, pair in enumerate(PAIRS) if code >> k & 1]
        if len(edges) != 3 or len(_joined(0, edges)) != 4:
            continue
        for a, b in edges:
            rest = [edge for edge in edges if edge != (a, b)]
            out[code, a, b] = sum(1 << k for k in _joined(a, rest))
            out[code, b, a] = sum(1 << k for k in _joined(b, rest))
    return out


def _joined(corner, edges):
    """The corners that edges connect with one of them."""
    found = {corner}
    for _ in range(3):
        found |= {b for pair in edges for a, b in (pair, pair[::-1]) if a in found}
    return found


BEYOND = _beyond()
