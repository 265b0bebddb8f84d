"""Meshes of basins that are no boxes, as files of a mesh generator hold them.

`python -m tests.coupler.basins` writes the one of cases/sloshing_cylinder.
"""

from itertools import pairwise

import meshio
import numpy as np
from scipy.spatial import Delaunay

from coupler.program.provenance import ROOT

SPLIT_PRISM = ((0, 1, 2, 5), (0, 1, 4, 5), (0, 3, 4, 5))
"""Tetrahedra of a prism whose corners 0 < 1 < 2 lie below 3, 4, 5: neighbours split their common side alike."""


def cylinder(radius, height, rings, layers):
    """Nodes (N, 3) [m] and cells (M, 4): rings of 6, 12, 18 ... points about the axis in each of the layers."""
    disc = [(0.0, 0.0)]
    for ring in range(1, rings + 1):
        angle = 2.0 * np.pi * np.arange(6 * ring) / (6 * ring)
        disc += list(zip(radius * ring / rings * np.cos(angle), radius * ring / rings * np.sin(angle)))
    disc = np.array(disc)
    triangles = np.sort(Delaunay(disc).simplices, axis=1)
    return upright(disc, triangles, np.linspace(0.0, height, layers + 1))


def upright(plan, triangles, heights):
    """Prisms over triangles (T, 3), corners in rising order, of a plan (n, 2) [m], each split into three cells."""
    nodes = np.concatenate([np.column_stack([plan, np.full(len(plan), z)]) for z in heights])
    cells = []
    for low, high in pairwise(range(len(heights))):
        prisms = np.hstack([triangles + low * len(plan), triangles + high * len(plan)])
        cells += [prisms[:, corners] for corners in SPLIT_PRISM]
    return nodes, np.concatenate(cells)


def write(path, nodes, **cells):
    """Write with meshio; cells by kind."""
    form = "gmsh22" if path.suffix == ".msh" else None
    meshio.Mesh(nodes, [(kind, np.asarray(rows)) for kind, rows in cells.items()]).write(path, form)
    return path


if __name__ == "__main__":
    nodes, cells = cylinder(0.5, 0.75, 8, 12)
    write(ROOT / "cases" / "sloshing_cylinder" / "cylinder.vtu", nodes, tetra=cells)
