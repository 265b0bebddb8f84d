"""Scenes that several coupled tests share."""

import numpy as np

from coupler.case.case import Case
from coupler.scene.fill import start_level
from coupler.step.coupled_step import CoupledStepper
from coupler.step.immersion import Immersion
from fluid.mesh.background import box_mesh
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from tests.fakes import no_clock
from yade_scripts.blocks.generators.wall import wall_of_blocks
from yade_scripts.dynamics.equilibrium import CannotStand, settle
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters

G, RHO = 9.81, 1000.0
SLICE = 0.5
"""Width of the tank of the walls [m]."""
STIFF_CONTACT = {"stiffness": 2e9, "friction": 0.4, "restitution": 0.3}
OVERHANG = 0.001
"""The walls reach beyond the tank in y, so that its sides neither hold them nor let water past."""


def standing_wall(
    depth,
    *,
    face=1.1,
    thickness=0.2,
    height=2.0,
    course=0.25,
    strength=1e6,
    opening=1e-3,
    damping=0.02,
    density=2000.0,
    cell=0.25,
    covers="multiple",
    settled=True,
    step_max=0.01,
    passes=2,
    sleep=None,
):
    """A wall of full-width courses, joined to one another and to the ground, with still water of `depth` [m] on its
    upstream face x = `face` and air behind it. Close its `structure` after use."""
    blocks = wall_of_blocks(
        "wall",
        (face, -OVERHANG, 0.0),
        (thickness, SLICE + 2 * OVERHANG, height),
        (thickness, SLICE + 2 * OVERHANG, course),
        density=density,
        group="wall",
    )
    joints = JointParameters(strength=strength, opening_at_failure=opening, damping=damping)
    structure = Structure(blocks, None, joints, ground=0.0, sleep=sleep)
    tank = ((0.0, 0.0, 0.0), (2.5, SLICE, 2.5))
    mesh = box_mesh(*tank, cell)
    water, immersion = _still_water(structure, mesh, tank, (face, SLICE, depth), covers)
    if settled:
        try:
            settle(structure, load_at_rest(water)[: structure.n])
        except CannotStand:
            structure.close()
            raise
        water, immersion = _still_water(structure, mesh, tank, (face, SLICE, depth), covers)
    return CoupledStepper(
        water, structure, immersion, rtol=1e-10, step_max=step_max, clock=no_clock, passes=passes
    )


def _still_water(structure, mesh, tank, upper, covers):
    immersion = Immersion(mesh, structure, [], covers)
    level = start_level([((0.0, 0.0, 0.0), upper)], tank, mesh, immersion.domain)
    water = Water(mesh, immersion.domain, level, WaterParameters(gravity=G), lambda n, _: n[:, 2] > 0.5)
    return water, immersion


def load_at_rest(water):
    """Force and moment (n, 6) of the water on bodies that are held."""
    from fluid.numerics.bounded import solve_pressure

    problem = water.predict(water.stable_step())
    x = solve_pressure(problem, 1e-12).x
    return problem.with_waterline_of(x).load(x)


def moment_about_base(coupling, load, face, thickness):
    """Overturning moment [N m] of block loads (n, 6) about the middle of the base, positive downstream."""
    arm = coupling.structure.centre() - np.array([face + 0.5 * thickness, 0.0, 0.0])
    return float((np.cross(arm, load[:, :3]) + load[:, 3:])[:, 1].sum())


def run(coupling, end, each=lambda record: None):
    """Step to `end` [s]; each(record) after every step."""
    while coupling.time < end * (1 - 1e-12):
        each(coupling.step(coupling.step_size(end - coupling.time)))


def case(**sections) -> Case:
    """A case of plain data, checked by the schema."""
    return Case.model_validate({"case": {"title": "a test"}, **sections})


def wall_with_uplift(uplift):
    """Sections of a case: a wall of four blocks, joined to one another and to the bed, before 2.2 m of still water
    that reaches up to its face, with air behind it."""
    return {
        "time": {"end": 1.0, "step_max": 1 / 30},
        "tank": {"lower": [0, 0, 0], "upper": [6, 1, 5], "cell": 0.2},
        "water": {"fill": [{"lower": [0, 0, 0], "upper": [3.1, 1, 2.2]}]},
        "structure": {
            "density": 2000.0,
            "wall": [{"name": "wall", "lower": [3.1, 0, 0], "size": [0.6, 1, 4], "block": [0.6, 1, 1]}],
        },
        "joints": {"strength": 2e5, "opening_at_failure": 1e-3, "uplift": uplift},
        "contact": {"friction": 0.5},
    }


def block_in_a_pool(centre, height, top):
    """Sections of a case: a loose block, 2 m x 2 m, on the bed of a pool 3 m deep in a tank of the height `top` [m]."""
    return {
        "time": {"end": 4.0, "step_max": 0.05},
        "tank": {"lower": [0, 0, 0], "upper": [8, 6, top], "cell": 0.5},
        "water": {"fill": [{"lower": [0, 0, 0], "upper": [8, 6, 3]}]},
        "structure": {
            "density": 2400.0,
            "block": [{"name": "block", "centre": [*centre, 0.5 * height], "size": [2, 2, height]}],
        },
        "contact": STIFF_CONTACT,
    }
