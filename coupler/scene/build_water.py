"""Builds the water of a case: mesh, solids in it, walls, and the sides through which it enters or leaves."""

from __future__ import annotations

from itertools import pairwise, permutations

import numpy as np

from array_types import Array
from coupler.case.case import Case
from coupler.case.inflow_records import levels_of, record_of
from coupler.geometry.solid_ground import raised_by
from coupler.geometry.start_surfaces import surface_of
from coupler.geometry.tank_mesh import bed_along, bed_under, floor_along, mean_bed, mesh_of, on_side
from coupler.geometry.terrain.land import friction_of
from coupler.program.errors import SurgebreakError
from coupler.program.threads import threads

READING_POINTS = 16
"""Places along an absorbing side at which depth and velocity of the water are read."""
SLACK = 1e-3
"""Share of a cell within which a box of water reaches a side of the tank."""


class AbsorbingSideBlocked(SurgebreakError):
    """The tank has no room for water beside an absorbing side."""


def water_of(case: Case, structure, solids, mesh=None):
    """(Water, Immersion) of a case with a structure or None and fixed solids [(vertices, faces)]; mesh: `Background` of
    its tank, None: it is made here."""
    from coupler.scene.fill import start_level, start_velocity
    from coupler.step.immersion import Immersion
    from fluid.domain.covers import OPENINGS
    from fluid.step.parameters import WaterParameters
    from fluid.step.water import Water
    from kernels.threads import use

    use(threads())
    w = case.water
    mesh = mesh_of(case.tank) if mesh is None else mesh
    cracks = _narrow_cracks(w.cracks, structure, mesh)
    immersion = Immersion(mesh, structure, solids, w.covers, cracks, OPENINGS[w.openings])
    parameters = WaterParameters(
        density=w.density,
        gravity=case.case.gravity,
        advection=w.advection,
        theta=w.theta,
        courant=case.time.cfl,
        viscosity=w.viscosity,
        walls=w.walls,
        **friction_of(case),
        suction=w.suction,
        vapour_pressure=w.vapour_pressure,
    )
    level = np.full(len(immersion.domain.nodes), np.ptp(mesh.bounds, axis=0).max())
    boxes = [_reaching(case.tank, fill) for fill in w.fill] + _strips(case, mesh)
    velocity = None
    if boxes:
        tops = [surface_of(fill) for fill in w.fill]
        level = _level_beside_films(
            immersion, lambda of: start_level(boxes, _walls(case.tank), mesh, of, tops)
        )
        velocity = start_velocity(boxes, [fill.velocity for fill in w.fill], immersion.domain.nodes)
    opened, smooth = sides_named(case.tank.open, mesh), sides_named(case.tank.smooth, mesh)
    water = Water(
        mesh,
        immersion.domain,
        level,
        parameters,
        opened,
        smooth,
        _flows(case, mesh, solids),
        velocity=velocity,
        **_trapped_air(w.air, structure, immersion.domain),
    )
    if immersion.cracks is not None and immersion.cracks.lumped:
        water.set_cracks(immersion.cracks.cracks())
    return water, immersion


def _level_beside_films(immersion, level_of) -> Array:
    """Level set (N,) of the start, level_of(domain), as if no films lay between blocks that touch and what they lie on:
    a side of a box of water that ends at a block would have its surface in the film under this block."""
    from fluid.domain.physical_domain import carry

    level, sealed = level_of(immersion.domain), immersion.sealed_domain()
    if sealed is immersion.domain:
        return level
    source = carry(sealed, immersion.domain)
    active = np.zeros(len(sealed.nodes), bool)
    active[sealed.cells] = True
    there = (source >= 0) & active[source]
    level[there] = level_of(sealed)[source[there]]
    return _as_beside(level, there, immersion.domain)


def _as_beside(level, there, domain) -> Array:
    """The level (N,) with that of the nearest of the nodes `there` (N,) bool around them at the other nodes: in a solid
    that is drawn in by a film along all of its faces, they have no more than slivers of fluid around."""
    cells, nodes = domain.cells, domain.nodes
    known = there[cells]
    mixed = cells[known.any(axis=1) & ~known.all(axis=1)].astype(np.int64)
    distance, found = np.full(len(level), np.inf), level.copy()
    for a, b in permutations(range(4), 2):
        use = ~there[mixed[:, a]] & there[mixed[:, b]]
        to, of = mixed[use, a], mixed[use, b]
        way = np.linalg.norm(nodes[to] - nodes[of], axis=1)
        order = np.lexsort((of, -way))  # the last one written is the nearest
        to, of, way = to[order], of[order], way[order]
        nearer = way < distance[to]
        found[to[nearer]], distance[to[nearer]] = level[of[nearer]], way[nearer]
    return found


def _trapped_air(air, structure, domain) -> dict:
    """The arguments of `Water` for trapped air; none, and its code is not loaded, where all air is open."""
    if air.model == "open":
        return {}
    from fluid.air.gas import Gas
    from fluid.air.leaks import Vent

    bodies, vents = domain.memory.bodies, []
    for spec in air.vent:
        body, place = -1, np.array(spec.at, float)
        if spec.block is not None:
            body = structure.names.index(spec.block)
            place = bodies.rotation[body].T @ (place - bodies.centre[body])
        vents.append(Vent(place, spec.area, spec.discharge, body))
    return {"gas": Gas(air.gamma, air.atmospheric, air.smallest), "vents": tuple(vents)}


def _reaching(tank, fill) -> tuple:
    """A box of water (lower, upper); ends that miss a side of the tank by the rounding of a file are moved to it."""
    pairs = ((fill.lower, tank.lower), (fill.upper, tank.upper))
    return tuple(
        tuple(side if abs(end - side) <= SLACK * tank.cell else end for end, side in zip(ends, sides))
        for ends, sides in pairs
    )


def _walls(tank) -> tuple:
    """The box (lower, upper) of the walls, at which a fill has no surface. An open top is none: water up to the brim
    has its surface there and falls with it, as air takes its place."""
    lower, upper = tank.lower, tank.upper
    return (lower, (*upper[:2], 2.0 * upper[2] - lower[2])) if "z+" in tank.open else (lower, upper)


def _strips(case: Case, mesh) -> list[tuple]:
    """Boxes (lower, upper) of water, one cell wide there, beside inflows and seas that no fill reaches. Without water
    beside it a side would begin with a film, which is too thin to resolve pressure or volume."""
    found = []
    for spec in (*case.water.inflow, *case.water.sea):
        top = level_at_start(spec)
        if top > floor_along(case.tank, spec.side) and not fills_beside(case, spec.side):
            lower, upper = [*case.tank.lower], [*case.tank.upper]
            axis, at_end = "xyz".index(spec.side[0]), spec.side[1] == "+"
            if at_end:
                lower[axis] = upper[axis] - _cell_beside(mesh, spec.side)
            else:
                upper[axis] = lower[axis] + _cell_beside(mesh, spec.side)
            found.append((lower, [*upper[:2], top]))
    return found


def _cell_beside(mesh, side: str) -> float:
    """Length [m] across a side of the tank of the cells beside it."""
    planes = mesh.axes["xyz".index(side[0])]
    return float(planes[-1] - planes[-2] if side[1] == "+" else planes[1] - planes[0])


def level_at_start(spec) -> float:
    """Height z [m] of the surface that an inflow or a sea has at the start, ahead of any wave."""
    if getattr(spec, "kind", "sea") == "record":
        return record_of(spec).level_at(0.0)
    if getattr(spec, "tide", None) is not None:
        return sea_level(spec)(0.0)
    return spec.ahead if getattr(spec, "ahead", None) is not None else spec.level


def fills_beside(case: Case, side: str) -> list:
    """The boxes of the initial water that reach a side of the tank."""
    axis, end = "xyz".index(side[0]), "upper" if side[1] == "+" else "lower"
    wall, slack = getattr(case.tank, end)[axis], SLACK * case.tank.cell
    return [f for f in case.water.fill if f.lower[axis] - slack <= wall <= f.upper[axis] + slack]


def _narrow_cracks(kind: str, structure, mesh):
    """The rule for narrow cracks; None where all cracks are open or no joint can break."""
    if kind == "open" or structure is None or structure.joints is None:
        return None
    from coupler.step.cracks import NarrowCracks

    corners, start = structure.joint_polygons()
    middle = np.array([corners[first:last].mean(axis=0) for first, last in pairwise(start)])
    return NarrowCracks(structure, mesh.size_at(middle), lumped=kind == "slit")


def sides_named(names, mesh):
    """Face normals (B, 3), centres (B, 3) → (B,) bool: those on the sides of these names; None without any."""
    if not names:
        return None

    def chosen(normals, centres):
        return np.any([on_side(mesh, name, normals, centres) for name in names], axis=0)

    return chosen


def _outward(side: str) -> Array:
    direction = np.zeros(3)
    direction["xyz".index(side[0])] = 1.0 if side[1] == "+" else -1.0
    return direction


def _flows(case: Case, mesh, solids):
    """Inflows and seas; None, and their code is not loaded, without any."""
    if not (case.water.inflow or case.water.sea):
        return None
    from fluid.sides import waves
    from fluid.sides.inflow import Side, Sides

    sides = []
    for spec in case.water.inflow:
        flow = flow_of(case, spec)
        if follows_inside(spec):
            flow = _following(case, spec, flow, mesh, solids)
        sides.append(Side.of(mesh, sides_named([spec.side], mesh), flow))
    for sea in case.water.sea:
        if sea.absorbs:
            tide = waves.tide(-_outward(sea.side), sea_level(sea))
            flow = _following(case, sea, tide, mesh, solids)
            sides.append(Side.of(mesh, sides_named([sea.side], mesh), flow))
            continue
        sides.append(Side.of(mesh, sides_named([sea.side], mesh), level=sea_level(sea)))
    return Sides(sides)


def sea_level(sea):
    """Height z [m] of a sea as a function of the time [s]. Raises RecordError."""
    tide = sea.tide
    if tide is None:
        return lambda time: sea.level
    if tide.path is not None:
        times, levels = levels_of(tide.path)
        return lambda time: float(np.interp(time, times, levels))
    return lambda time: (
        sea.level + tide.amplitude * float(np.cos(2.0 * np.pi * (time - tide.high) / tide.period))
    )


def follows_inside(spec) -> bool:
    """Whether the side of an inflow or a sea follows the water a cell inside: it absorbs, or keeps its discharge."""
    return spec.absorbs or keeps_discharge(spec)


def keeps_discharge(spec) -> bool:
    """Whether an inflow or a sea is an inflow that keeps its discharge."""
    return getattr(spec, "keeps", "level") == "discharge"


def _following(case: Case, spec, flow, mesh, solids=()):
    """The flow of a side that absorbs or keeps its discharge; the water is read one cell inside, at columns of the
    mesh, over what solids leave of the depth.

    Raises AbsorbingSideBlocked."""
    from fluid.sides.absorbing import Absorber, kept_discharge, outgoing_wave

    axis = "xyz".index(spec.side[0])
    along = bed_along(case.tank, spec.side)
    if len(along) == 2:  # of a box: its floor is level
        along = np.column_stack(
            [np.linspace(*along[:, 0], READING_POINTS + 2), np.full(READING_POINTS + 2, along[0, 1])]
        )
    along = along[1:-1][:: max(1, (len(along) - 2) // READING_POINTS)]
    places = np.empty((len(along), 2))
    cell = _cell_beside(mesh, spec.side)
    inside = -_outward(spec.side)[axis] * cell
    places[:, axis] = mesh.bounds[int(spec.side[1] == "+"), axis] + inside
    places[:, 1 - axis] = along[:, 0]
    bed = bed_under(mesh, places)  # there, not at the side: a bed that rises inwards is higher
    there = np.isfinite(bed)
    if not there.any():
        does = "keeps its discharge" if keeps_discharge(spec) else "absorbs"
        raise AbsorbingSideBlocked(
            f"side {spec.side} {does}, but {cell:.3g} m inside of it, where the water is read, the tank has "
            f"no room for water: the ground reaches its upper side; let another side absorb, or move this one"
        )
    places, bed = places[there], raised_by(bed[there], places[there], solids)
    law = kept_discharge if keeps_discharge(spec) else outgoing_wave
    return Absorber(flow, -_outward(spec.side), places, bed, case.case.gravity, law).as_flow()


def instants_of(case: Case, spec) -> np.ndarray:
    """Times (k,) [s] from the start on at which the largest energy of an inflow of the case is sought: those of its
    record, or times around its wave."""
    if spec.kind in ("solitary", "n-wave"):
        return np.linspace(0.0, 4.0 * (spec.crest if spec.kind == "solitary" else spec.middle), 401)
    if spec.kind != "record":
        return np.zeros(1)
    found = record_of(
        spec, _turn(case), mean_bed(case.tank, spec.side, level_at_start(spec)), case.case.gravity
    )
    return np.unique(np.maximum(found.time, 0.0))


def flow_of(case: Case, spec):
    """The flow of an inflow of the case; the depth of a wave is measured from the bed along its side."""
    from fluid.sides import waves

    inward, gravity = -_outward(spec.side), case.case.gravity
    if spec.kind == "steady":
        return waves.steady(inward, spec.level, spec.velocity)
    bed = mean_bed(case.tank, spec.side, spec.level) if spec.kind != "record" else 0.0
    if spec.kind == "bore":
        return waves.steady(inward, spec.level, bore_velocity(case, spec))
    if spec.kind == "n-wave":
        sign = 1.0 if spec.leading == "depression" else -1.0
        return waves.n_wave(inward, bed, spec.level - bed, spec.height, gravity, spec.middle, sign)
    if spec.kind == "solitary":
        order = 1 if spec.theory == "goring" else 3
        wave = waves.SolitaryWave(spec.level - bed, spec.height, gravity, spec.crest, order)
        return wave.flow(inward, bed)
    found = record_of(spec, _turn(case), mean_bed(case.tank, spec.side, level_at_start(spec)), gravity)
    if found.varies or found.sideways.any():
        return waves.record_along(
            inward, found.time, found.along, found.level, found.velocity, found.sideways
        )
    return waves.record(inward, found.time, found.level[:, 0], found.velocity[:, 0])


def _turn(case: Case) -> float:
    """Angle [rad] between the axes of files and those of the tank."""
    return case.terrain.turn if case.terrain is not None else 0.0


def bore_velocity(case: Case, spec) -> float:
    """Velocity [m/s] of the water behind the front of a bore, over wet or dry ground."""
    from fluid.sides.waves import bore_speed, dry_bore_speed

    depth = spec.level - mean_bed(case.tank, spec.side, spec.level)
    if spec.ahead is None:
        return dry_bore_speed(depth, case.case.gravity)
    return bore_speed(spec.ahead - mean_bed(case.tank, spec.side, spec.ahead), depth, case.case.gravity)[1]
