"""Blocks alike share their nodes, faces and edges; what belongs to a contact lies together in memory."""

import numpy as np

from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import FixedPlane
from yade_scripts.contact.arrays import Rows, Slots, empty_rows
from yade_scripts.contact.nodes import block_edges, block_nodes, contact_shapes


def test_each_block_has_its_own_nodes_faces_and_edges_and_blocks_alike_have_the_same():
    wedge = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    flat, tall = (2.0, 1.0, 0.5), (1.0, 1.0, 3.0)
    blocks = [Block("a", np.zeros(3), size=flat), Block("b", np.ones(3), size=tall)]
    blocks += [Block("c", np.ones(3), vertices=wedge), Block("d", np.ones(3), size=flat)]
    planes = [FixedPlane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), FixedPlane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))]
    shapes = contact_shapes(blocks, planes, 3)
    assert len(shapes.node) == 26 + 26 + 14
    number = 0
    for row, block in enumerate(blocks):
        nodes, holders = block_nodes(block, 3)
        at = slice(shapes.node_start[row], shapes.node_end[row])
        faces = slice(shapes.face_start[row], shapes.face_end[row])
        edges = slice(shapes.edge_start[row], shapes.edge_end[row])
        assert (shapes.node[at] == nodes).all()
        assert (shapes.normal[faces] == block.planes[0]).all()
        assert (shapes.offset[faces] == block.planes[1]).all()
        assert (shapes.edge[edges] == [ends for ends, _ in block_edges(block)]).all()
        for node, held in zip(range(at.start, at.stop), holders, strict=True):
            of = shapes.of[shapes.of_start[node] : shapes.of_start[node + 1]]
            assert (of - faces.start == held).all()
        assert shapes.vertex_end[row] - at.start == len(block.vertices)
        assert shapes.face_nodes[faces].sum() == sum(len(held) for held in holders)
        assert shapes.face_number[row] == number
        number += len(block.faces)
    for row, plane in enumerate(planes, len(blocks)):
        assert (shapes.normal[shapes.face_start[row] : shapes.face_end[row]] == plane.normal).all()
        assert shapes.node_start[row] == shapes.node_end[row]
        assert shapes.face_number[row] == number
        number += 1
    assert shapes.node_start[0] == shapes.node_start[3] != shapes.node_start[1]


def fields_apart(record):
    """Whether every number of a record of arrays has a place of its own."""
    for number, values in enumerate(record):
        values[...] = number
    return all((values == number).all() for number, values in enumerate(record))


def test_columns_of_a_table_are_apart_and_a_contact_lies_in_one_piece():
    slots, rows = Slots.empty(5), empty_rows(5)
    assert (slots.face == -1).all()
    assert fields_apart(slots)
    assert fields_apart(rows)
    assert rows.slot.dtype == np.int64
    for record, size in ((slots, 64), (rows, 320)):
        for values in record[1:]:
            assert values.strides[0] == size
            assert np.shares_memory(values.base, record[-1].base)
    assert len(rows) == len(Rows._fields)
