"""What the loops over contact nodes work on: blocks, pairs, the memory of nodes, and the contacts of an evaluation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

Array = np.ndarray

BEGINS = -1.0
"""In place of the last normal force of a contact that has not pushed yet."""
CROSSINGS = 4
"""Edges of a block that may cross edges of another at a time: the corners of beams that lie on one another."""


class Bodies(NamedTuple):
    """Blocks and planes: inverse_mass (n,) [1/kg], inverse_inertia (n, 3, 3) body frame, zero where motion is given.

    stiffness (n,) K of a face [N/m], inf for planes · material (n,) rows of `Law.friction`.
    """

    inverse_mass: Array
    inverse_inertia: Array
    stiffness: Array
    material: Array


class Law(NamedTuple):
    """shear: k_t/k_n · zeta, zeta_t: damping ratios (zeta_t < 0: c_t = sqrt(shear) c_n) · friction (m, m) μ
    whole: K is that of two faces of which the smaller lies on the other, whatever its size; else it goes with the area.
    """

    shear: float
    zeta: float
    zeta_t: float
    friction: Array
    whole: bool


class Pairs(NamedTuple):
    """a < b (p,) bodies; b may be a plane · start (p+1,) first slot: the nodes of a, those of b, then
    `CROSSINGS` for edges that cross

    fresh (p,): contact begins with the depth there is, what held the two until now having this share of its stiffness;
    0: it does not · touching (p,) bool: had contacts last time · calm (p,) [m]: way that the two must move before they
    can touch · overlap (p,) [m]: way that parts them, zero if they are apart · found (p,) bool: its contacts at the
    present places are known; contacts begin and end once for each place, however often they are read there.
    """

    a: Array
    b: Array
    start: Array
    fresh: Array
    touching: Array
    calm: Array
    overlap: Array
    found: Array


class Slots(NamedTuple):
    """What a node remembers of its contact with the other body of the pair: face (s,) or -1 (of edges: the number of
    their pair), k (s,) [N/m],

    rest (s,) [m]: depth at which it began · shear (s, 3) [N] on the node's block, in the frame of the face's
    spread (s,): how much nearer to the middle of the contacts of its pair it rubs · push (s,) [N]: normal force of
    the substep before, `BEGINS` in none · speed (s,) [m/s] at which it closed then.
    """

    face: Array
    k: Array
    rest: Array
    shear: Array
    spread: Array
    push: Array
    speed: Array

    @classmethod
    def empty(cls, size: int) -> Slots:
        """Nodes without a contact."""
        rest, k, spread, push, speed = (np.zeros(size) for _ in range(5))
        return cls(np.full(size, -1, np.int64), k, rest, np.zeros((size, 3)), spread, push, speed)


class Rows(NamedTuple):
    """The contacts of one evaluation, one row each: a block of the node, b of the face; slot.

    point, normal (out of b) (c, 3) · depth [m] · kn, kt, cn, ct · mu · force, viscous, shear (c, 3) on a
    push (c,) [N]: mean normal force over the substep · arm_a, arm_b (c, 3) [m] · shift (c, 3) [m]: from there to where
    it rubs · velocity (c, 3): of a against b before the substep · held (c,) [J]: energy of the shear spring at the
    time of that velocity.
    """

    a: Array
    b: Array
    slot: Array
    point: Array
    normal: Array
    depth: Array
    kn: Array
    kt: Array
    cn: Array
    ct: Array
    mu: Array
    push: Array
    force: Array
    viscous: Array
    shear: Array
    arm_a: Array
    arm_b: Array
    shift: Array
    velocity: Array
    held: Array


def empty_rows(size: int) -> Rows:
    """Room for `size` contacts."""
    whole, one, three = (np.zeros(size, np.int64) for _ in range(3)), (size,), (size, 3)
    scalars = [np.zeros(one) for _ in range(8)]
    vectors = [np.zeros(three) for _ in range(9)]
    return Rows(*whole, vectors[0], vectors[1], *scalars[:7], *vectors[2:], scalars[7])
