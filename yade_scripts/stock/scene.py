"""Blocks, joints and motion as the plain description that a stock script holds: numbers and texts only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from yade_scripts.blocks import Block
from yade_scripts.cohesion import JointParameters
from yade_scripts.faces import TouchingFaces, gauss_points

Array = np.ndarray

INSET = 0.8
"""Radius of a bond's spheres over the distance of its point from the border of the face: spheres stay inside their
block and meet their partner alone."""
THIN = 0.25
"""The same over the smallest width of the block."""


@dataclass(frozen=True)
class StockScene:
    """What all stock laws share. blocks; faces that are joined; joints: the law to match; points: bonds along each
    edge of a face; friction; gravity (3,) [m/s²]; end, substep [s]; records of the run."""

    blocks: list[Block]
    faces: list[TouchingFaces]
    joints: JointParameters
    points: int
    friction: float
    gravity: tuple[float, float, float]
    end: float
    substep: float
    records: int

    def described(self, variant: str) -> dict:
        """For JSON: blocks, points, joint and times; the substep is cut so that records are whole substeps."""
        points = [p for number, face in enumerate(self.faces) for p in self._bonds(number, face)]
        count = max(1, int(np.ceil(self.end / self.records / self.substep * (1.0 - 1e-12))))
        return {
            "variant": variant,
            "joint": joint_numbers(self.joints, self.friction, self.edge) | {"variant": variant},
            "gravity": [float(g) for g in self.gravity],
            "radius": min((p["radius"] for p in points), default=self.edge),
            "records": self.records,
            "substeps_per_record": count,
            "substep": self.end / self.records / count,
            "blocks": [described_block(b) for b in self.blocks],
            "points": points,
        }

    @property
    def edge(self) -> float:
        """Smallest width of a block [m]."""
        return min(float(np.ptp(b.vertices, axis=0).min()) for b in self.blocks)

    def _bonds(self, number: int, face: TouchingFaces) -> list[dict]:
        places, areas = gauss_points(face.polygon, self.points)
        widths = [self.blocks[r] for r in (face.a, face.b) if r >= 0]
        thin = THIN * min(float(np.ptp(b.vertices, axis=0).min()) for b in widths)
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


def joint_numbers(joints: JointParameters, friction: float, edge: float) -> dict:
    """What a law may be matched to: K_0 [Pa/m], T_max [Pa], G_c [J/m²], β, tan φ; edge [m] scales later contacts."""
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
