"""The physical domain: what the background tetrahedra hold of the water's side of the solids.

Every element keeps its P1 functions; only the region of integration shrinks to the fluid part, known by its
exact moments V = ∫ dV, c = ∫ x dV / V, S = ∫ (x - c)(x - c)^T dV, and by its wetted surface, polygons with
owner, normal n (out of the body into the water) and a three-point rule. For linear fields that is all that
integration over the part needs.

With `covers = "single"` nodes and cells are those of the background (cells without fluid left out); with
"multiple" they are the virtual mesh of `covers.py`.

A step that moves few bodies cuts again only the cells near their old or new positions.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from fluid.bodies import ConvexBodies
from fluid.covers import Connection, pick_old_nodes, virtual_cells, without_pockets
from fluid.cut import Cuts, cut_cells
from fluid.mesh import Background, gradients
from fluid.near import near_pairs

__all__ = ["PhysicalDomain", "carry", "cut_domain", "gradients", "wetted_coupling"]

# One absolute tolerance for the whole mesh, as a share of its spacing; the search takes ten times that.
TOLERANCE = 1e-10
SEARCH_MARGIN = 1e-9
# Entries of the second moments in the order of the kernel.
XX = np.array([0, 1, 2, 0, 0, 1])
YY = np.array([0, 1, 2, 1, 2, 2])


@dataclass(frozen=True)
class WholeCells:
    """Moments of the uncut background cells: volume (M,), centroid (M, 3), second (M, 6)."""

    volume: np.ndarray
    centroid: np.ndarray
    second: np.ndarray


@dataclass(frozen=True)
class Memory:
    """What the next cut needs of this one: mesh, bodies, pairs sorted by (cell, body), cut parts."""

    mesh: Background
    bodies: ConvexBodies
    whole: WholeCells
    pair_cell: np.ndarray
    pair_body: np.ndarray
    cuts: Cuts
    connection: Connection


@dataclass(frozen=True)
class PhysicalDomain:
    """The part of the background tetrahedra outside the solids: N nodes, M cells, S wetted polygons.

    nodes (N, 3) [m] · cells (M, 4) · parent_node (N,), parent_cell (M,) in the background
    volume (M,) [m3], centroid (M, 3) [m], second (M, 6) [m5] (xx, yy, zz, xy, xz, yz): of the fluid part
    is_cut (M,): something was removed from the cell
    face_cell (S,) row of `cells` · face_body (S,) · face_area (S,) [m2] · face_centroid (S, 3) [m]
    face_normal (S, 3) out of the body · face_points (S, 3, 3) [m] three points, weight area / 3, degree 2
    face_corners (S, 3, 3) [m] (the polygons are triangles)
    n_bodies · body_centre (n_bodies, 3) [m] · covers "single" or "multiple".
    """

    nodes: np.ndarray
    cells: np.ndarray
    parent_node: np.ndarray
    parent_cell: np.ndarray
    volume: np.ndarray
    centroid: np.ndarray
    second: np.ndarray
    is_cut: np.ndarray
    face_cell: np.ndarray
    face_body: np.ndarray
    face_area: np.ndarray
    face_centroid: np.ndarray
    face_normal: np.ndarray
    face_points: np.ndarray
    face_corners: np.ndarray
    n_bodies: int
    body_centre: np.ndarray
    covers: str
    memory: Memory = field(repr=False, compare=False)


def cut_domain(
    mesh: Background,
    bodies: ConvexBodies,
    covers: str = "single",
    previous: PhysicalDomain | None = None,
    moved=None,
    connection: Connection | None = None,
) -> PhysicalDomain:
    """Cut the background mesh by the bodies.

    previous: a domain of the same mesh and bodies. Only cells near bodies whose planes changed since (old or
    new position, growth too) are cut again, which gives the same domain bit for bit as a full cut.
    moved (n_bodies,) bool: bodies to cut again in any case; not needed.
    connection: thresholds of the multiple covers (default: connect over any area)."""
    if covers not in ("single", "multiple"):
        raise ValueError(f"covers = {covers!r} is unknown; choose 'single' or 'multiple'")
    connection = connection or Connection()
    memory = _remembered(mesh, bodies, covers, previous, connection)
    if memory is None:
        memory = _cut_all(mesh, bodies, covers, connection)
    else:
        changed = changed_bodies(memory.bodies, bodies)
        memory = _cut_moved(memory, bodies, changed if moved is None else changed | moved, covers)
    return _assembled(memory, covers)


def changed_bodies(old: ConvexBodies, new: ConvexBodies) -> np.ndarray:
    """(n,) bool: some plane of the body differs, in direction, position or growth."""
    if len(new) == 0:
        return np.zeros(0, dtype=bool)
    planes = (old.normals != new.normals).any(axis=1) | (old.cut_offsets() != new.cut_offsets())
    return np.logical_or.reduceat(planes, new.plane_start[:-1])


def whole_cells(mesh) -> WholeCells:
    """Moments of the full tetrahedra: S = V/20 sum_a (x_a - c)(x_a - c)^T."""
    x = mesh.nodes[mesh.cells]
    centroid = (x[:, 0] + x[:, 1] + x[:, 2] + x[:, 3]) / 4
    d = x - centroid[:, None]
    second = (d[:, :, XX] * d[:, :, YY]).sum(axis=1) * (mesh.cell_volume / 20)[:, None]
    return WholeCells(mesh.cell_volume, centroid, second)


def wetted_coupling(domain: PhysicalDomain) -> sp.csr_matrix:
    """G (N, 6 n_bodies): G[i, 6b:6b+3] = ∫ N_i n dA [m2], G[i, 6b+3:6b+6] = ∫ N_i (x - x_b) x n dA [m3].

    n points out of body b, so a pressure field p loads it by force and torque -G^T p, and G V is the flux
    that the body's motion V = (v, omega) pushes into the test functions. Exact: the integrands are of
    degree 2."""
    shape = (len(domain.nodes), 6 * domain.n_bodies)
    if len(domain.face_cell) == 0:
        return sp.csr_matrix(shape)
    corners = domain.cells[domain.face_cell]
    hats = hat_values(domain.nodes[corners], domain.face_points) * (domain.face_area / 3)[:, None, None]
    arm = domain.face_points - domain.body_centre[domain.face_body][:, None]
    turning = np.cross(arm, domain.face_normal[:, None])
    block = np.empty((len(corners), 4, 6))
    block[:, :, :3] = hats.sum(axis=1)[:, :, None] * domain.face_normal[:, None]
    block[:, :, 3:] = np.swapaxes(hats, 1, 2) @ turning
    return _summed_blocks(corners, domain.face_body, block.reshape(-1, 6), shape)


def _summed_blocks(corners, body, block, shape):
    """CSR matrix of the rows block (4 S, 6) that belong to (node, body); repeated pairs are summed."""
    n_bodies = shape[1] // 6
    key = (corners * n_bodies + body[:, None]).ravel()
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    values = np.add.reduceat(block[order], first, axis=0)
    pair = key[order[first]]
    columns = 6 * (pair % n_bodies)[:, None] + np.arange(6)
    start = 6 * np.searchsorted(pair // n_bodies, np.arange(shape[0] + 1))
    return sp.csr_matrix((values.ravel(), columns.ravel(), start), shape=shape)


def hat_values(corners, points) -> np.ndarray:
    """P1 functions of tetrahedra corners (k, 4, 3) at points (k, q, 3) -> (k, q, 4)."""
    e1, e2, e3 = (corners[:, a] - corners[:, 0] for a in (1, 2, 3))
    normals = np.stack([np.cross(e2, e3), np.cross(e3, e1), np.cross(e1, e2)], axis=2)
    normals /= np.einsum("ki,ki->k", e1, normals[:, :, 0])[:, None, None]
    rest = (points - corners[:, :1]) @ normals
    return np.concatenate([1.0 - rest.sum(axis=2, keepdims=True), rest], axis=2)


def carry(old: PhysicalDomain, new: PhysicalDomain) -> np.ndarray:
    """(N_new,) index of the old node each new node takes its values from, -1 = no source.

    Single covers keep their nodes. Multiple covers: the copy of the same background node that shares the
    most fluid volume, sum over parts of min(V_old, V_new)."""
    if old.covers == "single" and new.covers == "single":
        return np.arange(len(new.nodes))
    return pick_old_nodes(old, new)


def _remembered(mesh, bodies, covers, previous, connection):
    if previous is None:
        return None
    memory = previous.memory
    if memory.mesh is not mesh or memory.connection != connection or previous.covers != covers:
        raise ValueError(
            "cut_domain: `previous` belongs to another mesh, other covers or other thresholds; "
            "pass previous=None to start afresh"
        )
    if not np.array_equal(memory.bodies.plane_start, bodies.plane_start):
        raise ValueError(
            f"cut_domain: `previous` holds {len(memory.bodies)} bodies of other shapes than the {len(bodies)} now; "
            "pass previous=None when bodies come, go or change their faces"
        )
    return memory


def _cut_all(mesh, bodies, covers, connection):
    every = np.arange(len(bodies))
    cell, body = near_pairs(mesh, bodies, every, SEARCH_MARGIN * mesh.spacing)
    cuts = _cut_pairs(mesh, bodies, cell, body, covers, connection)
    return Memory(mesh, bodies, whole_cells(mesh), cell, body, cuts, connection)


def _cut_moved(memory, bodies, moved, covers):
    """Replace the pairs of moved bodies and cut the cells of the pairs that went or came."""
    mesh = memory.mesh
    gone = moved[memory.pair_body]
    new_cell, new_body = near_pairs(mesh, bodies, np.flatnonzero(moved), SEARCH_MARGIN * mesh.spacing)
    touched = np.zeros(len(mesh.cells), dtype=bool)
    touched[memory.pair_cell[gone]] = True
    touched[new_cell] = True
    cell = np.concatenate([memory.pair_cell[~gone], new_cell])
    body = np.concatenate([memory.pair_body[~gone], new_body])
    order = np.argsort(cell * len(bodies) + body, kind="stable")
    cell, body = cell[order], body[order]
    again = touched[cell]
    fresh = _cut_pairs(mesh, bodies, cell[again], body[again], covers, memory.connection)
    cuts = _joined(memory.cuts, ~touched[memory.cuts.part_cell], fresh)
    return Memory(mesh, bodies, memory.whole, cell, body, cuts, memory.connection)


def _cut_pairs(mesh, bodies, cell, body, covers, connection):
    chosen, first = np.unique(cell, return_index=True)
    start = np.append(first, len(cell)).astype(np.int64)
    link_area = -1.0 if covers == "single" else connection.link_area(mesh.spacing)
    tolerance = TOLERANCE * mesh.spacing
    return cut_cells(mesh.nodes, mesh.cells, chosen, start, body, bodies, tolerance, mesh.spacing, link_area)


def _joined(old: Cuts, keep, new: Cuts) -> Cuts:
    """Parts of `old` that are kept together with `new`, in the order of the cells."""
    part_cell = np.concatenate([old.part_cell[keep], new.part_cell])
    order = np.argsort(part_cell, kind="stable")
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    old_place = np.cumsum(keep) - 1
    new_place = np.arange(len(new.part_cell)) + keep.sum()

    def parts(a, b):
        return np.concatenate([a[keep], b])[order]

    def rows(old_part, new_part):
        kept = keep[old_part]
        part = place[np.concatenate([old_place[old_part[kept]], new_place[new_part]])]
        return kept, part, np.argsort(part_cell[order][part], kind="stable")

    wet_kept, wet_part, wet_order = rows(old.wet_part, new.wet_part)
    open_kept, open_part, open_order = rows(old.open_part, new.open_part)
    start, corner = _ragged(old.open_start, open_kept, new.open_start, open_order)
    return Cuts(
        part_cell[order],
        parts(old.part_whole, new.part_whole),
        parts(old.moments, new.moments),
        wet_part[wet_order],
        np.concatenate([old.wet_body[wet_kept], new.wet_body])[wet_order],
        np.concatenate([old.wet[wet_kept], new.wet])[wet_order],
        open_part[open_order],
        np.concatenate([old.open_face[open_kept], new.open_face])[open_order],
        start,
        np.concatenate([old.open_x, new.open_x])[corner],
    )


def _ragged(old_start, kept, new_start, order):
    """Start and source index of the ragged rows old[kept] + new taken in a new order."""
    length = np.concatenate([np.diff(old_start)[kept], np.diff(new_start)])[order]
    begin = np.concatenate([old_start[:-1][kept], new_start[:-1] + old_start[-1]])[order]
    start = np.concatenate([[0], np.cumsum(length)]).astype(np.int64)
    source = np.repeat(begin - start[:-1], length) + np.arange(start[-1])
    return start, source


def _assembled(memory: Memory, covers: str) -> PhysicalDomain:
    mesh, cuts = memory.mesh, memory.cuts
    parent, element_of_part = _elements(memory)
    volume, centroid, second, is_cut = _moments(memory, parent, element_of_part)
    domain = PhysicalDomain(
        nodes=mesh.nodes,
        cells=mesh.cells[parent],
        parent_node=np.arange(len(mesh.nodes)),
        parent_cell=parent,
        volume=volume,
        centroid=centroid,
        second=second,
        is_cut=is_cut,
        face_cell=element_of_part[cuts.wet_part],
        face_body=cuts.wet_body,
        face_area=cuts.wet[:, 0],
        face_centroid=cuts.wet[:, 1:4],
        face_normal=cuts.wet[:, 4:7],
        face_points=cuts.wet[:, 7:16].reshape(-1, 3, 3),
        face_corners=cuts.wet[:, 16:].reshape(-1, 3, 3),
        n_bodies=len(memory.bodies),
        body_centre=memory.bodies.centre,
        covers=covers,
        memory=memory,
    )
    return domain if covers == "single" else _with_copies(domain, element_of_part)


def _moments(memory, parent, element_of_part):
    """volume, centroid, second, is_cut of the elements: of the whole cell, or of the part."""
    cuts, whole = memory.cuts, memory.whole
    volume, centroid, second = whole.volume[parent], whole.centroid[parent], whole.second[parent]
    is_cut = np.zeros(len(parent), dtype=bool)
    removed = ~cuts.part_whole
    at = element_of_part[removed]
    volume[at] = cuts.moments[removed, 0]
    centroid[at] = cuts.moments[removed, 1:4]
    second[at] = cuts.moments[removed, 4:]
    is_cut[at] = True
    return volume, centroid, second, is_cut


def _with_copies(domain, element_of_part):
    """The same elements on the nodes of the virtual mesh, without tiny pockets."""
    memory = domain.memory
    mesh, connection = memory.mesh, memory.connection
    cells, parent_node = virtual_cells(mesh, domain.parent_cell, element_of_part, memory.cuts, connection)
    domain = replace(domain, cells=cells, parent_node=parent_node, nodes=mesh.nodes[parent_node])
    keep = without_pockets(cells, domain.volume, len(parent_node), connection.pocket * mesh.spacing**3)
    return domain if keep.all() else _restricted(domain, keep)


def _restricted(domain, keep):
    """Only the elements keep (M,) bool, their nodes and their wetted polygons."""
    used = np.zeros(len(domain.nodes), dtype=bool)
    used[domain.cells[keep]] = True
    wet = keep[domain.face_cell]
    of_cell = ("parent_cell", "volume", "centroid", "second", "is_cut")
    of_face = ("face_body", "face_area", "face_centroid", "face_normal", "face_points", "face_corners")
    return replace(
        domain,
        nodes=domain.nodes[used],
        parent_node=domain.parent_node[used],
        cells=(np.cumsum(used) - 1)[domain.cells[keep]],
        face_cell=(np.cumsum(keep) - 1)[domain.face_cell[wet]],
        **{name: getattr(domain, name)[keep] for name in of_cell},
        **{name: getattr(domain, name)[wet] for name in of_face},
    )


def _elements(memory):
    """Fluid elements in the order of the background cells: parent (M,), element of each cut part."""
    cuts = memory.cuts
    count = np.ones(len(memory.mesh.cells), dtype=np.int64)
    count[memory.pair_cell] = 0
    count += np.bincount(cuts.part_cell, minlength=len(count))
    start = np.cumsum(count) - count
    parts = np.arange(len(cuts.part_cell))
    first = np.searchsorted(cuts.part_cell, cuts.part_cell)
    return np.repeat(np.arange(len(count)), count), start[cuts.part_cell] + parts - first
