"""The contacts there are now, as arrays; their forces and springs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Array
from yade_scripts.blocks.tangent import Springs
from yade_scripts.contact.arrays import Rows, empty_rows

SLIPS = 1.0 - 1e-9
"""Share of μ F_n from which a contact counts as sliding."""


@dataclass(frozen=True, kw_only=True)
class Contacts:
    """c node contacts. a, b (c,) rows · point, shear_point (c, 3) [m]: where they push and rub · normal (c, 3) from a
    to b

    depth (c,) [m] · kn, ks [N/m] · cn, cs [N s/m], cs zero while it slides · mu · normal_force (with dashpot),
    shear_force (without) (c, 3) [N] on b · shear_energy (c,) [J], half a substep ago. a is the block of the node, b
    that of the face or -1 for a fixed plane.
    """

    a: Array
    b: Array
    point: Array
    shear_point: Array
    normal: Array
    depth: Array
    kn: Array
    ks: Array
    cn: Array
    cs: Array
    mu: Array
    normal_force: Array
    shear_force: Array
    shear_energy: Array

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
        viscous = np.where(self.slides, 0.0, self.cs)[:, None] * self._sliding_velocity(v, x)
        return self.normal_force + self.shear_force + viscous

    def _sliding_velocity(self, v: Array, x: Array) -> Array:
        """Velocity of a against b along the face where they rub (c, 3) [m/s]."""
        w = point_velocities(self.a, self.shear_point, v, x) - point_velocities(
            self.b, self.shear_point, v, x
        )
        return w - np.einsum("ci,ci->c", w, self.normal)[:, None] * self.normal

    def keeps_sliding(self, v: Array, x: Array, dt: float) -> Array:
        """(c,) bool: contacts whose spring would pull more than friction allows after a substep of dt [s] at the block
        velocities v (n, 6). One that slides has the friction of the substep that ended: where the normal force has
        grown since then, by however little, it is below what friction allows now."""
        limit = self.mu * np.linalg.norm(self.normal_force, axis=1)
        pull = self.shear_force + dt * self.ks[:, None] * self._sliding_velocity(v, x)
        return self.slides | (np.linalg.norm(pull, axis=1) >= SLIPS * limit)

    def closing_velocity(self, v: Array, x: Array) -> Array:
        """Velocity of a against b at the contact point (c, 3) [m/s]; v (n, 6), x (n, 3)."""
        return point_velocities(self.a, self.point, v, x) - point_velocities(self.b, self.point, v, x)

    def springs(self, v: Array, x: Array, dt: float) -> Springs:
        """Secant springs and dashpots; a contact that keeps sliding in a substep of dt [s] has no tangential ones."""
        sticks, none = ~self.keeps_sliding(v, x, dt), np.zeros(len(self))
        return self.pushing_springs(x).and_(
            self._springs_at(self.shear_point, x, none, self.ks * sticks, none, self.cs * sticks)
        )

    def pushing_springs(self, x: Array) -> Springs:
        """Their part along the normals."""
        none = np.zeros(len(self))
        return self._springs_at(self.point, x, self.kn, none, self.cn, none)

    def _springs_at(self, point, x, kn, kt, cn, ct) -> Springs:
        """`assemble` reads -1 as the fixed world; its arm is not used there."""
        return Springs(
            a=self.a,
            b=self.b,
            arm_a=point - x[self.a],
            arm_b=point - x[self.b],
            normal=self.normal,
            kn=kn,
            kt=kt,
            cn=cn,
            ct=ct,
        )


def point_velocities(row: Array, point: Array, v: Array, x: Array) -> Array:
    """v + ω x (point - centre) of body points (c, 3), zero for row < 0."""
    u = v[row, :3] + np.cross(v[row, 3:], point - x[row])
    u[row < 0] = 0.0
    return u


def sum_on_blocks(contacts: Contacts, force: Array, x: Array) -> Array:
    """Force and moment (n, 6) on the blocks from contact forces on b (c, 3)."""
    total, n = np.zeros((len(x), 6)), contacts.normal
    normal = np.einsum("ci,ci->c", force, n)[:, None] * n
    for point, part in ((contacts.point, normal), (contacts.shear_point, force - normal)):
        for row, sign in ((contacts.a, -1.0), (contacts.b, 1.0)):
            on = row >= 0
            f = sign * part[on]
            np.add.at(total, row[on], np.concatenate([f, np.cross(point[on] - x[row[on]], f)], axis=1))
    return total


def contacts_of_rows(rows: Rows, count: int, n: int) -> Contacts:
    """Copies of the first `count` contacts of a kernel, the first n bodies being blocks."""
    r = Rows(*(array[:count].copy() for array in rows))
    on_face = r.b < n
    normal_force = np.einsum("ci,ci->c", r.force, r.normal)
    return Contacts(
        a=r.a,
        b=np.where(on_face, r.b, -1),
        point=r.point,
        shear_point=r.point + r.shift,
        normal=-r.normal,
        depth=r.depth,
        kn=r.kn,
        ks=r.kt,
        cn=r.cn,
        cs=r.ct,
        mu=r.mu,
        normal_force=-normal_force[:, None] * r.normal,
        shear_force=-r.shear,
        shear_energy=r.held,
    )


def no_contacts() -> Contacts:
    """Those of a scene without contact."""
    return contacts_of_rows(empty_rows(0), 0, 0)
