"""Openings of multiple covers that are wide beside free edges, and spare slits and films."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.covers import OPENINGS, components
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh

H = 0.1
MESH = box_mesh((0, 0, 0), (1, 1, 1), H)


def cut(bodies, openings, previous=None):
    return cut_domain(MESH, bodies, "multiple", previous, connection=OPENINGS[openings])


def same(one, other):
    names = ("nodes", "cells", "parent_node", "volume", "face_cell", "face_area")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


def test_the_faces_of_a_plate_and_of_a_box_are_apart_at_their_edges():
    """As with wide openings, bit for bit: a plate 0.3 cells thick and a box have more nodes than where any opening
    counts."""
    plate = ConvexBodies.boxes([[0.537, 0.48, 0.46]], [[0.03, 0.31, 0.33]])
    box = ConvexBodies.boxes([[0.537, 0.48, 0.46]], [[0.35, 0.31, 0.33]])
    for body in (plate, box):
        assert same(cut(body, "edges"), cut(body, "wide"))
        assert len(cut(body, "edges").nodes) > len(cut(body, "all").nodes)


def test_a_face_without_edges_closes_nothing():
    """A slab from side to side leaves a fifth of the cells at its face: water moves along it as where any opening
    counts. Closed as narrow openings, the fifth stood still beside a sheet that fell past it."""
    slab = ConvexBodies.boxes([[0.28, 0.5, 0.5]], [[0.4, 2.0, 2.0]])
    for openings in ("edges", "wide"):
        assert same(cut(slab, openings), cut(slab, "all"))


@pytest.mark.parametrize("opening", [1e-5, 0.2 * H, 0.7 * H])
@pytest.mark.parametrize("at", [0.4, 0.437])
def test_a_slit_between_two_boxes_stays_open(opening, at):
    """Two boxes that part the tank but for a slit between them, on a plane of the mesh and off it: one water through
    it, two with wide openings."""
    low, high = [-1.0, at], [at + opening, 2.0]
    centre = [[0.52, 0.5, (a + b) / 2] for a, b in (low, high)]
    boxes = ConvexBodies.boxes(centre, [[0.33, 4.0, b - a] for a, b in (low, high)])
    assert _waters(cut(boxes, "edges")) == 1
    assert _waters(cut(boxes, "wide")) > 1


def _waters(domain):
    """Bodies of water with more than a cell of it."""
    volume = np.bincount(components(domain.cells, len(domain.nodes)), domain.volume)
    return int((volume > H**3).sum())


def test_the_film_between_blocks_belongs_to_the_water_around():
    """A block 1e-4 of a cell above another one: its lower face is wetted, as it is not with wide openings."""
    above, size = H * 1e-4, np.array([0.5, 0.5, 0.25])
    centre = [[0.537, 0.537, above + 0.5 * size[2]], [0.537, 0.537, 2 * above + 1.5 * size[2]]]
    blocks = ConvexBodies.boxes(centre, np.broadcast_to(size, (2, 3)))
    for openings, wetted in (("edges", True), ("wide", False)):
        domain = cut(blocks, openings)
        part = components(domain.cells, len(domain.nodes))[domain.face_cell]
        of_water = part == part[np.argmax(domain.face_centroid[:, 2])]
        below = of_water & (domain.face_normal[:, 2] < -0.9) & (domain.face_body == 1)
        area = domain.face_area[below].sum()
        assert (
            area == pytest.approx(size[0] * size[1], rel=1e-6) if wetted else area < 0.9 * size[0] * size[1]
        )


def test_cutting_again_around_moved_bodies_gives_the_same():
    """What is a slit hangs on bodies in other cells: a body that comes or goes changes the cells of its neighbours."""
    rng = np.random.default_rng(1)
    centre = np.array([[0.5, 0.5, 0.125], [0.5, 0.5, 0.3801], [0.82, 0.5, 0.2], [0.3, 0.21, 0.3]])
    size = np.array([[0.5, 0.5, 0.25], [0.4, 0.4, 0.25], [0.1, 0.3, 0.3], [0.2, 0.05, 0.3]])
    bodies = ConvexBodies.boxes(centre, size)
    domain = cut(bodies, "edges")
    for step in range(4):
        centre = centre + rng.uniform(-0.05, 0.05, centre.shape) * (np.arange(4)[:, None] % 2 == step % 2)
        bodies = bodies.moved(centre)
        domain = cut(bodies, "edges", domain)
        assert same(domain, cut(bodies, "edges"))
