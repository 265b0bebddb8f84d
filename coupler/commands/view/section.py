"""What a cut through the scene shows: the section of the water, and of each block, as filled faces."""

import numpy as np
import pyvista as pv

from coupler.commands.view.water_surface import WHOLE, some


def with_section(surface, water, normal, origin, bodies=()):
    """The surface of the water behind a cut, and the water in the plane of the cut itself.

    surface: what `water_surface` gives, cut off · water: as stored · normal (3,) towards the eye and origin (3,) [m] of
    the plane · bodies: blocks and fixed solids, whose sections are taken off that of the water where they are convex.
    In cells that others cut, the section is left out where more than half of the cell is in the body."""
    cut = [body for mesh in bodies for body in _bodies(mesh) if _passes(body, normal, origin)]
    convex = [body for body in cut if _is_convex(body)]
    least = 0.0 if convex and len(convex) == len(cut) else 0.5 * WHOLE
    wet = some((water.level_set < 0.0)[water.cells]) & (water.fraction > least)
    grid = pv.UnstructuredGrid({pv.CellType.TETRA: water.cells[wet]}, water.nodes)
    grid["level_set"], grid["velocity"] = water.level_set, water.velocity
    grid.cell_data["fraction"] = np.asarray(water.fraction)[wet]
    plane = grid.slice(normal=normal, origin=origin).triangulate()
    plane = plane.clip_scalar(scalars="level_set", value=0.0) if plane.n_cells else plane
    if plane.n_cells:
        plane = _outside(plane, [_ring_of(body, normal, origin) for body in convex], normal)
    if plane.n_cells == 0:
        return surface
    section = plane.extract_surface(algorithm="dataset_surface").triangulate()
    found = pv.PolyData(section.points, section.faces)
    found["speed"] = np.linalg.norm(section["velocity"], axis=1)
    found["normals"] = np.tile(normal, (found.n_points, 1))
    if "foam" in surface.point_data:
        found["foam"] = np.zeros(found.n_points)
    for name in surface.point_data:  # arrays of different kinds would be left out
        found[name] = found[name].astype(surface[name].dtype)
    whole = surface.append_polydata(found) if surface.n_cells else found
    whole.point_data.active_normals_name = "normals"
    return whole


def _outside(plane, rings, normal):
    """The part of a plane mesh outside of convex polygons (k, 3) in it; only cells with less than their whole volume of
    water can lie inside."""
    cut = np.asarray(plane.cell_data["fraction"]) < WHOLE
    pieces, near = [plane.extract_cells(np.flatnonzero(~cut))], plane.extract_cells(np.flatnonzero(cut))
    for corners in (ring for ring in rings if len(ring) >= 3):
        beyond = []
        middle = corners.mean(axis=0)
        for start, end in zip(corners, np.roll(corners, -1, axis=0)):
            out = np.cross(end - start, normal)
            out = out if out @ (start - middle) > 0.0 else -out
            if near.n_cells and np.linalg.norm(out) > 0.0:
                beyond.append(near.clip(normal=out, origin=start, invert=False))
                near = near.clip(normal=out, origin=start)
        kept = [part for part in beyond if part.n_cells]
        near = pv.merge(kept) if kept else pv.UnstructuredGrid()
    pieces = [piece for piece in (*pieces, near) if piece.n_cells]
    return pv.merge(pieces) if pieces else pv.UnstructuredGrid()


def solid_behind_cut(blocks, cut):
    """Blocks behind a cut (normal (3,), origin (3,) [m]), or None for all, with the faces that the cut makes; these
    have the data of their block."""
    if cut is None or blocks.n_cells == 0:
        return blocks
    normal, origin = np.asarray(cut[0], float), np.asarray(cut[1], float)
    kept = blocks.clip(normal=normal, origin=origin, crinkle=False)
    faces = [kept] if kept.n_cells else []
    for body in _bodies(blocks):
        corners = _ring_of(body, normal, origin) if _passes(body, normal, origin) else ()
        if len(corners) < 3:
            continue
        face = pv.PolyData(corners, [len(corners), *range(len(corners))])
        for name in blocks.cell_data:
            face.cell_data[name] = body.cell_data[name][:1]
        faces.append(face)
    return faces[0].append_polydata(*faces[1:]) if faces else kept


def closed_behind_cut(solids, cut):
    """Fixed solids behind a cut, or None for all: closed again by the face that the cut makes, where they were closed
    before; an open surface stays one."""
    if cut is None:
        return solids
    normal, origin = np.asarray(cut[0], float), np.asarray(cut[1], float)
    if solids.n_open_edges:
        return solids.clip(normal=normal, origin=origin, crinkle=False)
    return solids.clip_closed_surface(normal=-normal, origin=origin)


def ground_behind_cut(bed, cut, foot):
    """The bed behind a cut, or None for all, and in the plane of an upright cut the ground below it to foot [m]."""
    if cut is None:
        return bed
    normal, origin = np.asarray(cut[0], float), np.asarray(cut[1], float)
    kept = bed.clip(normal=normal, origin=origin, crinkle=False)
    line = np.asarray(bed.slice(normal=normal, origin=origin).points, float)
    if len(line) < 2 or abs(normal[2]) > 0.5:
        return kept
    line = line[np.argsort(line @ np.cross(normal, [0.0, 0.0, 1.0]))]
    under = line.copy()
    under[:, 2] = np.minimum(foot, line[:, 2])
    k, n = np.arange(len(line) - 1), len(line)
    quads = np.stack([np.full(len(k), 4), k, k + 1, n + k + 1, n + k], axis=1)
    return kept.append_polydata(pv.PolyData(np.concatenate([line, under]), quads.ravel()))


def _bodies(mesh):
    """The surface of each block or fixed solid of a mesh of faces."""
    if mesh.n_cells == 0:
        return
    number = np.asarray(mesh.cell_data["block" if "block" in mesh.cell_data else "solid"])
    order = np.argsort(number, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(number[order])) + 1):
        yield mesh.extract_cells(rows).extract_surface(algorithm="dataset_surface")


def _is_convex(body):
    """Whether no corner of a closed surface lies before the plane of one of its faces."""
    points, normals = np.asarray(body.points, float), np.asarray(body.compute_normals().cell_normals, float)
    middles = np.asarray(body.cell_centers().points, float)
    side = np.einsum("fk,pfk->fp", normals, points[:, None] - middles)
    return bool((np.minimum(side.max(axis=1), -side.min(axis=1)) <= 1e-5 * body.length).all())


def _passes(body, normal, origin):
    """Whether a plane goes through a body."""
    side = (np.asarray(body.points, float) - origin) @ normal
    return side.min() < 0.0 < side.max()


def _ring_of(body, normal, origin):
    """The corners (k, 3) of the section of a convex body, in their order around it."""
    return _ring(body.slice(normal=normal, origin=origin).points, normal)


def _ring(points, normal):
    """The corners (k, 3) of a convex section, in their order around it."""
    points = np.unique(np.round(np.asarray(points, float), 9), axis=0)
    if len(points) < 3:
        return points
    out = points - points.mean(axis=0)
    across = np.eye(3)[int(np.argmin(np.abs(normal)))]
    u = np.cross(normal, across)
    v = np.cross(normal, u)
    return points[np.argsort(np.arctan2(out @ v, out @ u))]
