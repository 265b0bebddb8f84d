"""Processor time of cutting a cell: walls of blocks, and loose boxes by the number of boxes near the cell.

The mesh has 196,608 tetrahedra. The time includes the search, the splitting, the surfaces and the parts, and is given
in microseconds for every cell that was cut.
"""

from __future__ import annotations

import time

import numpy as np
from scipy.spatial.transform import Rotation

CELLS_ALONG = 32
WALLS = (1, 5, 10, 50)
"""Blocks along each edge of a wall 1.6 wide and high in a unit cube; of the last, 32 are as wide as the cube."""
BOXES = 1000
NEAR = (1, 2, 3, 4, 6)
"""Numbers of bodies near a cell."""
REPEATS = 5
MOST_WALL = {1: 4.6, 5: 5.8, 10: 9.0, 50: 35.0}
MOST_NEAR = {2: 10.7, 3: 15.0, 4: 20.6, 6: 34.0}
"""Limits [us] a cut cell: walls, and numbers of bodies near the cell."""
TURN = Rotation.from_euler("xyz", [0.1, 0.15, 0.2]).as_matrix()


def wall(count: int):
    """count x count blocks, 0.05 thick, rotated out of all planes of the mesh."""
    from fluid.cut.bodies import ConvexBodies

    edge = 1.6 / count
    at = (np.arange(count) + 0.5) * edge - 0.8
    centre = np.array([[0.0, y, z] for y in at for z in at]) @ TURN.T + 0.5
    n = len(centre)
    return ConvexBodies.boxes(centre, np.tile([0.05, edge, edge], (n, 1)), np.repeat(TURN[None], n, axis=0))


def loose_boxes(count: int):
    """Boxes of 1.3 to 3.8 cells at random positions and orientations."""
    from fluid.cut.bodies import ConvexBodies

    random = np.random.default_rng(0)
    centre, size = random.uniform(0.02, 0.98, (count, 3)), random.uniform(0.04, 0.12, (count, 3))
    return ConvexBodies.boxes(centre, size, Rotation.random(count, rng=random).as_matrix())


def cutting(size: int) -> dict:
    """CPU seconds a cut cell: walls [(blocks, cells, seconds)] and near [(bodies near, cells, seconds)]."""
    from fluid.mesh.background import box_mesh

    mesh = box_mesh((0, 0, 0), (1, 1, 1), 1 / CELLS_ALONG)
    walls = []
    for count in WALLS:
        bodies = wall(count)
        seconds = shortest_time(lambda bodies=bodies: cut(mesh, bodies, *search(mesh, bodies)))
        cells = cut_cells(cut(mesh, bodies, *search(mesh, bodies)))
        walls.append((len(bodies), cells, seconds / cells))
    bodies, near = loose_boxes(BOXES), []
    cell, body = search(mesh, bodies)
    around = np.bincount(cell, minlength=len(mesh.cells))[cell]
    for count in NEAR:
        pairs = cell[around == count], body[around == count]
        seconds = shortest_time(lambda pairs=pairs: cut(mesh, bodies, *pairs))
        cells = cut_cells(cut(mesh, bodies, *pairs))
        near.append((count, cells, seconds / cells))
    return {"walls": walls, "near": near}


def search(mesh, bodies):
    """Pairs (cell, body) that may meet."""
    from fluid.cut.candidate_pairs import near_pairs
    from fluid.domain.physical_domain import SEARCH_MARGIN

    return near_pairs(mesh, bodies, np.arange(len(bodies)), SEARCH_MARGIN * mesh.tolerance)


def cut(mesh, bodies, cell, body):
    """Cuts of the cells in the pairs, with the parts that multiple covers need."""
    from fluid.cut.cut_cells import cut_cells
    from fluid.domain.covers import Connection

    chosen, first = np.unique(cell, return_index=True)
    start = np.append(first, len(cell)).astype(np.int64)
    area = Connection().link_area(mesh.spacing)
    return cut_cells(mesh.nodes, mesh.cells, chosen, start, body, bodies, mesh.tolerance, mesh.spacing, area)


def cut_cells(cuts) -> int:
    """Number of cells of which a part was removed and a part is left."""
    return len(np.unique(cuts.part_cell[~cuts.part_whole]))


def shortest_time(work) -> float:
    """Least CPU seconds of REPEATS calls after one that warms up."""
    work()
    spent = []
    for _ in range(REPEATS):
        began = time.process_time()
        work()
        spent.append(time.process_time() - began)
    return min(spent)


def figures(measured: dict):
    """(what, bodies, us a cut cell, limit or None) of every line."""
    for (blocks, cells, seconds), count in zip(measured["walls"], WALLS):
        yield (
            f"cutting: wall of {count} x {count} blocks, {cells} cells",
            blocks,
            1e6 * seconds,
            MOST_WALL[count],
        )
    for count, cells, seconds in measured["near"]:
        what = f"cutting: {cells} cells near {count} of {BOXES} loose boxes"
        yield what, BOXES, 1e6 * seconds, MOST_NEAR.get(count)
