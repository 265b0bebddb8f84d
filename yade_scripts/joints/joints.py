"""Cohesive joints of a structure: their construction from touching faces, their state over time, and the table for
reports."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from array_types import Array, Bools, Floats, Ints
from kernels.ranges import alone
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import TouchingFaces, gauss_points, to_body
from yade_scripts.joints import kernel
from yade_scripts.joints.arrays import JointPoints, Placement, PointMemory, Taken, in_fours
from yade_scripts.joints.cohesion import JointParameters
from yade_scripts.joints.forces import MU, NOT_GROWING, PULL, JointKernels, kernels_of
from yade_scripts.joints.seals import both_faces

JOINT = 20
"""Cost of a joint, in rows of an ordinary loop: it decides how joints are divided among threads."""


@dataclass(frozen=True, kw_only=True)
class JointTable:
    """One row a joint. a, b: blocks (b = -1: ground or wall) · face_a, face_b: their faces (-1: fixed plane)

    area [m²] · centre (J, 3) [m] and normal (J, 3) out of a, now (both follow block a) · damage: largest λ/δ_f of the
    joint's points, weighted mean in `mean_damage` · torn: share of its area whose points have failed, 1 once
    it is not alive · opening, sliding [m] means · mode_mix: share of shear in the effective opening, 0 (opening) to
    1 (shear), frozen at failure · stored, dissipated, damped [J]
    failure_time [s], nan while alive · intact: nothing broken · alive: still carries tension
    """

    a: Ints
    b: Ints
    face_a: Ints
    face_b: Ints
    area: Floats
    centre: Floats
    normal: Floats
    damage: Floats
    mean_damage: Floats
    torn: Floats
    opening: Floats
    sliding: Floats
    mode_mix: Floats
    stored: Floats
    dissipated: Floats
    damped: Floats
    failure_time: Floats
    alive: Bools

    def __len__(self) -> int:
        return len(self.a)


class Joints:
    """Geometry (constant), history λ of every point, and which joints are alive.

    faces: from `touching_faces` (coordinates of the scene) · parameters: the law of most joints · laws: that of each,
    None: the same for all.
    """

    def __init__(
        self,
        blocks: list[Block],
        faces: list[TouchingFaces],
        parameters: JointParameters,
        laws: list[JointParameters] | None = None,
    ):
        self.share: Callable[..., list] = alone
        """As in `contact_forces`."""
        self.parameters = parameters
        n = len(faces)
        laws = [parameters] * n if laws is None else laws
        self.laws = laws
        self.families, self.family = _families(laws)
        self.a = np.array([f.a for f in faces], np.int64)
        self.b = np.array([max(f.b, -1) for f in faces], np.int64)
        self.plane = np.array([-1 - f.b for f in faces], np.int64)
        """Number of the fixed plane where b = -1."""
        self.face_a = np.array([f.face_a for f in faces], np.int64)
        self.face_b = np.array([f.face_b for f in faces], np.int64)
        rules = [gauss_points(f.polygon, law.rule) for f, law in zip(faces, laws)]
        self.start = np.concatenate([[0], np.cumsum([len(w) for _, w in rules])]).astype(np.int64)
        self.weight = np.concatenate([w for _, w in rules]) if n else np.zeros(0)
        place = np.concatenate([p for p, _ in rules]) if n else np.zeros((0, 3))
        self.joint_of = np.repeat(np.arange(n), np.diff(self.start))
        self.area = np.bincount(self.joint_of, self.weight, minlength=n).astype(float, copy=False)
        centre = np.array([b.centre for b in blocks]).reshape(-1, 3)
        R = np.array([b.rotation for b in blocks]).reshape(-1, 3, 3)
        corners = np.concatenate([f.polygon for f in faces]) if n else np.zeros((0, 3))
        self.corner_start = np.concatenate([[0], np.cumsum([len(f.polygon) for f in faces])]).astype(np.int64)
        self._corner_of = np.repeat(np.arange(n), np.diff(self.corner_start))
        self._corner = to_body(corners, self.a[self._corner_of], centre, R)
        self.xi_a = to_body(place, self.a[self.joint_of], centre, R)
        self.xi_b = to_body(place, self.b[self.joint_of], centre, R)
        normal = np.array([f.normal for f in faces]).reshape(-1, 3)
        self.normal = np.stack(
            [to_body(normal, rows, np.zeros_like(centre), R) for rows in (self.a, self.b)], 1
        )
        known = {law: _numbers(law) for law in dict.fromkeys(laws)}
        numbers = np.array([known[law] for law in laws]).reshape(-1, 5)
        unit, self.df, self.beta, self.kc, self.k0 = (column.copy() for column in numbers.T)
        self.law = np.stack([unit, self.df, self.beta, self.kc, self.k0, np.zeros(n)], axis=1)
        """Columns as in `joint_forces`."""
        self._fours = in_fours(self.start, self.xi_a, self.xi_b, self.weight)
        self._points = [self._of_law(peak) for _, peak in self.families]
        self._keeps_out = np.array([law.uplift == "none" for law in laws], bool)
        self._by_damage = np.array([law.uplift == "damage" for law in laws], bool)
        self._peak = np.array([law.peak_share for law in laws])
        kinked = np.array([law.closing_ratio != 1.0 or law.mixed_mode != "effective" for law in laws], bool)
        self._most_held = np.where(kinked, -np.inf, self._peak * self.df)
        self.eta = 0.0
        """Time constant of the stiffness-proportional dashpot [s]."""
        self.stiffness_on: tuple[Array, Array] | None = None
        """What each joint adds to the stiffness of its blocks (J, 6, 6), kept by `timestep.joint_frequency`."""
        self.alive = np.ones(n, bool)
        self.live = np.arange(n)
        self.resting = np.zeros(n, bool)
        """Joints of blocks that sleep: substeps pass them by."""
        self.visited = self.live
        """Live joints that are not resting."""
        self.largest = np.zeros(len(self.weight))
        self.paid = np.zeros((len(self.weight), 4))
        self.paid[:, PULL] = NOT_GROWING
        self.damped = np.zeros(n)
        """Energy that the dashpots of each joint have taken [J]."""
        self.rub = np.zeros((len(self.weight), 3))
        """Sliding at which the failed points stick [m], in the frames of the blocks a."""
        self.rubbed = np.zeros(n)
        """Energy that this friction has taken [J]."""
        self.failure_time = np.full(n, np.nan)
        self.final_openings = np.zeros((n, 3))

    def __len__(self) -> int:
        return len(self.a)

    def forces(
        self,
        x,
        v,
        R,
        F,
        dt: float = 0.0,
        advance: bool = False,
        eta: float | None = None,
        which: Array | None = None,
    ) -> float:
        """Add the forces of the joints `which`, by default of all live ones that do not rest, on the blocks to F
        (n, 6); see `joint_forces`."""
        eta, fastest = self.eta if eta is None else eta, 0.0
        memory, motion = self._memory(), Placement(x, v, R)
        for kernels, own, points in self._families_of(self.visited if which is None else which):
            taken, given = Taken(self.damped, self.rubbed), np.empty((len(own), 6))
            state = (own, points, memory, motion, eta, dt, advance, given, taken)
            fastest = max(fastest, *self.share(kernels.joint_forces, len(own), *state, weight=JOINT))
            kernel.add_up(own, self.a, self.b, x, given, F)
        return fastest

    def _of_law(self, peak: float) -> JointPoints:
        """What never changes, as kernels take it; peak: of the law."""
        return JointPoints(
            self.a, self.b, self.start, self.xi_a, self.xi_b, self.weight, self.normal, self.law, peak,
            *self._fours,
        )  # fmt: skip

    def _memory(self) -> PointMemory:
        return PointMemory(self.largest, self.paid, self.rub)

    def _families_of(self, joints: Array) -> Iterator[tuple[JointKernels, Array, JointPoints]]:
        """Kernels of each law, those of the live `joints` of that law, and what the kernels read of them."""
        for number, (kernels, _) in enumerate(self.families):
            own = joints if len(self.families) == 1 else joints[self.family[joints] == number]
            yield kernels, own, self._points[number]

    def stored_between(self, x: Array, R: Array, x0: Array, R0: Array, which: Array | None = None) -> Array:
        """Elastic energy of the joints `which`, by default of all live ones, between two places of the blocks; zero for
        the others, (J,) [J]."""
        out = np.zeros(len(self))
        for kernels, own, points in self._families_of(self.live if which is None else which):
            kernels.stored_between(own, points, self._memory(), (x, R), (x0, R0), out)
        return out

    def lost(self) -> Array:
        """Energy (J,) [J] that the damage of each joint has dissipated according to its law: G_c A once it has
        failed."""
        out, own = np.empty(len(self)), np.empty(len(self))
        for number, (kernels, _) in enumerate(self.families):
            kernels.lost(self._points[number], self.largest, own)
            of_law = self.family == number
            out[of_law] = own[of_law]
        return out

    def of_points(self, index: Array) -> Iterator[tuple[JointKernels, Array, tuple]]:
        """For each law: its kernels, which of the points `index` are its own (bool), and what the kernels of single
        points read of these first: index, joint of each point, JointPoints, PointMemory."""
        for number, (kernels, _) in enumerate(self.families):
            own = self.family[self.joint_of[index]] == number
            yield kernels, own, (index[own], self.joint_of, self._points[number], self._memory())

    def broken_now(self) -> Array:
        """Numbers of the live joints that have failed since the last call of `retire`."""
        return self.visited[kernel.broken(self.visited, self.start, self.largest, self.df)]

    def set_asleep(self, resting: Array) -> None:
        """(J,) bool: joints that substeps pass by from now on."""
        self.resting = resting
        self._list_visited()

    def _list_visited(self) -> None:
        self.visited = self.live[~self.resting[self.live]] if self.resting.any() else self.live

    def holding(self) -> bool:
        """Whether all points close as stiffly as they open, by the effective opening, and none is beyond its peak."""
        return kernel.holding(self.visited, self.start, self.largest, self._most_held)

    def pace(self, x: Array, v: Array, R: Array) -> float:
        """Largest relative speed of the points that substeps visit, over their opening at failure [1/s]."""
        return kernel.pace(self.visited, self._of_law(0.0), Placement(x, v, R))

    def visited_points(self) -> Array:
        """Points of the joints that are alive and do not rest."""
        return np.flatnonzero((self.alive & ~self.resting)[self.joint_of])

    def set_friction(self, friction: Array) -> None:
        """μ (J,) of points that have failed and are pressed, while the rest of their joint holds."""
        self.law[:, MU] = friction

    def release(self, joints: Array, x: Array, R: Array) -> Array:
        """End the friction of `joints` (k,) at the positions x (n, 3), R (n, 3, 3) and return the energy (k,) [J] that
        was left in its springs."""
        friction = self.law[joints, MU]
        whole = self.stored_between(x, R, x, R, which=joints)[joints]
        self.law[joints, MU] = 0.0
        held = whole - self.stored_between(x, R, x, R, which=joints)[joints]
        self.law[joints, MU] = friction
        self.rubbed[joints] += held
        return held

    def retire(self, joints: Array, x: Array, R: Array, time: float) -> None:
        """Remove failed joints from the live ones: they have dissipated G_c A and are not visited any more."""
        self.final_openings[joints] = self.openings(joints, x, R)
        self.alive[joints] = False
        self.failure_time[joints] = time
        self.live = self.live[self.alive[self.live]]
        self._list_visited()

    def pairs(self, joints: Array, n: int) -> Array:
        """Pairs of bodies (k, 2) that `joints` (k,) hold; fixed planes are bodies n, n + 1, ..."""
        return np.stack([self.a[joints], np.where(self.b < 0, n + self.plane, self.b)[joints]], axis=1)

    def openings(self, joints: Array, x: Array, R: Array) -> Array:
        """Mean normal opening, mean sliding, largest normal opening of the points of `joints`, (len, 3) [m]."""
        return self._openings(joints, x, R)[:, :3]

    def pressing(self, joints: Array, x: Array, R: Array) -> Array:
        """Normal force (k,) [N] of the points of `joints` (k,) that are pressed."""
        return self.kc[joints] * self.area[joints] * self._openings(joints, x, R)[:, 3]

    def _openings(self, joints: Array, x: Array, R: Array) -> Array:
        """Columns as in `joint_openings`, (k, 4) [m]."""
        out = np.zeros((len(self), 4))
        kernel.joint_openings(np.asarray(joints), self._of_law(0.0), x, R, out)
        return out[joints]

    def sealed_faces(self, x: Array, R: Array) -> tuple[Array, Array, Array]:
        """Both faces of each live joint that keeps water out: block (m,), face (m,), half of the joint's largest
        opening (m,) [m]."""
        live = self.live[self._keeps_out[self.live]]
        half = 0.5 * self.openings(live, x, R)[:, 2]
        return both_faces(self, live, half)

    def wet_faces(self, x: Array, R: Array) -> tuple[Array, Array, Array]:
        """Both faces of each live joint that lets water between them: block (m,), face (m,), depth (m,) [m] by which
        they are in one another where they are most, zero where they are nowhere."""
        live = self.live[~self._keeps_out[self.live]]
        opening = self.openings(live, x, R)
        return both_faces(self, live, np.maximum(opening[:, 2] - 2.0 * opening[:, 0], 0.0))

    def uplift_points(self) -> tuple[Array, Array, Array, Array]:
        """Where live joints whose `uplift` is damage let a share of the pressure of the surrounding water act: block
        (m,), face (m,), points (m, 3) [m] in the frame of the block, share (m,).

        The share of a point is (λ/δ_f - p)/(1 - p): none up to the largest traction, since a joint that has not
        cracked keeps water out, the whole pressure once the point has failed. It rises in between as the traction
        falls (Brühwiler and Saouma, ACI Mater. J. 92 (1995) 383, measured pressures that rise with the opening)."""
        points = np.flatnonzero((self.alive & self._by_damage)[self.joint_of])
        joint = self.joint_of[points]
        peak = self._peak[joint]
        share = np.clip((self._ratio()[points] - peak) / (1.0 - peak), 0.0, 1.0)
        inner = self.b[joint] >= 0
        return (
            np.concatenate([self.a[joint], self.b[joint][inner]]),
            np.concatenate([self.face_a[joint], self.face_b[joint][inner]]),
            np.concatenate([self.xi_a[points], self.xi_b[points][inner]]),
            np.concatenate([share, share[inner]]),
        )

    def rows(self) -> Array:
        """Blocks with a live joint that does not rest, sorted."""
        ends = np.concatenate([self.a[self.visited], self.b[self.visited]])
        return np.flatnonzero(np.bincount(ends[ends >= 0]))

    def damaged_blocks(self, n: int) -> Array:
        """(n,) bool: blocks that have lost a joint, or never had one."""
        loose = np.ones(n, bool)
        loose[self.a] = False
        loose[self.b[self.b >= 0]] = False
        dead = ~self.alive
        loose[self.a[dead]] = True
        loose[self.b[dead & (self.b >= 0)]] = True
        return loose

    def _ratio(self) -> Array:
        return np.minimum(self.largest / self.df[self.joint_of], 1.0)

    def damage(self) -> Array:
        """Largest λ/δ_f of the points of each joint (J,), at most 1."""
        found = np.zeros(len(self))
        np.maximum.at(found, self.joint_of, self._ratio())
        return found

    def table(self, x: Array, R: Array) -> JointTable:
        """The joints now. x (n, 3), R (n, 3, 3): places of the blocks."""
        opening = self.final_openings.copy()
        opening[self.live] = self.openings(self.live, x, R)
        ratio = self._ratio()
        mean, torn = (
            np.bincount(self.joint_of, share * self.weight, minlength=len(self)) / self.area
            for share in (ratio, ratio >= 1.0)
        )
        centre = x[self.a] + np.einsum("nij,nj->ni", R[self.a], self._centre_in_a())
        normal = np.einsum("nij,nj->ni", R[self.a], self.normal[:, 0])
        shear = self.beta * opening[:, 1]
        effective = np.hypot(np.maximum(opening[:, 0], 0.0), shear)
        mix = np.divide(shear, effective, out=np.zeros(len(self)), where=effective > 0.0)
        return JointTable(
            a=self.a,
            b=self.b,
            face_a=self.face_a,
            face_b=self.face_b,
            area=self.area,
            centre=centre,
            normal=normal,
            damage=self.damage(),
            mean_damage=mean,
            torn=np.where(self.alive, torn, 1.0),
            opening=opening[:, 0],
            sliding=opening[:, 1],
            mode_mix=mix,
            stored=self.stored_between(x, R, x, R),
            dissipated=self.lost(),
            damped=self.damped.copy(),
            failure_time=self.failure_time.copy(),
            alive=self.alive.copy(),
        )

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
        names = (
            "alive",
            "live",
            "largest",
            "paid",
            "rub",
            "rubbed",
            "damped",
            "failure_time",
            "final_openings",
        )
        return {name: getattr(self, name).copy() for name in names}

    def restore(self, history: dict[str, Array]) -> None:
        """Return to a state that `history` gave."""
        for name, value in history.items():
            setattr(self, name, value.copy())
        self._list_visited()


def _numbers(law: JointParameters) -> tuple[float, ...]:
    """T_max/δ_f [Pa/m], δ_f [m], β, k_c [Pa/m], k_0 [Pa/m] of a law."""
    unit = law.strength / law.opening_at_failure
    return unit, law.opening_at_failure, law.shear_ratio, law.closing_stiffness, law.stiffness


def _families(laws: list[JointParameters]) -> tuple[list[tuple[JointKernels, float]], Array]:
    """Kernels and place of the peak of each law that is used, and the number (J,) of that of each joint."""
    keys = [(law.law, law.mixed_mode, law.peak_share) for law in laws]
    used = list(dict.fromkeys(keys))
    numbers = {key: number for number, key in enumerate(used)}
    families = [(kernels_of(law, mode), peak) for law, mode, peak in used]
    return families, np.array([numbers[key] for key in keys], np.int64)
