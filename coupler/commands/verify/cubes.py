"""Three stacked cubes in the path of a dam break."""

from __future__ import annotations

import numpy as np

from coupler.commands.verify.figures import columns
from coupler.commands.verify.registry import TOLD, Finding, check
from coupler.commands.verify.scenes import DENSITY, G, box, column
from coupler.run.clock import Clock
from coupler.step.coupled_step import CoupledStepper
from coupler.step.immersion import Immersion
from fluid.mesh.background import box_mesh
from fluid.mesh.refinement import InBox, refined_mesh
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import FixedPlane
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure

EDGE, RESERVOIR, DEPTH = 0.15, 3.5, 0.4
HALF = InBox((RESERVOIR + 0.3, -1.0, -1.0), (RESERVOIR + 2.5, 2.0, 0.15), 1)
"""Region in which cells may be half as large: the sheet of water before and around the cubes."""
QUARTER = InBox((RESERVOIR + 1.45, 0.15, -1.0), (RESERVOIR + 2.4, 0.55, 0.15), 2)
"""Region in which cells may be a quarter as large, three to four over the sheet: the way of the lowest cube."""
STEADY, CONVERGED = (0.8, 1.0), 39.0
"""Window [s], and the force [N] on a column in the place of the cubes in it, with cells of edge/24 at its foot:
`held_column(EDGE / 3, (HALF, QUARTER, InBox((5.1, 0.22, -1.0), (5.38, 0.48, 0.08), 3)))`, 70 CPU s. The sheet brings
45 N, ∫ ρ u² dA over the width of a cube in the tank without cubes; a part of it passes by."""
FRICTION = 0.15
"""Of the cubes on one another and on the bed: PVC in the simulation of this experiment that comes with DualSPHysics,
whose contacts are between faces, as here (Project Chrono). The paper has 0.45, for contacts between particles, where,
say its authors, the coefficient depends on their size (https://github.com/DualSPHysics/DualSPHysics/issues/27). None
was measured."""
ANY = 100.0
"""Tolerance of values that are reported, not judged."""


@check("P56", "three stacked cubes in a dam break", "Canelas et al. 2016 (experiment), digitised", "M")
def stacked_cubes():
    """The gate vanishes at t = 0; the opening time in the experiment is not reported, nor is the friction.

    Judged on cells that resolve the sheet of water where it meets the cubes."""
    table = columns("canelas_three_cubes_x")
    t, place = cubes(EDGE / 3.0, 1.65, (HALF, QUARTER))
    coarse_t, coarse = cubes(EDGE / 3.0, 1.65)
    for at, measured in ((1.2, 1.900), (1.4, 2.074), (1.6, 2.334)):
        near = np.abs(np.interp(at, table["t_s"], table["x_m"]) - measured) < 0.03
        assert near, "the figure is that of the record"
        found = float(np.interp(at, t, place[:, 2, 0]))
        what = f"top cube, x at {at:g} s [m from the gate], edge/h = 12 where the sheet meets the cubes"
        yield Finding(what, found, measured, 0.15, False)
        found = float(np.interp(at, coarse_t, coarse[:, 2, 0]))
        yield Finding(f"edge/h = 3: the same at {at:g} s {TOLD}", found, measured, ANY, False)
    for regions, cells in (((), 3), ((HALF,), 6), ((HALF, QUARTER), 12)):
        what = f"column held in their place, edge/h = {cells}: force from 0.8 to 1 s [N] {TOLD}"
        yield Finding(what, held_column(EDGE / 3.0, regions), CONVERGED, ANY, False)
    height = columns("canelas_three_cubes_z")
    landed = height["t_s"][np.argmax(height["z_m"] < 0.15)]
    found = t[np.argmax(place[:, 2, 2] < 0.15)] if (place[:, 2, 2] < 0.15).any() else np.inf
    yield Finding("top cube, time at which its centre is below one edge [s]", found, landed, 0.15, False)


def cubes(cell: float, until: float, finer: tuple = ()) -> tuple[np.ndarray, np.ndarray]:
    """(t (n,), centres (n, 3, 3) from the gate) of the cubes, bottom to top; finer: regions of `refined_mesh`."""
    size, mesh = _tank(cell, finer)
    blocks = [
        Block(
            f"cube {i}",
            (RESERVOIR + 1.70 + 0.5 * EDGE, 0.5 * size[1], (i + 0.5) * EDGE),
            size=EDGE,
            density=800.0,
        )
        for i in range(3)
    ]
    contact = ContactLaw(2e5, 0.3, FRICTION)
    sides = [FixedPlane((0, y, 0), (0, s, 0), f"side {s}") for y, s in ((0.0, 1.0), (size[1], -1.0))]
    with Structure(blocks, contact, ground=0.0, planes=sides) as s:
        c = _stepper(mesh, s, [], 2)
        t, place = [0.0], [s.centre()]
        while t[-1] < until:
            c.step(c.step_size(1.0))
            t.append(c.time)
            place.append(s.centre())
    return np.array(t), np.array(place) - np.array([RESERVOIR, 0.0, 0.0])


def held_column(cell: float, finer: tuple = ()) -> float:
    """Mean force [N] along the stream, over STEADY, on a fixed column in the place of the cubes."""
    size, mesh = _tank(cell, finer)
    middle = (RESERVOIR + 1.70 + 0.5 * EDGE, 0.5 * size[1], 1.5 * EDGE)
    c = _stepper(mesh, None, [box(middle, (EDGE, EDGE, 3.0 * EDGE))], 1)
    impulse = time = 0.0
    while c.time < STEADY[1]:
        c.step(c.water.stable_step())
        if c.time > STEADY[0]:
            impulse -= c.water.report.momentum.lines["bodies"][0]
            time += c.water.report.dt
    return impulse / time


def _tank(cell: float, finer: tuple):
    """Size (3,) [m] of the tank and its mesh."""
    cells = np.round(np.array([6.6, 0.7, 0.7]) / cell).astype(int)
    size = cells * cell
    return size, refined_mesh(box_mesh(np.zeros(3), size, size / cells), finer)


def _stepper(mesh, structure, solids, passes: int) -> CoupledStepper:
    """The dam break in the tank; its far end lets water out."""
    immersion = Immersion(mesh, structure, solids, "single")
    water = Water(
        mesh,
        immersion.domain,
        column(RESERVOIR, DEPTH),
        WaterParameters(density=DENSITY, gravity=G),
        lambda normal, centre: normal[:, 0] > 0.5,
    )
    return CoupledStepper(water, structure, immersion, rtol=1e-7, step_max=1.0, clock=Clock(), passes=passes)
