"""Damage of groups of blocks: how many joints broke, how much weight left its place, and what state that is.

From plain arrays it makes one `Damage` for each group, for any division of the blocks: walls and floors of one
building, storeys, buildings of a town. It needs neither a run nor YADE, so the table of a finished run is enough.

State       rule (keys of [verdict])
stands      no more than `damaged_joints` of the joined area is broken or torn, and no block has left its place
damaged     anything else that is not collapsed
collapsed   at least `collapsed_weight` of the weight has left its place and stays out of it, or at least
            `collapsed_joints` of the joined area is broken, where the case gives that key

A joint is broken when it has failed everywhere, and torn when it has failed over a part of its face and holds by the
rest: the base of a wall that gapes at one edge is torn for as long as the other edge is pressed.

A block has left its place when its centre has moved by `moved` of its thickness (the smallest width across a face
through its centre of mass, as for limits.overlap). One that came back or rocks (`rocking.py`) does not stay out of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from array_types import Array, Bools, Floats, Ints

NOWHERE = -1
"""Label of a block that belongs to no group, and of the ground."""


class State(IntEnum):
    """In the order of severity, so that states of a sweep can be counted from one upwards."""

    STANDS = 0
    DAMAGED = 1
    COLLAPSED = 2

    @property
    def word(self) -> str:
        """Its name in reports."""
        return self.name.lower()


@dataclass(frozen=True)
class Rules:
    """Shares (0 to 1) from which a group counts as damaged and as collapsed; see the head of this file."""

    moved: float = 0.1
    damaged_joints: float = 0.0
    collapsed_weight: float = 0.2
    collapsed_joints: float | None = None


@dataclass(frozen=True)
class Blocks:
    """mass (n,) [kg] · thickness (n,) [m] · moved (n,) [m]: how far each centre has moved since the start, the farthest
    so far · out (n,) bool: those out of their place that do not come back; None: all that left it"""

    mass: Floats
    thickness: Floats
    moved: Floats
    out: Bools | None = None

    def left(self, rules: Rules) -> Array:
        """(n,) bool: blocks that have left their place."""
        return self.moved > rules.moved * self.thickness

    def stay_out(self, rules: Rules) -> Array:
        """(n,) bool: blocks that have left their place for good."""
        return self.left(rules) if self.out is None else self.left(rules) & self.out


@dataclass(frozen=True)
class Joints:
    """a, b (J,) rows of the blocks, negative for the ground · area (J,) [m²] · broken (J,) [s]: time of failure, NaN
    while it holds · torn (J,): share of the area that has failed"""

    a: Ints
    b: Ints
    area: Floats
    broken: Floats
    torn: Floats

    @classmethod
    def none(cls) -> Joints:
        """No joints, for blocks without any."""
        return cls(np.zeros(0, int), np.zeros(0, int), *np.zeros((3, 0)))


@dataclass(frozen=True)
class Damage:
    """What happened to one group.

    blocks, blocks_moved, blocks_out: number of all, of those that left their place, and of those that stay out of it ·
    joints, joints_broken, joints_torn: number of all, of the broken and of the torn · area_broken: share of the joined
    area in broken joints, area_torn: that which has failed in torn ones · weight_moved, weight_out: share of the weight
    that left its place, and that stays out of it · farthest [m] and farthest_block: the way of the block that moved
    most, and its row · first_break [s] and first_joint: time and row of the first joint that broke, None and -1
    without one · state · rule: the sentence that decided it
    """

    name: str
    blocks: int
    blocks_moved: int
    blocks_out: int
    joints: int
    joints_broken: int
    joints_torn: int
    area_broken: float
    area_torn: float
    weight_moved: float
    weight_out: float
    farthest: float
    farthest_block: int
    first_break: float | None
    first_joint: int
    state: State
    rule: str

    @property
    def joined(self) -> bool:
        """Whether any block of the group had a joint at the start."""
        return self.joints > 0

    @property
    def word(self) -> str:
        """The state in words; a group that never had joints cannot break, and is called moved, in part or as a
        whole, or back in place."""
        if self.joined:
            return self.state.word
        if self.blocks_moved and not self.blocks_out:
            return "back in place"
        return ("in place", "partly moved", "moved")[self.state]


def damage(label: Array, names: Sequence[str], blocks: Blocks, joints: Joints, rules: Rules) -> list[Damage]:
    """The damage of each group, in the order of names.

    label (n,): number of the group of each block, NOWHERE for none. A joint belongs to the groups of both of its
    blocks: a crack between a wall and a floor is damage to either. Groups without blocks are whole.
    """
    label = np.asarray(label)
    left, out = blocks.left(rules), blocks.stay_out(rules)
    of_a, of_b = _labels_of(label, joints.a), _labels_of(label, joints.b)
    return [
        _of_group(
            name,
            np.flatnonzero(label == k),
            np.flatnonzero((of_a == k) | (of_b == k)),
            blocks,
            joints,
            (left, out),
            rules,
        )
        for k, name in enumerate(names)
    ]


def _labels_of(label: Array, rows: Array) -> Array:
    """Group of each row; NOWHERE for the ground."""
    return (
        np.where(rows < 0, NOWHERE, label[np.maximum(rows, 0)]) if len(label) else np.full(len(rows), NOWHERE)
    )


def _of_group(
    name: str,
    rows: Array,
    own: Array,
    blocks: Blocks,
    joints: Joints,
    moved: tuple[Array, Array],
    rules: Rules,
) -> Damage:
    """rows: of its blocks · own: rows of its joints · moved: blocks (n,) bool that left their place, and that stay out
    of it."""
    left, out = (rows[of_all[rows]] for of_all in moved)
    broken = own[np.isfinite(joints.broken[own])]
    first = broken[np.argmin(joints.broken[broken])] if len(broken) else -1
    farthest = rows[np.argmax(blocks.moved[rows])] if len(rows) else -1
    torn = own[(joints.torn[own] > 0.0) & ~np.isfinite(joints.broken[own])]
    joined = joints.area[own].sum()
    area = _share(joints.area[broken].sum(), joined)
    area_torn = _share((joints.area[torn] * joints.torn[torn]).sum(), joined)
    weight, weight_out = (_share(blocks.mass[of].sum(), blocks.mass[rows].sum()) for of in (left, out))
    state, rule = state_of(area, weight_out, (len(left), len(out)), rules, area_torn, joined=len(own) > 0)
    return Damage(
        name=name,
        blocks=len(rows),
        blocks_moved=len(left),
        blocks_out=len(out),
        joints=len(own),
        joints_broken=len(broken),
        joints_torn=len(torn),
        area_broken=area,
        area_torn=area_torn,
        weight_moved=weight,
        weight_out=weight_out,
        farthest=float(blocks.moved[farthest]) if farthest >= 0 else 0.0,
        farthest_block=int(farthest),
        first_break=float(joints.broken[first]) if first >= 0 else None,
        first_joint=int(first),
        state=state,
        rule=rule,
    )


def state_of(
    area_broken: float,
    weight_out: float,
    blocks_moved: tuple[int, int],
    rules: Rules,
    area_torn: float = 0.0,
    *,
    joined: bool = True,
) -> tuple[State, str]:
    """The state and the rule that decided it, from shares of the joined area and of the weight, and from the numbers of
    blocks that left their place and that stay out of it. joined: whether there are joints at all."""
    moved, out = blocks_moved
    failed = min(area_broken + area_torn, 1.0)
    which = (
        "torn, though no joint broke" if area_broken == 0.0 else "broken or torn" if area_torn else "broken"
    )
    if weight_out >= rules.collapsed_weight and out:
        return State.COLLAPSED, (
            f"{weight_out:.0%} of its weight left its place "
            f"(rule: {rules.collapsed_weight:.0%} or more, verdict.collapsed_weight)"
        )
    if rules.collapsed_joints is not None and area_broken >= rules.collapsed_joints:
        return State.COLLAPSED, (
            f"{area_broken:.0%} of its joined area is broken "
            f"(rule: {rules.collapsed_joints:.0%} or more, verdict.collapsed_joints)"
        )
    if moved:
        left = f"{_count(moved, 'block')} left {'its' if moved == 1 else 'their'} place"
        return State.DAMAGED, left if out == moved else f"{left}, of which {out or 'none'} stayed out of it"
    if failed > rules.damaged_joints:
        return State.DAMAGED, f"{_percent(failed)} of its joined area is {which}"
    if failed > 0.0:
        return State.STANDS, (
            f"{_percent(failed)} of its joined area is {which} "
            f"(rule: damaged from more than {rules.damaged_joints:.0%}, verdict.damaged_joints)"
        )
    return State.STANDS, "no joint broke and no block left its place" if joined else "no block left its place"


def _share(part: float, whole: float) -> float:
    return float(part / whole) if whole > 0.0 else 0.0


def _percent(share: float) -> str:
    return f"{share:.0%}" if share >= 0.01 else f"{share:.2%}"


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
