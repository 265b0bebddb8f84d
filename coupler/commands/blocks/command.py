"""`surgebreak blocks FILE`: cuts a drawing into blocks, forecasts their cost and draws them, without a run."""

from __future__ import annotations

import math
import tempfile
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from coupler.case.case import Case
from coupler.case.messages import explain_error
from coupler.geometry.bodies import Body
from coupler.geometry.drawing.drawing import Cut, cut_drawing, in_words, turned_in_words
from coupler.geometry.drawing.reading import BadDrawing
from coupler.geometry.parts import parts_of
from coupler.geometry.solids import solids_of
from coupler.geometry.start_surfaces import surface_of
from coupler.program import terminal
from coupler.program.errors import BadCase
from coupler.program.extras import missing
from coupler.program.process import run_module, trouble
from coupler.program.quantities import counted, quantity
from yade_scripts.blocks.polyhedra import fans, hull_faces, shown

WATER = "water"
"""The transparent part of a picture."""
BED, BED_POINTS = "ground", 121
"""Name of the ground of a terrain in a picture, and points along a side of it."""
APART = 0.12
"""Share of their size by which blocks are pulled apart in a picture."""


def blocks(path: Path, options: dict, joints: dict, picture: Path | None, to: Path | None) -> None:
    """Cut a drawing into blocks, describe and draw them. options: of [[structure.drawing]] · joints: of [joints].

    Raises BadDrawing, with a picture of the place where one can be drawn, BadCase and MeshFileError."""
    case = _case(path, options, joints)
    spec = case.structure.drawing[0]
    picture = picture or path.with_name(f"{path.stem}_blocks.png")
    try:
        cut = cut_drawing(spec, density=spec.density or case.structure.density, material=spec.material)
    except BadDrawing as error:
        if error.surface is not None and not missing("view"):
            _draw_trouble(error, picture)
            raise BadDrawing(f"{error}; {picture} shows the place") from error
        raise
    terminal.table(str(path), _rows(cut))
    terminal.table("forecast", _forecast(case))
    for place, width in cut.slivers:
        print(
            f"note: a part at {shown(place)} is {quantity(width, 'm')} wide; it shortens the substep (see sliver)"
        )
    for text in turned_in_words(cut.turned):
        print(f"note: {text}")
    if to is not None:
        write_bodies(to, cut)
        print(f"blocks: {to}")
    problems = missing("view")
    if problems:
        print(f"no picture: {problems}")
    else:
        _draw_blocks(cut, picture)
        print(f"picture: {picture}")
    print(_snippet(path, options))


def as_number(text: str) -> float | str:
    """A number without a unit is in SI, as in a case file."""
    try:
        return float(text)
    except ValueError:
        return text


def _case(path: Path, options: dict, joints: dict) -> Case:
    """A case of the drawing alone, on the ground, with the checks of a case."""
    table = {
        "case": {"title": path.name},
        "time": {"end": 1.0},
        "structure": {"drawing": [{"path": str(path)} | options], "start": "sudden"},
        "contact": {},
        "joints": joints,
    }
    try:
        return Case.model_validate(table)
    except ValidationError as error:
        problems = [explain_error(item) for item in error.errors()]
        raise BadCase([f"--{place[-1]}: {text}" for place, text in problems]) from error


def _rows(cut: Cut) -> Iterable[terminal.Row]:
    yield terminal.Row("extent", in_words(cut.extent).removesuffix(" m"), "m", "along x, y and z (scale)")
    yield terminal.Row("volume", cut.volume, "m3", "of the drawing; that of the blocks is the same")
    yield terminal.Row("blocks", len(cut.blocks), "", _counted(b.group for b in cut.blocks))
    for name, (volume, count) in cut.layers.items():
        yield terminal.Row(f"layer {name}", volume, "m3", counted(count, "block"))
    volumes = np.array([b.volume for b in cut.blocks])
    yield terminal.Row(
        "block", float(np.median(volumes)), "m3", f"usual; {volumes.min():.3g} to {volumes.max():.3g}"
    )


def _counted(names: Iterable[str]) -> str:
    return ", ".join(f"{count} {name}" for name, count in Counter(names).most_common())


def _forecast(case: Case) -> Iterable[terminal.Row]:
    """Number of joints, the substep and the block that limits it, and the cost of a simulated second."""
    from coupler.run.cost import structure_seconds
    from coupler.scene.build import build_structure

    structure = build_structure(case)
    try:
        limit, substep = structure.substep_limit(), structure.substep()
        joints = structure.joints
        yield terminal.Row("joints", 0 if joints is None else len(joints), "")
        yield terminal.Row("substep", 1e6 * substep, "us", f"set by {limit.what}")
        count = math.ceil(1.0 / substep)
        seconds = structure_seconds(structure, count)
        yield terminal.Row(
            "a second", seconds, "s of processor time", f"{count} substeps, about, without water"
        )
    finally:
        structure.close()


def _snippet(path: Path, options: dict) -> str:
    beside = "   # from the directory of the case"
    lines = ["in a case:", "", "[[structure.drawing]]", f'path = "{path.name}"{beside}']
    for name, value in options.items():
        lines.append(f"{name} = {_toml(value)}")
    return "\n".join(lines)


def _toml(value: object) -> str:
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return f'"{value}"' if isinstance(value, str) else f"{value:g}"


def write_bodies(path: Path, cut: Cut) -> None:
    """The blocks as closed surfaces, one object each, which [[structure.file]] reads as well (OBJ)."""
    lines, first = [], 1
    for block in cut.blocks:
        lines.append(f"o {block.name}")
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in block.world_vertices().tolist()]
        triangles = fans(block.faces)[0]
        lines += ["f " + " ".join(str(first + int(k)) for k in row) for row in triangles]
        first += len(block.vertices)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _draw_blocks(cut: Cut, picture: Path) -> None:
    groups = sorted({b.group for b in cut.blocks})
    triangles, part, edges = [], [], []
    for block in cut.blocks:
        x = block.world_vertices()
        x = block.centre + (1.0 - APART) * (x - block.centre)
        own = fans(block.faces)[0]
        triangles.append(x[own])
        part.append(np.full(len(own), groups.index(block.group)))
        pairs = {tuple(sorted(edge)) for face in block.faces for edge in zip(face, (*face[1:], face[0]))}
        edges.append(x[np.array(sorted(pairs))])
    _draw(
        picture,
        np.concatenate(triangles),
        np.concatenate(part),
        groups,
        np.concatenate(edges),
        np.zeros((0, 2, 3)),
        np.ptp(np.concatenate([block.world_vertices() for block in cut.blocks]), axis=0),
    )


def draw_case(case: Case, picture: Path) -> None:
    """Blocks by their groups, fixed solids, the ground of a terrain, the edges of a tank that is a box and the boxes of
    water of a case, at the start."""
    bodies = [(b.group, b.world_vertices(), b.faces) for part in parts_of(case) for b in part.blocks]
    bodies += [("solid", solid.vertices, solid.faces) for solid in solids_of(case)]
    bed = _bed_triangles(case)
    fills = case.water.fill if case.water else ()
    own_top = [] if len(bed) else [fill for fill in fills if surface_of(fill) is not None]
    for fill in fills if not len(bed) else ():
        if fill not in own_top:
            bodies.append((WATER, Body.between(fill.lower, fill.upper).vertices, None))
    names = sorted({name for name, *_ in bodies} - {WATER}) + [BED] * bool(len(bed)) + [WATER] * bool(fills)
    triangles, part, edges = [bed], [np.full(len(bed), names.index(BED) if len(bed) else 0)], []
    for fill in fills if len(bed) else own_top:
        triangles.append(_surface_over(bed if len(bed) else _floor(fill), fill))
        part.append(np.full(len(triangles[-1]), names.index(WATER)))
    for name, x, faces in bodies:
        own = fans(faces if faces is not None else hull_faces(name, x, 1e-9))[0]
        triangles.append(x[own])
        part.append(np.full(len(own), names.index(name)))
        if faces is not None:
            pairs = {tuple(sorted(edge)) for face in faces for edge in zip(face, (*face[1:], face[0]))}
            edges.append(x[np.array(sorted(pairs))])
    if case.tank is not None and case.tank.is_box:
        edges.append(_box_edges(case.tank.lower, case.tank.upper))
    lines = np.concatenate(edges) if edges else np.zeros((0, 2, 3))
    _draw(picture, np.concatenate(triangles), np.concatenate(part), names, lines, np.zeros((0, 2, 3)))


def _box_edges(lower, upper) -> np.ndarray:
    """(12, 2, 3) [m] the edges of a box."""
    corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    pairs = [(a, b) for a in range(8) for b in range(a) if np.abs(corners[a] - corners[b]).sum() == 1]
    return (np.asarray(lower) + corners * np.subtract(upper, lower))[np.array(pairs)]


def _bed_triangles(case: Case) -> np.ndarray:
    """(t, 3, 3) [m] of the ground under the tank; none without a terrain."""
    if case.tank is None or case.tank.ground is None:
        return np.zeros((0, 3, 3))
    return _raster(case.tank.lower, case.tank.upper, case.tank.ground)


def _floor(fill) -> np.ndarray:
    """(t, 3, 3) [m] of the underside of a box of water."""
    return _raster(fill.lower, fill.upper, lambda x, y: np.full(x.shape, fill.lower[2]))


def _raster(lower, upper, heights) -> np.ndarray:
    """(t, 3, 3) [m] of heights(x, y) over the rectangle between two corners."""
    x, y = (np.linspace(lower[k], upper[k], BED_POINTS) for k in (0, 1))
    X, Y = (a.ravel() for a in np.meshgrid(x, y, indexing="ij"))
    points = np.column_stack([X, Y, heights(X, Y)])
    i, j = np.meshgrid(np.arange(BED_POINTS - 1), np.arange(BED_POINTS - 1), indexing="ij")
    a = (i * BED_POINTS + j).ravel()
    rows = np.concatenate(
        [
            np.column_stack([a, a + BED_POINTS, a + 1]),
            np.column_stack([a + 1, a + BED_POINTS, a + BED_POINTS + 1]),
        ]
    )
    found = points[rows]
    return found[np.isfinite(found).all(axis=(1, 2))]


def _surface_over(bed: np.ndarray, fill) -> np.ndarray:
    """(t, 3, 3) [m] the surface of a box of water where the ground lies below it."""
    middle = bed.mean(axis=1)
    inside = ((middle >= fill.lower) & (middle <= fill.upper))[:, :2].all(axis=1)
    top = surface_of(fill)
    found = bed[inside & (middle[:, 2] < (fill.upper[2] if top is None else top(middle)))].copy()
    found[:, :, 2] = fill.upper[2] if top is None else top(found.reshape(-1, 3)).reshape(-1, 3)
    return found


def _draw_trouble(error: BadDrawing, picture: Path) -> None:
    part = np.zeros(len(error.surface), int)
    _draw(picture, error.surface, part, ["drawing"], np.zeros((0, 2, 3)), error.lines)


def _draw(picture: Path, triangles, part, names, edges, lines, size=None) -> None:
    """size (3,) [m] that the picture tells; None: of what it shows."""
    if size is None:
        size = np.ptp(np.concatenate([triangles.reshape(-1, 3), edges.reshape(-1, 3)]), axis=0)
    with tempfile.TemporaryDirectory() as folder:
        there = Path(folder) / "blocks.npz"
        np.savez(there, triangles=triangles, part=part, names=names, edges=edges, lines=lines, size=size)
        done = run_module("coupler.commands.view.drawing", there, picture, capture_output=True, text=True)
    if done.returncode != 0:
        raise BadDrawing(f"no picture: {trouble(done.returncode, done.stderr)}")
