"""Contact nodes of convex blocks: the points of a block that meet faces of other blocks.

A node of one block inside another, near one of its faces, is one contact point. Nodes are the vertices, points along
the edges and the middle of every face: with three an edge a box carries 26, nine on a face, so that resting, stacking,
toppling and sliding come out right (two an edge let offset blocks fall over). Edges that cross between nodes carry each
other (`contact_edges`).
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from yade_scripts.blocks.block import MARGIN, Block
from yade_scripts.blocks.faces import FixedPlane, gauss_points
from yade_scripts.contact.edges import ROUND_OFF

Array = np.ndarray


FINE = 8
"""Gauss points along an edge for the mean distance within a face."""


class Shapes(NamedTuple):
    """Blocks, then fixed planes, as bodies 0 .. n-1, n .. n+m-1; points and normals in the frame of their body.

    node_start (n+m+1,) · node (N, 3) [m] · vertex_end (n+m,): the vertices come first
    of_start (N+1,), of (.,): faces that hold a node
    face_start (n+m+1,) · normal (F, 3) outward · offset (F,) [m]: inside is normal·x < offset
    face_nodes (F,): nodes on a face · face_spread (F,): mean distance of its points from its middle over that of its
    nodes
    radius, margin (n+m,) [m] · swell (n+m,): bound of how far a corner moves as all faces move outwards by 1
    half (n+m, 3) [m]: half the edges of a box, nan for other bodies
    edge_start (n+m+1,) · edge (E, 2) vertices of the block · edge_out (E, 3): sum of the normals of its two faces
    edge_like (E,): the first edge of the block that is parallel, counted from its first one.
    """

    node_start: Array
    node: Array
    vertex_end: Array
    of_start: Array
    of: Array
    face_start: Array
    normal: Array
    offset: Array
    face_nodes: Array
    face_spread: Array
    radius: Array
    margin: Array
    swell: Array
    half: Array
    edge_start: Array
    edge: Array
    edge_out: Array
    edge_like: Array


def block_nodes(block: Block, per_edge: int) -> tuple[Array, list[list[int]]]:
    """Nodes (k, 3) [m] of a block in its frame, and the faces that hold each.

    Vertices, then per_edge - 2 points along each edge, then the middles of the faces.
    """
    points, holders = [*block.vertices], [[] for _ in block.vertices]
    for number, face in enumerate(block.faces):
        for i in face:
            holders[i].append(number)
    for (i, j), faces in block_edges(block):
        for s in np.linspace(0.0, 1.0, per_edge)[1:-1]:
            points.append((1.0 - s) * block.vertices[i] + s * block.vertices[j])
            holders.append(faces)
    for number, face in enumerate(block.faces):
        points.append(block.vertices[list(face)].mean(axis=0))
        holders.append([number])
    return np.array(points), holders


def block_edges(block: Block) -> list[tuple[tuple[int, int], list[int]]]:
    """Vertices of each edge, and the two faces that meet there."""
    edges: dict[tuple[int, int], list[int]] = {}
    for number, face in enumerate(block.faces):
        for i, j in zip(face, (*face[1:], face[0])):
            edges.setdefault((min(i, j), max(i, j)), []).append(number)
    return sorted(edges.items())


def contact_shapes(blocks: list[Block], planes: list[FixedPlane], per_edge: int) -> Shapes:
    """Nodes and faces of all blocks and planes in one set of arrays."""
    nodes, holders, normals, offsets, counts, spreads, swells = [], [], [], [], [], [], []
    edges: list[tuple[Array, Array, Array]] = []
    faces_before = 0
    known: dict[tuple, tuple] = {}
    for block in blocks:
        key = (block.vertices.tobytes(), block.faces)
        if key not in known:
            nodes_of = block_nodes(block, per_edge)
            known[key] = (*nodes_of, *block.planes, _edges(block), _spreads(block, *nodes_of), _swell(block))
        points, holding, normal, offset, along, spread, swell = known[key]
        swells.append(swell)
        spreads.append(spread)
        edges.append(along)
        nodes.append(points)
        holders += [[faces_before + f for f in held] for held in holding]
        normals.append(normal)
        offsets.append(offset)
        counts.append((len(points), len(normal), len(block.vertices)))
        faces_before += len(normal)
    for plane in planes:
        normals.append(plane.normal[None])
        offsets.append(np.zeros(1))
        spreads.append(np.ones(1))
        swells.append(0.0)
        counts.append((0, 1, 0))
    node_count, face_count, vertex_count = np.array(counts, np.int64).reshape(-1, 3).T
    node_start = _starts(node_count)
    of = np.array([f for held in holders for f in held], np.int64)
    number_of_faces = int(face_count.sum())
    inner = np.array([b.planes[1].min() for b in blocks] + [np.inf] * len(planes))
    half = [0.5 * b.size if b.is_box else np.full(3, np.nan) for b in blocks]
    radius = np.array([b.radius for b in blocks] + [np.inf] * len(planes))
    return Shapes(
        node_start,
        np.concatenate(nodes) if nodes else np.zeros((0, 3)),
        node_start[:-1] + vertex_count,
        _starts([len(held) for held in holders]),
        of,
        _starts(face_count),
        np.concatenate(normals) if normals else np.zeros((0, 3)),
        np.concatenate(offsets) if offsets else np.zeros(0),
        np.bincount(of, minlength=number_of_faces),
        np.concatenate(spreads) if spreads else np.zeros(0),
        radius,
        MARGIN * inner,
        np.array(swells),
        np.array([*half, *np.full((len(planes), 3), np.nan)]).reshape(-1, 3),
        _starts([len(ends) for ends, _, _ in edges] + [0] * len(planes)),
        np.concatenate([np.zeros((0, 2), np.int64), *(ends for ends, _, _ in edges)]),
        np.concatenate([np.zeros((0, 3)), *(out for _, out, _ in edges)]),
        np.concatenate([np.zeros(0, np.int64), *(like for _, _, like in edges)]),
    )


def _swell(block: Block) -> float:
    """Upper bound of how far the support of a block, max n·x over its points for a unit vector n, grows when all faces
    move outwards by 1.

    Where the faces with the normals N meet in a corner it is n·w with N w = 1. Of more than three faces those three
    count whose normals have n between them, one of all threes that are no two parallel; it never exceeds the
    growth of the block scaled up until its nearest face has moved so far."""
    normals, offsets = block.planes
    ways = []
    for corner in range(len(block.vertices)):
        at = [number for number, face in enumerate(block.faces) if corner in face]
        for three in combinations(at, 3):
            if abs(np.linalg.det(normals[list(three)])) > ROUND_OFF:
                ways.append(np.linalg.norm(np.linalg.solve(normals[list(three)], np.ones(3))))
    return float(min(max(ways), block.radius / offsets.min()))


def _spreads(block: Block, points: Array, holders: list[list[int]]) -> Array:
    """Of each face, the mean distance of its points from the middle of its nodes over the mean distance of the nodes.

    Most nodes lie on the rim, where a pressure that is even over the face has little of its moment of friction."""
    found = np.ones(len(block.faces))
    for number, face in enumerate(block.faces):
        nodes = points[[number in held for held in holders]]
        middle = nodes.mean(axis=0)
        places, weights = gauss_points(block.vertices[list(face)], FINE)
        even = weights @ np.linalg.norm(places - middle, axis=1) / weights.sum()
        found[number] = even / np.linalg.norm(nodes - middle, axis=1).mean()
    return found


def _edges(block: Block) -> tuple[Array, Array, Array]:
    """Ends (e, 2) of edges, the sum of the normals (e, 3) on both sides, and the first parallel edge (e,) of each."""
    found = block_edges(block)
    normals = block.planes[0]
    ends = np.array([ends for ends, _ in found], np.int64)
    along = np.diff(block.vertices[ends], axis=1)[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    sine = np.linalg.norm(np.cross(along[:, None], along), axis=2)
    return (
        ends,
        np.array([normals[faces].sum(axis=0) for _, faces in found]),
        np.argmax(sine < ROUND_OFF, axis=1),
    )


def _starts(counts) -> Array:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
