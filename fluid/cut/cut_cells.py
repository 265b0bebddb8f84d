"""The part of a tetrahedron outside convex bodies: exact, for any number of bodies per cell.

The method is sequential convex splitting. The fluid in a cell is a list of convex pieces, at first the cell itself. For
each body B, each piece P is split by the planes of B one after the other: the part outside a plane is set aside, the
part inside goes on to the next plane. If nothing is left inside, P does not meet B and stays whole; otherwise P is
replaced by the parts set aside. The *wetted surface* is then read off the pieces: a face of a piece that lies in a
plane of B, with the piece on the outer side, clipped by the other planes of B. This one rule serves faces made by
splitting and faces of a body that coincide with faces of the mesh, so each is counted once, in the cell on its water
side, and never between two bodies that touch.  Faces made by splitting that none claims lie between two pieces, or
are given to the nearest body (`unclaimed_faces.py`).

Two tolerances: mesh nodes nearer to a plane than `tolerance` [m], one for the whole mesh, lie in it; at
vertices made by splitting only round-off is snapped (see `pieces.py`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Floats, Ints
from fluid.cut.cut_arrays import Cuts, Output, behind, doubled, output, trimmed
from fluid.cut.fans import fan
from fluid.cut.parts_of_cell import label_parts
from fluid.cut.pieces import (
    BROKEN_CAP,
    DONE,
    OUTPUT_FULL,
    ROUND_OFF,
    WORKSPACE_FULL,
    Workspace,
    classify,
    copy_piece,
    lies_outside,
    merge_moments,
    piece_moments,
    split,
    start_piece,
    workspace,
)
from fluid.cut.unclaimed_faces import claim_rest
from fluid.cut.wetted_polygons import wetted
from fluid.mesh.arrays import Corners, Planes
from kernels.decorators import inlined, inner, released
from kernels.threads import over

# A piece too thin for its cross-section to close goes to one side whole; thicker ones are an error.
THIN = 1e-6
# Wetted polygons below this share of h^2 are round-off.
NO_AREA = 1e-15
# Faces made by splitting that cancel but for this share of h^2 all lie between two pieces.
UNMATCHED = 1e-12
# Cost of cutting a cell, in visits of a node.
WORK = 500


class CutFailed(RuntimeError):
    """The cross-section of a piece could not be closed although the piece is not thin."""


class Limits(NamedTuple):
    """tolerance [m]: nodes of the mesh nearer to a plane lie in it · round_off [m]: vertices made by splitting do ·
    thin [m]: see THIN · least [m²]: see NO_AREA · unmatched [m²]: see UNMATCHED."""

    tolerance: float
    round_off: float
    thin: float
    least: float
    unmatched: float

    @classmethod
    def of(cls, tolerance: float, spacing: float) -> Limits:
        """The limits for a mesh with that spacing [m]."""
        area = spacing * spacing
        return cls(tolerance, ROUND_OFF * spacing, THIN * spacing, NO_AREA * area, UNMATCHED * area)


class Cutting(NamedTuple):
    """The data of a cut: scratch arrays, planes of all bodies, tolerances, and the arrays that it fills."""

    work: Workspace
    planes: Planes
    limits: Limits
    out: Output


class Chosen(NamedTuple):
    """cell (C,) to cut · start (C+1,), bodies: those near each · link_area (C,) [m²] over which pieces of it are one
    part, < 0: all are, and no openings are listed."""

    cell: Ints
    start: Ints
    bodies: Ints
    link_area: Floats


@inlined
def _nearby(w, x, bodies, planes, tolerance):
    """Bodies that meet or touch the cell x (4, 3), with the planes of each that separate some of its nodes.

    -> number of bodies, or -1 when one body contains the whole cell."""
    n = 0
    w.near_start[0] = 0
    for at in range(len(bodies)):
        body = bodies[at]
        end = w.near_start[n]
        apart = False
        for g in range(planes.start[body], planes.start[body + 1]):
            low, high = np.inf, -np.inf
            for k in range(4):
                n_x = (
                    planes.normal[g, 0] * x[k, 0]
                    + planes.normal[g, 1] * x[k, 1]
                    + planes.normal[g, 2] * x[k, 2]
                )
                d = n_x - planes.offset[g]
                if abs(d) <= tolerance:
                    d = 0.0
                w.near_distance[end, k] = d
                low = min(low, d)
                high = max(high, d)
            if low > 0.0:
                apart = True
                break
            if high > 0.0:
                _align(w, end, tolerance)
                w.near_plane[end] = g
                end += 1
        if apart:
            continue
        if end == w.near_start[n]:
            return -1
        w.near_body[n] = body
        n += 1
        w.near_start[n] = end
    return n


@inner
def _align(w, row, tolerance):
    """Give a plane the distances of an earlier one (or their negatives) if the two agree within the tolerance, so that
    touching and flush faces of two bodies lie in exactly one plane in spite of round-off."""
    for r in range(row):
        for sign in (1.0, -1.0):
            same = True
            for k in range(4):
                if abs(w.near_distance[row, k] - sign * w.near_distance[r, k]) > tolerance:
                    same = False
                    break
            if same:
                for k in range(4):
                    w.near_distance[row, k] = sign * w.near_distance[r, k]
                return


@inlined
def _subtract(w, piece, at, round_off, thin, top, n_vertices):
    """Take body number `at` of the cell away from a piece.

    Fragments are left on top of the stack -> (state, whole, new top, number of vertices)."""
    start, end = w.near_start[at], w.near_start[at + 1]
    for r in range(end - 1, start, -1):
        if lies_outside(w, piece, w.near_distance[r], round_off):
            return DONE, True, top, n_vertices
    low, high = classify(w, piece, w.near_distance[start], round_off)
    if low == 0.0:
        return DONE, True, top, n_vertices
    # Fragments stack up from `top`; what is still inside alternates between the last two slots.
    current, fresh, spare = piece, top, len(w.faces) - 1
    for r in range(start, end):
        if r > start:
            low, high = classify(w, current, w.near_distance[r], round_off)
        if fresh + 3 > len(w.faces):
            return WORKSPACE_FULL, False, top, n_vertices
        if low == 0.0:
            if current == piece or not _has_flat_face(w, current):
                return DONE, True, top, n_vertices
            copy_piece(w, current, fresh)
            return DONE, False, fresh + 1, n_vertices
        if high == 0.0:
            continue
        state, n_vertices = split(w, current, fresh, spare, w.near_plane[r], n_vertices)
        if state == BROKEN_CAP and (min(high, -low) < thin or _is_thin(w, current, thin)):
            if high >= -low:
                return DONE, True, top, n_vertices
            continue
        if state != DONE:
            return state, False, top, n_vertices
        fresh += 1
        current = spare
        spare = 2 * len(w.faces) - 3 - spare
    return DONE, False, fresh, n_vertices


@inner
def _has_flat_face(w, piece):
    """Whether a face of a piece lies in the plane whose distances are in w.distance: a body that only touches the piece
    there may touch but a part of a face of the whole."""
    for f in range(w.faces[piece]):
        flat = True
        for k in range(w.size[piece, f]):
            flat = flat and w.distance[w.loop[piece, f, k]] == 0.0
        if flat:
            return True
    return False


@inner
def _is_thin(w, piece, thin):
    """Whether the volume of a piece is below that of a layer of thickness `thin` over a tenth of the spacing
    squared."""
    piece_moments(w, piece, w.moments)
    return w.moments[0] < thin * (thin / THIN) ** 2 * 0.01


@inlined
def _fluid_pieces(w, n_near, round_off, thin):
    """Subtract all bodies near the cell -> (state, number of pieces, nothing removed)."""
    count, n_vertices, whole_cell = 1, 4, True
    for at in range(n_near):
        kept, top = 0, count
        for piece in range(count):
            state, whole, top_new, n_vertices = _subtract(w, piece, at, round_off, thin, top, n_vertices)
            if state != DONE:
                return state, 0, False
            if whole:
                if kept != piece:
                    copy_piece(w, piece, kept)
                kept += 1
            else:
                whole_cell = False
                top = top_new
        for piece in range(count, top):
            if kept != piece:
                copy_piece(w, piece, kept)
            kept += 1
        count = kept
    return DONE, count, whole_cell


@inlined
def _openings(w, piece, origin, part, out, n_open):
    """Append the faces of a piece that lie on faces of the cell -> (state, number of openings)."""
    for f in range(w.faces[piece]):
        if w.tag[piece, f] >= 0:
            continue
        start = out.open_start[n_open]
        if n_open + 1 >= len(out.open_part) or start + w.size[piece, f] > len(out.open_x):
            return OUTPUT_FULL, n_open
        out.open_part[n_open] = part
        out.open_face[n_open] = -1 - w.tag[piece, f]
        for k in range(w.size[piece, f]):
            v = w.loop[piece, f, k]
            for c in range(3):
                out.open_x[start + k, c] = origin[c] + w.x[v, 4 + c]
        n_open += 1
        out.open_start[n_open] = start + w.size[piece, f]
    return DONE, n_open


@inlined
def _wetted(cut, origin, count, n_near, n_wet):
    """Append the wetted polygons of all pieces, with the piece in place of the part, and fill w.beside -> (state,
    number of polygons)."""
    w, out = cut.work, cut.out
    for r in range(w.near_start[n_near]):
        w.unclaimed[r] = 0.0
    for piece in range(count):
        first = n_wet
        state, n_wet = wetted(cut, piece, origin, n_near, piece, n_wet)
        if state != DONE:
            return state, n_wet
        area = 0.0
        w.beside[piece, 0], w.beside[piece, 1], w.beside[piece, 2] = 0.0, 0.0, 0.0
        for row in range(first, n_wet):
            area += out.wet[row, 0]
            for c in range(3):
                w.beside[piece, c] += out.wet[row, 0] * out.wet[row, 4 + c]
        if area > 0.0:
            for c in range(3):
                w.beside[piece, c] /= area
    return DONE, n_wet


@inlined
def _emit(cut, cell, origin, count, n_near, whole, link_area, at):
    """Write the parts of one cell, their moments, wetted polygons and tetrahedra (and openings if link_area >= 0)."""
    w, out, limits = cut.work, cut.out, cut.limits
    n_part, n_open, n_tet = at[1], at[3], at[4]
    state, n_wet = _wetted(cut, origin, count, n_near, at[2])
    if state != DONE:
        return state
    parts = label_parts(w, count, cut.planes.normal, limits.round_off, link_area, limits.unmatched)
    if n_part + parts > len(out.part_cell):
        return OUTPUT_FULL
    for row in range(at[2], n_wet):
        out.wet_part[row] = n_part + w.label[out.wet_part[row]]
    for part in range(n_part, n_part + parts):
        out.part_cell[part] = cell
        out.part_whole[part] = whole
        for c in range(10):
            out.part_moments[part, c] = 0.0
    for piece in range(count):
        part = n_part + w.label[piece]
        piece_moments(w, piece, w.moments)
        merge_moments(out.part_moments[part], w.moments)
        if link_area >= 0.0:
            state, n_open = _openings(w, piece, origin, part, out, n_open)
        if state != DONE:
            return state
    for part in range(0 if whole else parts):  # in their order, so that `fans` need not sort them
        for piece in range(count):
            if w.label[piece] == part:
                state, n_tet = fan(w, piece, n_part + part, out, n_tet)
                if state != DONE:
                    return state
    state, n_wet = claim_rest(cut, count, n_near, n_part, origin, n_wet)
    if state != DONE:
        return state
    for part in range(n_part, n_part + parts):
        for c in range(3):
            out.part_moments[part, 1 + c] += origin[c]
    at[1], at[2], at[3], at[4] = n_part + parts, n_wet, n_open, n_tet
    return DONE


@released
def _cut_cells(last, mesh, chosen, cut, at):
    """Cut the chosen cells from at[0] to before `last`.

    mesh: Corners · cut: Cutting · at (5,) <- cells, parts, wetted polygons, openings, tetrahedra done."""
    x = np.empty((4, 3))
    w, planes, limits = cut.work, cut.planes, cut.limits
    nodes, cells = mesh
    for row in range(at[0], last):
        cell = chosen.cell[row]
        for k in range(4):
            for c in range(3):
                x[k, c] = nodes[cells[cell, k], c]
        bodies = chosen.bodies[chosen.start[row] : chosen.start[row + 1]]
        near = _nearby(w, x, bodies, planes, limits.tolerance)
        if near >= 0:
            start_piece(w, x)
            state, count, whole = _fluid_pieces(w, near, limits.round_off, limits.thin)
            if state != DONE:
                return state
            if count > 0:
                state = _emit(cut, cell, x[0], count, near, whole, chosen.link_area[row], at)
                if state != DONE:
                    return state
        at[0] = row + 1
    return DONE


def cut_cells(nodes, cells, chosen, body_start, bodies, solids, tolerance, spacing, link_area=-1.0) -> Cuts:
    """Cut chosen cells by the bodies near each.

    nodes (N, 3) [m] · cells (M, 4) · chosen (C,) cells to cut · body_start (C+1,), bodies: those near each
    solids: ConvexBodies · tolerance [m] for nodes, spacing [m] of the mesh
    link_area [m2], one or (C,): pieces of a cell are one part where they touch over more than this; < 0: all pieces of
    a cell are one part and no openings are listed.
    Raises CutFailed where the cross-section of a piece that is not thin cannot be closed."""
    link_area = np.broadcast_to(np.asarray(link_area, float), len(chosen)).copy()
    mesh, which = Corners(nodes, cells), Chosen(chosen, body_start, bodies, link_area)
    limits = Limits.of(tolerance, spacing)
    return behind(over(_cut_range, len(chosen), mesh, which, solids.planes(), limits, weight=WORK))


def _cut_range(first, last, mesh: Corners, chosen: Chosen, planes: Planes, limits: Limits) -> Cuts:
    """Cut the chosen cells from `first` to before `last`."""
    at = np.array([first, 0, 0, 0, 0])
    scale = 1
    most_bodies = int(np.diff(chosen.start[first : last + 1]).max()) if last > first else 0
    most_planes = int(np.diff(planes.start).max(initial=0))
    w = workspace(scale, most_bodies, most_bodies * most_planes)
    count = last - first
    out = output(count, bool((chosen.link_area >= 0).all()))
    while True:
        state = _cut_cells(last, mesh, chosen, Cutting(w, planes, limits, out), at)
        if state == DONE:
            return _with_volume(trimmed(out, at))
        if state == BROKEN_CAP:
            raise CutFailed(_failure(mesh, chosen, int(at[0])))
        if state == WORKSPACE_FULL:
            scale *= 2
            w = workspace(scale, most_bodies, most_bodies * most_planes)
        else:
            out = doubled(out, at)


def _with_volume(cuts):
    """Without the parts whose volume is lost in round-off (their surface is of the same order)."""
    solid = cuts.moments[:, 0] > 0.0
    if solid.all():
        return cuts
    return cuts.kept(solid)


def _failure(mesh: Corners, chosen: Chosen, row: int) -> str:
    cell = chosen.cell[row]
    centre = mesh.nodes[mesh.cells[cell]].mean(axis=0)
    near = chosen.bodies[chosen.start[row] : chosen.start[row + 1]].tolist()
    return (
        f"cell {cell} at {np.round(centre, 6).tolist()} m could not be cut by bodies {near}: "
        "check that the polyhedra are convex and no smaller than a millionth of the cell"
    )
