"""Cells across the faces of a domain that solids cut: paths, pools and layers go from cell to cell by them."""

from collections import defaultdict

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.domain.topology import Topology
from fluid.mesh.background import box_mesh

MESH = box_mesh((0, 0, 0), (1, 1, 1), 1 / 8)
THIN = [[0.52, 0.5, 0.5]], [[0.02, 4.0, 4.0]]
"""A plate that divides the tank."""
SHORT = [[0.52, 0.5, 0.3]], [[0.02, 4.0, 0.5]]
"""One that ends in the tank: its free edge has water all around."""
BOX = [[0.5, 0.5, 0.5]], [[0.4, 0.3, 0.5]]
"""A block as thick as several cells: all nodes have one copy, and some cells are gone."""


@pytest.mark.parametrize("given", [THIN, SHORT, BOX])
def test_cells_are_neighbours_that_have_the_three_nodes_of_a_face_in_common(given):
    """No copy of a cell on the other side of a wall is taken, and none on the same side is missed. Of two copies that
    both have the nodes, at the free edge of a plate, it is the first."""
    domain = cut_domain(MESH, ConvexBodies.boxes(*given), "multiple")
    neighbours, parent = Topology.of(MESH, domain).neighbours, domain.parent_cell
    of_face = defaultdict(list)
    for e, cell in enumerate(domain.cells):
        for a in range(4):
            of_face[frozenset(np.delete(cell, a).tolist())].append(e)
    assert (len(domain.nodes) > len(MESH.nodes)) == (given is not BOX)
    for e, cell in enumerate(domain.cells):
        for a in range(4):
            others = [k for k in of_face[frozenset(np.delete(cell, a).tolist())] if parent[k] != parent[e]]
            assert neighbours[e, a] == (others[0] if others else -1)
