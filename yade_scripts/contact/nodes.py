"""Contact nodes of convex blocks: the points of a block that meet faces of other blocks.

A node of one block inside another, near one of its faces, is one contact point. Nodes are the vertices, points along
the edges and the middle of every face: with three an edge a box carries 26, nine on a face, so that resting, stacking,
toppling and sliding come out right (two an edge let offset blocks fall over). Edges that cross between nodes carry each
other (`edges.py`).
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from array_types import Array
from yade_scripts.blocks.block import MARGIN, Block
from yade_scripts.blocks.faces import FixedPlane, gauss_points
from yade_scripts.contact.edges import ROUND_OFF

FINE = 8
"""Gauss points along an edge for the mean distance within a face."""


class Shapes(NamedTuple):
    """Blocks, then fixed planes, as bodies 0 .. n-1, n .. n+m-1; points and normals in the frame of their body. Blocks
    alike have theirs in common, so that few of them are in use.

    node_start, node_end (n+m,) · node (N, 3) [m] · vertex_end (n+m,): the vertices come first
    of_start (N+1,), of (.,): faces that hold a node
    face_start, face_end (n+m,) · normal (F, 3) outward · offset (F,) [m]: inside is normal·x < offset
    face_number (n+m,): number of the first face of each body, if each had its own
    face_nodes (F,): nodes on a face · face_spread (F,): mean distance of its points from its middle over that of its
    nodes
    radius, margin (n+m,) [m] · swell (n+m,): bound of how far a corner moves as faces move out by 1
    half (n+m, 3) [m]: half the edges of a box, nan for other bodies
    edge_start, edge_end (n+m,) · edge (E, 2) vertices of the block · edge_out (E, 3): sum of normals of its two faces
    edge_like (E,): the first edge of the block that is parallel, counted from its first one.
    """

    node_start: Array
    node_end: Array
    node: Array
    vertex_end: Array
    of_start: Array
    of: Array
    face_start: Array
    face_end: Array
    face_number: Array
    normal: Array
    offset: Array
    face_nodes: Array
    face_spread: Array
    radius: Array
    margin: Array
    swell: Array
    half: Array
    edge_start: Array
    edge_end: Array
    edge: Array
    edge_out: Array
    edge_like: Array


def block_nodes(block: Block, per_edge: int) -> tuple[Array, list[list[int]]]:
    """Nodes (k, 3) [m] of a block in its frame, and the faces that hold each.

    Vertices, then per_edge - 2 points along each edge, then the middles of the faces.
    """
    points = [*block.vertices]
    holders: list[list[int]] = [[] for _ in block.vertices]
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
    kinds: list[_Kind] = []
    known: dict[object, int] = {}
    of_body = []
    for block in blocks:
        key = (block.vertices.tobytes(), block.faces, block.is_box)
        if key not in known:
            known[key] = len(kinds)
            kinds.append(_of_block(block, per_edge))
        of_body.append(known[key])
    for plane in planes:
        of_body.append(len(kinds))
        kinds.append(_of_plane(plane))
    of = np.array(of_body, np.int64)
    nodes, faces, edges = (
        _starts([len(part) for part in parts])
        for parts in ([k.nodes for k in kinds], [k.normals for k in kinds], [k.ends for k in kinds])
    )
    holding = [[first + f for f in held] for k, first in zip(kinds, faces) for held in k.holders]
    holders = np.array([f for held in holding for f in held], np.int64)
    node_start, face_start, edge_start = nodes[:-1][of], faces[:-1][of], edges[:-1][of]
    inner = np.array([b.planes[1].min() for b in blocks] + [np.inf] * len(planes))
    half = [np.full(3, np.nan) if b.size is None else 0.5 * b.size for b in blocks]
    return Shapes(
        node_start=node_start,
        node_end=nodes[1:][of],
        node=_joined([k.nodes for k in kinds], 3),
        vertex_end=node_start + np.array([kinds[k].vertices for k in of_body], np.int64),
        of_start=_starts([len(held) for held in holding]),
        of=holders,
        face_start=face_start,
        face_end=faces[1:][of],
        face_number=_starts([len(kinds[k].normals) for k in of_body])[:-1],
        normal=_joined([k.normals for k in kinds], 3),
        offset=np.concatenate([np.zeros(0), *(k.offsets for k in kinds)]),
        face_nodes=np.bincount(holders, minlength=int(faces[-1])),
        face_spread=np.concatenate([np.zeros(0), *(k.spreads for k in kinds)]),
        radius=np.array([b.radius for b in blocks] + [np.inf] * len(planes)),
        margin=MARGIN * inner,
        swell=np.array([kinds[k].swell for k in of_body]),
        half=np.array([*half, *np.full((len(planes), 3), np.nan)]).reshape(-1, 3),
        edge_start=edge_start,
        edge_end=edges[1:][of],
        edge=_joined([k.ends for k in kinds], 2).astype(np.int64),
        edge_out=_joined([k.out for k in kinds], 3),
        edge_like=np.concatenate([np.zeros(0, np.int64), *(k.like for k in kinds)]),
    )


class _Kind(NamedTuple):
    """Nodes, faces and edges that all bodies alike have; as in `Shapes`, faces counted from the first one."""

    nodes: Array
    holders: list[list[int]]
    vertices: int
    normals: Array
    offsets: Array
    spreads: Array
    swell: float
    ends: Array
    out: Array
    like: Array


def _of_block(block: Block, per_edge: int) -> _Kind:
    nodes, holders = block_nodes(block, per_edge)
    spreads = _spreads(block, nodes, holders)
    return _Kind(nodes, holders, len(block.vertices), *block.planes, spreads, _swell(block), *_edges(block))


def _of_plane(plane: FixedPlane) -> _Kind:
    none = np.zeros((0, 3))
    no_edges = np.zeros((0, 2), np.int64), none, np.zeros(0, np.int64)
    return _Kind(none, [], 0, plane.normal[None], np.zeros(1), np.ones(1), 0.0, *no_edges)


def _joined(tables: list[Array], columns: int) -> Array:
    return np.concatenate([np.zeros((0, columns)), *tables])


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
