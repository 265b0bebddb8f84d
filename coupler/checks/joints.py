"""Checks of cases in which joints replace all contact: faces must touch, and no block may be without a joint."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.case.case import Case
from coupler.case.types import Problem
from coupler.geometry.cell_sizes import cells_at
from coupler.geometry.parts import Part
from coupler.geometry.tank_mesh import is_measured
from coupler.program.errors import did_you_mean


def joint_problems(case: Case, parts: list[Part]) -> Iterator[Problem]:
    """Cases in which no faces touch, so that joints give contact no stiffness; blocks held by neither joint nor
    contact."""
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
                f"'{loose[0]}' has no joint, and {len(loose) - 1} more: blocks without joints need a section "
                "[contact], which may be empty",
            )


def pair_problems(case: Case, parts: list[Part]) -> Iterator[Problem]:
    """Pairs of joints: names that something has, laws that can be; scatter with its measure."""
    j = case.joints
    if j is None or case.structure is None:
        return
    if (j.distribution is None) != (j.variation is None):
        absent, given = (
            ("variation", "distribution") if j.variation is None else ("distribution", "variation")
        )
        yield (
            ("joints", absent),
            f"missing; it belongs to joints.{given}, for instance "
            + ("0.2" if absent == "variation" else "'weibull'"),
        )
    known = _names(case, parts)
    for i, pair in enumerate(j.pair):
        for name in dict.fromkeys(pair.between):
            if name not in known:
                hint = did_you_mean(name, known) or f"; there are {', '.join(known[:8])}"
                if name == "ground" and "tank" in known:
                    hint = ", since there is no [structure.ground]; the floor of the tank is 'tank'"
                yield ("joints", "pair", i, "between"), f"nothing is called '{name}'{hint}"
        yield from _pair_law(case, i, pair)


def uplift_problems(case: Case, parts: list[Part]) -> Iterator[Problem]:
    """Joints that let water between their faces, but are too narrow for the cells: reported for the narrowest."""
    j = case.joints
    if j is None or case.water is None or case.tank is None or not is_measured(case.tank):
        return
    if j.uplift == "none" and all(pair.uplift in (None, "none") for pair in j.pair):
        return
    from coupler.step.cracks import THINNEST, least_width
    from yade_scripts.blocks.faces import both_held

    blocks, planes, faces, laws = joined_faces(case, parts)
    wet = [
        face
        for face, law in zip(faces, laws)
        if law is not None and law.uplift != "none" and not both_held(blocks, face)
    ]
    if not wet:
        return
    width = np.array([least_width(face.polygon) for face in wet])
    cell = cells_at(case.tank, np.array([face.polygon.mean(axis=0) for face in wet]))
    narrow = np.flatnonzero(width < THINNEST * cell * (1 - 1e-9))
    if len(narrow):
        row = narrow[(width[narrow] / cell[narrow]).argmin()]
        face, wide, size = wet[row], width[row], cell[row]
        other = blocks[face.b].name if face.b >= 0 else planes[-1 - face.b].name
        yield (
            ("joints", "uplift"),
            f"the joint of '{blocks[face.a].name}' with '{other}' is {wide:.3g} m wide ({len(narrow)} of {len(wet)} "
            f"such joints are under {THINNEST:g} cells of {size:.3g} m): water between so narrow faces would flow as "
            f"through an opening a cell wide; take cells of {wide / THINNEST:.2g} m, or give uplift in a joints.pair "
            'for wide joints alone, and "none" elsewhere',
        )


def _pair_law(case: Case, i: int, pair) -> Iterator[Problem]:
    from coupler.scene.build import joint_parameters, of_pair
    from yade_scripts.joints import laws
    from yade_scripts.joints.cohesion import JointParameterError

    if pair.law is not None and pair.law not in laws.names():
        yield ("joints", "pair", i, "law"), laws.unknown(pair.law)
    elif case.joints.law in laws.names():
        try:
            joint_parameters(of_pair(case.joints, pair))
        except JointParameterError as error:
            yield ("joints", "pair", i), str(error)


def _names(case: Case, parts: list[Part]) -> list[str]:
    """Names of the tables of the structure; names, groups and materials of blocks and solids, and of the planes that
    joints may be to."""
    from coupler.geometry.solids import obstacle_blocks
    from coupler.scene.build import names_of_part, planes_of

    blocks = [block for part in parts for block in part.blocks] + obstacle_blocks(case)
    found = [name for part in parts for name in names_of_part(case, part)]
    found += [name for b in blocks for name in (b.group, b.name, b.material) if name]
    for town in case.structure.town:  # whose houses may be missing for another reason, reported with it
        found += [name for name in (town.name, town.material, *(rule.material for rule in town.rule)) if name]
    return list(
        dict.fromkeys([*found, *(n for p in planes_of(case) if p.bonds for n in (p.name, p.material))])
    )


def joined_blocks(case: Case, parts: list[Part]) -> tuple[list, set[int]]:
    """All blocks with the fixed solids behind them, and the rows of those with a face that a joint connects to
    another."""
    from yade_scripts.blocks.faces import both_held

    blocks, _, faces, laws = joined_faces(case, parts)
    with_joint = [face for face, law in zip(faces, laws) if law is not None and not both_held(blocks, face)]
    return blocks, {row for face in with_joint for row in (face.a, face.b) if row >= 0}


def joined_faces(case: Case, parts: list[Part]) -> tuple[list, list, list, list]:
    """All blocks with the fixed solids behind them, planes, faces that touch, and the law of each pair of these."""
    from coupler.geometry.solids import obstacle_blocks
    from coupler.scene.build import joint_rules, planes_of
    from yade_scripts.blocks.faces import touching_faces

    blocks = [block for part in parts for block in part.blocks] + obstacle_blocks(case)
    planes = planes_of(case)
    faces = touching_faces(blocks, planes)
    return blocks, planes, faces, joint_rules(case, parts).of_faces(faces, blocks, planes)
