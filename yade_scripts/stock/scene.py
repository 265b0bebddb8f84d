"""Blocks, joints and motion as the plain description in a stock script: numbers and texts only."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from array_types import Array
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import TouchingFaces, gauss_points
from yade_scripts.joints.cohesion import JointParameters

INSET = 0.8
"""Radius of a bond's spheres over the distance of its point from the border of the face: the spheres stay inside their
block and touch only their partner."""
THIN = 0.25
"""Largest radius of these spheres over the smallest width of the block."""


def described(
    blocks: list[Block],
    faces: list[TouchingFaces],
    joints: JointParameters,
    points: int,
    friction: float,
    gravity,
) -> dict:
    """Blocks, bonds and the numbers to match, for JSON; the blocks lie near the origin.

    points: bonds along each edge of a face, at Gauss points (stock spheres need room to the border)
    friction: tan φ · gravity (3,) [m/s²]
    """
    bonds = [bond for number, face in enumerate(faces) for bond in _bonds(blocks, number, face, points)]
    edge = min(_width(b) for b in blocks)
    return {
        "joint": joint_numbers(joints, friction, edge),
        "gravity": [float(g) for g in gravity],
        "radius": min((bond["radius"] for bond in bonds), default=edge),
        "blocks": [described_block(b) for b in blocks],
        "points": bonds,
    }


def timed(scene: dict, variant: str, end: float, substep: float, records: int) -> dict:
    """A described scene with the variant of a law, the end [s], and equal records of whole substeps of at most
    `substep` [s]."""
    records = min(records, max(1, int(np.ceil(end / substep * (1.0 - 1e-12)))))
    count = max(1, int(np.ceil(end / records / substep * (1.0 - 1e-12))))
    return scene | {
        "variant": variant,
        "joint": scene["joint"] | {"variant": variant},
        "records": records,
        "substeps_per_record": count,
        "substep": end / records / count,
    }


def _bonds(blocks: list[Block], number: int, face: TouchingFaces, points: int) -> list[dict]:
    places, areas = gauss_points(face.polygon, points)
    thin = THIN * min(_width(blocks[row]) for row in (face.a, face.b) if row >= 0)
    return [
        {
            "joint": number,
            "a": int(face.a),
            "b": int(max(face.b, -1)),
            "place": [float(x) for x in place],
            "normal": [float(x) for x in face.normal],
            "area": float(area),
            "radius": min(thin, INSET * border_distance(face.polygon, place)),
        }
        for place, area in zip(places, areas)
    ]


def _width(block: Block) -> float:
    return float(np.ptp(block.vertices, axis=0).min())


def joint_numbers(joints: JointParameters, friction: float, edge: float) -> dict:
    """The joint properties that a law may match: K_0 [Pa/m], T_max [Pa], G_c [J/m²], β, tan φ; edge [m] scales later
    contacts."""
    return {
        "stiffness": float(joints.stiffness),
        "strength": float(joints.strength),
        "work": float(joints.work_of_separation),
        "shear_ratio": float(joints.shear_ratio),
        "friction": float(friction),
        "edge": float(edge),
    }


def described_block(block: Block) -> dict:
    """Centre, principal axes as a quaternion (w, x, y, z), extents, mass, principal inertia and motion."""
    values, axes = np.linalg.eigh(block.inertia)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    x, y, z, w = Rotation.from_matrix(block.rotation @ axes).as_quat()
    return {
        "centre": block.centre.tolist(),
        "orientation": [float(q) for q in (w, x, y, z)],
        "size": np.ptp(block.vertices @ axes, axis=0).tolist(),
        "mass": float(block.mass),
        "inertia": values.tolist(),
        "velocity": block.velocity.tolist(),
        "spin": block.spin.tolist(),
        "held": bool(block.fixed or block.driven),
    }


def border_distance(polygon: Array, point: Array) -> float:
    """Distance of a point inside a convex polygon (k, 3) from its nearest edge [m]."""
    along = np.roll(polygon, -1, axis=0) - polygon
    across = np.linalg.norm(np.cross(along, point - polygon), axis=1)
    return float((across / np.linalg.norm(along, axis=1)).min())
