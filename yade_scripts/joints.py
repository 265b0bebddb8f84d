"""Cohesive joints of a structure: built from touching faces, state through time, table for reports."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from yade_scripts import joint_kernel as kernel
from yade_scripts.blocks import Block
from yade_scripts.cohesion import JointParameters
from yade_scripts.faces import TouchingFaces, gauss_points, to_body
from yade_scripts.joint_forces import NOT_GROWING, PULL, kernels_of

Array = np.ndarray


@dataclass(frozen=True)
class JointTable:
    """One row a joint. a, b: blocks (b = -1: ground or wall) · face_a, face_b: their faces (-1: fixed plane)

    area [m²] · centre (J, 3) [m] and normal (J, 3) out of a, now (both follow block a) · damage: largest λ/δ_f of the
    joint's points, weighted mean in `mean_damage` · opening, sliding [m] means · mode_mix: share of shear in the
    effective opening, 0 (opening) .. 1 (shear), frozen at failure · stored, dissipated, damped [J]
    failure_time [s], nan while alive · intact: nothing broken · alive: still carries tension
    """

    a: Array
    b: Array
    face_a: Array
    face_b: Array
    area: Array
    centre: Array
    normal: Array
    damage: Array
    mean_damage: Array
    opening: Array
    sliding: Array
    mode_mix: Array
    stored: Array
    dissipated: Array
    damped: Array
    failure_time: Array
    alive: Array

    def __len__(self) -> int:
        return len(self.a)


class Joints:
    """Geometry (constant), history λ of every point, and which joints are alive.

    faces: from `touching_faces` (coordinates of the scene) · parameters: one law for all joints
    """

    def __init__(self, blocks: list[Block], faces: list[TouchingFaces], parameters: JointParameters):
        self.parameters = parameters
        self.kernels = kernels_of(parameters.law, parameters.mixed_mode)
        n = len(faces)
        self.a = np.array([f.a for f in faces], np.int64)
        self.b = np.array([max(f.b, -1) for f in faces], np.int64)
        self.plane = np.array([-1 - f.b for f in faces], np.int64)
        """Number of the fixed plane where b = -1."""
        self.face_a = np.array([f.face_a for f in faces], np.int64)
        self.face_b = np.array([f.face_b for f in faces], np.int64)
        rules = [gauss_points(f.polygon, parameters.rule) for f in faces]
        self.start = np.concatenate([[0], np.cumsum([len(w) for _, w in rules])]).astype(np.int64)
        self.weight = np.concatenate([w for _, w in rules]) if n else np.zeros(0)
        place = np.concatenate([p for p, _ in rules]) if n else np.zeros((0, 3))
        self.joint_of = np.repeat(np.arange(n), np.diff(self.start))
        self.area = np.bincount(self.joint_of, self.weight, minlength=n)
        centre = np.array([b.centre for b in blocks]).reshape(-1, 3)
        R = np.array([b.rotation for b in blocks]).reshape(-1, 3, 3)
        corners = np.concatenate([f.polygon for f in faces]) if n else np.zeros((0, 3))
        self.corner_start = np.concatenate([[0], np.cumsum([len(f.polygon) for f in faces])]).astype(np.int64)
        self._corner_of = np.repeat(np.arange(n), np.diff(self.corner_start))
        self._corner = to_body(corners, self.a[self._corner_of], centre, R)
        self.xi_a = to_body(place, self.a[self.joint_of], centre, R)
        self.xi_b = to_body(place, self.b[self.joint_of], centre, R)
        normal = np.array([f.normal for f in faces]).reshape(-1, 3)
        self.normal = np.einsum("nji,nj->ni", R[self.a], normal) if n else np.zeros((0, 3))
        self.k0 = np.full(n, parameters.stiffness)
        self.df = np.full(n, parameters.opening_at_failure)
        self.beta = np.full(n, parameters.shear_ratio)
        self.kc = np.full(n, parameters.closing_stiffness)
        unit = np.full(n, parameters.strength / parameters.opening_at_failure)
        self.law = np.stack([unit, self.df, self.beta, self.kc, self.k0], axis=1)
        """Columns as in `joint_forces`."""
        self.eta = 0.0
        """Time constant of the stiffness-proportional dashpot [s]."""
        self.stiffness_on: tuple[Array, Array] | None = None
        """What each joint adds to the stiffness of its blocks (J, 6, 6), kept by `timestep.joint_frequency`."""
        self.alive = np.ones(n, bool)
        self.live = np.arange(n)
        self.largest = np.zeros(len(self.weight))
        self.paid = np.zeros((len(self.weight), 2))
        self.paid[:, PULL] = NOT_GROWING
        self.damped = np.zeros(n)
        """Energy that the dashpots of each joint have taken [J]."""
        self.failure_time = np.full(n, np.nan)
        self.final_openings = np.zeros((n, 3))

    def __len__(self) -> int:
        return len(self.a)

    def forces(self, x, v, R, F, dt: float = 0.0, advance: bool = False, eta: float | None = None) -> float:
        """Add the joint forces on the blocks to F (n, 6); see `joint_forces.joint_forces`."""
        return self.kernels.joint_forces(
            *self._arrays(), self.paid, self.eta if eta is None else eta, x, v, R, dt, advance, F, self.damped
        )

    def _arrays(self) -> tuple:
        """What the kernels of the law read of the live joints, in their order."""
        return (
            self.live, self.a, self.b, self.start, self.xi_a, self.xi_b, self.weight, self.normal, self.law,
            self.parameters.peak_share, self.largest,
        )  # fmt: skip

    def stored_between(self, x: Array, R: Array, x0: Array, R0: Array) -> Array:
        """Elastic energy of each joint between two places of the blocks, (J,) [J]."""
        out = np.zeros(len(self))
        self.kernels.stored_between(*self._arrays(), x, R, x0, R0, out)
        return out

    def lost(self) -> Array:
        """Energy that the damage of each joint stands for by its law, G_c A once it has failed, (J,) [J]."""
        out = np.empty(len(self))
        self.kernels.lost(self.start, self.weight, self.law, self.parameters.peak_share, self.largest, out)
        return out

    def of_points(self, index: Array) -> tuple:
        """What the kernels of single points read of the points `index`, in their order."""
        return (
            index, self.joint_of, self.a, self.b, self.xi_a, self.xi_b, self.normal, self.law,
            self.parameters.peak_share, self.largest,
        )  # fmt: skip

    def broken_now(self) -> Array:
        """Live joints that have failed since the last call of `retire`."""
        return self.live[kernel.broken(self.live, self.start, self.largest, self.df)]

    def retire(self, joints: Array, x: Array, R: Array, time: float) -> None:
        """Take failed joints out: they have dissipated G_c A and cost nothing from now on."""
        self.final_openings[joints] = self.openings(joints, x, R)
        self.alive[joints] = False
        self.failure_time[joints] = time
        self.live = self.live[self.alive[self.live]]

    def joined_pairs(self, n: int) -> Array:
        """Pairs of bodies (p, 2) with a live joint; fixed planes are bodies n, n + 1, ..."""
        return np.stack([self.a[self.live], np.where(self.b < 0, n + self.plane, self.b)[self.live]], axis=1)

    def openings(self, joints: Array, x: Array, R: Array) -> Array:
        """Mean normal opening, mean sliding, largest normal opening of the points of `joints`, (len, 3) [m]."""
        out = np.zeros((len(self), 3))
        kernel.joint_openings(
            np.asarray(joints),
            self.a,
            self.b,
            self.start,
            self.xi_a,
            self.xi_b,
            self.weight,
            self.normal,
            x,
            R,
            out,
        )
        return out[joints]

    def sealed_faces(self, x: Array, R: Array) -> tuple[Array, Array, Array]:
        """Both faces of each live joint: block (m,), face (m,), half of the joint's largest opening (m,) [m]."""
        live = self.live
        half = 0.5 * self.openings(live, x, R)[:, 2]
        inner = self.b[live] >= 0
        return (
            np.concatenate([self.a[live], self.b[live][inner]]),
            np.concatenate([self.face_a[live], self.face_b[live][inner]]),
            np.concatenate([half, half[inner]]),
        )

    def rows(self) -> Array:
        """Blocks with a live joint, sorted."""
        ends = np.concatenate([self.a[self.live], self.b[self.live]])
        return np.unique(ends[ends >= 0])

    def damaged_blocks(self, n: int) -> Array:
        """(n,) bool: blocks that have lost a joint, or never had one."""
        loose = np.ones(n, bool)
        loose[self.a] = False
        loose[self.b[self.b >= 0]] = False
        dead = ~self.alive
        loose[self.a[dead]] = True
        loose[self.b[dead & (self.b >= 0)]] = True
        return loose

    def table(self, x: Array, R: Array) -> JointTable:
        """The joints now. x (n, 3), R (n, 3, 3): places of the blocks."""
        opening = self.final_openings.copy()
        opening[self.live] = self.openings(self.live, x, R)
        ratio = np.minimum(self.largest / self.df[self.joint_of], 1.0)
        damage = np.zeros(len(self))
        np.maximum.at(damage, self.joint_of, ratio)
        mean = np.bincount(self.joint_of, ratio * self.weight, minlength=len(self)) / self.area
        centre = x[self.a] + np.einsum("nij,nj->ni", R[self.a], self._centre_in_a())
        normal = np.einsum("nij,nj->ni", R[self.a], self.normal)
        shear = self.beta * opening[:, 1]
        effective = np.hypot(np.maximum(opening[:, 0], 0.0), shear)
        mix = np.divide(shear, effective, out=np.zeros(len(self)), where=effective > 0.0)
        return JointTable(
            self.a, self.b, self.face_a, self.face_b, self.area, centre, normal, damage, mean, opening[:, 0],
            opening[:, 1], mix, self.stored_between(x, R, x, R), self.lost(), self.damped.copy(),
            self.failure_time.copy(), self.alive.copy(),
        )  # fmt: skip

    def corners(self, x: Array, R: Array) -> Array:
        """Corners of the joined faces (c, 3) [m] where block a is, those of joint j from corner_start[j]."""
        a = self.a[self._corner_of]
        return x[a] + np.einsum("nij,nj->ni", R[a], self._corner)

    def _centre_in_a(self) -> Array:
        weighted = self.xi_a * self.weight[:, None]
        return (
            np.stack([np.bincount(self.joint_of, w, len(self)) for w in weighted.T], 1) / self.area[:, None]
        )

    def history(self) -> dict[str, Array]:
        """Copies of everything that changes in time, for `restore`."""
        names = ("alive", "live", "largest", "paid", "damped", "failure_time", "final_openings")
        return {name: getattr(self, name).copy() for name in names}

    def restore(self, history: dict[str, Array]) -> None:
        """Back to a `history`."""
        for name, value in history.items():
            setattr(self, name, value.copy())
