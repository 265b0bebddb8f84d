"""Lattices of bricks, each split into six tetrahedra along one diagonal (Kuhn, IBM J. Res. Dev. 4 (1960) 518).

"kuhn": the same diagonal in all bricks.  The cells around an inner node are symmetric about the node only: flow along
the diagonal and flow across it meet different cells.
"mirrored": every brick is the mirror image of those beside it, in all three directions (the triangulation J1 of Todd,
The Computation of Fixed Points and Applications, Springer 1976, ch. III).  On a uniform lattice the cells around a node
are symmetric in x, y and z, and so is the whole mesh about its middle where the number of bricks is even.  Diagonals
end in every second node along each direction; these nodes hold three times the volume of the others.
"""

from __future__ import annotations

import numpy as np
from skfem import MeshTet

from array_types import Array


def split_bricks(axes, split: str = "kuhn") -> tuple[Array, Array]:
    """Nodes (N, 3) [m] and cells (6 n, 4) of the bricks between the coordinates axes (three arrays [m]), with the six
    cells of a brick one after the other, so that neighbours in space are close in memory.

    Numbers run along the axis with the fewest coordinates first and along that with the most last (of two alike along y
    before x and x before z), so that a range of numbers has the smallest borders to others that there are."""
    first, middle, last = sorted((1, 0, 2), key=lambda k: len(axes[k]))
    order = [middle, first, last]  # of scikit-fem's lattice the second axis runs first
    mesh = MeshTet.init_tensor(*(axes[k] for k in order))
    nodes = np.empty_like(mesh.p.T)
    nodes[:, order] = mesh.p.T
    bricks = SPLITS[split](nodes, mesh.t.T.reshape(6, -1, 4).swapaxes(0, 1).astype(np.int64), axes)
    return nodes, bricks.reshape(-1, 4)


def _alike(nodes, bricks, axes):
    """The cells of bricks (n, 6, 4) as scikit-fem makes them."""
    return bricks


def _mirrored(nodes, bricks, axes):
    """The cells of bricks (n, 6, 4), reflected along the directions in which the place of the brick is odd."""
    place = np.column_stack([np.searchsorted(axes[k], nodes[:, k]) for k in range(3)])
    number = np.empty([len(a) for a in axes], np.int64)
    number[tuple(place.T)] = np.arange(len(nodes))
    low = place[bricks].min(axis=(1, 2), keepdims=True)
    corner = place[bricks] - low
    corner = np.where(low % 2 == 1, 1 - corner, corner)
    return number[tuple(np.moveaxis(low + corner, -1, 0))]


SPLITS = {"kuhn": _alike, "mirrored": _mirrored}
"""Cells (n, 6, 4) of bricks by the name of the split."""
