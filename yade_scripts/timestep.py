"""Time step of the structure: accuracy of joints and contacts, with the pair of blocks that limits it.

    dt = min( 0.1 * 2/ω_max,  0.2 sqrt(m/K) ),   ω_max² ≤ max over joints (S_i + S_j)

S_i: sum over the joints of block i of the largest eigenvalue of M_i⁻¹ K_ii (never below the exact ω_max). The explicit
limit is 2/ω_max; a tenth of it keeps the energy of a half-broken joint (the kink between tension and compression and
the damage make the leapfrog gain energy at larger steps). A dashpot of ratio z shortens the limit by sqrt(1+z²) - z.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from yade_scripts.blocks import Block

Array = np.ndarray

JOINT_SHARE = 0.1
CONTACT_SHARE = 0.2
DRIVEN_SHARE = 0.002


@dataclass(frozen=True)
class SubstepLimit:
    """dt [s] · what: the joint or block that limits it, in words · omega [rad/s] of the joints (0 without)."""

    dt: float
    what: str
    omega: float


def joint_frequency(blocks: list[Block], joints) -> tuple[float, int]:
    """Upper bound of ω_max [rad/s] and the joint that gives it (-1 without joints)."""
    if joints is None or len(joints.live) == 0:
        return 0.0, -1
    if joints.stiffest is None:
        joints.stiffest = _stiffest_modes(blocks, joints)
    live = joints.live
    S = np.zeros(len(blocks) + 1)  # the last one stands for the ground
    np.add.at(S, joints.a[live], joints.stiffest[live, 0])
    np.add.at(S, joints.b[live], joints.stiffest[live, 1])
    S[-1] = 0.0
    pair = S[joints.a[live]] + S[joints.b[live]]
    worst = int(np.argmax(pair))
    return float(np.sqrt(pair[worst])), int(live[worst])


def _stiffest_modes(blocks: list[Block], joints) -> Array:
    """Largest eigenvalue of M⁻¹ K of each joint for its two blocks (J, 2) [1/s²]; zero for blocks that do not yield."""
    modes = np.zeros((len(joints), 2))
    for j in range(len(joints)):
        for side, row in enumerate((joints.a[j], joints.b[j])):
            if row >= 0 and not (blocks[row].fixed or blocks[row].driven):
                modes[j, side] = _largest_eigenvalue(blocks[row], joints, j, row)
    return modes


def _largest_eigenvalue(block: Block, joints, j: int, row: int) -> float:
    """Largest eigenvalue of M⁻¹ K of one block held by one joint [1/s²], body frame."""
    p = slice(joints.start[j], joints.start[j + 1])
    stiff = joints.weight[p] * joints.k0[j] * max(1.0, joints.kc[j] / joints.k0[j], joints.beta[j] ** 2)
    arm = joints.xi_a[p] if row == joints.a[j] else joints.xi_b[p]
    B = np.zeros((len(arm), 3, 6))
    B[:, range(3), range(3)] = 1.0
    B[:, 0, 4], B[:, 0, 5] = arm[:, 2], -arm[:, 1]
    B[:, 1, 3], B[:, 1, 5] = -arm[:, 2], arm[:, 0]
    B[:, 2, 3], B[:, 2, 4] = arm[:, 1], -arm[:, 0]
    K = np.einsum("p,pki,pkj->ij", stiff, B, B)
    M = np.zeros((6, 6))
    M[:3, :3], M[3:, 3:] = block.mass * np.eye(3), block.inertia
    L = np.linalg.inv(np.linalg.cholesky(M))
    return float(np.linalg.eigvalsh(L @ K @ L.T)[-1])


def substep_limit(
    blocks: list[Block],
    joints,
    face_stiffness: Array | None,
    damping: float = 0.0,
    contact_damping: float = 0.0,
) -> SubstepLimit:
    """The substep that joints and contacts allow. face_stiffness (n,) [N/m], None without contact.

    damping, contact_damping: ζ of joints and contacts; a dashpot in parallel shortens the limit of the explicit
    scheme by √(1 + ζ²) - ζ."""
    best = SubstepLimit(np.inf, "nothing limits the substep (no joints, no contact)", 0.0)
    omega, j = joint_frequency(blocks, joints)
    if omega > 0.0:
        dt = JOINT_SHARE * 2.0 / omega * _dashpot_share(damping)
        other = blocks[joints.b[j]].name if joints.b[j] >= 0 else "ground"
        best = SubstepLimit(dt, f"joint {blocks[joints.a[j]].name} - {other}, ω ≤ {omega:.4g} rad/s", omega)
    if face_stiffness is not None and len(blocks):
        mass = np.array([np.inf if b.fixed or b.driven else b.mass for b in blocks])
        limit = CONTACT_SHARE * _dashpot_share(contact_damping) * np.sqrt(mass / face_stiffness)
        i = int(np.argmin(limit))
        if limit[i] < best.dt:
            text = f"contact of block {blocks[i].name}: m = {mass[i]:.4g} kg, K = {face_stiffness[i]:.4g} N/m"
            best = SubstepLimit(float(limit[i]), text, omega)
    return _driven_limit(blocks, joints, best)


def _dashpot_share(damping: float) -> float:
    """√(1 + ζ²) - ζ."""
    return float(np.sqrt(1.0 + damping**2) - damping)


def _driven_limit(blocks: list[Block], joints, best: SubstepLimit) -> SubstepLimit:
    """A driven block opens no joint by more than DRIVEN_SHARE δ_f a substep."""
    if joints is None:
        return best
    for block in blocks:
        speed = np.linalg.norm(block.velocity) + np.linalg.norm(block.spin) * block.radius
        if block.driven and speed * best.dt > DRIVEN_SHARE * joints.df.min():
            dt = DRIVEN_SHARE * joints.df.min() / speed
            best = SubstepLimit(
                float(dt), f"prescribed motion of block {block.name}, {speed:.4g} m/s", best.omega
            )
    return best
