"""Sleep: islands of blocks at rest are left out of the substeps.

Live joints tie blocks together into islands; held blocks and fixed planes part them. An island sleeps while every one
of its blocks stands in its place, held by joints that reach the ground or a held block, with nothing loose in reach,
and while the forces on it stay in balance. While it sleeps, its blocks stand still, its joints and its contacts with
the ground keep their history and carry the load, and for the water it is a rigid body.

The distance from balance is measured with the forces f of the joints, and of contacts with the ground and other planes,
at the time the island fell asleep, weight and load F, and the tangent K of the joints as they open further,

    K u = F + f,    change = max over joints of k_0 |δ(u) - δ(0)|/T_max

with δ the largest and the mean normal opening and β times the mean sliding of each joint. Beyond `share` the island
wakes before the load acts on it. So no traction is off by more than that share of the strength while it sleeps, and,
since what was held back comes on at once, by as much again when it wakes (to first order in the share). The tangent
softens towards the peak: the nearer a joint is to failure, the smaller the load that wakes its island. Contacts would
only stiffen K: without them the change is overestimated.

At rest: for a whole period of its slowest mode no opening has changed by more than half of the share, or at the start,
settled, nothing moves at all. What motion is left is taken by the joints, and booked there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import SuperLU
from scipy.spatial.transform import Rotation

from array_types import Array
from yade_scripts.blocks import tangent
from yade_scripts.contact.forces import ContactForces
from yade_scripts.dynamics.energy import EnergySums, Masses
from yade_scripts.dynamics.equilibrium import factors
from yade_scripts.dynamics.impulses import ImpulseSums
from yade_scripts.dynamics.onset import ContactOnset
from yade_scripts.dynamics.spin import SpinCorrection
from yade_scripts.joints.joints import Joints
from yade_scripts.yade_side.motion import Motion
from yade_scripts.yade_side.scene import Scene

FALLS = 0.5
"""Share of the share up to which openings may change, and forces be out of balance, of what is about to sleep."""
NEVER, UNKNOWN = 1e30, -1.0
"""An opening [m] that no joint has, a time [s] that does not come; a period that was not asked for yet. (What is not
finite cannot be saved.)"""
ROUNDS = 30
"""Inverse iterations for the slowest mode; modes nearly as slow do no harm."""


@dataclass(frozen=True)
class Island:
    """Blocks `rows` (k,) that joints `joints` (j,) tie together; those to held blocks and fixed planes among them."""

    rows: Array
    joints: Array


@dataclass(frozen=True)
class Sleeper:
    """An island asleep. x (k, 3), R (k, 3, 3): where · force (k, 6): of its joints on its blocks · pressed (k, 6):
    of its contacts with planes · holders (h,), held_by (h, 6): blocks of prescribed motion that hold it, and the force
    of its joints on them · factor: of its tangent · stored [J] in its joints · openings (j, 3) [m] of its joints."""

    island: Island
    x: Array
    R: Array
    force: Array
    pressed: Array
    holders: Array
    held_by: Array
    factor: SuperLU
    stored: float
    openings: Array


class Sleep:
    """Which islands of a structure sleep. share: of the strength of the joints.

    asleep (n,) bool · wakes, falls: how often so far · put_to_rest [J]: motion that was left when islands fell asleep.
    relist: called after islands woke or fell asleep.
    """

    def __init__(
        self,
        share: float,
        scene: Scene,
        motion: Motion,
        joints: Joints,
        contacts: ContactForces | None,
        onset: ContactOnset,
        spin: SpinCorrection,
        masses: Masses,
        energy_sums: EnergySums,
        impulses: ImpulseSums,
        relist: Callable[[], None],
    ):
        self.share = share
        self._scene, self._motion, self._joints, self._contacts = scene, motion, joints, contacts
        self._onset, self._spin, self._masses = onset, spin, masses
        self._energy_sums, self._impulses, self._relist = energy_sums, impulses, relist
        n = len(masses.mass)
        self.asleep = np.zeros(n, bool)
        self.force = np.zeros((n, 6))
        """Of the joints of all that sleeps on all blocks [N, N m]."""
        self.wakes = self.falls = 0
        self.put_to_rest = 0.0
        self._sleepers: list[Sleeper] = []
        self._reference = np.full((len(joints), 3), NEVER)
        self._since = np.zeros(len(joints))
        self._period = np.full(n, UNKNOWN)
        """Of the slowest mode of the island that each block is the first of [s]."""
        self._islands: list[Island] | None = None
        self._seen: Array | None = None
        self._outer = np.zeros((n, 6))
        self._began = self._from = 0.0
        strength = joints.law[:, 0] * joints.df
        self._scale = (joints.k0 / strength)[:, None] * np.stack(
            [np.ones(len(joints)), joints.beta, np.ones(len(joints))], axis=1
        )
        """Change of traction over the strength, of a change of each opening [1/m]."""

    def described(self) -> str:
        """A description in one line: which islands may sleep, and how large the error in traction can be."""
        islands = self.islands()
        blocks = sum(len(i.rows) for i in islands)
        return (
            f"{len(islands)} islands of {blocks} blocks in all may sleep; a traction in their joints is then off by at "
            f"most {self.share:.3g} of the strength, and by as much when they wake"
        )

    def figures(self) -> dict[str, float]:
        """Blocks asleep now, how often islands fell asleep and woke, and the energy [J] that falling asleep took."""
        return {
            "asleep": int(self.asleep.sum()),
            "falls": self.falls,
            "wakes": self.wakes,
            "put_to_rest": self.put_to_rest,
        }

    # ---- a step ---------------------------------------------------------------------------------------------

    def begin(self, outer: Array, time: float, ramp: float) -> None:
        """Before a step under the weight and load `outer` (n, 6) [N, N m], wake the islands that these would move. ramp
        [s]: no island falls asleep before the weight acts in full."""
        self._began, self._outer, self._from = time, outer, ramp
        if self._sleepers and (self._seen is None or not np.array_equal(self._seen, outer)):
            changes = self._changes(self._sleepers, outer)
            self._wake([s for s, change in zip(self._sleepers, changes) if change > self.share], time)
            self._seen = outer
        if time == 0.0:
            if self._contacts is not None:
                self._contacts.now()  # which touch
            self._fall(time)

    def reached(self, time: float) -> bool:
        """Wake the islands that a moving block has approached since the last substep, and return whether there were
        any."""
        if self._contacts is None or not self._sleepers:
            return False
        near = self._contacts.approached_groups()
        if not near.any():
            return False
        self._wake([s for s, woken in zip(self._sleepers, near) if woken], time)
        return True

    def end(self, time: float) -> None:
        """After the substeps of a step, account for the forces that held the sleeping islands, and put others to
        sleep."""
        self._hold(self._sleepers, time)
        self._fall(time)
        self._began = time

    def joints_failed(self) -> None:
        """Have the islands determined again."""
        self._islands = None
        self._period[~self.asleep] = UNKNOWN

    def wake_all(self, time: float) -> None:
        """Wake all islands, before blocks are displaced directly."""
        self._wake(self._sleepers, time)
        self._reference[:] = NEVER

    # ---- islands --------------------------------------------------------------------------------------------

    def islands(self) -> list[Island]:
        """Those of all movable blocks that live joints tie to a fixed plane or a held block."""
        if self._islands is not None:
            return self._islands
        joints, free = self._joints, self._masses.free
        n, live = len(free), joints.live
        a, b = joints.a[live], joints.b[live]
        inner = (b >= 0) & free[a] & free[np.maximum(b, 0)]
        graph = csc_matrix((np.ones(inner.sum()), (a[inner], b[inner])), shape=(n, n))
        count, label = connected_components(graph, directed=False)
        of_joint = np.where(free[a], label[a], label[np.maximum(b, 0)])
        holds = ~inner & (free[a] | ((b >= 0) & free[np.maximum(b, 0)]))
        held = np.zeros(count, bool)
        held[of_joint[holds]] = True
        held[label[np.flatnonzero(self._driven_ends())]] = False
        order, first = np.argsort(label, kind="stable"), np.searchsorted(np.sort(label), np.arange(count))
        ends = np.append(first[1:], n)
        by_joint = np.argsort(of_joint, kind="stable")
        begin = np.searchsorted(of_joint[by_joint], np.arange(count + 1))
        touches_free = inner | holds
        found = []
        for k in np.flatnonzero(held):
            rows, own = order[first[k] : ends[k]], by_joint[begin[k] : begin[k + 1]]
            if free[rows].all():
                found.append(Island(rows, live[np.sort(own[touches_free[own]])]))
        self._islands = found
        return found

    def _driven_ends(self) -> Array:
        """(n,) bool: blocks with a live joint to one that is driven."""
        joints, driven = self._joints, self._scene.driven
        live = joints.live
        a, b = joints.a[live], joints.b[live]
        inner = b >= 0
        found = np.zeros(len(driven), bool)
        found[a[inner & driven[np.maximum(b, 0)]]] = True
        found[b[inner & driven[a]]] = True
        return found

    def _quiet(self, island: Island) -> bool:
        """Whether no block of the island is loose, in contact with another one, or near one by contact."""
        return not self._onset.loose[island.rows].any() and (
            self._contacts is None or not self._contacts.busy()[island.rows].any()
        )

    # ---- falling asleep -------------------------------------------------------------------------------------

    def _fall(self, time: float) -> None:
        awake = [i for i in self.islands() if not self.asleep[i.rows[0]]]
        if not awake or time < self._from:
            return
        m = self._motion
        now = self._joints.openings(np.concatenate([i.joints for i in awake]), m.x, m.R)
        changed, first = False, 0
        for island in awake:
            mine = now[first : first + len(island.joints)]
            first += len(island.joints)
            change = np.abs(mine - self._reference[island.joints]) * self._scale[island.joints]
            if not change.max() <= FALLS * self.share:
                self._reference[island.joints], self._since[island.joints] = mine, time
                still = time == 0.0 and not m.v[island.rows].any()
            else:
                still = time - self._since[island.joints[0]] >= self._slowest(island)
            if still and self._quiet(island):
                changed |= self._try(island, time)
        if changed:
            self._changed()

    def _try(self, island: Island, time: float) -> bool:
        """Put an island to sleep if it is in balance."""
        sleeper = self._sleeper(island)
        if sleeper is None or self._changes([sleeper], self._outer)[0] > FALLS * self.share:
            self._since[island.joints] = time  # not again before another period
            return False
        self._stop(island.rows)
        # as contacts press on the blocks at rest, which is what a restart finds
        self._sleepers.append(replace(sleeper, pressed=self._pressed(island.rows)))
        self.falls += 1
        return True

    def _stop(self, rows: Array) -> None:
        """Stop the blocks; their joints take up their momentum and energy."""
        m, energy_sums = self._motion, self._energy_sums
        if m.v[rows].any():
            left = energy_sums.of_motion(rows)
            p = self._masses.mass[rows, None] * m.v[rows, :3]
            spin = self._scene.angular_momentum(rows) - self._spin.save()[rows]
            self._impulses.give(rows, np.concatenate([-p, -spin, -np.cross(m.x[rows], p) - spin], axis=1))
            m.v[rows] = 0.0
            energy_sums.joint_work -= left
            self.put_to_rest += abs(left)
        self._spin.forget(rows)
        self._scene.hold(rows)

    def _sleeper(self, island: Island) -> Sleeper | None:
        """The state of an island that is to sleep at its present position; None if it has no stiffness."""
        m, joints = self._motion, self._joints
        n = len(self.asleep)
        points = np.flatnonzero(np.isin(joints.joint_of, island.joints))
        dofs = (6 * island.rows[:, None] + np.arange(6)).ravel()
        K = tangent.joint_tangent(joints, m.x, m.R, n, points)
        factor = factors(csc_matrix(K[dofs, :][:, dofs]))
        if factor is None:
            return None
        force, still = np.zeros((n, 6)), np.zeros_like(m.v)
        joints.forces(m.x, still, m.R, force, eta=0.0, which=island.joints)
        stored = joints.stored_between(m.x, m.R, m.x, m.R, which=island.joints)
        holders = np.flatnonzero(force.any(axis=1) & ~self._masses.free)
        return Sleeper(
            island,
            m.x[island.rows].copy(),
            m.R[island.rows].copy(),
            force[island.rows],
            self._pressed(island.rows),
            holders,
            force[holders],
            factor,
            float(stored[island.joints].sum()),
            joints.openings(island.joints, m.x, m.R),
        )

    def _pressed(self, rows: Array) -> Array:
        """Forces (k, 6) of the contacts of the blocks `rows`, which touch planes only."""
        return np.zeros((len(rows), 6)) if self._contacts is None else self._contacts.now_on_blocks()[rows]

    def _changes(self, sleepers: list[Sleeper], outer: Array) -> list[float]:
        """Largest change of a traction over the strength in each island if it came to balance under `outer` (n, 6)."""
        m = self._motion
        x, R = m.x.copy(), m.R.copy()
        for s in sleepers:
            rows = s.island.rows
            u = s.factor.solve((outer[rows] + s.force + s.pressed).ravel()).reshape(-1, 6)
            x[rows] += u[:, :3]
            R[rows] = Rotation.from_rotvec(u[:, 3:]).as_matrix() @ R[rows]
        joints = np.concatenate([s.island.joints for s in sleepers])
        opened = np.abs(self._joints.openings(joints, x, R) - np.concatenate([s.openings for s in sleepers]))
        first = np.cumsum([0, *(len(s.island.joints) for s in sleepers[:-1])])
        return np.maximum.reduceat((opened * self._scale[joints]).max(axis=1), first).tolist()

    def _slowest(self, island: Island) -> float:
        """Period [s] of its slowest mode, by inverse iteration; NEVER where it has none."""
        first = island.rows[0]
        if self._period[first] == UNKNOWN:
            self._period[first] = self._period_of(island)
        return float(self._period[first])

    def _period_of(self, island: Island) -> float:
        m, joints, rows = self._motion, self._joints, island.rows
        points = np.flatnonzero(np.isin(joints.joint_of, island.joints))
        dofs = (6 * rows[:, None] + np.arange(6)).ravel()
        springs = tangent.joint_springs(joints, m.x, m.R, points)
        factor = factors(csc_matrix(tangent.assemble(springs, len(self.asleep))[0][dofs, :][:, dofs]))
        if factor is None:
            return NEVER
        mass, inertia = self._masses.mass[rows, None], self._masses.inertia(m.R)[rows]
        reach = m.x[rows] - m.x[rows].mean(axis=0)
        u = np.concatenate([1.0 + reach[:, ::-1] / max(np.abs(reach).max(), 1e-300), 0.0 * reach], axis=1)
        square = 0.0
        for _ in range(ROUNDS):
            Mu = np.concatenate([mass * u[:, :3], np.einsum("nij,nj->ni", inertia, u[:, 3:])], axis=1)
            Mu /= np.sqrt(np.sum(u * Mu))
            u = factor.solve(Mu.ravel()).reshape(-1, 6)
            square = float(np.sum(u * Mu))
        return 2.0 * np.pi * np.sqrt(square)

    # ---- waking ---------------------------------------------------------------------------------------------

    def _wake(self, sleepers: list[Sleeper], time: float) -> None:
        if not sleepers:
            return
        self._hold(sleepers, time)
        for sleeper in sleepers:
            self._reference[sleeper.island.joints] = NEVER
            self._scene.release(sleeper.island.rows)
        gone = {id(s) for s in sleepers}
        self._sleepers = [s for s in self._sleepers if id(s) not in gone]
        self.wakes += len(sleepers)
        self._changed()

    def _hold(self, sleepers: list[Sleeper], time: float) -> None:
        """Add the impulses of joints on the sleeping blocks since the step began: those that, with the impulses of
        their contacts, kept them still."""
        dt = time - self._began
        if dt <= 0.0 or not sleepers:
            return
        rows = np.concatenate([s.island.rows for s in sleepers])
        self._give(rows, -dt * self._outer[rows])
        self._impulses.give(rows, -self._impulses.of_contacts(rows))
        for sleeper in sleepers:  # two islands may hang on one block
            if len(sleeper.holders):
                self._give(sleeper.holders, dt * sleeper.held_by)

    def _give(self, rows: Array, impulse: Array) -> None:
        arm = np.cross(self._motion.x[rows], impulse[:, :3])
        self._impulses.give(rows, np.concatenate([impulse, arm + impulse[:, 3:]], axis=1))

    def _changed(self) -> None:
        """Pass the list of sleeping blocks on to the other parts of the structure."""
        self._seen = None
        self._sleepers.sort(key=lambda s: int(s.island.rows[0]))  # sums in one order
        self.asleep[:] = False
        self.force[:] = 0.0
        still = np.zeros(len(self._joints), bool)
        for sleeper in self._sleepers:
            self.asleep[sleeper.island.rows] = True
            still[sleeper.island.joints] = True
            self.force[sleeper.island.rows] += sleeper.force
            self.force[sleeper.holders] += sleeper.held_by
        self._joints.set_asleep(still)
        self._motion.rest(self.asleep)
        self._energy_sums.stored_asleep = float(sum(s.stored for s in self._sleepers))
        if self._contacts is not None:
            self._contacts.set_asleep(self.asleep, [s.island.rows for s in self._sleepers])
        self._relist()

    # ---- saving and going back ------------------------------------------------------------------------------

    def save(self) -> dict[str, Array]:
        """Which islands sleep, and since when the openings of the others have not changed from which values."""
        return {
            "asleep": self.asleep.copy(),
            "reference": self._reference.copy(),
            "since": self._since.copy(),
            "period": self._period.copy(),
            "counts": np.array([self.wakes, self.falls, self.put_to_rest], float),
        }

    def restore(self, saved: dict[str, Array]) -> None:
        """Return to a saved state; blocks and joints must be where they were then."""
        self._reference[:], self._since[:] = saved["reference"], saved["since"]
        self._period[:] = saved["period"]
        self.wakes, self.falls = int(saved["counts"][0]), int(saved["counts"][1])
        self.put_to_rest = float(saved["counts"][2])
        asleep = saved["asleep"].astype(bool)
        known = {s.island.rows.tobytes(): s for s in self._sleepers}
        self._islands, self._sleepers = None, []
        for island in self.islands():
            if not asleep[island.rows[0]]:
                continue
            old = known.get(island.rows.tobytes())
            sleeper = old if old is not None and self._stands(old) else self._sleeper(island)
            assert sleeper is not None  # it had stiffness when it fell asleep just here
            self._sleepers.append(sleeper)
        self._scene.set_held(asleep)
        self._changed()

    def _stands(self, sleeper: Sleeper) -> bool:
        """Whether an island is exactly where it fell asleep."""
        m, rows = self._motion, sleeper.island.rows
        return np.array_equal(sleeper.x, m.x[rows]) and np.array_equal(sleeper.R, m.R[rows])
