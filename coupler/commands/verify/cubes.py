"""Three cubes on one another in the way of a dam break."""

from __future__ import annotations

import numpy as np

from coupler.commands.verify.figures import columns
from coupler.commands.verify.registry import Finding, check
from coupler.commands.verify.scenes import DENSITY, G, column
from coupler.run.clock import Clock
from coupler.step.coupled_step import CoupledStepper
from coupler.step.immersion import Immersion
from fluid.mesh.background import box_mesh
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import FixedPlane
from yade_scripts.contact.law import ContactLaw, PairFriction
from yade_scripts.dynamics.structure import Structure

EDGE, RESERVOIR, DEPTH = 0.15, 3.5, 0.4


@check("P56", "three stacked cubes in a dam break", "Canelas et al. 2016 (experiment), digitised", "M")
def stacked_cubes():
    """The gate is gone at t = 0; in the experiment it takes a time that is not reported."""
    table = columns("canelas_three_cubes_x")
    t, place = cubes(EDGE / 3.0, 1.65)
    for at, measured in ((1.2, 1.900), (1.4, 2.074), (1.6, 2.334)):
        near = np.abs(np.interp(at, table["t_s"], table["x_m"]) - measured) < 0.03
        assert near, "the figure is that of the record"
        found = float(np.interp(at, t, place[:, 2, 0]))
        yield Finding(f"top cube, x at {at:g} s [m from the gate], edge/h = 3", found, measured, 0.15, False)
    height = columns("canelas_three_cubes_z")
    landed = height["t_s"][np.argmax(height["z_m"] < 0.15)]
    found = t[np.argmax(place[:, 2, 2] < 0.15)] if (place[:, 2, 2] < 0.15).any() else np.inf
    yield Finding("top cube, time at which its centre is below one edge [s]", found, landed, 0.15, False)


def cubes(cell: float, until: float) -> tuple[np.ndarray, np.ndarray]:
    """(t (n,), centres (n, 3, 3) from the gate) of the cubes, bottom to top."""
    length, width, height = 6.6, 0.7, 0.7
    cells = np.round(np.array([length, width, height]) / cell).astype(int)
    size = cells * cell
    blocks = [
        Block(
            f"cube {i}",
            (RESERVOIR + 1.70 + 0.5 * EDGE, 0.5 * size[1], (i + 0.5) * EDGE),
            size=EDGE,
            density=800.0,
            material="cube",
        )
        for i in range(3)
    ]
    contact = ContactLaw(2e5, 0.3, 0.35, pairs=(PairFriction("cube", "cube", 0.45),))
    sides = [FixedPlane((0, y, 0), (0, s, 0), f"side {s}") for y, s in ((0.0, 1.0), (size[1], -1.0))]
    with Structure(blocks, contact, ground=0.0, planes=sides) as s:
        mesh = box_mesh(np.zeros(3), size, size / cells)
        immersion = Immersion(mesh, s, [], "single")
        # the far end lets water out
        water = Water(
            mesh,
            immersion.domain,
            column(RESERVOIR, DEPTH),
            WaterParameters(density=DENSITY, gravity=G),
            lambda normal, centre: normal[:, 0] > 0.5,
        )
        c = CoupledStepper(water, s, immersion, rtol=1e-7, step_max=1.0, clock=Clock(), passes=2)
        t, place = [0.0], [s.centre()]
        while t[-1] < until:
            c.step(c.step_size(1.0))
            t.append(c.time)
            place.append(s.centre())
    return np.array(t), np.array(place) - np.array([RESERVOIR, 0.0, 0.0])
