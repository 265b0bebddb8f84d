"""Work of the contacts, counted contact by contact in every substep.

YADE keeps no account for its spring-dashpot-slider law. After its contact forces are known, each contact's force on b
and the part that is dashpot are noted; when the substep has ended, the velocities before and after are known and

    work = F·(w⁻ + w⁺)/2 dt,   w: velocity of a against b at the contact point

is what the contact took from the blocks: the leapfrog's exact change of kinetic energy, turned axes apart.
"""

from __future__ import annotations

import numpy as np

from yade_scripts.contact_state import Contacts, read_contacts, sum_on_blocks
from yade_scripts.scene import Scene

Array = np.ndarray


class ContactWork:
    """Running sums [J]: `total` work that contacts took, `dashpot` and `friction` of it, `driving` from driven blocks.

    friction: force times slip (trial - kept)/k_s, with trial = last force + k_s w_t dt, and what is left in the
    tangential springs of contacts that open.
    """

    def __init__(self, scene: Scene):
        self.scene = scene
        self.total = self.dashpot = self.friction = self.driving = 0.0
        self._noted: tuple | None = None
        self._springs = (np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0))

    def take(self, v: Array, x: Array, dt: float) -> None:
        """Note the contacts of the running substep, before it moves the blocks."""
        contacts = read_contacts(self.scene)
        w = contacts.closing_velocity(v, x)
        self._slide(contacts, w, dt)
        if len(contacts):
            force = contacts.forces(v, x)
            self._noted = (contacts, force, force - contacts.elastic_forces(), w, x.copy(), dt)

    def _slide(self, contacts: Contacts, w: Array, dt: float) -> None:
        keys, last, last_ks = self._springs
        before = np.zeros((len(contacts), 3))
        spot = np.searchsorted(keys, contacts.key)
        known = spot < len(keys)
        known[known] = keys[spot[known]] == contacts.key[known]
        before[known] = last[spot[known]]
        tangential = w - np.einsum("ci,ci->c", w, contacts.normal)[:, None] * contacts.normal
        trial = before + dt * contacts.ks[:, None] * tangential
        slip = (trial - contacts.shear_force) / contacts.ks[:, None]
        work = np.einsum("ci,ci->c", contacts.shear_force, slip)
        self.friction += float(np.sum(work[contacts.slides]))
        gone = np.isin(keys, contacts.key, invert=True)
        self.friction += 0.5 * float(np.sum((last[gone] ** 2).sum(axis=1) / last_ks[gone]))
        order = np.argsort(contacts.key)
        self._springs = (contacts.key[order], contacts.shear_force[order], contacts.ks[order])

    def settle(self, v: Array) -> None:
        """Add the work of the noted contacts, the substep's end velocities v (n, 6) being known."""
        if self._noted is None:
            return
        contacts, force, viscous, w_before, x, dt = self._noted
        self._noted = None
        w = 0.5 * (w_before + contacts.closing_velocity(v, x))
        self.total += dt * float(np.sum(force * w))
        self.dashpot += dt * float(np.sum(viscous * w))
        self.driving += dt * self._on_driven(contacts, force, v, x)

    def sums(self) -> tuple:
        """What `restore` needs."""
        return (self.total, self.dashpot, self.friction, self.driving, self._springs)

    def restore(self, sums: tuple) -> None:
        """Back to earlier sums."""
        self.total, self.dashpot, self.friction, self.driving, self._springs = sums
        self._noted = None

    def _on_driven(self, contacts: Contacts, force: Array, v: Array, x: Array) -> float:
        """Power that driven blocks put into their contacts [W]."""
        driven = ~self.scene.moving
        if not driven.any():
            return 0.0
        on_blocks = sum_on_blocks(contacts, force, x)
        return -float(np.sum(on_blocks[driven] * v[driven]))
