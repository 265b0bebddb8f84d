"""The smallest water and the smallest structure, so that the coupler is tested without either engine."""

from contextlib import contextmanager
from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import scipy.sparse as sp

from yade_scripts.dynamics.impulses import Impulses


@dataclass(frozen=True)
class FakeProblem:
    """A PressureProblem made of given matrices, without a bound."""

    matrix: sp.csr_array
    rhs: np.ndarray
    coupling: sp.csr_array
    known: np.ndarray
    guess: np.ndarray
    other_load: np.ndarray
    lower: np.ndarray | None = None
    at_bound: np.ndarray | None = None
    air: np.ndarray | None = None
    dt: float = 0.0
    predicted: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(shear=None))

    def with_waterline_of(self, x):
        """Its bodies have no water line."""
        return self

    def load(self, x):
        """-Gᵀp + other_load (n, 6)."""
        return self.other_load - (self.coupling.T @ (x + self.known)).reshape(-1, 6)


def piston_column(length=1.0, area=1.0, cells=10, dt=0.01, density=1000.0, known=0.0) -> FakeProblem:
    """A horizontal pipe of water at rest between a free surface (p = 0) at 0 and a piston at `length`.

    Linear finite elements in one dimension; the water moves as one mass, density * area * length.
    """
    h = length / cells
    main = np.r_[np.full(cells - 1, 2.0), 1.0] * area / h
    off = np.full(cells - 1, -area / h)
    K = sp.diags_array([off, main, off], offsets=[-1, 0, 1])
    coupling = np.zeros((cells, 6))
    coupling[-1, 0] = -area  # out of the piston into the water: towards smaller x
    return FakeProblem(
        sp.csr_array(K * dt / density),
        np.zeros(cells),
        sp.csr_array(coupling),
        np.full(cells, known),
        np.zeros(cells),
        np.zeros((1, 6)),
        dt=dt,
    )


@dataclass(frozen=True)
class DirectResult:
    x: np.ndarray
    iterations: int
    residual: float
    at_bound: np.ndarray | None = None
    parting: np.ndarray | None = None
    lower: np.ndarray | None = None


def direct_solve(A, b, x0, rtol, lower=None, at_bound=None, air=None, extra=None) -> DirectResult:
    """The linear solver of the fakes: dense, exact, with the same call as the water's, without a bound."""
    dense = A.toarray()
    if extra is not None:
        dense = dense + np.column_stack([extra(e) for e in np.eye(len(b))])
    return DirectResult(np.linalg.solve(dense, b), 1, 0.0)


@contextmanager
def no_clock(part):
    """A clock that books nothing."""
    yield


@dataclass(frozen=True)
class FakeAdvance:
    mean_velocity: np.ndarray
    impulses: Impulses
    substeps: int = 1
    dt_s: float = 0.0
    opening_rate: float = 0.0


class FreeBody:
    """One rigid box without rotation, contact or joints: the smallest structure the coupler can carry."""

    joints = None

    def __init__(self, size, centre, density, gravity):
        half = 0.5 * np.array(size, float)
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
        self.n = 1
        self.names, self.groups = ["body"], ["body"]
        self.shape_vertices = [corners * half]
        self.shape_faces = [
            ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
        ]
        self.mass = np.array([density * np.prod(size)])
        self.fixed = self.still = np.array([False])
        self.prescribed = {}
        self.blocks = [SimpleNamespace(fixed=False, centre=np.array(centre, float), rotation=np.eye(3))]
        self._g = np.array([0, 0, -gravity])
        self._x, self._v = np.array([centre], float), np.zeros((1, 6))
        self._load, self._work = np.zeros((1, 6)), 0.0

    @classmethod
    def cube(cls, side, centre, density, gravity):
        return cls((side, side, side), centre, density, gravity)

    def uplift_shares(self):
        """The water has all of its faces."""
        return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0)

    def wet_joints(self):
        return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0)

    def centre(self):
        return self._x.copy()

    def rotation(self):
        return np.eye(3)[None]

    def velocity(self):
        return self._v.copy()

    def inertia(self):
        return 1e30 * np.eye(3)[None]

    def tangent(self):
        return sp.csr_array((6, 6)), sp.csr_array((6, 6))

    def internal_force(self):
        return np.zeros((1, 6))

    def gravity_force(self):
        return np.concatenate([self.mass[:, None] * self._g, np.zeros((1, 3))], axis=1)

    def weight_now(self):
        return self.gravity_force()

    def joined_planes(self):
        return np.zeros(0, int), np.zeros(0, int), np.zeros(0)

    def overlaps(self):
        return np.zeros(0, int), np.zeros((0, 3)), np.zeros(0)

    def touching_at_start(self):
        return np.zeros(0, int), np.zeros((0, 3))

    def set_load(self, load):
        self._load = load

    def save(self):
        return self._x.copy(), self._v.copy(), self._work

    def restore(self, saved):
        self._x, self._v, self._work = saved[0].copy(), saved[1].copy(), saved[2]

    def advance(self, dt):
        before = self._v.copy()
        self._v[:, :3] += dt * (self._load[:, :3] / self.mass[:, None] + self._g)
        mean = 0.5 * (before + self._v)
        self._x += dt * mean[:, :3]
        self._work += dt * float(np.sum(self._load * mean))
        nothing = np.zeros((1, 9))
        impulses = Impulses(
            contact=nothing,
            joint=nothing,
            place=dt * (self._x - 0.5 * dt * mean[:, :3]),
            dt=dt,
            zero=np.zeros(3),
            lifted=np.zeros((1, 3)),
        )
        return FakeAdvance(mean, impulses)

    def momentum(self, about):
        p = self.mass[:, None] * self._v[:, :3]
        return np.concatenate([p.sum(axis=0), np.cross(self._x - about, p).sum(axis=0)])

    def energies(self):
        height = float(self.mass @ self._x[:, 2])
        return {
            "kinetic": 0.5 * float(self.mass @ (self._v[:, :3] ** 2).sum(axis=1)),
            "gravity": -self._g[2] * height,
            "load_work": self._work,
            **dict.fromkeys(("joint_stored", "contact_stored", "joint_dissipated", "driving_work"), 0.0),
            **dict.fromkeys(("joint_damping", "dashpot", "friction"), 0.0),
        }
