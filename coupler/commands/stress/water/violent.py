"""Water that falls, splashes and hits, in steps and cells that are too long, too short or too slender."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.commands.stress.flow import Flow
from coupler.commands.stress.registry import Measure, scene
from coupler.commands.verify.scenes import DENSITY, G, box, column, tank
from fluid.step.parameters import WaterParameters


def dam_break(cells=(24, 3, 12), size=(2.0, 0.25, 1.0), **more):
    """A column of 0.6 m breaks in front of a wall."""
    return tank(size, cells, column(0.6, 0.6), rtol=1e-8, **more)


@scene("W20", "steps of four cells (CFL 4) in a dam break")
def four_cells_a_step() -> Iterator[Measure]:
    flow = Flow(dam_break(courant=4.0)).run(1.5)
    yield from flow.measures()
    yield Measure("energy taken by the numerics", flow.lost, None)


@scene("W21", "steps of 1e-5 s at the release of a dam")
def tiny_steps() -> Iterator[Measure]:
    """The force on the wall behind the column in its first five steps must not depend on the step."""
    forces = {}
    for dt in (1e-5, 1e-3):
        flow = Flow(dam_break(solids=[box((-0.03, 0.125, 0.5), (0.1, 1.0, 1.4))])).run(5 * dt, dt)
        forces[dt] = flow.record.load[0, 0]
        yield from flow.measures(f"dt {dt:g} s")
    yield Measure("force of 1e-5 s over that of 1e-3 s, off 1", forces[1e-5] / forces[1e-3] - 1.0, 0.02)


@scene("W22", "cells of aspect ratio 3, lying and standing, in a dam break")
def slender_cells() -> Iterator[Measure]:
    for name, cells in (("lying", (14, 2, 21)), ("standing", (42, 5, 7))):
        flow = Flow(dam_break(cells)).run(1.0)
        yield from flow.measures(name)


@scene("W26", "cells of aspect ratio 10, lying and standing, in a dam break", refusal="may")
def very_slender_cells() -> Iterator[Measure]:
    """Cells so slender occur in graded meshes only. The run may stop, but it must not continue with a wrong volume."""
    for name, cells in (("lying", (6, 1, 30)), ("standing", (60, 6, 6))):
        flow = Flow(dam_break(cells)).run(1.0)
        yield from flow.measures(name, energy=0.05)


def drop_at(height: float):
    """Fill: a ball of water in the air, 0.15 m in radius."""
    return lambda x: np.linalg.norm(x - np.array([0.5, 0.5, height]), axis=1) - 0.15


@scene("W23", "a drop of three cells falls and bursts on the floor")
def drop() -> Iterator[Measure]:
    """In the air its momentum grows by the impulse of its weight; after the impact the energy must not grow."""
    c = tank((1, 1, 1), (20, 20, 20), drop_at(0.7), rtol=1e-8)
    flow = Flow(c).run(0.2, 0.01)
    weight = DENSITY * c.water.volume() * G
    yield Measure(
        "momentum in the air, off weight times time", c.water.momentum()[2] / (-weight * c.time) - 1.0, 0.02
    )
    yield Measure(
        "momentum sideways over it", float(np.abs(c.water.momentum()[:2]).max() / (weight * c.time)), 0.01
    )
    flow.run(0.4)
    yield from flow.measures()


@scene("W24", "a slug of water hits a wall at 20 m/s")
def fast_slug() -> Iterator[Measure]:
    """The slug is 15 times as fast as a fall from the lid. The wall must take its momentum; no energy may appear."""
    n = 20
    limit = 1.1 * 20.0 / np.sqrt(G)
    wall = box((0.85, 0.1, 0.5), (0.1, 1.0, 1.4))
    c = tank(
        (1, 0.2, 1),
        (n, 4, n),
        lambda x: np.maximum(np.maximum(x[:, 0] - 0.5, 0.2 - x[:, 0]), np.abs(x[:, 2] - 0.5) - 0.2),
        solids=[wall],
        rtol=1e-8,
        speed_limit=max(limit, WaterParameters().speed_limit),
    )
    w = c.water
    w.velocity[:, 0] = 20.0
    w.set_cell_velocity(np.tile([20.0, 0.0, 0.0], (len(w.topology.cells), 1)))
    c.ledger.start(c._water_energy(), None)
    momentum = w.momentum()[0]
    impulse = [0.0]
    flow = Flow(c).run(0.05, each=lambda r: impulse.append(impulse[-1] + r.dt * r.load[0, 0]))
    yield Measure("impulse on the wall over the momentum of the slug", impulse[-1] / momentum, None)
    given = impulse[-1] + w.momentum()[0]
    yield Measure("momentum that went missing, tank walls included", given / momentum - 1.0, 0.3)
    yield from flow.measures(energy=0.02)


@scene("W25", "a column of one cell, and a film of a tenth of a cell")
def few_cells() -> Iterator[Measure]:
    """Less water than the mesh can resolve: it may move slowly or stay, but must neither be lost nor gain energy."""
    for name, fill in (("column", column(0.083, 0.6)), ("film", lambda x: x[:, 2] - 0.008)):
        flow = Flow(tank((2.0, 0.25, 1.0), (24, 3, 12), fill, rtol=1e-8)).run(0.5)
        yield from flow.measures(name)
