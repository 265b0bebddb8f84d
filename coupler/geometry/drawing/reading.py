"""The closed bodies of a drawing, layer by layer: STL, OBJ, PLY and what else trimesh reads; STEP and IFC by extras."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.case.paths import BadPath, check_file
from coupler.geometry.block_files import STL_DIGITS, WELD, welded
from coupler.geometry.closed_surfaces import SurfaceError, closed_surfaces
from coupler.geometry.mesh_files import MeshFileError
from coupler.program.extras import need
from yade_scripts.blocks.polyhedra import shown

SURFACES = ("stl", "obj", "ply", "off", "glb", "gltf", "3mf")
CAD = {"step": "cad", "stp": "cad", "iges": "cad", "igs": "cad", "brep": "cad", "ifc": "ifc"}
"""Endings that need an extra of their own, and which."""
SAME_VOLUME = 1e-9
"""Share by which volumes of one body may differ by round-off."""


@dataclass(frozen=True)
class Layer:
    """name of a layer, object or material of the drawing · body: all that is drawn in it, as one manifold3d.Manifold ·
    turned: middles (3,) [m] of bodies that face the other way than the others in the file, and were turned"""

    name: str
    body: object
    turned: tuple[Array, ...] = ()


class BadDrawing(MeshFileError):
    """A drawing that cannot be cut; `surface` (triangles (m, 3, 3) [m]) and `lines` (k, 2, 3) [m] show where."""

    def __init__(self, text: str, surface: Array | None = None, lines: Array | None = None):
        super().__init__(text)
        self.surface, self.lines = surface, lines


def read_layers(
    path: Path, scale: float, offset, up: str = "z", weld: float | None = None
) -> tuple[list[Layer], float]:
    """The layers of a drawing in metres, and the distance [m] within which its points are one.  Raises MeshFileError,
    BadDrawing with the place, and NotInstalled.

    Overlapping bodies of one layer are united; where two layers overlap, the one later in the file is cut.
    """
    need("drawing")
    drawn = _read(path)
    single = all((p == p.astype(np.float32)).all() for p, _ in drawn.values())
    heaps = {name: (_placed(p, scale, offset, up), t) for name, (p, t) in drawn.items()}
    edges = np.concatenate(
        [np.linalg.norm(p[t] - np.roll(p[t], 1, axis=1), axis=2).ravel() for p, t in heaps.values()]
    )
    digits = (
        STL_DIGITS * max(float(np.abs(p - np.asarray(offset)).max()) for p, _ in heaps.values())
        if single
        else 0.0
    )
    tolerance = weld or max(1e-2 * WELD * float(np.median(edges)), 4.0 * digits)
    layers: list[Layer] = []
    for name, (points, triangles) in heaps.items():
        body, turned = _body(path, name, _rounded(points, tolerance, single), triangles, tolerance)
        for before in layers:
            body = body - before.body
        if not body.is_empty():
            layers.append(Layer(name, body, turned))
    return layers, tolerance


def _placed(points: Array, scale: float, offset, up: str) -> Array:
    """Points in metres with the z-axis up."""
    if up == "y":
        points = points[:, [0, 2, 1]] * np.array([1.0, -1.0, 1.0])
    return points * scale + np.asarray(offset, float)


def _rounded(points: Array, tolerance: float, single: bool) -> Array:
    """Coordinates in single precision as they were typed: 9.10000038 is 9.1."""
    if not single:
        return points
    step = 10.0 ** np.ceil(np.log10(tolerance))
    return np.round(np.round(points / step) * step, 12)


def _read(path: Path) -> dict[str, tuple[Array, Array]]:
    """Points (n, 3) and triangles (m, 3) of each layer, in units of the file."""
    try:
        check_file(path)
    except BadPath as error:
        raise MeshFileError(f"{path}: {error}") from error
    kind = path.suffix.lower().lstrip(".")
    if kind in CAD:
        need(CAD[kind])
        from coupler.geometry.drawing import cad

        return cad.read(path)
    if kind not in SURFACES:
        raise MeshFileError(
            f"{path.name}: drawings end in {', '.join(SURFACES)}, with the extras `cad`, `ifc` in {', '.join(CAD)}"
        )
    return _surfaces(path, kind)


def _surfaces(path: Path, kind: str) -> dict[str, tuple[Array, Array]]:
    import trimesh

    options = {"split_objects": True, "split_groups": True, "skip_materials": True} if kind == "obj" else {}
    order = _order(path) if kind == "obj" else {}
    try:
        scene = trimesh.load_scene(path, file_type=kind, process=False, **options)
        found = {}
        nodes = [(name, node) for name in scene.geometry for node in scene.graph.geometry_nodes[name]]
        nodes.sort(key=lambda pair: order.get(pair[0], 0))
        for name, node in nodes:
            turn, mesh = scene.graph[node][0], scene.geometry[name]
            if len(getattr(mesh, "faces", ())):
                points = trimesh.transform_points(mesh.vertices, turn)
                found[_plain(name, path, found)] = (
                    np.asarray(points, float),
                    np.asarray(mesh.faces, np.int64),
                )
    except Exception as error:  # a reader of foreign files raises anything
        raise MeshFileError(
            f"{path.name}: trimesh cannot read it: {type(error).__name__}: {error}"
        ) from error
    if not found:
        raise MeshFileError(f"{path.name}: holds no surfaces; write closed surfaces of triangles")
    for name, (points, _) in found.items():
        if not np.isfinite(points).all():
            raise MeshFileError(f"{path.name}: layer '{name}': a coordinate is no finite number")
    return found


def _order(path: Path) -> dict[str, int]:
    """Where the objects and groups of an OBJ file begin, by name: trimesh gives them in another order."""
    found: dict[str, int] = {}
    with path.open(encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file):
            if line[:2] in ("o ", "g "):
                found.setdefault(line[2:].strip(), number)
    return found


def _plain(name: str, path: Path, taken) -> str:
    """The name of a layer as a case may write it: letters, digits, _ and -, beginning with a letter."""
    valid = re.sub(r"[^A-Za-z0-9_-]+", "_", str(name)).strip("_-")
    valid = (
        "all"
        if not valid
        or valid.lower() in (path.name.lower(), path.stem.lower(), path.name.replace(".", "_").lower())
        else valid
    )
    valid = valid if valid[0].isalpha() else f"layer_{valid}"
    first, number = valid[:50], 2
    while valid in taken:
        valid, number = f"{first}_{number}", number + 1
    return valid


def _body(path: Path, name: str, points: Array, triangles: Array, tolerance: float):
    """All that is drawn in a layer as one body, and the middles of those that were turned.  Raises BadDrawing."""
    points = welded(points, tolerance)
    unique, rows = np.unique(points, axis=0, return_inverse=True)
    triangles = rows.ravel()[triangles]
    triangles = triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]
    whole = _manifold(unique, triangles)
    if whole is not None and whole.volume() > 0.0:
        return _united(path, name, whole.decompose(), tolerance)
    try:
        surfaces = closed_surfaces(unique, list(triangles))
    except SurfaceError as error:
        lines = _open_edges(unique, triangles)
        raise BadDrawing(
            f"{path.name}: layer '{name}': {error}; {len(lines)} edges are open (corners within {tolerance:.2g} m are "
            "one; weld of this table sets that)",
            unique[triangles],
            lines,
        ) from error
    bodies = [(surface, _manifold(surface.points, np.array(surface.loops))) for surface in surfaces]
    for surface, body in bodies:
        if body is None:
            corners = surface.points[np.concatenate(surface.loops)]
            raise BadDrawing(
                f"{path.name}: layer '{name}': the surface around {shown(corners.mean(axis=0))} passes through itself "
                "or is open; draw each body once and closed",
                unique[triangles],
                _open_edges(surface.points, np.array(surface.loops)),
            )
    return _united(path, name, [body for _, body in bodies], tolerance)


def _united(path: Path, name: str, bodies, tolerance: float):
    """Bodies and cavities (those of negative volume) as one body, and the middles of those that were turned.

    Each cavity is taken out of the smallest body around it, so that what stands inside a closed room stays. What no
    other body holds, or what stands in a room, is no cavity, though its faces point inwards: it is turned.
    Raises BadDrawing where a surface may be either."""
    from manifold3d import Manifold, OpType

    whole = [body for body in bodies if body.volume() > 0.0]
    solids, rooms, turned = list(whole), [], []
    inwards = [_turned(body) for body in bodies if body.volume() < 0.0]
    for inner in sorted(inwards, key=lambda body: -body.volume()):  # rooms come before what stands in them
        around = [k for k, body in enumerate(whole) if _holds(body, inner, tolerance)]
        k = min(around, key=lambda k: whole[k].volume(), default=None)
        common = 0.0 if k is None else (solids[k] ^ inner).volume()
        if any(_same(room, inner, tolerance) for room in rooms):
            continue
        if k is not None and _equal(common, inner, tolerance):
            solids[k] = solids[k] - inner
            rooms.append(inner)
        elif common > _round_off(inner, tolerance) or any(_holds(inner, body, tolerance) for body in whole):
            what = "lies partly in a room of another body" if around else "holds another body"
            raise _inwards(path, name, inner, what)
        else:
            turned.append(inner)
    found = sum(body.volume() for body in solids)
    left = sum(body.volume() for body in whole) - sum(room.volume() for room in rooms)
    if abs(found - left) > sum(_round_off(body, tolerance) for body in solids):
        raise BadDrawing(
            f"{path.name}: layer '{name}': its bodies without their cavities hold {left:.9g} m3, and {found:.9g} m3 "
            "where the cavities are cut out; draw each body once and closed"
        )
    return Manifold.batch_boolean([*solids, *turned], OpType.Add), tuple(map(_middle, turned))


def _holds(solid, inner, tolerance: float) -> bool:
    """Whether a body holds all of another one."""
    a, b = np.array(solid.bounding_box()), np.array(inner.bounding_box())
    boxed = (a[:3] <= b[:3] + tolerance).all() and (a[3:] >= b[3:] - tolerance).all()
    return (
        bool(boxed) and solid.volume() > inner.volume() and _equal((solid ^ inner).volume(), inner, tolerance)
    )


def _same(body, other, tolerance: float) -> bool:
    """Whether two bodies fill the same place."""
    return _equal(body.volume(), other, tolerance) and _equal((body ^ other).volume(), other, tolerance)


def _equal(volume: float, body, tolerance: float) -> bool:
    """Whether a volume [m³] is that of a body."""
    return abs(volume - body.volume()) <= _round_off(body, tolerance)


def _round_off(body, tolerance: float) -> float:
    """Volume [m³] that does not count: of round-off, and of a skin as thick as points are apart that are one."""
    return SAME_VOLUME * body.volume() + tolerance * body.surface_area()


def _middle(body) -> Array:
    """The middle (3,) [m] of the box around a body."""
    return np.array(body.bounding_box()).reshape(2, 3).mean(axis=0)


def _inwards(path: Path, name: str, body, what: str) -> BadDrawing:
    """The refusal of a surface that may be a body or a room."""
    from coupler.geometry.drawing.convex_parts import mesh_of

    points, triangles = mesh_of(body)
    edges = np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    return BadDrawing(
        f"{path.name}: layer '{name}': the surface around {shown(_middle(body))} faces the other way than the others, "
        f"as that of a room does, and {what}; turn its faces if it is a body, or draw the room within one body",
        points[triangles],
        points[edges],
    )


def _manifold(points: Array, triangles: Array):
    """The body bounded by triangles, inverted if they face inwards; None where they bound none."""
    from manifold3d import Error, Manifold, Mesh64

    used, rows = np.unique(triangles, return_inverse=True)
    mesh = Mesh64(vert_properties=points[used], tri_verts=rows.reshape(-1, 3).astype(np.uint64))
    body = Manifold(mesh)
    if body.status() != Error.NoError or body.is_empty():
        return None
    return body


def _turned(body):
    """The body that fills a cavity, whose faces point inwards."""
    from coupler.geometry.drawing.convex_parts import mesh_of

    points, triangles = mesh_of(body)
    return _manifold(points, triangles[:, ::-1])


def _open_edges(points: Array, triangles: Array) -> Array:
    """Edges (k, 2, 3) [m] that belong to one triangle only."""
    ends = np.sort(np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
    edges, count = np.unique(ends, axis=0, return_counts=True)
    return points[edges[count % 2 == 1]]
