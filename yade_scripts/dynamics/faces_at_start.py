"""What becomes of the faces that touch as a scene begins: a joint, a seal against water, or a share of its pressure."""

from __future__ import annotations

from dataclasses import dataclass

from yade_scripts.blocks.faces import TouchingFaces, both_held, touching_faces
from yade_scripts.contact.law import ContactLaw
from yade_scripts.joints.cohesion import JointParameters
from yade_scripts.joints.joints import Joints
from yade_scripts.joints.rules import JointRules


def _materials(blocks, planes, face: TouchingFaces) -> tuple[str, str]:
    """Materials of both sides of a pair of faces."""
    other = blocks[face.b] if face.b >= 0 else planes[-1 - face.b]
    return blocks[face.a].material, other.material


@dataclass(frozen=True)
class FacesAtStart:
    """Touching faces: those that get a joint, those that only keep water out, those that get a share of its pressure,
    blocks held at others that are held, and blocks that rest on others without a joint."""

    joined: list[TouchingFaces]
    laws: list[JointParameters]
    sealed: list[TouchingFaces]
    partly: list[tuple[TouchingFaces, float]]
    held_rows: list[int]
    resting_rows: list[int]

    @classmethod
    def of(cls, blocks, planes, rules: JointRules | None, contact: ContactLaw | None) -> FacesAtStart:
        """Those of blocks and planes as described; `rules` of joints, `contact`: None without."""
        if rules is None and (contact is None or not contact.keeps_water_out):
            return cls([], [], [], [], [], [])
        faces = touching_faces(blocks, planes)
        laws = rules.of_faces(faces, blocks, planes) if rules is not None else [None] * len(faces)
        joined: list[tuple[TouchingFaces, JointParameters]] = []
        sealed: list[TouchingFaces] = []
        partly: list[tuple[TouchingFaces, float]] = []
        held_rows: set[int] = set()
        resting: set[int] = set()
        for face, law in zip(faces, laws):
            held = both_held(blocks, face)
            uplift = 1.0 if contact is None else contact.uplift_between(*_materials(blocks, planes, face))
            if law is not None and not held:
                joined.append((face, law))
            elif law is not None or uplift == 0.0:
                sealed.append(face)
            elif uplift < 1.0:
                partly.append((face, uplift))
            rows = [row for row in (face.a, face.b) if row >= 0]
            if law is not None and held:
                held_rows.update(rows)
            elif law is None and len(rows) == 2:
                resting.update(rows)
        return cls(
            [face for face, _ in joined],
            [law for _, law in joined],
            sealed,
            partly,
            sorted(held_rows),
            sorted(resting),
        )

    def joints(self, blocks, rules: JointRules | None) -> Joints | None:
        """The joints; None where no faces are joined."""
        if rules is None or not self.joined:
            return None
        return Joints(blocks, self.joined, rules.everywhere, rules.scattered(self.laws))
