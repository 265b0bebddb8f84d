"""Regions of finer cells: `[[tank.refine]]` and `[[tank.stretch]]`, and the meaning of the names in them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from coupler.case.case import Case, Tank
from coupler.case.types import KeyPath, Problem
from coupler.geometry.bodies import Body
from coupler.geometry.parts import parts_of
from coupler.geometry.solids import solids_of
from coupler.geometry.stretches import axes_of
from coupler.program.errors import did_you_mean
from coupler.program.memory import memory

ALL = ("solids", "blocks", "terrain")
"""Names in `around` that stand for everything of a kind."""
BYTES_PER_CELL = 420
"""Resident memory that a cell of the mesh takes in a run of water alone: topology, moments and fields ..."""
BYTES_KEPT_PER_CELL, MOST_KEPT = 130, 5_600_000
"""... and more for so many of the cells, since arrays of less than 256 MB stay in the process when they are freed."""
BYTES_OF_SINGLE_SHAPE = 144
"""Gradients and their products of a cell whose shape no other has, as in a mesh from a file."""
MOST_SLENDER = 8.0
"""Longest over shortest edge of a brick."""
MARGIN = 2.0
"""Cells of the size beyond a body to which they are finer, where no margin is given."""


@dataclass(frozen=True, eq=False)
class Regions:
    """Regions for `fluid.mesh.refinement`, in the order of the tables; equal to itself only."""

    found: tuple


def regions_of(case: Case) -> tuple[Regions, list[Problem]]:
    """The regions of `[[tank.refine]]`, and what is wrong with them. Raises what `parts_of` and `solids_of` raise."""
    wrong, found = [], []
    for i, spec in enumerate(case.tank.refine):
        path = ("tank", "refine", i)
        problems = list(_wrong(case, path, spec))
        wrong += problems
        if not problems:
            found.append(_box(spec) if spec.lower is not None else _around(case, spec))
    return Regions(tuple(region for region in found if region is not None)), wrong


def stretch_problems(case: Case) -> Iterator[Problem]:
    """The faults in `[[tank.stretch]]`."""
    tank = case.tank
    for i, spec in enumerate(tank.stretch):
        path, k = ("tank", "stretch", i), "xyz".index(spec.along)
        low = tank.lower[k] if spec.lower is None else spec.lower
        high = tank.upper[k] if spec.upper is None else spec.upper
        if spec.along == "z" and case.terrain is not None:
            yield (
                (*path, "along"),
                "z: over a terrain all layers are as high; use [[tank.refine]] for finer cells",
            )
        elif low >= high:
            yield (*path, "upper"), f"{spec.along}: upper ({high:g} m) must be greater than lower ({low:g} m)"
        elif high <= tank.lower[k] or low >= tank.upper[k]:
            ends = f"{tank.lower[k]:g} to {tank.upper[k]:g} m"
            yield (*path, "lower"), f"{spec.along}: {low:g} to {high:g} m is outside of the tank, {ends}"
        elif max(spec.cell, tank.cell) > MOST_SLENDER * min(spec.cell, tank.cell):
            yield (
                (*path, "cell"),
                f"{spec.cell:g} m beside cells of {tank.cell:g} m: bricks more slender than {MOST_SLENDER:g} to 1; "
                "use lengths that are more alike, or [[tank.refine]], which halves cells in every direction",
            )


def too_many(tank: Tank, regions: Regions) -> str | None:
    """Why a mesh of this size cannot be made with the memory that there is; None if it can. The mesh is not made."""
    cells = estimated_cells(tank, regions)
    needed, there = bytes_of_cells(cells), memory()
    if needed <= there:
        return None
    return (
        f"about {cells:.2g} cells, which need {needed / 1e9:.3g} GB; there are {there / 1e9:.3g} GB for it: fewer "
        "levels, a smaller margin or box, or a larger tank.cell"
    )


def bytes_of_cells(cells: float, own_shapes: bool = False) -> float:
    """Resident memory [B] that the cells of a mesh take in a run of water alone; own_shapes: no two are alike."""
    each = BYTES_PER_CELL + (BYTES_OF_SINGLE_SHAPE if own_shapes else 0)
    return each * cells + BYTES_KEPT_PER_CELL * min(cells, MOST_KEPT)


def estimated_cells(tank: Tank, regions: Regions) -> float:
    """Approximate number of cells that the mesh of a box will have."""
    bricks = np.prod([float(len(axis) - 1) for axis in axes_of(tank)])
    volume = np.prod(np.subtract(tank.upper, tank.lower))
    found = 6.0 * bricks
    for region in regions.found:
        share = min(region.volume_in(tank.lower, tank.upper) / volume, 1.0)
        found += 6.0 * bricks * share * (8.0**region.levels - 1.0)
    return found


def _wrong(case: Case, path: KeyPath, spec) -> Iterator[Problem]:
    box = spec.lower is not None or spec.upper is not None
    if box == bool(spec.around):
        yield (
            path,
            "write either lower and upper, the corners of a box, or around, what the cells are to be finer at",
        )
        return
    if box:
        yield from _wrong_box(case, path, spec)
        return
    if "terrain" in spec.around and case.terrain is None:
        yield (*path, "around"), "'terrain': the case has no section [terrain]"
    if spec.between is not None and "terrain" not in spec.around:
        yield (*path, "between"), 'is for around = ["terrain"]: levels z between which the ground lies'
    if spec.between is not None and spec.between[0] >= spec.between[1]:
        yield (*path, "between"), f"{list(spec.between)}: the second level must be above the first"
    known = _known(case)
    for name in spec.around:
        if name not in ALL and name not in known:
            there = [*ALL, *known]
            yield (
                (*path, "around"),
                f"no solid, block, group or part is named '{name}'{did_you_mean(name, there)}",
            )


def _wrong_box(case: Case, path: KeyPath, spec) -> Iterator[Problem]:
    for name in ("between", "margin"):
        if getattr(spec, name) is not None:
            yield (*path, name), "is for around; a box ends at lower and upper"
    for name in ("lower", "upper"):
        if getattr(spec, name) is None:
            yield (*path, name), "missing; a box has two corners"
            return
    for k, axis in enumerate("xyz"):
        if spec.lower[k] >= spec.upper[k]:
            yield (
                (*path, "upper"),
                f"{axis}: upper ({spec.upper[k]:g} m) must be greater than lower ({spec.lower[k]:g} m)",
            )
        elif spec.upper[k] <= case.tank.lower[k] or spec.lower[k] >= case.tank.upper[k]:
            yield (
                (*path, "lower"),
                f"{axis}: the box from {spec.lower[k]:g} to {spec.upper[k]:g} m is outside of the tank, "
                f"{case.tank.lower[k]:g} to {case.tank.upper[k]:g} m",
            )


def _known(case: Case) -> dict[str, list[Body]]:
    """Bodies of every name that a case may use for them."""
    found: dict[str, list[Body]] = {}
    for solid in solids_of(case):
        found.setdefault(solid.name, []).append(solid.body)
    for part in parts_of(case):
        for block in part.blocks:
            for name in {block.name, block.group, part.name}:
                found.setdefault(name, []).append(Body.of_block(block))
    return found


def _box(spec):
    from fluid.mesh.refinement import InBox

    return InBox(spec.lower, spec.upper, spec.levels)


def _around(case: Case, spec):
    """The region around bodies, around the ground, or both; None where there is nothing of the kind."""
    from fluid.mesh.refinement import Either, OnBed

    size = case.tank.cell / 2.0**spec.levels
    margin = MARGIN * size if spec.margin is None else spec.margin
    known, bodies = _known(case), []
    if "solids" in spec.around:
        bodies += [solid.body for solid in solids_of(case)]
    if "blocks" in spec.around:
        bodies += [Body.of_block(block) for part in parts_of(case) for block in part.blocks]
    for name in spec.around:
        bodies += known.get(name, []) if name not in ALL else []
    regions = [_near(bodies, margin, spec.levels)] if bodies else []
    if "terrain" in spec.around:
        low, high = (-np.inf, np.inf) if spec.between is None else spec.between
        regions.append(OnBed(case.tank.ground, low, high, margin, spec.levels))
    return Either(tuple(regions), spec.levels) if regions else None


def _near(bodies: list[Body], margin: float, levels: int):
    from fluid.mesh.refinement import NearBodies

    start = np.concatenate([[0], np.cumsum([len(body.normals) for body in bodies])])
    normals = np.concatenate([body.normals for body in bodies])
    offsets = np.concatenate([(body.vertices @ body.normals.T).max(axis=0) for body in bodies])
    low, high = (np.array([body.bounds()[end] for body in bodies]) for end in (0, 1))
    return NearBodies(
        normals=normals, offsets=offsets, start=start, lower=low, upper=high, margin=margin, levels=levels
    )
