"""Builds both sides of a scene from a case, and nothing that the case does not ask for.

A case without `[water]` imports no code of `fluid`, and a case without `[structure]` does not start YADE.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from array_types import Array
from coupler.case.case import Case
from coupler.geometry.basin import basin_planes
from coupler.geometry.parts import Part, parts_of
from coupler.geometry.solids import obstacle_blocks, solids_of
from coupler.geometry.tank_mesh import is_basin, mesh_of
from coupler.geometry.terrain.standing import ground_surface
from coupler.program.threads import threads
from coupler.results.gauges import Bodies, Gauge, make_gauges
from coupler.scene.build_water import water_of
from coupler.step.coupled_step import CoupledStepper
from coupler.step.limits import Limits

if TYPE_CHECKING:
    from coupler.results.maps import Maps
    from coupler.verdict.watch import Watch

PRESSURE_RTOL = 1e-8


@dataclass(frozen=True, kw_only=True)
class Scene:
    """The scene of a run: both sides, the gauges and the fixed solids (with a structure they are its last blocks
    too)."""

    coupling: CoupledStepper
    gauges: list[Gauge]
    solids: list[tuple[Array, tuple]]
    tank: tuple | None
    watch: Watch | None = None
    """The observations from which the verdict is made; None without a structure."""
    maps: Maps | None = None
    """Maps of the flood over a terrain; None without terrain or without water."""


def build(case: Case, clock, from_start: bool = True) -> Scene:
    """Build the scene of a case. clock(name) is a context that adds processor time to a part of the run.

    from_start: bring the blocks to equilibrium if the case asks for it; False where a state is restored afterwards."""
    solids = [(solid.vertices, solid.faces) for solid in solids_of(case)]
    with clock("set-up"), ExitStack() as on_failure:  # YADE holds one scene: the next build needs it free
        structure = build_structure(case) if case.structure else None
        if structure is not None:
            on_failure.callback(structure.close)
        only_in_water = [] if structure else solids
        coupling = _coupling(case, structure, only_in_water, clock, from_start)
        on_failure.pop_all()
    tank = (case.tank.lower, case.tank.upper) if case.tank else None
    watch = None if structure is None else watch_of(case, structure)
    maps = _maps(case, coupling.water)
    return Scene(coupling=coupling, gauges=_gauges(case), solids=solids, tank=tank, watch=watch, maps=maps)


def _maps(case: Case, water) -> Maps | None:
    """Maps of the flood; None without terrain."""
    if water is None or case.tank.ground is None:
        return None
    from coupler.geometry.terrain.bed_mesh import fitted_of
    from coupler.results.maps import Maps

    return Maps(water, fitted_of(case.tank), case.tank.ground)


def watch_of(case: Case, structure) -> Watch:
    """The observer of the blocks that the verdict is about: those that the case names, else all with joints, else all
    that can move."""
    from coupler.verdict.damage import Rules
    from coupler.verdict.divisions import Divisions
    from coupler.verdict.watch import Watch, joined

    reported = case.verdict
    divisions = Divisions.of(parts_of(case), structure.n)
    judged = np.zeros(structure.n, bool)
    for name in reported.on:
        judged[rows_by_name(case, parts_of(case)).get(name, divisions.rows_of(name))] = True
    if not reported.on:
        movable = ~structure.fixed & (divisions.bodies.label >= 0)
        jointed = movable & joined(structure)
        judged = jointed if jointed.any() else movable
    rules = Rules(
        reported.moved, reported.damaged_joints, reported.collapsed_weight, reported.collapsed_joints
    )
    return Watch(structure, divisions, rules, judged, reported.hit_speed)


def _coupling(case: Case, structure, solids, clock, from_start: bool) -> CoupledStepper:
    """Couple both sides, with the structure in equilibrium if the case asks for it."""
    water = immersion = None
    if case.water:
        water, immersion = water_of(case, structure, solids)
    settles = from_start and case.joints and case.structure.start == "settled"
    if settles and _settled(structure, water, immersion) and immersion is not None:
        water, immersion = water_of(case, structure, solids, immersion.mesh)
    return CoupledStepper(
        water,
        structure,
        immersion,
        rtol=PRESSURE_RTOL,
        step_max=case.time.step_max,
        clock=clock,
        passes=case.coupling.passes,
        tolerance=case.coupling.tolerance,
        most_defect=case.limits.defect,
        limits=limits_of(case),
        coming=_coming_energy(case),
    )


def limits_of(case: Case) -> Limits:
    """The limits of a case."""
    wanted = case.limits
    return Limits(wanted.volume_error, wanted.energy_error, wanted.cpu_seconds, wanted.momentum_error)


def _coming_energy(case: Case) -> Callable[[float], float] | None:
    """The energy [J] that inflows and seas can bring by a time [s]; None, and their code is not loaded, without any."""
    if case.water is None or not (case.water.inflow or case.water.sea):
        return None
    from coupler.scene.side_energy import coming_energy

    return coming_energy(case)


def _settled(structure, water, immersion) -> bool:
    """Move the joined blocks to their equilibrium with weight and still water; True if any moved."""
    from yade_scripts.dynamics.equilibrium import settle

    load = None
    if water is not None:
        water.leave_films_out(*immersion.films())
        load = _load_at_rest(structure, water)
    return settle(structure, load) > 0.0


def _load_at_rest(structure, water) -> Array:
    """Force and moment (n, 6) of the water on the blocks when they do not move."""
    from fluid.numerics.bounded import solve_pressure

    problem = water.predict(water.stable_step())
    if problem.coupling.nnz == 0:
        return np.zeros((structure.n, 6))
    x = solve_pressure(problem, PRESSURE_RTOL).x
    return problem.with_waterline_of(x).load(x)[: structure.n]


def build_structure(case: Case):
    """The structure of a case, in a new YADE scene."""
    from yade_scripts.contact.law import ContactLaw, PairFriction
    from yade_scripts.dynamics.structure import Structure

    c, j = case.contact, case.joints
    contact = joints = None
    if c:
        contact = ContactLaw(
            c.stiffness,
            c.restitution,
            c.friction,
            shear_ratio=c.shear_ratio,
            tangential_restitution=c.tangential_restitution,
            rule=c.rule,
            nodes_per_edge=c.nodes_per_edge,
            pairs=tuple(PairFriction(*pair.materials, pair.friction, share_of(pair)) for pair in c.pair),
            uplift=share_of(c),
        )
    if j:
        joints = joint_rules(case, parts_of(case))
    gravity = (0.0, 0.0, -case.case.gravity)
    planes = planes_of(case)
    blocks = [block for part in parts_of(case) for block in part.blocks] + obstacle_blocks(case)
    structure = Structure(
        blocks,
        contact,
        joints,
        None,
        planes,
        gravity,
        substep=case.structure.substep,
        ramp=case.structure.ramp or 0.0,
        sleep=case.structure.sleep and case.structure.sleep.share,
    )
    if threads() > 1:
        from kernels.threads import over, use

        use(threads())
        structure.share_work(over)
    return structure


def share_of(section) -> float | None:
    """Share of the pressure between faces according to `uplift` of [contact] or of one of its pairs; None: not
    given."""
    return {None: None, "full": 1.0, "none": 0.0, "share": section.uplift_share}[section.uplift]


def joint_rules(case: Case, parts: Sequence[Part]):
    """The rules of the section [joints] for all joints, for pairs of what is named, and for the scatter of strengths.

    parts: those that the blocks are from."""
    from yade_scripts.joints.rules import JointRules, PairJoints, Scatter

    joints = case.joints
    pairs = tuple(
        PairJoints(*pair.between, joint_parameters(of_pair(joints, pair)) if pair.joined else None)
        for pair in joints.pair
    )
    scatter = joints.distribution and Scatter(joints.distribution, joints.variation, joints.seed)
    called = {block.name: names_of_part(case, part) for part in parts for block in part.blocks}
    return JointRules(joint_parameters(joints), pairs, scatter, called if pairs else {})


def names_of_part(case: Case, part: Part) -> tuple[str, ...]:
    """The names of the tables that a part is from: its own, and for a house of a town that of the town."""
    if part.path[1] != "town":
        return (part.name,)
    return part.name, case.structure.town[part.path[2]].name


def of_pair(joints, pair):
    """The section [joints] with the values of a pair."""
    own = {name for name in pair.model_fields_set if getattr(pair, name) is not None}
    own -= {"between", "joined"}
    change = {name: getattr(pair, name) for name in own}
    if pair.law is not None and pair.law != joints.law and pair.peak is None:
        change["peak"] = None
    return joints.model_copy(update=change)


def joint_parameters(joints):
    """The parameters of the cohesive law of a section [joints]."""
    from yade_scripts.joints.cohesion import JointParameters

    return JointParameters(**{field.name: getattr(joints, field.name) for field in fields(JointParameters)})


def planes_of(case: Case) -> list:
    """The fixed boundaries for blocks: the ground, plane or not, and the closed sides of the tank."""
    uneven, walls = ground_surface(case), []
    if is_basin(case.tank):
        uneven, walls = basin_planes(mesh_of(case.tank))
    bed = [] if uneven is None else [uneven]
    return [*_ground(case), *bed, *_tank_planes(case, has_bed=bool(bed)), *walls]


def _ground(case: Case) -> list:
    """The ground as a plane; an empty list without ground."""
    from yade_scripts.blocks.faces import FixedPlane

    ground = case.structure.ground
    return (
        [FixedPlane((0.0, 0.0, ground.level), (0.0, 0.0, 1.0), "ground", material=ground.material)]
        if ground
        else []
    )


def _tank_planes(case: Case, has_bed: bool) -> list:
    """The closed sides of the tank as walls for blocks; its floor only where there is no other ground."""
    from yade_scripts.blocks.faces import FixedPlane

    if case.tank is None:
        return []
    planes, has_ground = [], case.structure.ground is not None or has_bed
    for axis, name in enumerate("xyz"):
        for sign, corner in (("-", case.tank.lower), ("+", case.tank.upper)):
            side = name + sign
            if side in case.tank.open or (side == "z-" and has_ground):
                continue
            normal = np.zeros(3)
            normal[axis] = 1.0 if sign == "-" else -1.0
            planes.append(FixedPlane(np.array(corner), normal, f"tank {side}", side == "z-", "tank"))
    return planes


def _gauges(case: Case) -> list[Gauge]:
    if not case.gauge:
        return []
    bodies = _bodies(case)
    return [gauge for spec in case.gauge for gauge in make_gauges(spec, bodies)]


def _bodies(case: Case) -> Bodies:
    """The blocks and fixed solids in the form that gauges need."""
    parts, solids = parts_of(case), solids_of(case)
    blocks = [block for part in parts for block in part.blocks]
    centre = [block.centre for block in blocks] + [solid.vertices.mean(axis=0) for solid in solids]
    mass = [block.mass for block in blocks] + [1.0] * len(solids)
    names = [block.name for block in blocks] + [solid.name for solid in solids]
    present = {
        "pressure": case.water, "friction": case.water, "contact": case.contact, "joint": case.joints,
        "weight": case.structure,
    }  # fmt: skip
    loads = [name for name, section in present.items() if section is not None]
    rows = rows_by_name(case, parts)
    return Bodies(names, np.array(centre, float).reshape(-1, 3), np.array(mass), rows, loads)


def rows_by_name(case: Case, parts: tuple[Part, ...]) -> dict[str, Array]:
    """Rows of the load table for every name a case may use: blocks, groups, parts of the structure, solids."""
    rows: dict[str, list[int]] = {}
    row = 0
    for part in parts:
        for block in part.blocks:
            for known in {block.name, block.group, part.name}:
                rows.setdefault(known, []).append(row)
            row += 1
    for solid in solids_of(case):
        rows.setdefault(solid.name, []).append(row)
        row += 1
    return {name: np.array(found) for name, found in rows.items()}
