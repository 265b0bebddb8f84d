"""The contacts that YADE holds now, as arrays; their energies, forces and springs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from yade_scripts.scene import Scene
from yade_scripts.tangent import Springs

Array = np.ndarray

SLIPS = 1.0 - 1e-9
"""Share of μ F_n from which a contact counts as sliding."""


@dataclass(frozen=True)
class Contacts:
    """c node contacts. a, b (c,) rows (-1: fixed plane) · point (c, 3) [m] · normal (c, 3) from a to b

    depth (c,) [m] · kn, ks [N/m] · cn, cs [N s/m] · mu · normal_force, shear_force (c, 3) [N] as YADE keeps them
    (acting on b; the shear force without its dashpot) · key (c,): number of the pair of bodies, lasts with the contact.
    """

    a: Array
    b: Array
    point: Array
    normal: Array
    depth: Array
    kn: Array
    ks: Array
    cn: Array
    cs: Array
    mu: Array
    normal_force: Array
    shear_force: Array
    key: Array

    def __len__(self) -> int:
        return len(self.a)

    @property
    def slides(self) -> Array:
        """(c,) bool"""
        limit = self.mu * np.linalg.norm(self.normal_force, axis=1)
        return np.linalg.norm(self.shear_force, axis=1) >= SLIPS * limit

    def elastic_forces(self) -> Array:
        """Force on b without dashpots: k_n depth n + shear spring (c, 3) [N]."""
        return self.kn[:, None] * np.maximum(self.depth, 0.0)[:, None] * self.normal + self.shear_force

    def forces(self, v: Array, x: Array) -> Array:
        """Whole force on b (c, 3) [N] at block velocities v (n, 6): with the dashpots, as the law applies it."""
        w = self.closing_velocity(v, x)
        ws = w - np.einsum("ci,ci->c", w, self.normal)[:, None] * self.normal
        viscous = np.where(self.slides, 0.0, self.cs)[:, None] * ws
        return self.normal_force + self.shear_force + viscous

    def closing_velocity(self, v: Array, x: Array) -> Array:
        """Velocity of a against b at the contact point (c, 3) [m/s]; v (n, 6), x (n, 3)."""
        return point_velocities(self.a, self.point, v, x) - point_velocities(self.b, self.point, v, x)

    def springs(self, x: Array) -> Springs:
        """Secant springs and dashpots; a sliding contact has no tangential ones."""
        sticks = ~self.slides
        arm_a, arm_b = self.point - x[self.a], self.point - x[self.b]
        # `assemble` reads -1 as the fixed world; its arm is not used there.
        return Springs(
            self.a, self.b, arm_a, arm_b, self.normal, self.kn, self.ks * sticks, self.cn, self.cs * sticks
        )


def point_velocities(row: Array, point: Array, v: Array, x: Array) -> Array:
    """v + ω x (point - centre) of body points (c, 3), zero for row < 0."""
    u = v[row, :3] + np.cross(v[row, 3:], point - x[row])
    u[row < 0] = 0.0
    return u


def sum_on_blocks(contacts: Contacts, force: Array, x: Array) -> Array:
    """Force and moment (n, 6) on the blocks from contact forces on b (c, 3)."""
    total = np.zeros((len(x), 6))
    for row, sign in ((contacts.a, -1.0), (contacts.b, 1.0)):
        on = row >= 0
        f = sign * force[on]
        np.add.at(total, row[on], np.concatenate([f, np.cross(contacts.point[on] - x[row[on]], f)], axis=1))
    return total


def read_contacts(scene: Scene) -> Contacts:
    """Everything YADE knows about its real interactions: one pass in Python, the only one."""
    found = scene.contacts()
    row_of = scene.row_of
    geom = [i.geom for i in found]
    phys = [i.phys for i in found]
    ids = np.array([(i.id1, i.id2) for i in found], np.int64).reshape(-1, 2)
    a = np.array([row_of[i] for i in ids[:, 0].tolist()], np.int64)
    b = np.array([row_of[i] for i in ids[:, 1].tolist()], np.int64)
    scalars = np.array([(p.kn, p.ks, p.cn, p.cs, p.tangensOfFrictionAngle) for p in phys]).reshape(-1, 5).T
    return Contacts(
        np.where(a < 0, -1, a),
        np.where(b < 0, -1, b),
        _vectors([g.contactPoint for g in geom]),
        _vectors([g.normal for g in geom]),
        np.array([g.penetrationDepth for g in geom], float),
        *scalars.copy(),
        _vectors([p.normalForce for p in phys]),
        _vectors([p.shearForce for p in phys]),
        (ids[:, 0] << 32) + ids[:, 1],
    )


def _vectors(items: list) -> Array:
    return np.array([(v[0], v[1], v[2]) for v in items], float).reshape(-1, 3)
