"""A wall of two blocks and a crate whose verdict is watched, without YADE and without water."""

from types import SimpleNamespace

import numpy as np

from coupler.verdict.damage import Rules
from coupler.verdict.divisions import Divisions
from coupler.verdict.watch import Watch
from yade_scripts.blocks.block import Block

G = 9.81


class FakeJoints:
    """Two joints: block 0 with the ground, block 1 with block 0; x is out of the wall."""

    a, b = np.array([0, 1]), np.array([-1, 0])

    def __len__(self):
        return 2


class FakeStructure:
    """A wall of two blocks of 1 m, 0.4 m thick along x, one on the other, and a loose crate in front of it."""

    def __init__(self):
        wall = {"size": np.array([0.4, 1.0, 1.0]), "density": 1000.0}
        self.blocks = [
            Block("wall-0", np.array([5.0, 0, 0.5]), **wall),
            Block("wall-1", np.array([5.0, 0, 1.5]), **wall),
            Block("crate", np.array([3.0, 0, 0.5]), size=np.ones(3), density=500.0, group="crate"),
        ]
        self.names = [b.name for b in self.blocks]
        self.n, self.fixed = 3, np.zeros(3, bool)
        self.mass = np.array([b.mass for b in self.blocks])
        self.gravity = np.array([0.0, 0.0, -G])
        self.joints = FakeJoints()
        self.x = np.array([b.centre for b in self.blocks])
        self.turn = np.array([np.eye(3)] * 3)
        self.v = np.zeros((3, 6))
        self.broke, self.torn = np.full(2, np.nan), np.zeros(2)

    def centre(self):
        return self.x

    def rotation(self):
        return self.turn

    def velocity(self):
        return self.v.copy()

    def joint_table(self):
        return SimpleNamespace(
            a=FakeJoints.a,
            b=FakeJoints.b,
            area=np.array([0.4, 0.4]),
            alive=np.isnan(self.broke),
            failure_time=self.broke,
            torn=np.where(np.isnan(self.broke), self.torn, 1.0),
        )

    def joint_polygons(self, at_start=False):
        square = np.array([[4.8, -0.5, 0.0], [5.2, -0.5, 0.0], [5.2, 0.5, 0.0], [4.8, 0.5, 0.0]])
        return np.concatenate([square, square + np.array([0, 0, 1.0])]), np.array([0, 4, 8])


def verdict_scene():
    """That structure, its watch, and the coupling that `Watch.step` reads."""
    s = FakeStructure()
    parts = [
        SimpleNamespace(path=("structure", "wall", 0), name="wall", blocks=tuple(s.blocks[:2])),
        SimpleNamespace(path=("structure", "block", 0), name="crate", blocks=tuple(s.blocks[2:])),
    ]
    watch = Watch(
        s, Divisions.of(parts, 3), Rules(moved=0.1, collapsed_weight=0.5), np.array([True, True, False])
    )
    water = SimpleNamespace(domain=SimpleNamespace(body_centre=s.x))
    return s, watch, SimpleNamespace(structure=s, water=water)


def record(time, contact=None, load=None):
    """A step of 10 ms that ends at time, with impulses of contacts (3, 3) [N s] and forces of the water (3, 3) [N]."""
    impulses = SimpleNamespace(contact=np.zeros((3, 9)))
    if contact is not None:
        impulses.contact[:, :3] = contact
    forces = np.zeros((3, 6))
    if load is not None:
        forces[:, :3] = load
    return SimpleNamespace(time=time, dt=0.01, impulses=impulses, load=forces)
