"""Start at rest: where the joints carry the weight and the load that act at the start.

A building whose weight comes on at once swings to twice its deflection, and may break before anything has hit it. So
the joined blocks are moved to their equilibrium first,

    f(u) = f_joints(u) + f_weight + f_load = 0,      K_sec(u) Δu = f(u),   u ← u + Δu,

with the secant stiffness K_sec of the joints (the law of the joints makes this converge as long as they can carry
the load; softening joints need several iterations, joints that cannot carry it make it diverge).
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu
from scipy.spatial.transform import Rotation

Array = np.ndarray

TOLERANCE = 1e-7
MOST_ITERATIONS = 60


class CannotStand(RuntimeError):
    """The joints cannot carry the weight and the load at the start."""

    exit_code = 2


def settle(structure, load: Array | None = None) -> float:
    """Move the joined blocks that reach the ground (or a fixed block) to their equilibrium; they stay at rest.

    load (n, 6) [N, N m]: what else acts at the start. Returns the largest displacement [m].
    Raises CannotStand with the joint of largest damage.
    """
    rows = supported_blocks(structure)
    if len(rows) == 0:
        return 0.0
    start = structure.centre()
    outer = structure.gravity_force() + (0.0 if load is None else load)
    scale = np.abs(outer[rows]).max()
    if scale == 0.0:
        return 0.0
    dofs = (6 * rows[:, None] + np.arange(6)).ravel()
    for _ in range(MOST_ITERATIONS):
        residual = (outer + structure.internal_force()).ravel()[dofs]
        if np.abs(residual).max() <= TOLERANCE * scale:
            return float(np.linalg.norm(structure.centre() - start, axis=1).max())
        stiffness = structure.tangent()[0][dofs, :][:, dofs]
        step = _solved(structure, stiffness, residual)
        structure.displace(rows, step[:, :3], Rotation.from_rotvec(step[:, 3:]).as_matrix())
        _check_joints(structure)
    raise CannotStand(_message(structure, f"no equilibrium after {MOST_ITERATIONS} iterations"))


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


def _solved(structure, stiffness, residual: Array) -> Array:
    try:
        return splu(csc_matrix(stiffness)).solve(residual).reshape(-1, 6)
    except RuntimeError as error:
        raise CannotStand(_message(structure, "joints have lost their stiffness")) from error


def _check_joints(structure) -> None:
    damage = structure.joint_table().damage
    if not np.isfinite(damage).all() or damage.max() >= 1.0:
        raise CannotStand(_message(structure, "a joint opens beyond its opening at failure"))


def _message(structure, reason: str) -> str:
    table = structure.joint_table()
    worst = int(np.nanargmax(table.damage))
    b = "the ground" if table.b[worst] < 0 else f"'{structure.names[table.b[worst]]}'"
    return (
        f"the structure cannot carry its own weight and the load at the start: {reason}. Most strained: the joint "
        f"of '{structure.names[table.a[worst]]}' with {b}, damage {min(table.damage[worst], 1.0):.2f}. Raise "
        "joints.strength, shorten the spans, or let it fall with structure.start = 'sudden'."
    )
