"""Contact between blocks, and of blocks with fixed planes: candidate pairs, history, forces and their work."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from array_types import Array
from kernels.ranges import alone
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import FixedPlane
from yade_scripts.contact.arrays import (
    CROSSINGS,
    ROOM,
    Bodies,
    Kinematics,
    Law,
    Pairs,
    Parted,
    Rows,
    Slots,
    empty_rows,
)
from yade_scripts.contact.ground import NO_GROUND, GroundSurface
from yade_scripts.contact.kernel import carry_slots, contact_forces
from yade_scripts.contact.law import ContactLaw
from yade_scripts.contact.nodes import contact_shapes
from yade_scripts.contact.search import fastest
from yade_scripts.contact.springs import contact_work
from yade_scripts.contact.state import Contacts, contacts_of_rows
from yade_scripts.yade_side.motion import Motion


class ContactForces:
    """Contacts between the blocks, and of the blocks with planes and ground.

    blocks, planes: in the coordinates of the scene · face_stiffness (n,) K [N/m] · neighbours(): the pairs (p, 2) of
    rows whose bounding boxes can meet while no point of a block moves by more than reach [m]; after that it is called
    again · free (n,) bool: motion not prescribed.

    Running sums [J]: dashpot and friction, the energy taken by dashpots, and by friction and springs of contacts that
    ended; driving, the energy put in by driven blocks.
    """

    _pairs: Pairs
    _rows: Rows

    def __init__(
        self,
        blocks: list[Block],
        planes: list[FixedPlane],
        law: ContactLaw,
        face_stiffness: Array,
        free: Array,
        motion: Motion,
        neighbours: Callable[[], Array],
        reach: float,
    ):
        self.share: Callable[..., list] = alone
        """As in `contact_forces`."""
        self._motion, self._neighbours, self._reach = motion, neighbours, reach
        self._planes = planes
        uneven = (p.as_row(row) for row, p in enumerate(planes, len(blocks)) if isinstance(p, GroundSurface))
        self._ground = next(uneven, NO_GROUND)
        self._n = len(blocks)
        self._shapes = contact_shapes(blocks, planes, law.nodes_per_edge)
        names = [b.material for b in blocks] + [p.material for p in planes]
        materials = sorted(set(names))
        rows = np.array([materials.index(name) for name in names], np.int64)
        self._bodies = _bodies(blocks, len(planes), face_stiffness, free, rows)
        self._law = Law(
            law.shear_ratio,
            law.damping_ratio,
            law.tangential_damping_ratio,
            law.friction_table(materials),
            law.stiffness is not None,
        )
        self._free = np.concatenate([free, np.zeros(len(planes), bool)])
        self._nodes = self._shapes.node_end - self._shapes.node_start
        self._on = np.zeros(self._n, bool)
        self._asleep = np.zeros(len(self._free), bool)
        self._boxes = np.zeros((0, 2, 3))
        self._comers = np.zeros((0, 2), np.int64)
        self._joined = np.zeros(0, np.int64)
        self._set_pairs(np.zeros((0, 2), np.int64))
        self._count = 0
        self._read: Contacts | None = None
        self._moved = 0.0
        self.dashpot = self.friction = self.driving = 0.0

    # ---- pairs ----------------------------------------------------------------------------------------------

    def switch_on(self, rows: Array, as_deep: bool = False) -> None:
        """Let these blocks have contacts from now on. as_deep: present overlaps count in full; otherwise depths are
        measured from the present ones."""
        self._on[rows] = True
        self.search(as_deep=as_deep)

    def leave_out(self, joined: Array, failed: Parted | None = None) -> None:
        """Exclude pairs (p, 2) that live joints hold, since these carry compression too. Pairs that were excluded
        before and are not now continue by contact, with the force of the joints that have `failed`."""
        keys = _once(self._key(*np.sort(joined, axis=1).T))
        parted = self._joined[~_among(self._joined, keys)]
        self._joined = keys
        if len(parted) and self._asleep.any():
            self.search()
        elif len(parted):
            self._add_pairs(parted)
        if failed is not None:
            self._take_over(failed)

    def _take_over(self, failed: Parted) -> None:
        """Have the contacts that begin where joints have failed take over their force. The energy of joints whose pair
        another joint still holds, or whose blocks are apart, is lost."""
        p, own = self._pairs, self._key(*np.sort(failed.pairs, axis=1).T)
        keys = self._key(p.a, p.b)
        found = _among(own, keys)
        at = np.searchsorted(keys, own[found])
        np.add.at(p.force, at, failed.force[found])
        np.add.at(p.held, at, failed.energy[found])
        self.friction += float(failed.energy[~found].sum())

    def search(self, as_deep: bool = False) -> None:
        """Find the candidate pairs at the present positions. as_deep: as in `switch_on`."""
        self._set_pairs(self._in_order(self._near()), as_deep)

    def _add_pairs(self, parted: Array) -> None:
        """Add the pairs (keys `parted`) that joints have held until now to the others, which the last search found for
        a while to come."""
        more = np.stack(np.divmod(parted, len(self._free)), axis=1)
        to_plane = more[:, 1] >= self._n
        on = to_plane | self._on[more[:, 0]] | self._on[np.where(to_plane, 0, more[:, 1])]
        more = more[on & self._free[more].any(axis=1)]
        now = np.stack([self._pairs.a, self._pairs.b], axis=1)
        self._set_pairs(self._in_order(np.concatenate([now, more])), searched=False)

    def _key(self, a: Array, b: Array) -> Array:
        return a * len(self._free) + b

    def _in_order(self, pairs: Array) -> Array:
        """Pairs (p, 2) with the smaller row first, sorted, each once."""
        keys = _once(self._key(*np.sort(pairs, axis=1).T))
        return np.stack(np.divmod(keys, len(self._free)), axis=1)

    def _near(self) -> Array:
        """Pairs that touch or may do so before the next search, (p, 2)."""
        near, self._moved = self._neighbours(), 0.0
        held = np.stack([self._pairs.a, self._pairs.b], axis=1)[self._pairs.touching]
        near = np.concatenate([near[self._on[near].any(axis=1)], self._near_planes(), held])
        near = np.sort(near[self._free[near].any(axis=1)], axis=1)
        if self._asleep.any():
            near = self._awake(near)
        return near[~_among(self._key(*near.T), self._joined)]

    def _awake(self, near: Array) -> Array:
        """The pairs in which a block can move, and those of sleeping blocks that press on planes. Blocks that may
        approach a sleeping group are recorded as well."""
        moves = self._free[: self._n] | self._motion.v.any(axis=1)
        on = np.flatnonzero(self._on & moves & ~self._asleep[: self._n])
        row, group = np.indices((len(on), len(self._boxes))).reshape(2, -1)
        comes = self._within(on[row], group, 2.0 * self._reach)
        self._comers = np.stack([on[row], group], axis=1)[comes]
        p = self._pairs
        pressed = self._key(p.a, p.b)[p.touching & (p.b >= self._n)]
        return near[(self._free & ~self._asleep)[near].any(axis=1) | _among(self._key(*near.T), pressed)]

    def _within(self, rows: Array, groups: Array, way: float) -> Array:
        """(k,) bool: whether the boxes around blocks `rows` (k,) are within `way` [m] of those of `groups` (k,)."""
        reach = self._shapes.radius[rows, None] + way
        x, boxes = self._motion.x[rows], self._boxes[groups]
        return np.all((x - reach <= boxes[:, 1]) & (x + reach >= boxes[:, 0]), axis=1)

    def approached_groups(self) -> Array:
        """(groups,) bool: sleeping groups of blocks that a loose body has approached."""
        rows, groups = self._comers.T
        found = np.zeros(len(self._boxes), bool)
        found[groups[self._within(rows, groups, self._reach)]] = True
        return found

    def set_asleep(self, asleep: Array, groups: list[Array]) -> None:
        """asleep (n,) bool: blocks that do not move from now on and have no contacts but those with planes that they
        touch; rows of each group of them."""
        self._asleep[: self._n] = asleep
        radius, x = self._shapes.radius[:, None], self._motion.x
        self._boxes = np.array(
            [[(x[g] - radius[g]).min(axis=0), (x[g] + radius[g]).max(axis=0)] for g in groups]
        ).reshape(-1, 2, 3)
        self._comers = np.zeros((0, 2), np.int64)
        self.search()

    def busy(self) -> Array:
        """(n,) bool: blocks that touch another one by contact, or have one near that can move too."""
        pairs, found = self._pairs, np.zeros(len(self._free), bool)
        near, both = (
            pairs.touching & (pairs.b < self._n),
            np.flatnonzero(self._free[pairs.a] & self._free[pairs.b]),
        )
        low, high = self._bounds()
        a, b = pairs.a[both], pairs.b[both]
        near[both] |= ((low[a] <= high[b]) & (high[a] >= low[b])).all(axis=1)
        found[pairs.a[near]] = found[pairs.b[near]] = True
        return found[: self._n]

    def _bounds(self) -> tuple[Array, Array]:
        """Lowest and highest corners (n, 3) of the boxes around the blocks, with the margins of their faces."""
        s, m = self._shapes, self._motion
        count = self._nodes[: self._n]
        first, of = np.cumsum(count) - count, np.repeat(np.arange(self._n), count)
        node = s.node[np.arange(len(of)) + (s.node_start[: self._n] - first)[of]]
        points = m.x[of] + np.einsum("kij,kj->ki", m.R[of], node)
        margin = s.margin[: self._n, None]
        return np.minimum.reduceat(points, first) - margin, np.maximum.reduceat(points, first) + margin

    def _near_planes(self) -> Array:
        """Pairs (k, 2) of a block and a plane that it may reach before the next search."""
        rows = np.arange(self._n)
        radius = self._shapes.radius[rows] + 2.0 * self._reach
        found = [np.zeros((0, 2), np.int64)]
        for number, plane in enumerate(self._planes):
            near = rows[plane.distance(self._motion.x[rows]) < radius]
            found.append(np.stack([near, np.full(len(near), self._n + number)], axis=1))
        return np.concatenate(found)

    def _set_pairs(self, pairs: Array, as_deep: bool = False, searched: bool = True) -> None:
        """Pairs (p, 2) in order; known pairs keep their history. as_deep: others begin with the whole present depth ·
        searched: the distance of pairs that do not touch is to be found anew."""
        a, b = pairs.T.copy()
        size = self._nodes[a] + self._nodes[b] + CROSSINGS
        start = np.concatenate([[0], np.cumsum(size)]).astype(np.int64)
        total = int(start[-1])
        slots = Slots.empty(total)
        known, touching, found = (np.zeros(len(a), bool) for _ in range(3))
        force, held, overlap, calm = (np.zeros(len(a)) for _ in range(4))
        if hasattr(self, "_pairs") and len(self._pairs.a):
            known, spot = self._carry(a, b, start, slots)
            for now, old in zip((force, held, touching, overlap, found, calm), self._remembered(searched)):
                now[known] = old[spot]
        if as_deep:
            force[~known] = np.inf
        near, left = np.empty((len(a), 2, 1 + ROOM), np.uint8), np.zeros(len(a))
        self._pairs = Pairs(a, b, start, force, held, touching, calm, overlap, found, near, left)
        self._slots = slots
        if not hasattr(self, "_rows") or len(self._rows.a) < total:
            self._rows = empty_rows(total + total // 4)

    def _remembered(self, searched: bool) -> tuple[Array, ...]:
        """The history of pairs that continue; after a search the distance of those that do not touch is found again."""
        p = self._pairs
        calm = np.where(p.touching, p.calm, 0.0) if searched else p.calm
        return p.force, p.held, p.touching, p.overlap, p.found, calm

    def _carry(self, a, b, start, slots: Slots) -> tuple[Array, Array]:
        """Copy the slots of pairs that were known before; (p,) bool, and which of the pairs before these are."""
        old = self._pairs
        old_keys, keys = self._key(old.a, old.b), self._key(a, b)
        spot = np.minimum(np.searchsorted(old_keys, keys), len(old_keys) - 1)
        known = old_keys[spot] == keys
        self.friction += carry_slots(
            old, self._slots, np.flatnonzero(known), spot[known], start, slots, self._law.shear
        )
        return known, spot[known]

    # ---- forces ---------------------------------------------------------------------------------------------

    def add_forces(self, dt: float, F: Array) -> None:
        """Add the contact forces at the present places to F (n, 6) for a substep of dt [s]."""
        self._read = None
        if not len(self._pairs.a):  # those of a building whose joints all hold
            self._count = 0
            return
        m = self._motion
        state = Kinematics(m.all_x, m.all_v, m.all_R, dt, m.dt)
        self._count, lost = contact_forces(
            self.share, self._shapes, self._bodies, self._law, self._pairs, self._slots, self._ground, state,
            self._rows, F,
        )  # fmt: skip
        self.friction += lost

    def now_on_blocks(self) -> Array:
        """Forces of the contacts at the present positions, (n, 6) [N, N m]."""
        F = np.zeros((self._n, 6))
        self.add_forces(0.0, F)
        return F

    def settle(self, dt: float) -> None:
        """Account for the work of the contacts over the substep that has just ended, and search for neighbours if it is
        due."""
        if self._count:
            dashpot, driving = contact_work(self._rows, self._count, self._motion.all_v, ~self._free, dt)
            self.dashpot += dashpot
            self.driving += driving
        self._moved += dt * fastest(self._motion.v, self._shapes.radius)
        if self._moved > self._reach:
            self.search()

    def now(self) -> Contacts:
        """The contacts at the present positions; they are found again after `moved`."""
        if self._read is None:
            self.add_forces(0.0, np.zeros((self._n, 6)))
            self._read = contacts_of_rows(self._rows, self._count, self._n)
        return self._read

    def deepest(self) -> tuple[Array, Array, Array]:
        """Pairs that overlap: blocks a (p,) and b (p,), where -1 - k stands for the fixed plane k, and the smallest
        displacement (p,) [m] that would separate them."""
        self.now()
        pairs = self._pairs
        on = np.flatnonzero(pairs.overlap > 0.0)
        b = pairs.b[on]
        return pairs.a[on], np.where(b < self._n, b, self._n - 1 - b), pairs.overlap[on]

    def moved(self) -> None:
        """Note that blocks have been displaced directly. Contacts that begin there have the full present depth, so that
        their forces depend on the positions alone and not on the path to them."""
        self.search()
        self._pairs.found[:], self._pairs.force[:] = False, np.inf
        self._read = None

    # ---- saving and going back ------------------------------------------------------------------------------

    def save(self) -> dict[str, Array]:
        """The history of all contacts, and the running sums."""
        self.now()  # contacts that are to take over from joints begin here, not after the way back
        index = np.flatnonzero(self._slots.face >= 0)
        pair = np.searchsorted(self._pairs.start, index, side="right") - 1
        over = np.flatnonzero(self._pairs.overlap > 0.0)
        return {
            "on": self._on.copy(),
            "joined": self._joined.copy(),
            "a": self._pairs.a[pair],
            "b": self._pairs.b[pair],
            "node": index - self._pairs.start[pair],
            "face": self._slots.face[index],
            "k": self._slots.k[index],
            "rest": self._slots.rest[index],
            "shear": self._slots.shear[index],
            "spread": self._slots.spread[index],
            "push": self._slots.push[index],
            "speed": self._slots.speed[index],
            "calm": self._pairs.calm[pair],
            "over_a": self._pairs.a[over],
            "over_b": self._pairs.b[over],
            "overlap": self._pairs.overlap[over],
            "sums": np.array([self.dashpot, self.friction, self.driving]),
        }

    def restore(self, saved: dict[str, Array]) -> None:
        """Return to a saved state; the blocks must be where they were then."""
        self._on[:], self._joined = saved["on"], saved["joined"].copy()
        self._set_pairs(np.zeros((0, 2), np.int64))
        in_contact = np.stack([saved["a"], saved["b"]], axis=1)
        over = np.stack([saved["over_a"], saved["over_b"]], axis=1)
        self._set_pairs(self._in_order(np.concatenate([self._near(), in_contact, over])))
        keys = self._key(self._pairs.a, self._pairs.b)
        pair = np.searchsorted(keys, self._key(saved["a"], saved["b"]))
        slot = self._pairs.start[pair] + saved["node"]
        self._pairs.touching[pair], self._pairs.calm[pair] = True, saved["calm"]
        self._pairs.overlap[np.searchsorted(keys, self._key(*over.T))] = saved["overlap"]
        self._pairs.found[:] = True  # `save` has found them
        for name in Slots._fields:
            getattr(self._slots, name)[slot] = saved[name]
        self.dashpot, self.friction, self.driving = saved["sums"].tolist()
        self._read = None


def _among(keys: Array, of: Array) -> Array:
    """(k,) bool: which of the numbers `keys` (k,) are in `of`, sorted."""
    if not len(of):
        return np.zeros(len(keys), bool)
    return of[np.minimum(np.searchsorted(of, keys), len(of) - 1)] == keys


def _once(keys: Array) -> Array:
    """The numbers `keys` (k,) sorted, each once. Quicker than `np.unique`, which looks them up in a table first."""
    keys = np.sort(keys)
    return keys[np.append(True, keys[1:] != keys[:-1])] if len(keys) else keys


def _bodies(blocks, planes: int, face_stiffness: Array, free: Array, material: Array) -> Bodies:
    inverse_mass = np.array([1.0 / b.mass if f else 0.0 for b, f in zip(blocks, free)] + [0.0] * planes)
    inverse_inertia = np.zeros((len(blocks) + planes, 3, 3))
    for row, block in enumerate(blocks):
        if free[row]:
            inverse_inertia[row] = np.linalg.inv(block.inertia)
    stiffness = np.concatenate([face_stiffness, np.full(planes, np.inf)])
    return Bodies(inverse_mass, inverse_inertia, stiffness, material)
