"""Time step of the structure: accuracy of joints and contacts, with the pair of blocks that limits it.

    dt = min( s * 2/ω_max,  0.2 sqrt(m/K),  0.9 of the limit (1) of contacts below ),  s = 0.4 or 0.1,
    ω_max² ≤ max over blocks of the largest eigenvalue of M_i⁻¹ Σ c K_ii

K_ii: what a joint holds block i with; c = 2, since |d_a - d_b|² ≤ 2 |d_a|² + 2 |d_b|², or 1 where d_b = 0 is fixed.
As M_i⁻¹ Σ K_ii is part of the whole, the bound is at most √2 of the exact ω_max. The explicit limit is 2/ω_max. Of it
0.4 is taken as long as the joints hold, that is no point has passed its peak or moves by more than 0.01 δ_f in such a
substep: joints and contacts of one block, which are springs beside one another, then stay stable together, 0.4² + 0.9²
< 1. Else it is a tenth, which keeps the work of separation at any speed. It is a tenth from the start where k_c differs
from k_0, since the leapfrog gains energy at the kink (bilinear law, k_c = 4 k_0: 0.02 % of it at a tenth, 0.6 % at
0.4), and with the potential of Needleman, whose work is right only where an opening takes several substeps. A dashpot
of ratio z shortens the limit by sqrt(1+z²) - z.

For contacts the sum is over two faces of a block, those for which the limit is shortest: a block between two others, or
in the corner of a tank. The n_f nodes p of a face f, at the arms r_p, share its stiffness K:

    K_n,f = K/n_f Σ_p B_pᵀ n nᵀ B_p,   K_t,f = K_t/n_f Σ_p B_pᵀ (1 - n nᵀ) B_p,   B_p (u, θ) = u + θ x r_p

so that rocking counts, and shear at the height of the centre above the face. c = 2 where another block of the scene
moves, else 1. Dashpots are in proportion to springs: η = 2 ζ/ω_0 along the normal and η_t = 2 ζ_t/(ω_0 sqrt(K_t/K))
along the face, ω_0² = K/m_eff at the middle of the face, 1/m_eff ≥ c/m + (r x n)·I⁻¹(r x n). At the limit the fastest
mode reverses in every substep. Tangential dashpots take the speed half a substep ago, then 2/dt of the displacement.
Normal ones take the speed of the present time as `contact.springs.normal_force` finds it, twice as much less what the
force itself takes off. Both act as stiffer springs, and the motion is stable as long as

    λ_max( M_i⁻¹ Σ_f c [ (dt²/4 + η dt)/(1 + ω_0² η dt) K_n,f + (dt²/4 + η_t dt/2) K_t,f ] ) ≤ 1                 (1)

which is dt ≤ 2/ω_max without dashpots. Fewer nodes of a face have weaker springs, but a stronger dashpot, since their
K is less; any part of the nodes of one face stays within the bound of two (boxes of four shapes, K_t/K of 0.1 to 10, ζ
of 0 to 2, all parts). With one face in place of two, (1) is within 10 % of where the energy of a cube on the ground
begins to grow, which is at 1.7 to 2.2 times the bound of two (K_t/K of 0.5 to 10, e of 0.3 and 0.1). The limit is never
longer than √(m/K) (√(1 + ζ²) - ζ), beyond which a touch lasts less than three substeps. Not covered: more than two
faces in contact at a time, smaller blocks that press with the whole stiffness K on a corner of a larger one, or several
on one face, faces that meet equally large ones of stiffer joints (up to 2 K), and joints and contacts of one block
together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.optimize import brentq
from scipy.sparse.linalg import eigsh

from array_types import Array
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.tangent import assemble, joint_springs
from yade_scripts.contact.law import ContactLaw
from yade_scripts.contact.nodes import block_nodes

HOLDING_SHARE = 0.4
SOFTENING_SHARE = 0.1
"""Of the explicit limit of joints: as long as they hold, and else."""
QUIET = 0.01
"""Largest growth of λ/δ_f in a substep of joints that hold."""
CONTACT_SHARE = 0.2
"""Of √(m/K), which is 2/ω of a chain of equal blocks in contact that move along their normals, ω² ≤ 4 K/m."""
STABLE_SHARE = 0.9
"""Most of the explicit limit of contacts that is taken where no substep is asked for. It decides where springs along
faces are stiffer than normal ones; elsewhere `CONTACT_SHARE` is shorter, for boxes from e = 0.06 on."""
ROUNDING = 1e-9
"""Relative accuracy to which the explicit limit of contacts is found."""
TINY = float(np.finfo(float).tiny)
"""Absolute accuracy of it, so that the relative one decides; that of scipy, 2e-12, is too coarse for short limits."""
DRIVEN_SHARE = 0.002
DENSE = 60
"""Unknowns up to which the exact frequency is found with full matrices."""


class SubstepTooLong(ValueError):
    """The explicit scheme is unstable at the substep asked for."""

    exit_code = 2


@dataclass(frozen=True, kw_only=True)
class SubstepLimit:
    """dt [s] · what: the joint or block that limits it, in words · omega [rad/s] of the joints (0 without)

    stable [s], stable_what: the same for the explicit limit, beyond which energy grows without end.
    """

    dt: float
    what: str
    omega: float
    stable: float = np.inf
    stable_what: str = ""

    def check(self, substep: float) -> None:
        """Raise SubstepTooLong beyond the explicit limit."""
        if substep > self.stable * (1.0 + 1e-9):
            raise SubstepTooLong(
                f"substep {substep:.4g} s is too long: the motion is unstable beyond {self.stable:.4g} s "
                f"({self.stable_what}); accurate up to {self.dt:.4g} s ({self.what}). Take that, or leave it out"
            )

    def remark(self, substep: float) -> str:
        """A remark on a substep that is stable but not accurate; "" if it is both."""
        if substep <= self.dt * (1.0 + 1e-9):
            return ""
        return (
            f"substep {substep:.4g} s is stable, but longer than the {self.dt:.4g} s that the accuracy of energy asks "
            f"for ({self.what})"
        )


def joint_frequency(blocks: list[Block], joints) -> tuple[float, int]:
    """Upper bound of ω_max [rad/s], at most √2 of it, and the joint that gives most to it (-1 without joints)."""
    if joints is None or len(joints.visited) == 0:
        return 0.0, -1
    if joints.stiffness_on is None:
        joints.stiffness_on = _stiffness_on_blocks(blocks, joints)
    live = joints.visited
    K = np.zeros((len(blocks) + 1, 6, 6))  # the last one stands for the ground
    for side, row in zip(joints.stiffness_on, (joints.a, joints.b)):
        np.add.at(K, row[live], side[live])
    rows = np.unique(np.concatenate([joints.a[live], joints.b[live] % len(K)]))
    largest = np.zeros(len(K))
    largest[rows] = np.linalg.eigvalsh(K[rows])[:, -1]
    worst = int(np.argmax(largest))
    share = [
        np.where(row[live] % len(K) == worst, np.trace(side[live], axis1=1, axis2=2), 0.0)
        for side, row in zip(joints.stiffness_on, (joints.a, joints.b))
    ]
    return float(np.sqrt(largest[worst])), int(live[np.argmax(share[0] + share[1])])


def exact_joint_frequency(blocks: list[Block], joints) -> float:
    """ω_max [rad/s] of the live joints: the largest eigenvalue of M⁻¹ K, K with k_0 or k_c, the larger, in the normals
    and β² k_0 across. Takes a sparse eigenvalue problem of six unknowns a block."""
    held = [b.fixed or b.driven for b in blocks]
    free = np.flatnonzero(~np.repeat(held, 6))
    if joints is None or len(joints.live) == 0 or len(free) == 0:
        return 0.0
    x, R = np.array([b.centre for b in blocks]), np.array([b.rotation for b in blocks])
    springs = _first_springs(joints, x, R)
    root = sp.block_diag([_inverse_root(b) for b in blocks], format="csr")
    K = (root.T @ assemble(springs, len(blocks))[0] @ root)[free][:, free]
    if len(free) <= DENSE:
        return float(np.sqrt(np.linalg.eigvalsh(K.toarray())[-1]))
    start = np.cos(np.arange(len(free)))  # fixed, so that the same blocks give the same number
    return float(np.sqrt(eigsh(K, k=1, which="LA", v0=start, return_eigenvectors=False)[0]))


def _first_springs(joints, x: Array, R: Array):
    """Springs of the undamaged live joints, closed or open, whichever is stiffer; arms in world axes."""
    springs = joint_springs(joints, x, R)
    index = np.flatnonzero(joints.alive[joints.joint_of])
    j = joints.joint_of[index]
    kn = joints.weight[index] * np.maximum(joints.k0[j], joints.kc[j])
    kt = joints.weight[index] * joints.beta[j] ** 2 * joints.k0[j]
    return replace(springs, kn=kn, kt=kt)


def _inverse_root(block: Block) -> Array:
    """A with A Aᵀ = M⁻¹ (6, 6), world axes."""
    root = np.zeros((6, 6))
    root[:3, :3] = np.eye(3) / np.sqrt(block.mass)
    turned = block.rotation @ block.inertia @ block.rotation.T
    root[3:, 3:] = np.linalg.inv(np.linalg.cholesky(turned)).T
    return root


def _stiffness_on_blocks(blocks: list[Block], joints) -> tuple[Array, Array]:
    """What each joint adds to 2 M⁻¹ᐟ² K_ii M⁻¹ᐟ² of its block a and its block b, (J, 6, 6) each [1/s²].

    Once instead of twice where the other side does not yield; zero for blocks that do not."""
    root = np.zeros((len(blocks) + 1, 6, 6))  # the last one stands for the ground
    for i, block in enumerate(blocks):
        if not (block.fixed or block.driven):
            root[i, :3, :3] = np.eye(3) / np.sqrt(block.mass)
            root[i, 3:, 3:] = np.linalg.inv(np.linalg.cholesky(block.inertia)).T
    frame = np.array([b.rotation for b in blocks] + [np.eye(3)])
    normal = np.einsum("jkl,jl->jk", frame[joints.a], joints.normal[:, 0])
    yields = np.any(root, axis=(1, 2))
    count = np.where(yields[joints.a] & yields[joints.b], 2.0, 1.0)[:, None, None]
    sides = ((joints.xi_a, joints.a), (joints.xi_b, joints.b))
    first, second = (
        count
        * root[row].transpose(0, 2, 1)
        @ _block_stiffness(joints, arm, _in_frame(frame[row], normal))
        @ root[row]
        for arm, row in sides
    )
    return first, second


def _in_frame(frame: Array, vectors: Array) -> Array:
    """World vectors (J, 3) in the axes of frames (J, 3, 3)."""
    return np.einsum("jkl,jk->jl", frame, vectors)


def _block_stiffness(joints, arm: Array, normal: Array) -> Array:
    """K (J, 6, 6) that each joint holds one of its blocks with: points at arm (P, 3), axes those of normal (J, 3);
    k_0 or k_c, the larger, along the normals and β² k_0 across."""
    kn, kt = np.maximum(joints.k0, joints.kc), joints.beta**2 * joints.k0
    D = (kn - kt)[:, None, None] * normal[:, :, None] * normal[:, None, :] + kt[:, None, None] * np.eye(3)
    D = D[joints.joint_of] * joints.weight[:, None, None]
    B = _motion_of_points(arm)
    return np.add.reduceat(B.transpose(0, 2, 1) @ (D @ B), joints.start[:-1])


def _motion_of_points(arm: Array) -> Array:
    """B (P, 3, 6): displacement of points at arm (P, 3) from the centre of a block by its own (u, θ), u + θ x arm."""
    B = np.zeros((len(arm), 3, 6))
    B[:, range(3), range(3)] = 1.0
    B[:, 0, 4], B[:, 0, 5] = arm[:, 2], -arm[:, 1]
    B[:, 1, 3], B[:, 1, 5] = -arm[:, 2], arm[:, 0]
    B[:, 2, 3], B[:, 2, 4] = arm[:, 1], -arm[:, 0]
    return B


def contact_limits(blocks: list[Block], face_stiffness: Array, law: ContactLaw) -> Array:
    """Explicit limit (n,) [s] of the substep by the contacts that each block may have, equation (1); inf for blocks of
    prescribed motion.

    face_stiffness (n,) [N/m] · law: constants of contacts. Source: the von Neumann condition of the leapfrog with
    dashpots, for the two faces that make it shortest."""
    free = [i for i, b in enumerate(blocks) if not (b.fixed or b.driven)]
    limits, of_shape = np.full(len(blocks), np.inf), {}
    for i in free:
        shape = blocks[i].vertices.tobytes(), tuple(map(tuple, blocks[i].faces))
        if shape not in of_shape:
            of_shape[shape] = _contact_limit(blocks[i], 2.0 if len(free) > 1 else 1.0, law)
        limits[i] = of_shape[shape] * np.sqrt(blocks[i].mass / face_stiffness[i])
    return limits


def _contact_limit(block: Block, count: float, law: ContactLaw) -> float:
    """Explicit limit in √(m/K): dt of equation (1) for the two faces for which it is shortest. count: c."""
    normal, across, turning = _stiffness_of_faces(block, law.nodes_per_edge)
    one, other = np.triu_indices(len(normal), 1)
    zeta, zeta_t = law.damping_ratio, law.tangential_damping_ratio
    omega = np.sqrt(count + turning)
    eta, omega_t = 2.0 * zeta / omega, omega
    if zeta_t >= 0.0:
        omega_t = np.full(len(omega), np.sqrt(count))
    eta_t = 2.0 * (zeta_t if zeta_t >= 0.0 else zeta) / (omega_t * np.sqrt(law.shear_ratio))

    def acting(dt: float, faces: Array) -> Array:
        spring = 0.25 * dt**2
        along = (spring + eta * dt) / (1.0 + omega**2 * eta * dt)
        sideways = law.shear_ratio * (spring + 0.5 * eta_t * dt)
        K = count * (along[:, None, None] * normal + sideways[:, None, None] * across)
        return np.linalg.eigvalsh(K[faces].sum(axis=1))[:, -1]

    pairs, dt = np.stack([one, other], axis=1), _dashpot_share(zeta)
    while True:
        largest = acting(dt, pairs)
        worst = int(np.argmax(largest))
        if largest[worst] <= 1.0 + ROUNDING:
            return dt
        pair = pairs[worst, None]
        dt = float(brentq(lambda t, pair: acting(t, pair)[0] - 1.0, 0.0, dt, (pair,), TINY, 0.1 * ROUNDING))


def _stiffness_of_faces(block: Block, per_edge: int) -> tuple[Array, Array, Array]:
    """M⁻¹ᐟ² K M⁻¹ᐟ² of springs at the nodes of each face, along its normal and across, (F, 6, 6) each in K/m, and
    m (r x n)·I⁻¹(r x n) (F,) of the middle r of its nodes."""
    points, holders = block_nodes(block, per_edge)
    root = np.eye(6)
    root[3:, 3:] = np.linalg.inv(np.linalg.cholesky(block.inertia / block.mass)).T
    normal, across, turning = [], [], []
    for number, n in enumerate(block.planes[0]):
        B = _motion_of_points(points[[number in held for held in holders]]) @ root
        all_ways, along = np.einsum("pki,pkj->ij", B, B), n @ B
        normal.append(along.T @ along / len(B))
        across.append(all_ways / len(B) - normal[-1])
        turning.append(np.sum(along.mean(axis=0)[3:] ** 2))
    return np.array(normal), np.array(across), np.array(turning)


def substep_limit(
    blocks: list[Block],
    joints,
    face_stiffness: Array,
    damping: float = 0.0,
    law: ContactLaw | None = None,
    contact_stable: Array | None = None,
    asleep: Array | None = None,
    holding: bool = False,
) -> SubstepLimit:
    """The substep that joints and contacts allow, and the explicit limit.

    holding: whether the joints hold, as the module says.

    face_stiffness (n,) [N/m] · asleep (n,) bool: blocks that do not count, None: all do
    damping: ζ of joints; a dashpot in parallel shortens the limit of the explicit scheme by √(1 + ζ²) - ζ
    law, contact_stable (n,) [s]: constants of contacts and their `contact_limits`, None without contact."""
    best = SubstepLimit(dt=np.inf, what="nothing limits the substep (no joints, no contact)", omega=0.0)
    omega, j = joint_frequency(blocks, joints)
    if omega > 0.0:
        stable = 2.0 / omega * _dashpot_share(damping)
        other = blocks[joints.b[j]].name if joints.b[j] >= 0 else "ground"
        text = f"joint {blocks[joints.a[j]].name} - {other}, ω ≤ {omega:.4g} rad/s"
        share = HOLDING_SHARE if holding else SOFTENING_SHARE
        best = SubstepLimit(dt=share * stable, what=text, omega=omega, stable=stable, stable_what=text)
    if law is not None and contact_stable is not None and len(blocks):
        passed = np.zeros(len(blocks), bool) if asleep is None else asleep
        best = _contact_substep(blocks, face_stiffness, law, np.where(passed, np.inf, contact_stable), best)
    return _driven_limit(blocks, joints, best)


def _contact_substep(
    blocks: list[Block], K: Array, law: ContactLaw, explicit: Array, best: SubstepLimit
) -> SubstepLimit:
    """`best`, or what contacts with faces of stiffness K (n,) and these explicit limits (n,) allow, where less."""
    mass = np.array([b.mass if np.isfinite(e) else np.inf for b, e in zip(blocks, explicit)])
    accurate = _dashpot_share(law.damping_ratio) * np.sqrt(mass / K)
    i, j = int(np.argmin(accurate)), int(np.argmin(explicit))
    if CONTACT_SHARE * accurate[i] < best.dt:
        text = f"contact of block {blocks[i].name}: m = {mass[i]:.4g} kg, K = {K[i]:.4g} N/m"
        best = replace(best, dt=float(CONTACT_SHARE * accurate[i]), what=text)
    text = f"contact of block {blocks[j].name}: m = {mass[j]:.4g} kg, K = {K[j]:.4g} N/m, "
    text += f"K_t = {law.shear_ratio * K[j]:.4g} N/m"
    if STABLE_SHARE * explicit[j] < best.dt:
        best = replace(best, dt=float(STABLE_SHARE * explicit[j]), what=text)
    if explicit[j] < best.stable:
        best = replace(best, stable=float(explicit[j]), stable_what=text)
    return best


def _dashpot_share(damping: float) -> float:
    """√(1 + ζ²) - ζ."""
    return float(np.sqrt(1.0 + damping**2) - damping)


def _driven_limit(blocks: list[Block], joints, best: SubstepLimit) -> SubstepLimit:
    """Substep at which a driven block opens no joint by more than DRIVEN_SHARE δ_f."""
    if joints is None:
        return best
    for block in (b for b in blocks if b.driven):
        along = np.linalg.norm(block.velocity) if block.motion is None else block.motion.fastest()
        speed = along + np.linalg.norm(block.spin) * block.radius
        if speed * best.dt > DRIVEN_SHARE * joints.df.min():
            dt = DRIVEN_SHARE * joints.df.min() / speed
            text = f"prescribed motion of block {block.name}, {speed:.4g} m/s"
            best = replace(best, dt=float(dt), what=text)
    return best
