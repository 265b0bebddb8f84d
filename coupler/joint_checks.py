"""Cases whose joints must do what a contact would: faces that touch, and no block without one."""

from __future__ import annotations

from collections.abc import Iterator

from coupler.case import Case
from coupler.parts import Part

KeyPath = tuple[str | int, ...]
Problem = tuple[KeyPath, str]


def joint_problems(case: Case, parts: list[Part]) -> Iterator[Problem]:
    """Joints that give contact no stiffness, since no faces touch, and blocks that neither joint nor contact hold."""
    if case.joints is None or not parts or (case.contact and case.contact.stiffness is not None):
        return
    blocks, joined = joined_blocks(case, parts)
    if not joined:
        yield (
            ("joints",),
            "no two faces touch, so there is no joint"
            + (" and no stiffness for [contact] either; give contact.stiffness" if case.contact else "")
            + "; move blocks until faces touch, or leave [joints] out",
        )
    elif case.contact is None:
        loose = [block.name for row, block in enumerate(blocks) if not block.fixed and row not in joined]
        if loose:
            yield (
                ("structure",),
                f"'{loose[0]}' has no joint, and {len(loose) - 1} more: blocks that lie loose need a section [contact] "
                "with stiffness, restitution and friction",
            )


def joined_blocks(case: Case, parts: list[Part]) -> tuple[list, set[int]]:
    """All blocks with the fixed solids behind them, and the rows of those with a face that joints glue to another."""
    from coupler.build import planes_of
    from coupler.solids import obstacle_blocks
    from yade_scripts.faces import both_held, touching_faces

    blocks = [block for part in parts for block in part.blocks] + obstacle_blocks(case)
    faces = touching_faces(blocks, planes_of(case) if case.joints.ground else ())
    glued = [face for face in faces if not both_held(blocks, face)]
    return blocks, {row for face in glued for row in (face.a, face.b) if row >= 0}
