"""Multiple covers: blocks separate the water, openings connect it, fields stay on their side."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fluid.cut.bodies import ConvexBodies
from fluid.domain.continued_nodes import blocked, pick_old_cells
from fluid.domain.covers import Connection, components
from fluid.domain.physical_domain import carry, cut_domain
from kernels.decorators import plain
from tests.fluid.test_thin_walls import BOX, MESH, H

SHARP = Connection(inner=0.1, face=0.2)


def test_blocks_that_meet_along_an_edge_separate_the_water():
    """Two quadrants of water touch only along a line; the open halves of the mesh faces there have equal
    area but lie apart."""
    for x, y in ((0.5, 0.5), (0.5 + H / 2, 0.5), (0.5 + H / 2, 0.5 + H / 2), (0.53, 0.47)):
        bodies = ConvexBodies.boxes([[x - 1, y + 1, 0.5], [x + 1, y - 1, 0.5]], [[2, 2, 4], [2, 2, 4]])
        domain = cut_domain(BOX, bodies, "multiple")
        assert components(domain.cells, len(domain.nodes)).max() == 1


@plain
def _blocked(a, b, planes):
    """`blocked`, which only kernels can call."""
    return blocked(a, b, planes.normal, planes.offset, planes.start[0], planes.start[1])


def test_a_segment_is_blocked_where_points_of_it_lie_in_the_body():
    """Segments of random ends past, through, into and inside of a turned box, against 2000 points of each; those that
    only graze it are left out."""
    rng, seen = np.random.default_rng(8), set()
    turn = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    planes = ConvexBodies.boxes([[0.5, 0.5, 0.5]], [[0.7, 0.3, 0.2]], [turn]).planes()
    for a, b in rng.uniform(0.0, 1.0, (300, 2, 3)):
        points = a + np.linspace(0.0, 1.0, 2000)[:, None] * (b - a)
        deepest = (points @ planes.normal.T - planes.offset).max(axis=1).min()
        if abs(deepest) > 1e-3:
            assert _blocked(a, b, planes) == (deepest < 0.0)
            seen.add(bool(deepest < 0.0))
    assert seen == {True, False}


def test_door_connects_and_slit_depends_on_the_thresholds():
    """A door two cells wide joins the two sides. A slit of 0.05 h does so by default; the thresholds for
    thin plates close it."""

    def parts(width, connection):
        low, high = 0.5 - width / 2, 0.5 + width / 2
        bodies = ConvexBodies.boxes(
            [[0.52, low / 2, 0.5], [0.52, (1 + high) / 2, 0.5]], [[0.3 * H, low, 2], [0.3 * H, 1 - high, 2]]
        )
        domain = cut_domain(MESH, bodies, "multiple", connection=connection)
        return components(domain.cells, len(domain.nodes)).max() + 1

    assert parts(2 * H, None) == 1
    assert parts(2 * H, SHARP) == 1
    assert parts(0.05 * H, None) == 1
    assert parts(0.05 * H, SHARP) == 2


def test_without_thin_solids_covers_are_single():
    """No bodies: the background itself. A half space of solid: the same cells, nodes inside it absent."""
    plain = cut_domain(MESH, ConvexBodies.empty(), "multiple")
    np.testing.assert_array_equal(plain.cells, MESH.cells)
    np.testing.assert_array_equal(plain.nodes, MESH.nodes)
    turn = Rotation.from_euler("xyz", [0.3, 0.2, 0.1]).as_matrix()
    bodies = ConvexBodies.boxes([[0.5, 0.5, -1.5]], [[9, 9, 4]], turn[None])
    one, many = (
        cut_domain(MESH, bodies),
        cut_domain(MESH, bodies, "multiple", connection=Connection(pocket=0)),
    )
    np.testing.assert_array_equal(many.parent_node[many.cells], one.cells)
    np.testing.assert_array_equal(many.volume, one.volume)
    assert len(np.unique(many.parent_node)) == len(many.parent_node) < len(MESH.nodes)


def hollow_box(inner):
    """Six plates round a cavity of edge `inner` at the middle of the cube."""
    t = 0.5 * H
    centre, size = [], []
    for a in range(3):
        for s in (-1, 1):
            c, d = np.full(3, 0.5), np.full(3, inner + 2 * t)
            c[a] += s * (inner + t) / 2
            d[a] = t
            centre.append(c)
            size.append(d)
    return ConvexBodies.boxes(centre, size)


def test_closed_pockets():
    """A cavity of several cells is a component of its own; one below the limit is dropped with its faces."""
    large = cut_domain(MESH, hollow_box(2.5 * H), "multiple")
    volume = np.bincount(components(large.cells, len(large.nodes)), large.volume)
    assert volume.min() == pytest.approx((2.5 * H) ** 3, rel=1e-12)
    small = cut_domain(MESH, hollow_box(0.05 * H), "multiple")
    assert components(small.cells, len(small.nodes)).max() == 0
    outer = 1.05 * H
    assert small.face_area.sum() == pytest.approx(6 * outer**2, rel=1e-12)


def test_fields_stay_on_their_side_of_a_moving_plate():
    """A full plate 0.3 h thick moves four cells through the mesh: copies of nodes and cells take their values from
    their own side, or have no source where the plate has just uncovered them; the two sides never mix. Where the first
    copy of a cell handed on its velocity, the water of a sliver between blocks pushed the whole cell beside it."""
    turn = Rotation.from_euler("yz", [0.2, -0.15]).as_matrix()
    reference = ConvexBodies.boxes([[0, 0, 0]], [[0.3 * H, 4, 4]])

    def at(x, previous=None):
        moved = None if previous is None else np.ones(1, dtype=bool)
        bodies = reference.moved([[x, 0.5, 0.5]], turn[None])
        return cut_domain(MESH, bodies, "multiple", previous=previous, moved=moved)

    def side_of_cells(domain, x):
        return (domain.centroid - [x, 0.5, 0.5]) @ turn[:, 0] > 0

    def side(domain, x):
        cell = side_of_cells(domain, x)
        node = np.zeros(len(domain.nodes))
        node[domain.cells] = cell[:, None]
        return node

    x = 0.3
    old = at(x)
    for _ in range(25):
        new = at(x + 0.02, old)
        source = carry(old, new)
        found = source >= 0
        assert found.mean() > 0.97
        np.testing.assert_array_equal(old.parent_node[source[found]], new.parent_node[found])
        np.testing.assert_array_equal(side(old, x)[source[found]], side(new, x + 0.02)[found])
        cells = pick_old_cells(old, new, source)
        known = cells >= 0
        assert known.mean() > 0.97
        np.testing.assert_array_equal(old.parent_cell[cells[known]], new.parent_cell[known])
        np.testing.assert_array_equal(
            side_of_cells(old, x)[cells[known]], side_of_cells(new, x + 0.02)[known]
        )
        old, x = new, x + 0.02


def test_cutting_again_equals_a_full_cut():
    """Bit for bit with multiple covers too."""
    rng = np.random.default_rng(4)
    n = 20
    centre, size = rng.uniform(0, 1, (n, 3)), rng.uniform(0.02, 0.3, (n, 3))
    reference = ConvexBodies.boxes(centre, size)
    rotation = Rotation.random(n, rng=5).as_matrix()
    domain = cut_domain(MESH, reference.moved(centre, rotation), "multiple")
    for _ in range(4):
        moved = rng.random(n) < 0.4
        centre = centre + moved[:, None] * rng.normal(0, 0.05, (n, 3))
        bodies = reference.moved(centre, rotation)
        domain = cut_domain(MESH, bodies, "multiple", previous=domain, moved=moved)
        full = cut_domain(MESH, bodies, "multiple")
        for f in dataclasses.fields(full):
            if f.name != "memory":
                np.testing.assert_array_equal(getattr(domain, f.name), getattr(full, f.name))
