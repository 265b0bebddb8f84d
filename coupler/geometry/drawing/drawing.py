"""Blocks from a drawing: `[[structure.drawing]]` and `surgebreak blocks`."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.geometry.drawing.convex_parts import CannotCut, Part, convex_parts, merged, smallest_width
from coupler.geometry.drawing.division import divided, how_many
from coupler.geometry.drawing.names import member_names
from coupler.geometry.drawing.reading import SAME_VOLUME, BadDrawing, Layer, read_layers
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.generators.cuts import check_count
from yade_scripts.blocks.polyhedra import BlockError, shown

SLIVER = 0.25
"""Of the usual thickness of a layer: parts narrower than this are merged with a neighbour where that is convex."""
UNITS = {"millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254, "feet": 0.3048}
UNIT_TEXT = {"millimetres": "mm", "centimetres": "cm", "inches": "inch", "feet": "ft"}
"""Lengths of one unit [m] of drawings that are not in metres, and how a case writes them."""
A_BUILDING = (1.0, 300.0)
"""Largest lengths [m] of what is drawn, from a garden wall to a quay."""
GROUP = re.compile("[a-z]+")


@dataclass(frozen=True)
class Cut:
    """Result of cutting a drawing: blocks · extent (3,) [m] and volume [m³] drawn · layers: volume and number of blocks
    by name · slivers: places (3,) [m] of the narrow parts that no neighbour could take, with their width [m] · turned:
    names of layers and middles (3,) [m] of their bodies that face the other way than the others in the file"""

    blocks: tuple[Block, ...]
    extent: Array
    volume: float
    layers: dict[str, tuple[float, int]]
    slivers: tuple[tuple[Array, float], ...]
    turned: tuple[tuple[str, Array], ...] = ()


def blocks_from_drawing(spec, **common) -> list[Block]:
    """Blocks of a `[[structure.drawing]]`; common: for every Block. Raises MeshFileError, BadDrawing."""
    return list(cut_drawing(spec, **common).blocks)


def cut_drawing(spec, **common) -> Cut:
    """The blocks of a drawing, with figures to report."""
    path = Path(spec.path)
    layers, tolerance = read_layers(path, spec.scale, spec.offset, spec.up, spec.weld)
    _check_layers(path, spec, layers)
    rules = {rule.name: rule for rule in spec.layer}
    layers = [layer for layer in layers if not (layer.name in rules and rules[layer.name].leave_out)]
    pieces: list[tuple[Layer, Part, list[Part]]] = []
    slivers: list[tuple[Array, float]] = []
    extent = _extent(layers)
    cut = [(layer, _parts_of(path, layer, tolerance)) for layer in layers]
    _check_size(
        path, spec, extent, [(part, _size(spec, rules.get(la.name))) for la, ps in cut for part in ps]
    )
    for layer, parts in cut:
        rule = rules.get(layer.name)
        size = _size(spec, rule)
        least = spec.sliver or SLIVER * _usual(parts)
        parts = merged(parts, tolerance, max(size), least)
        slivers += [(p.middle, w) for p in parts for w in [smallest_width(p.corners)] if w < least]
        bond = (rule and rule.bond) or spec.bond
        pieces += [(layer, part, divided(_solid(part), part, size, bond)) for part in parts]
        _check_count(path, sum(len(blocks) for *_, blocks in pieces))
    blocks = _blocks(path, spec, pieces, rules, tolerance, common)
    whole = sum(layer.body.volume() for layer in layers)
    _check_volume(path, blocks, whole, tolerance, layers)
    counts = Counter(layer.name for layer, _, found in pieces for _ in found)
    given_values = {layer.name: (layer.body.volume(), counts[layer.name]) for layer in layers}
    return Cut(tuple(blocks), extent, whole, given_values, tuple(slivers), _turned(layers))


def drawing_remarks(case) -> Iterator[str]:
    """Bodies of drawings that were turned, since they face the other way than the others."""
    for i, spec in enumerate(case.structure.drawing if case.structure else ()):
        layers, _ = read_layers(Path(spec.path), spec.scale, spec.offset, spec.up, spec.weld)
        left_out = {rule.name for rule in spec.layer if rule.leave_out}
        for text in turned_in_words(_turned([layer for layer in layers if layer.name not in left_out])):
            yield f"structure.drawing[{i}]: {text}"


def _turned(layers: list[Layer]) -> tuple[tuple[str, Array], ...]:
    return tuple((layer.name, place) for layer in layers for place in layer.turned)


def turned_in_words(turned) -> Iterator[str]:
    """What to know about bodies that were turned, one line for each layer; turned: see Cut."""
    for name in dict.fromkeys(name for name, _ in turned):
        places = [place for layer, place in turned if layer == name]
        more = f" and {len(places) - 1} more" if len(places) > 1 else ""
        yield (
            f"layer '{name}': the surface around {shown(places[0])}{more} faces the other way than the others; it lies "
            "within no other body and is taken for a body, not for a room: draw it facing outwards"
        )


def _size(spec, rule) -> tuple[float, float]:
    """Wanted length and height of the blocks of a layer [m]."""
    length = (rule and rule.size) or spec.size
    return length, (rule and rule.course) or (rule and rule.size) or spec.course or length


def _check_layers(path: Path, spec, layers: list[Layer]) -> None:
    known = [layer.name for layer in layers]
    for rule in spec.layer:
        if rule.name not in known:
            raise BadDrawing(f"{path.name}: no layer '{rule.name}'; it has {', '.join(known)}")


def _parts_of(path: Path, layer: Layer, tolerance: float) -> list[Part]:
    try:
        return convex_parts(layer.body, tolerance)
    except CannotCut as error:
        from coupler.geometry.drawing.convex_parts import mesh_of, reflex_edges

        points, triangles = mesh_of(layer.body)
        dents = points[reflex_edges(points, triangles, tolerance).ends]
        near = np.argsort(np.linalg.norm(dents.mean(axis=1) - error.place, axis=1))[:50]
        raise BadDrawing(
            f"{path.name}: layer '{layer.name}' at {shown(error.place)} {error}",
            points[triangles],
            dents[near],
        ) from error


def _usual(parts: list[Part]) -> float:
    """Median thickness [m] of the parts, weighted by volume."""
    width = np.array([smallest_width(part.corners) for part in parts])
    order = np.argsort(width)
    volume = np.cumsum(np.array([part.volume for part in parts])[order])
    return float(width[order][np.searchsorted(volume, 0.5 * volume[-1])])


def _solid(part: Part):
    from manifold3d import Manifold

    return Manifold.hull_points(part.corners)


def _extent(layers: list[Layer]) -> Array:
    """Length along x, y and z (3,) [m] of the whole drawing."""
    boxes = np.array([layer.body.bounding_box() for layer in layers]).reshape(-1, 6)
    return boxes[:, 3:].max(axis=0) - boxes[:, :3].min(axis=0) if len(boxes) else np.zeros(3)


def _check_size(path: Path, spec, extent: Array, parts: list[tuple[Part, tuple[float, float]]]) -> None:
    """Refuse more blocks than are wanted before one is made, with the unit of the file that is most likely meant."""
    count = sum(how_many(part, size) for part, size in parts)
    if count <= spec.most_blocks:
        return
    raise BadDrawing(
        f"{path.name}: it is {in_words(extent)} as it is read (scale: a unit of the file is {spec.scale:g} m) and "
        f"would make about {count:.3g} blocks of {spec.size:g} m, at most {spec.most_blocks} (most_blocks). "
        f"{_likely_unit(spec, extent)}"
    )


def _likely_unit(spec, extent: Array) -> str:
    """The remedy for too many blocks."""
    for name, unit in UNITS.items():
        size = extent * unit / spec.scale
        if (
            unit < spec.scale
            and extent.max() > A_BUILDING[1]
            and A_BUILDING[0] <= size.max() <= A_BUILDING[1]
        ):
            return (
                f'If the file is drawn in {name}, write scale = "1 {UNIT_TEXT[name]}" (--scale "1 {UNIT_TEXT[name]}"): '
                f"then it is {in_words(size)}"
            )
    return "Take a larger size, or raise most_blocks"


def in_words(extent: Array) -> str:
    """9 x 7 x 3 m"""
    return " x ".join(f"{length:.4g}" for length in extent) + " m"


def _check_count(path: Path, count: int) -> None:
    try:
        check_count(path.name, count)
    except BlockError as error:
        raise BadDrawing(f"{error}; a larger size makes fewer blocks") from error


def _blocks(path: Path, spec, pieces, rules: dict, tolerance: float, common: dict) -> list[Block]:
    middles = [np.array([block.middle for block in blocks]) for *_, blocks in pieces]
    names = member_names(spec.name, [part.corners for _, part, _ in pieces], middles, tolerance)
    number: Counter[str] = Counter()
    found = []
    for (layer, _, blocks), members in zip(pieces, names):
        more = common | _of_layer(rules.get(layer.name), common)
        for block, member in zip(blocks, members):
            name, group = f"{member}-{number[member]}", GROUP.match(member.removeprefix(f"{spec.name}-"))[0]
            number[member] += 1
            try:
                found.append(
                    Block.standing(name, block.corners, tolerance=4.0 * tolerance, group=group, **more)
                )
            except BlockError as error:
                raise BadDrawing(f"{path.name}: at {shown(block.middle)}: {error}") from error
    return found


def _of_layer(rule, common: dict) -> dict:
    """Settings that a layer makes for its blocks."""
    if rule is None:
        return {}
    given_values = {"material": rule.material, "density": rule.density}
    return {name: value for name, value in given_values.items() if value is not None} | {
        "fixed": rule.fixed or common.get("fixed", False)
    }


def _check_volume(
    path: Path, blocks: list[Block], whole: float, tolerance: float, layers: list[Layer]
) -> None:
    """Check that the blocks fill the drawn volume once, to round-off or to the digits of the file."""
    found = sum(block.volume for block in blocks)
    allowed = SAME_VOLUME * whole + tolerance * sum(layer.body.surface_area() for layer in layers)
    if abs(found - whole) > allowed:
        raise BadDrawing(
            f"{path.name}: its blocks hold {found:.9g} m3, the drawing {whole:.9g} m3; cut it otherwise"
        )
