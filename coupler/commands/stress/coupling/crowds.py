"""Many blocks, blocks between walls, cavities that blocks close, walls that break, and steps that are too long."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.commands.stress.flow import Flow, speed
from coupler.commands.stress.registry import Measure, scene
from coupler.commands.verify.scenes import DENSITY, G, column, level_at
from coupler.commands.verify.scenes import tank as one_pass_tank
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.generators.wall import wall_of_blocks
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters


def tank(*args, **more):
    """A tank as in the shipped cases, with two passes."""
    c = one_pass_tank(*args, **more)
    c.passes = 2
    return c


@scene("C20", "1000 blocks of debris, half of them lighter than water")
def thousand() -> Iterator[Measure]:
    """The blocks start apart, then rise or sink. The momentum they gain must equal the impulse of water and weight."""
    n, edge = 10, 0.05
    places = (np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), -1).reshape(-1, 3) + 0.5) * 0.08 + 0.1
    blocks = [
        Block(f"b{k}", p, size=edge, density=500.0 if (p.sum() / 0.08).astype(int) % 2 else 2000.0)
        for k, p in enumerate(places)
    ]
    with Structure(blocks, ContactLaw(1e5, 0.3), ground=0.0) as s:
        flow = Flow(tank((1, 1, 1.2), (10, 10, 12), level_at(1.0), s, rtol=1e-8))
        before = (s.mass[:, None] * s.velocity()[:, :3]).sum(axis=0)
        impulse = np.zeros(3)

        def look(record):
            force = record.load[: s.n, :3] + s.gravity_force()[:, :3]
            impulse[:] += record.dt * force.sum(axis=0)

        flow.run(0.08, 0.01, look)
        gained = (s.mass[:, None] * s.velocity()[:, :3]).sum(axis=0) - before
        given = np.abs(s.mass * G * 0.08).sum()
        yield Measure(
            "momentum, off the impulse of water and weight",
            float(np.abs(gained - impulse).max() / given),
            1e-9,
        )
        yield Measure("largest speed", speed(s), 0.5 * G * 0.08 * 2.5, "m/s")
    yield from flow.measures()


@scene("C21", "block squeezed between two walls under water")
def squeezed() -> Iterator[Measure]:
    """One wall is driven until the block is compressed by 2 mm. Both walls must then exert the same force, with a
    stiffness of K/2: each pair has the stiffness K whatever the sizes of its faces, and two of them act in series."""
    stiffness, gap, press, fast = 1e6, 0.01, 0.002, 0.1
    plate = (0.2, 0.6, 0.6)
    blocks = [
        Block("still", (0.2, 0.5, 0.4), size=plate, fixed=True),
        Block("driven", (0.8 + gap, 0.5, 0.4), size=plate, driven=True, velocity=(-fast, 0.0, 0.0)),
        Block("block", (0.5 + 0.5 * gap, 0.5, 0.4), size=(0.4, 0.3, 0.3), density=DENSITY),
    ]
    with Structure(blocks, ContactLaw(stiffness, 0.2)) as s:
        flow = Flow(tank((1, 1, 1.2), (10, 10, 12), level_at(0.9), s))
        flow.run((gap + press) / fast, 0.004)
        s.drive("driven")
        flow.run(0.1, 0.004)
        c = s.contacts()
        onto = c.normal_force[:, 0]
        force = [abs(onto[c.b == row].sum() - onto[c.a == row].sum()) for row in (0, 1)]
        yield Measure("force of one wall over that of the other, off 1", force[0] / force[1] - 1.0, 0.02)
        yield Measure("force, off K/2 times the way", force[0] / (0.5 * stiffness * press) - 1.0, 0.02)
        yield Measure("speed of the block at the end", float(np.abs(s.velocity()[2, :3]).max()), 0.01, "m/s")
    yield from flow.measures()


@scene("C22", "chamber of loose blocks full of water, under water")
def chamber() -> Iterator[Measure]:
    """Four walls and a lid that are not glued: nothing may move, whether the chamber is sealed or not."""
    t, h, stiffness = 0.1, 0.4, 1e7
    density = 2400.0
    walls = [
        Block("x-", (0.25, 0.5, 0.5 * h), size=(t, 0.6, h), density=density),
        Block("x+", (0.75, 0.5, 0.5 * h), size=(t, 0.6, h), density=density),
        Block("y-", (0.5, 0.25, 0.5 * h), size=(0.4, t, h), density=density),
        Block("y+", (0.5, 0.75, 0.5 * h), size=(0.4, t, h), density=density),
    ]
    lid = Block("lid", (0.5, 0.5, h + 0.5 * t), size=(0.6, 0.6, t), density=density)
    with Structure([*walls, lid], ContactLaw(stiffness, 0.1), ground=0.0) as s:
        start = s.centre()
        flow = Flow(tank((1, 1, 1), (10, 10, 10), level_at(0.8), s, covers="multiple")).run(0.5)
        weight = sum((density - DENSITY) * b.volume * G for b in s.blocks)
        c = s.contacts()
        carried = np.abs(c.normal_force[c.b < 0, 2].sum())
        yield Measure("bed carries, off weight less buoyancy", carried / weight - 1.0, 0.05)
        yield Measure("moved", float(np.abs(s.centre() - start).max()), 1e-3, "m")
        yield Measure("speed at the end", speed(s), 5e-3, "m/s")
    yield Measure("error of the volume", flow.volume, 1e-3)


@scene("C23", "piston driven into a chamber that is full and closed", refusal="must")
def piston() -> Iterator[Measure]:
    """The water cannot escape, so no pressure satisfies the equations; the run must report this, not make one up."""
    plate = Block("piston", (0.5, 0.5, 0.5), size=(0.2, 1.1, 1.1), driven=True, velocity=(0.05, 0.0, 0.0))
    with Structure([plate]) as s:
        flow = Flow(tank((1, 1, 1), (8, 8, 8), level_at(9.0), s, covers="multiple")).run(0.1, 0.01)
    yield Measure("pressure", float(np.abs(flow.coupling.water.pressure).max()), 1e7, "Pa")


def wave_on_wall(strength: float, closing: float = 1.0, width: float = 0.8):
    """(structure, coupling): a column `width` [m] wide breaks in front of a wall of joined blocks at 1.5 m."""
    blocks = wall_of_blocks("wall", (1.5, -0.001, 0.0), (0.2, 0.502, 1.0), (0.2, 0.251, 0.25), density=1500.0)
    joints = JointParameters(strength, 2e-3, closing_ratio=closing, damping=0.02)
    structure = Structure(blocks, ContactLaw(None, 0.2, 0.5), joints, ground=0.0)
    c = tank((2.5, 0.5, 1.25), (20, 4, 10), column(width, 0.9), structure, rtol=1e-8, covers="multiple")
    return structure, c


@scene("C30", "wall of joined blocks fails under the impact of a wave")
def wall_fails() -> Iterator[Measure]:
    structure, c = wave_on_wall(2e4)
    with structure as s:
        flow = Flow(c).run(0.9)
        yield Measure("share of the joints that hold", float(s.joint_table().alive.mean()), 0.9)
        yield Measure("blocks carried off", float((s.centre()[:, 0] - 1.6).max()), None, "m")
    yield from flow.measures()


@scene("C31", "the same in steps ten times too long", refusal="may")
def long_steps() -> Iterator[Measure]:
    structure, c = wave_on_wall(2e4)
    with structure:
        flow = Flow(c)
        while c.time < 0.9:
            flow.step(10.0 * c.step_size(1.0))
    yield from flow.measures(energy=0.05)


@scene("C32", "joints that close 1e4 times too stiffly, loaded at once by a full depth of water")
def stiff_joints() -> Iterator[Measure]:
    """The substep is a hundredth of the usual one; the wall must vibrate without gaining energy."""
    structure, c = wave_on_wall(2e6, closing=1e4, width=1.5)
    with structure as s:
        flow = Flow(c).run(0.02, 0.002)
        yield Measure("share of the joints that broke", 1.0 - float(s.joint_table().alive.mean()), 0.0)
        yield Measure("moved", float(np.abs(s.centre()[:, 0] - 1.6).max()), 1e-3, "m")
    yield from flow.measures()


@scene("C33", "block that lies 1e4 times too stiffly on the bed under water")
def stiff_contact() -> Iterator[Measure]:
    edge, density = 0.3, 2000.0
    block = Block("c", (0.52, 0.47, 0.5 * edge + 1e-3), size=edge, density=density)
    with Structure([block], ContactLaw(1e11, 0.3), ground=0.0) as s:
        flow = Flow(tank((1, 1, 1.2), (10, 10, 12), level_at(0.8), s)).run(0.06, 0.005)
        yield Measure("height over the bed", s.centre()[0, 2] - 0.5 * edge, 1.1e-3, "m")
        yield Measure("speed at the end", speed(s), 0.05, "m/s")
    yield from flow.measures(energy=0.05)
