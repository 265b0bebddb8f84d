"""Arrays for the loops over contact nodes: blocks, pairs, the history of nodes, and the contacts of an evaluation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Array

BEGINS = -1.0
"""In place of the last normal force of a contact that has not pushed yet."""
ROOM = 31
"""Nodes of a block that a pair can list as near the faces of the other, of up to 256 that it has."""
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
    whole: whether a face has the stiffness K wherever the smaller of two faces lies wholly on the other; otherwise K is
    proportional to the area in contact.
    """

    shear: float
    zeta: float
    zeta_t: float
    friction: Array
    whole: bool


class Kinematics(NamedTuple):
    """Bodies at the time of an evaluation: x (n, 3) [m] centres · v (n, 6) [m/s, rad/s] before the substep to come ·
    R (n, 3, 3) from the frame of the body · dt [s]: that substep, 0: the contacts are only read · last_dt [s]: the
    substep that led here."""

    x: Array
    v: Array
    R: Array
    dt: float
    last_dt: float


class Direction(NamedTuple):
    """One direction of a pair: the nodes or edges of body a against the faces or edges of body b.

    begins: whether contacts may begin here; they may not where those of the present places are known already ·
    whole: whether they begin with the whole present depth, not from it on."""

    a: int
    b: int
    begins: bool
    whole: bool


class Faces(NamedTuple):
    """Faces of b in the frame of a: planes (.., 4), of which the first `used` count: the depth of a point ξ
    behind face g is planes[g, 3] - planes[g, :3]·ξ · farthest: the face before which the nodes of a lie farthest out ·
    margin [m] by which a node may lie beside a face."""

    planes: Array
    used: int
    farthest: int
    margin: float


class Pairs(NamedTuple):
    """a < b (p,) bodies; b may be a plane · start (p+1,) first slot: the nodes of a, those of b, then
    `CROSSINGS` for edges that cross

    force (p,) [N]: normal force of the joint that held the two bodies until now, with which a new contact begins; 0: it
    begins without force, inf: with the force of its whole depth · held (p,) [J]: energy of the springs of that joint ·
    touching (p,) bool: the pair had contacts at the last evaluation · calm (p,) [m]: relative motion below which the
    two cannot touch or, where they touch, below which the outermost edges need not be sought again · overlap (p,) [m]:
    smallest displacement that separates them, zero if they are apart · found (p,) bool: the contacts at the present
    positions are known. Contacts begin and end once for each position, however often they are evaluated there ·
    near (p, 2, 1 + ROOM) bytes: how many nodes of a, and of b, may come into contact before the two have moved by
    left (p,) [m] against each other, and which, counted from the first node of the block; more than ROOM: not known.
    """

    a: Array
    b: Array
    start: Array
    force: Array
    held: Array
    touching: Array
    calm: Array
    overlap: Array
    found: Array
    near: Array
    left: Array


class Parted(NamedTuple):
    """What joints that have just failed hand over to contact: pairs (k, 2) of bodies, normal force (k,) [N] under which
    each was compressed, energy (k,) [J] in its springs."""

    pairs: Array
    force: Array
    energy: Array


class Slots(NamedTuple):
    """History of the contact of each node with the other body of its pair.

    face (s,): the face in contact, -1 without contact; for edges the number of the pair of edges · k (s,) [N/m]:
    stiffness · rest (s,) [m]: depth at which the contact began · shear (s, 3) [N]: elastic shear force on the block of
    the node, in the frame of the block of the face · spread (s,): distance of the point where friction acts from the
    middle of the contacts of the pair, over that of the node · push (s,) [N]: normal force in the last substep,
    `BEGINS` if there was none · speed (s,) [m/s]: closing speed in the last substep.
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
        """The history of `size` nodes without contact, of which nothing but `face` is filled. What is known of a node
        lies in one line of the cache."""
        table = np.empty((size, 8))
        k, rest, spread, push, speed = table[:, :5].T
        return cls(np.full(size, -1, np.int64), k, rest, table[:, 5:], spread, push, speed)


class Rows(NamedTuple):
    """The contacts of one evaluation, one row each: a: block of the node · b: block of the face · slot: its history.

    point, normal (out of b) (c, 3) · depth [m] · kn, kt, cn, ct · mu · force, viscous, shear (c, 3) on a
    push (c,) [N]: mean normal force over the substep · arm_a, arm_b (c, 3) [m] · shift (c, 3) [m]: from the contact
    point to the point where friction acts · velocity (c, 3) [m/s]: of a relative to b before the substep · held (c,)
    [J]: energy of the shear spring at the time of that velocity."""

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
    """Uninitialised rows for up to `size` contacts; what belongs to a contact lies together."""
    table = np.empty((size, 40))
    a, b, slot = table[:, :3].view(np.int64).T
    depth, kn, kt, cn, ct, mu, push, held = table[:, 3:11].T
    point, normal, force, viscous, shear, arm_a, arm_b, shift, velocity = (
        table[:, at : at + 3] for at in range(11, 38, 3)
    )
    return Rows(
        a, b, slot, point, normal, depth, kn, kt, cn, ct, mu, push, force, viscous, shear, arm_a, arm_b, shift,
        velocity, held,
    )  # fmt: skip
