"""Columns of the histories of a run: name, unit, meaning. They are written in the header of each file."""

from __future__ import annotations

from coupler.balance.momentum import LINES

ENERGY = (
    ("time", "s", "time"),
    ("water_kinetic", "J", "kinetic energy of the water"),
    ("water_potential", "J", "potential energy of the water above the floor of the tank"),
    ("numerical_dissipation", "J", "energy the numerics took out of the water so far; negative: put in"),
    ("shear_dissipation", "J", "energy that viscosity and friction of walls took out of the water so far"),
    ("parting_work", "J", "energy spent so far on parting water from its vapour"),
    (
        "air_energy",
        "J",
        "energy that trapped air holds, and what of it was lost with air that got away so far",
    ),
    ("entered", "J", "energy that came with water through inflows and seas so far, less what left there"),
    ("left", "J", "energy of the water that fell out through open sides so far"),
    ("work_given", "J", "work of the water on the blocks so far, with the velocities of the pressure solve"),
    ("work_received", "J", "the same loads over the motion that the blocks made"),
    ("blocks_kinetic", "J", "kinetic energy of the blocks"),
    ("blocks_gravity", "J", "potential energy of the blocks"),
    ("joint_stored", "J", "elastic energy in the joints"),
    ("joint_dissipated", "J", "energy used to open joints so far"),
    ("joint_damping", "J", "energy taken by the damping of the joints so far"),
    ("contact_stored", "J", "elastic energy in contacts"),
    ("dashpot", "J", "energy taken by contact dashpots so far"),
    (
        "friction",
        "J",
        "energy taken by friction so far, with the springs of contacts that ended",
    ),
    ("driving_work", "J", "work of prescribed motions on the structure so far"),
    ("structure_residual", "J", "what the structure's own ledger misses"),
    ("interface_residual", "J", "work given less work received"),
    ("input_energy", "J", "energy the scene has put in so far, the scale of the error"),
    ("energy_error", "1", "unbalanced share of the input energy"),
)
COUPLING = (
    ("time", "s", "time at the end of the step"),
    ("dt", "s", "length of the step"),
    ("passes", "1", "pressure solves in the step as it was taken"),
    ("iterations", "1", "iterations of the linear solver, those of steps that were halved included"),
    ("unknowns", "1", "pressure unknowns (wet nodes)"),
    ("bodies_cut", "1", "bodies whose cells were cut again"),
    ("retries", "1", "times that the step was halved and taken again"),
    ("substeps", "1", "YADE substeps, those of steps that were halved included"),
    ("substep", "s", "length of a substep"),
    (
        "defect",
        "1",
        "share by which the blocks' mean motion missed the motion that the pressure solve assumed",
    ),
    ("opening_rate", "1", "largest opening in a substep over the opening at failure"),
)
WATER = (
    ("time", "s", "time"),
    ("volume", "m3", "volume of the water"),
    ("entered", "m3", "volume that came in through inflows and seas so far"),
    ("left", "m3", "volume that left through open sides, inflows and seas so far"),
    (
        "volume_error",
        "1",
        "volume + left - entered - volume at the start, over the volume at the start and what entered",
    ),
    (
        "reinserted",
        "m3",
        "volume that the last correction of the total moved so far, a sum of absolute values",
    ),
    ("reinserted_net", "m3", "the same with its sign: positive where the transport had lost water"),
    ("clipped", "1", "nodes whose speed was capped so far (spray)"),
    (
        "lowest_pressure",
        "Pa",
        "lowest pressure of the water in the step, relative to the air; but in films between blocks",
    ),
    ("wall_at_bound", "1", "share of the wetted walls on which the pressure is at its lower bound"),
    ("parted", "m3", "room that opened so far where the pressure was at its lower bound"),
    ("momentum_x", "N s", "momentum of the water"),
    ("momentum_y", "N s", "momentum of the water"),
    ("momentum_z", "N s", "momentum of the water"),
)
AIR = (
    ("time", "s", "time"),
    ("pockets", "1", "pockets of trapped air"),
    ("volume", "m3", "volume of all pockets"),
    ("reference", "m3", "volume that their air would have at the pressure of the atmosphere"),
    ("largest_pressure", "Pa", "largest pressure of a pocket over the step, relative to the open air"),
    ("lowest_pressure", "Pa", "lowest pressure of a pocket over the step, relative to the open air"),
    ("lost", "J", "energy of air that got away or was mixed with other air so far"),
    ("entrained", "m3", "reference volume of pockets that opened within the water so far"),
    ("filled", "1", "pockets that water filled so far"),
    ("let_go", "1", "pockets that became smaller than water.air.smallest so far, and are open air since"),
)
STRUCTURE = (
    ("time", "s", "time"),
    ("joints_intact", "1", "joints that still carry traction"),
    ("joints_broken", "1", "joints that have failed"),
    ("largest_damage", "1", "largest damage of a live joint"),
    ("momentum_x", "N s", "momentum of the blocks"),
    ("momentum_y", "N s", "momentum of the blocks"),
    ("momentum_z", "N s", "momentum of the blocks"),
    ("impulse_x", "N s", "impulse of the water on the blocks so far"),
    ("impulse_y", "N s", "impulse of the water on the blocks so far"),
    ("impulse_z", "N s", "impulse of the water on the blocks so far"),
    ("fastest", "m/s", "speed of the fastest point of a block"),
)


STRUCTURE_LINES = (
    "joint_stored",
    "joint_dissipated",
    "joint_damping",
    "contact_stored",
    "dashpot",
    "friction",
)
"""Lines of energy that the structure keeps itself, by their names there."""

MOMENTUM_TITLE = "momentum: each line is what it has added to water and free blocks since the start"


def momentum_columns(unit: str, of: str) -> tuple[tuple[str, str, str], ...]:
    """Columns of the balance of momentum; of: what a vector is, behind the name of its line."""
    sums = (
        ("water", f"{of} of the water"),
        ("blocks", f"{of} of the blocks that move freely"),
        ("residual", "what the lines miss so far: round-off"),
    )
    sources = (*sums[:2], *LINES, sums[2])
    return (("time", "s", "time"), *((f"{n}_{a}", unit, m) for n, m in sources for a in "xyz"))
