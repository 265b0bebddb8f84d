"""Start at rest: where the joints carry the weight and the load that act at the start.

A building whose weight is applied at once swings to twice its static deflection and may break before anything has hit
it. The joined blocks are therefore moved to their equilibrium first,

    f(u) = f_joints(u) + f_weight + f_load = 0,      K(u) Δu = f(u),   u ← u + a Δu,

by Newton's method with the tangent of the joints as they open. K is then the curvature of an energy that equilibrium
makes smallest: where softening makes K indefinite the secant stiffness takes its place, whose step still goes
downhill, and a is cut until f(u + a Δu)·Δu does not point back strongly (stiff closing flips points between open and
closed). Contacts push in proportion to their depth and have no friction: displacing blocks directly stretches no spring
of friction.
Joints that cannot carry the load open beyond their opening at failure, or the search finds no end.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import SuperLU, splu
from scipy.spatial.transform import Rotation

from array_types import Array

TOLERANCE = 1e-7
MOST_ITERATIONS = 100
ROUNDING = 8.0
"""Units in the last place that a position may be off."""
MOST_TRIALS = 12
SLACK = 0.5
"""A step may overshoot by this share of the work that it set out with."""
SHORTEST = 0.1
"""Least share of a step that the next trial keeps."""


class CannotStand(RuntimeError):
    """The joints cannot carry the weight and the load at the start."""

    exit_code = 2


def settle(structure, load: Array | None = None) -> float:
    """Move the joined blocks that reach the ground (or a fixed block) to their equilibrium; they stay at rest.

    load (n, 6) [N, N m]: what else acts at the start. Returns the largest displacement [m].
    Raises CannotStand with the joint of largest damage.
    """
    rows = supported_blocks(structure)
    outer = structure.gravity_force() + (0.0 if load is None else load)
    scale = np.abs(outer[rows]).max(initial=0.0)
    if scale == 0.0:
        return 0.0
    start = structure.centre()
    search = Search(structure, rows, outer)
    enough = max(TOLERANCE * scale, search.rounding())
    for _ in range(MOST_ITERATIONS):
        residual = search.residual()
        largest = np.abs(residual).max()
        if largest <= enough:
            search.keep()
            return float(np.linalg.norm(structure.centre() - start, axis=1).max())
        search.along(search.direction(residual), residual)
    at = structure.names[rows[np.abs(residual).argmax() // 6]]
    reason = f"no equilibrium after {MOST_ITERATIONS} iterations, {largest:.2g} N or N m left on '{at}'"
    raise CannotStand(_message(structure, reason, search.damage))


class Search:
    """Trial places of the blocks `rows` under the forces `outer` (n, 6). Damage is measured from the start of the
    search, so that a step too far leaves none behind."""

    def __init__(self, structure, rows: Array, outer: Array):
        self._structure, self._rows, self._outer = structure, rows, outer
        self._dofs = (6 * rows[:, None] + np.arange(6)).ravel()
        self._history = structure.joints.history()
        self.damage = structure.joints.damage()
        """(J,) of the joints at the last place tried."""

    def rounding(self) -> float:
        """Forces [N] that the rounding of positions makes in the stiffest joints."""
        stiffest = self._structure.secant_without_friction().diagonal().reshape(-1, 6)[:, :3].max()
        extent = np.ptp(self._structure.centre(), axis=0).max() + max(
            b.radius for b in self._structure.blocks
        )
        return ROUNDING * np.finfo(float).eps * extent * float(stiffest)

    def residual(self) -> Array:
        """Unbalanced forces of the unknowns (6 rows,)."""
        return (self._outer + self._structure.internal_force()).ravel()[self._dofs]

    def direction(self, residual: Array) -> Array:
        """Newton's step where the tangent is positive definite, else the step of the secant stiffness."""
        tangent = factors(self._part(self._structure.tangent_without_friction()))
        if tangent is None:
            tangent = factors(self._part(self._structure.secant_without_friction()))
        if tangent is None:
            raise CannotStand(_message(self._structure, "joints have lost their stiffness", self.damage))
        return tangent.solve(residual)

    def along(self, step: Array, residual: Array) -> None:
        """Go along the step (6 rows,) until the unbalanced forces do little work on it any more."""
        share, first = 1.0, residual @ step
        self._move(step)
        for _ in range(MOST_TRIALS):
            left = self.residual() @ step
            if -SLACK * first <= left:
                break
            shorter = max(first / (first - left), SHORTEST) * share
            self._move((shorter - share) * step)
            share = shorter
        self._check()

    def keep(self) -> None:
        """Write the present positions into the history of the joints."""
        self._move(np.zeros(len(self._dofs)), note=True)

    def _move(self, step: Array, note: bool = False) -> None:
        step = step.reshape(-1, 6)
        turn = Rotation.from_rotvec(step[:, 3:]).as_matrix()
        self._structure.displace(self._rows, step[:, :3], turn)
        self.damage = self._structure.joints.damage()
        if not note:
            self._structure.joints.restore(self._history)

    def _check(self) -> None:
        if not np.isfinite(self.damage).all() or self.damage.max() >= 1.0:
            reason = "a joint opens beyond its opening at failure"
            raise CannotStand(_message(self._structure, reason, self.damage))

    def _part(self, matrix):
        return csc_matrix(matrix[self._dofs, :][:, self._dofs])


def factors(matrix) -> SuperLU | None:
    """Factors of a symmetric matrix if it is positive definite, else None.

    Pivots stay on the diagonal, so by Sylvester's law their signs are those of the eigenvalues."""
    try:
        factors = splu(
            matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError:  # exactly singular
        return None
    definite = (factors.perm_r == factors.perm_c).all() and (factors.U.diagonal() > 0.0).all()
    return factors if definite else None


def supported_blocks(structure) -> Array:
    """Rows of the movable blocks that live joints tie to a fixed plane or a fixed block."""
    table = structure.joint_table()
    if table is None:
        return np.zeros(0, np.int64)
    n = structure.n
    b = np.where(table.b < 0, n, table.b)[table.alive]
    a = table.a[table.alive]
    held = np.flatnonzero(structure.fixed)
    links = np.concatenate([np.stack([a, b]), np.stack([held, np.full(len(held), n)])], axis=1)
    graph = csc_matrix((np.ones(links.shape[1]), links), shape=(n + 1, n + 1))
    component = connected_components(graph, directed=False)[1]
    return np.flatnonzero((component[:n] == component[n]) & ~structure.fixed)


def _message(structure, reason: str, damage: Array) -> str:
    joints = structure.joints
    worst = int(np.nanargmax(damage))
    a, b = joints.a[worst], joints.b[worst]
    other = "the ground" if b < 0 else f"'{structure.names[b]}'"
    return (
        f"the structure cannot carry its own weight and the load at the start: {reason}. Most strained: the joint "
        f"of '{structure.names[a]}' with {other}, damage {damage[worst]:.2f}. Raise "
        "joints.strength, shorten the spans, or let it fall with structure.start = 'sudden'."
    )
