"""Checks of the list of blocks, and quantities derived from it, before a structure is built."""

from __future__ import annotations

import numpy as np

from array_types import Array
from yade_scripts.blocks.block import Block, BlockError
from yade_scripts.blocks.polyhedra import polygon_area_vector
from yade_scripts.contact.law import ContactError
from yade_scripts.joints.joints import Joints

FAR = 1e3
"""Scenes farther than this from the origin [m] are computed about a local one."""


def check_names(blocks: list[Block]) -> None:
    """Raise BlockError where two blocks share a name."""
    seen: set[str] = set()
    for block in blocks:
        if block.name in seen:
            raise BlockError(f"two blocks are called '{block.name}'; names must be unique")
        seen.add(block.name)


def local_origin(blocks: list[Block]) -> Array:
    """Origin (3,) [m] of local coordinates: zero, or near the blocks if large map coordinates would cost digits."""
    if not blocks:
        return np.zeros(3)
    middle = np.array([b.centre for b in blocks]).mean(axis=0)
    return np.round(middle) if np.abs(middle).max() > FAR else np.zeros(3)


def moved_block(block: Block, shift: Array) -> Block:
    """The same block at another position."""
    return block.changed(centre=block.centre + shift)


def matched_stiffness(blocks: list[Block], joints: Joints | None) -> Array:
    """K (n,) [N/m] of faces in contact that continues the closing stiffness of the joints: the mean k_c times the mean
    area of the joined faces of a block; a block without joints takes the mean of the others."""
    if joints is None:
        raise ContactError(
            "contact.stiffness is not given and there are no joints to take it from; give contact.stiffness in N/m"
        )
    faces: dict[tuple[int, int], float] = {}
    closing: dict[int, list[float]] = {}
    for ends, side in ((joints.a, joints.face_a), (joints.b, joints.face_b)):
        for row, face, k in zip(ends.tolist(), side.tolist(), joints.kc.tolist()):
            if row >= 0:
                closing.setdefault(row, []).append(k)
                faces[row, face] = float(
                    np.linalg.norm(polygon_area_vector(blocks[row].vertices[list(blocks[row].faces[face])]))
                )
    areas: dict[int, list[float]] = {}
    for (row, _), area in faces.items():
        areas.setdefault(row, []).append(area)
    K = np.full(len(blocks), np.nan)
    for row, own in areas.items():
        K[row] = np.mean(closing[row]) * np.mean(own)
    return np.where(np.isnan(K), np.nanmean(K), K)
