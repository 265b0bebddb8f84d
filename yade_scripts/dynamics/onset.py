"""Which blocks are loose and therefore have contacts.

Two blocks with a live joint have no contact: the joint carries compression too. When it fails, contact continues with
the present depth. Other pairs can have contact as soon as one of the two is loose: it has lost a joint, moves freely,
rests on another without a joint (`joints.pair`), or has left its initial position. Most of a building therefore needs
no contact search before it is hit. All blocks can touch fixed planes."""

from __future__ import annotations

import numpy as np

from array_types import Array
from yade_scripts.blocks.block import Block
from yade_scripts.contact.arrays import Parted
from yade_scripts.contact.forces import ContactForces
from yade_scripts.joints.joints import Joints
from yade_scripts.yade_side.motion import Motion
from yade_scripts.yade_side.scene import Scene

STANDS = 0.02
"""A joined block counts as at rest as long as it has moved less than this share of its radius."""
NONE = np.zeros(0, np.int64)


def loose_at_start(blocks: list[Block], joints: Joints | None) -> Array:
    """(n,) bool: blocks without joints, and blocks that move."""
    loose = np.ones(len(blocks), bool) if joints is None else joints.damaged_blocks(len(blocks))
    return loose | np.array([moves(b) for b in blocks], bool)


def moves(block: Block) -> bool:
    """Whether the block moves at the start."""
    return bool(block.velocity.any() or block.spin.any())


class ContactOnset:
    """Keeps the search for neighbours and the contacts in step with the state of the joints.

    radius (n,) [m] · loose (n,) bool at the start · contacts: None in a scene without contact.
    """

    def __init__(
        self,
        scene: Scene,
        motion: Motion,
        joints: Joints | None,
        contacts: ContactForces | None,
        radius: Array,
        loose: Array,
    ):
        self._scene, self._motion, self._joints, self._contacts = scene, motion, joints, contacts
        self._radius = radius
        self.loose = np.zeros(len(loose), bool)
        self.rest_here()
        self.leave_out_joined()
        self.loosen(np.flatnonzero(loose), as_deep=True)

    def rest_here(self) -> None:
        """Take the present positions as the positions of rest."""
        self._x_rest, self._R_rest = self._motion.x.copy(), self._motion.R.copy()

    def moved(self) -> Array:
        """Rows that were not loose and have left their position: intact pieces of a broken wall meet the ground too."""
        if self.loose.all():
            return NONE
        turned = np.abs(self._motion.R - self._R_rest).max(axis=(1, 2)) * self._radius
        moved = np.linalg.norm(self._motion.x - self._x_rest, axis=1) + turned
        return np.flatnonzero(~self.loose & (moved > STANDS * self._radius))

    def of_failed(self, joints: Array) -> Array:
        """Rows that were not loose and have just lost one of `joints`."""
        assert self._joints is not None  # one of them failed
        ends = np.concatenate([self._joints.a[joints], self._joints.b[joints]])
        ends = np.unique(ends[ends >= 0])
        return ends[~self.loose[ends]]

    def leave_out_joined(self, failed: Parted | None = None) -> None:
        """Exclude pairs with a live joint, which carries compression itself, from contact; joints that have just
        `failed` give way to it."""
        if self._contacts is not None and self._joints is not None:
            self._contacts.leave_out(self._joints.pairs(self._joints.live, len(self.loose)), failed)

    def loosen(self, rows: Array, as_deep: bool = False) -> None:
        """Let the blocks `rows` have contacts with all others from now on; as_deep: with their full present
        overlaps."""
        self.loose[rows] = True
        if self._contacts is not None and (len(rows) or as_deep):
            self._scene.set_loose(self.loose)
            self._contacts.switch_on(rows, as_deep)

    def save(self) -> dict[str, Array]:
        """Which blocks are loose, and the positions of rest of the others."""
        return {"loose": self.loose.copy(), "x_rest": self._x_rest.copy(), "R_rest": self._R_rest.copy()}

    def restore(self, saved: dict[str, Array]) -> None:
        """Return to a saved state; contacts restore their own."""
        self.loose[:] = saved["loose"]
        self._x_rest, self._R_rest = saved["x_rest"].copy(), saved["R_rest"].copy()
        if self._contacts is not None:
            self._scene.set_loose(self.loose)
