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
    """Running sums: `total` work that contacts took [J], `dashpot` of it in dashpots, `driving` on driven blocks."""

    def __init__(self, scene: Scene):
        self.scene = scene
        self.total = self.dashpot = self.driving = 0.0
        self._noted: tuple | None = None

    def take(self, v: Array, x: Array, dt: float) -> None:
        """Note the contacts of the running substep, before it moves the blocks."""
        contacts = read_contacts(self.scene)
        if len(contacts):
            force = contacts.forces(v, x)
            self._noted = (
                contacts,
                force,
                force - contacts.elastic_forces(),
                contacts.closing_velocity(v, x),
                x.copy(),
                dt,
            )

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

    def _on_driven(self, contacts: Contacts, force: Array, v: Array, x: Array) -> float:
        """Power that driven blocks put into their contacts [W]."""
        driven = ~self.scene.moving
        if not driven.any():
            return 0.0
        on_blocks = sum_on_blocks(contacts, force, x)
        return -float(np.sum(on_blocks[driven] * v[driven]))
