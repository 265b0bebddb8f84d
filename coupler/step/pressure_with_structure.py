"""The pressure solve with the structure inside, so that light debris and bonded walls need no iteration.

One step of length dt, about block centres, world axes; one row of six [velocity, angular velocity] a body.
Water (x: unknown part of the pressure, p = x + known; q_i: hat functions):

    (dt/ρ) K x = ∫ u*·∇q + G V                                   mass balance with moving walls          (1)

Structure, implicit in its own stiffness and damping over the step:

    D V = M/dt V^n + f − Gᵀ (x + known),   D = M/dt + C + dt K_sec                                     (2)

f: gravity, joint and contact forces at t^n; K_sec: secant stiffness of live joints and active contacts;
C: their dashpots. Eliminating V gives one symmetric positive definite system,

    [(dt/ρ) K + G D⁻¹ Gᵀ] x = ∫ u*·∇q + G V_free,   V = V_free − D⁻¹ Gᵀ x,                             (3)
    V_free = D⁻¹ (M/dt V^n + f − Gᵀ known).

The force −Gᵀ (x + known) is the exact adjoint of the volume flux G V of the bodies in (1), so the power that leaves the
water through the wetted surfaces equals the power received by the velocities V, to round-off. `other_load` of the water
(wall shear; its surface in the cells of a body) is part of f.

The blocks move while the load is held constant, and the buoyancy of a floating block decreases as it rises. The
hydrostatic stiffness K_h (`fluid.pressure.waterline`, 3) therefore acts over half of the displacement: h K_h with
h = (dt - dt_s)/2 is added to D, and the load is reduced by h K_h V (dt_s: substep, which moves a block with the
velocity at its end, so that a step of one substep needs nothing). With h = 0 an oscillation would grow by ω² dt²/4 in
every step of many substeps; with h = dt/2 it decays by as much in steps of one.

V is the velocity at the end of the step.  Over the step the blocks move with the mean

    V − L,    L = ½ (1 − dt_s/dt) D⁻¹ (M/dt + h K_h) (V − V^n)                                         (4)

(dt_s: substep; the load acts from the first one on).  Stiff joints and contacts, for which D⁻¹ is small,
oscillate within a step, so that only their mean velocity matters.  A second pass replaces the estimate (2) by the
motion of the discrete elements under the first load x₁, with the mean velocity W over the step:
V_free = V + D⁻¹ Gᵀ x₁ with the V of which W is the mean by (4), V = W + L(V). With the L of the first pass instead, the
error of blocks that collide within the step, which the first pass could not foresee, would only be halved in each pass.
D and L are then those of the joints and contacts at the end of the first pass: a block that the water presses to the
floor is held by contacts that begin within the step.  And where the water did not move with a block before the step,
V^n in (4) is `start_of_water`: a block thrown at the bed through still water comes back within the step, and with its
own V^n the water would have to turn round with it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from array_types import Array, Bools, Floats
from coupler.step.coupling_rows import Wetting
from kernels.decorators import kernel, plain

if TYPE_CHECKING:
    from fluid.pressure.projection import PressureProblem

DEFECT_FLOOR = 1e-3
"""Fraction of the energy of the scene below which the motion of blocks counts as rest."""
ROUND_OFF = 1e-12
"""The same for round-off, where neither load nor weight gives a larger energy."""
LEAD_ROUNDS = 12
"""Number of iterations for the velocity at the end of a step from its mean; the error is reduced by 2⁻¹²."""


def mass_matrix(mass: Array, inertia: Array) -> sp.csr_array:
    """Block-diagonal mass of rigid bodies: mass (n,) [kg], inertia (n, 3, 3) [kg m²], world axes → (6n, 6n)."""
    n = len(mass)
    blocks = np.zeros((n, 6, 6))
    blocks[:, [0, 1, 2], [0, 1, 2]] = np.asarray(mass)[:, None]
    blocks[:, 3:, 3:] = inertia
    return sp.csr_array(sp.bsr_array((blocks, np.arange(n), np.arange(n + 1)), shape=(6 * n, 6 * n)))


class StructureResponse:
    """Equation (2): the velocities that a force held over the step gives to the bodies.

    mass, stiffness, damping: (6n, 6n) sparse, world axes · dt [s] · driven (n,) bool: bodies whose velocity
    `driven_velocity` (n, 6) is imposed (fixed solids, prescribed motions); they do not respond to loads · driven_lead
    (n, 6): that velocity, which is the one at the end of the step, less their mean over it, None: it does not change ·
    afloat (n, 3, 3): K_h for heave, roll and pitch, None: of no body · substep dt_s [s]: of the blocks afloat.
    """

    def __init__(
        self,
        mass: sp.csr_array,
        stiffness: sp.csr_array,
        damping: sp.csr_array,
        dt: float,
        driven: Array,
        driven_velocity: Array,
        afloat: Array | None = None,
        substep: float = 0.0,
        driven_lead: Array | None = None,
    ) -> None:
        self._driven_lead = driven_lead
        self.dt = dt
        self.mass = mass
        self.imposed = np.where(driven[:, None], driven_velocity, 0.0).ravel()
        self.free = np.flatnonzero(np.repeat(~driven, 6))
        self._restoring = (
            None
            if afloat is None
            else _of_heave(0.5 * (dt - substep) * afloat, mass.diagonal().reshape(-1, 6))
        )
        self._held = sp.csr_array(mass / dt)
        self.matrix = self._held
        for part in (damping, dt * stiffness, self._restoring):
            if part is not None and part.nnz:
                self.matrix = self.matrix + part
        own, tied = _own_blocks(self.matrix.indptr, self.matrix.indices, self.matrix.data, len(driven))
        tied &= ~driven
        self._alone = np.flatnonzero(~driven & ~tied)
        self._inverse = np.linalg.inv(own[self._alone])
        self._tied = np.flatnonzero(np.repeat(tied, 6))
        self._factor = None
        if len(self._tied):
            block = self.matrix[self._tied][:, self._tied]
            self._factor = splu(
                sp.csc_matrix(block), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}
            )

    def compliance(self, force: Array) -> Array:
        """D⁻¹ force over the free bodies, zero on the driven ones. force (6n,) [N, N m] → (6n,) [m/s, rad/s]

        Bodies without joints or contacts are solved one by one."""
        velocity = np.zeros_like(force)
        _answer(self._alone, self._inverse, force, velocity)
        if self._factor is not None:
            velocity[self._tied] = self._factor.solve(np.ascontiguousarray(force[self._tied]))
        return velocity

    def velocity(self, force: Array) -> Array:
        """Solve D V = force with the driven bodies at their imposed velocity. (6n,) → (6n,)"""
        return self.imposed + self.compliance(force - self.matrix @ self.imposed)

    def free_velocity(self, velocity: Array, force: Array) -> Array:
        """V_free of (3) from the velocities at t^n and the force without the unknown pressure, each (n, 6)."""
        return self.velocity(self.mass @ velocity.ravel() / self.dt + force.ravel())

    def restoring_load(self, velocity: Array) -> Array:
        """-h K_h V (n, 6) [N, N m] of V (n, 6): change of the load over the first half of the displacement."""
        if self._restoring is None:
            return np.zeros_like(velocity)
        return -(self._restoring @ velocity.ravel()).reshape(-1, 6)

    def held(self, force: Array) -> Array:
        """Share (n, 1), 0 to 1, of a force (n, 6) on each body that joints, contacts and imposed rest hold: 0 where it
        moves the body within the step as if that were loose, and where a motion is imposed."""
        share = np.where(self.imposed.reshape(-1, 6).any(axis=1), 0.0, 1.0)
        free = np.zeros(len(share), bool)
        free[self.free // 6] = True
        bodies = np.flatnonzero(free & force.any(axis=1))
        if len(bodies):
            inertia = _own_blocks(self._held.indptr, self._held.indices, self._held.data, len(share))[0][
                bodies
            ]
            answer = self.compliance(force.ravel()).reshape(-1, 6)[bodies]
            loose = np.linalg.solve(inertia, force[bodies][:, :, None])[:, :, 0]
            moved, whole = (np.einsum("ni,nij,nj->n", v, inertia, v) for v in (answer, loose))
            share[bodies] = np.clip(1.0 - np.sqrt(moved / whole), 0.0, 1.0)
        return share[:, None]

    def lead(self, velocity: Array, before: Array, substep: float) -> Array:
        """L (n, 6) of (4) from V and V^n (n, 6): the difference between V and the mean velocity over the step; for
        driven bodies that of their motion.

        substep dt_s [s]."""
        change = (velocity - before).ravel()
        gained = self._held @ change
        if self._restoring is not None:
            gained += self._restoring @ change
        lead = 0.5 * (1.0 - substep / self.dt) * self.compliance(gained).reshape(-1, 6)
        return lead if self._driven_lead is None else lead + self._driven_lead

    def at_end(self, mean: Array, before: Array, substep: float) -> Array:
        """The V (n, 6) of (4) whose mean over the step is mean (n, 6), by the fixed-point iteration V = mean + L(V),
        which reduces the error to less than half each time. before V^n (n, 6), substep dt_s [s]."""
        velocity = mean
        for _ in range(LEAD_ROUNDS):
            velocity = mean + self.lead(velocity, before, substep)
        return velocity


def _of_heave(blocks: Array, mass: Array) -> sp.csr_array:
    """(6n, 6n) from blocks (n, 3, 3) for heave, roll and pitch; only the positive definite part of them is kept.

    mass (n, 6) [kg, kg m²]: of every component; the radius of gyration converts angles to lengths."""
    n = len(blocks)
    gyration = np.sqrt(mass[:, 3:].mean(axis=1) / np.where(mass[:, 0] > 0.0, mass[:, 0], 1.0))
    length = np.ones((n, 3))
    length[:, 1:] = np.where(gyration > 0.0, gyration, 1.0)[:, None]
    unit = length[:, :, None] * length[:, None, :]
    value, vector = np.linalg.eigh(0.5 * (blocks + blocks.transpose(0, 2, 1)) / unit)
    whole = np.zeros((n, 6, 6))
    whole[:, 2:5, 2:5] = unit * np.einsum("nik,nk,njk->nij", vector, np.maximum(value, 0.0), vector)
    matrix = sp.csr_array(sp.bsr_array((whole, np.arange(n), np.arange(n + 1)), shape=(6 * n, 6 * n)))
    matrix.eliminate_zeros()
    return matrix


@kernel
def _own_blocks(indptr: Array, indices: Array, data: Array, n: int) -> tuple[Array, Array]:
    """Diagonal blocks (n, 6, 6) of a csr matrix (6n, 6n), and (n,) bool: bodies with entries in the rows of others."""
    blocks, tied = np.zeros((n, 6, 6)), np.zeros(n, np.bool_)
    for row in range(6 * n):
        for s in range(indptr[row], indptr[row + 1]):
            column = indices[s]
            if column // 6 == row // 6:
                blocks[row // 6, row % 6, column % 6] += data[s]
            elif data[s] != 0.0:
                tied[row // 6] = tied[column // 6] = True
    return blocks, tied


@plain
def _answer(bodies: Array, inverse: Array, force: Array, velocity: Array) -> None:
    """Rows of `bodies` (k,) of velocity (6n,) from force (6n,) and inverse (k, 6, 6), in place."""
    for k in range(len(bodies)):
        first = 6 * bodies[k]
        for i in range(6):
            total = 0.0
            for j in range(6):
                total += inverse[k, i, j] * force[first + j]
            velocity[first + i] = total


@dataclass(frozen=True, kw_only=True)
class CoupledSolution:
    """x (n_dofs,) [Pa] · velocity (n_bodies, 6) [m/s, rad/s] at the end of the step · load (n_bodies, 6) [N, N m] on
    the bodies · problem: with all of this load (`_acting`) · at_bound (n_dofs,) bool, parting (n_dofs,) [m³/s], lower
    (n_dofs,) [Pa]: see `fluid.numerics.bounded`."""

    x: Floats
    velocity: Floats
    load: Floats
    problem: PressureProblem
    iterations: int
    at_bound: Bools
    parting: Floats
    lower: Floats


def solve_coupled(
    problem: PressureProblem,
    response: StructureResponse,
    v_free: Array,
    solve: Callable,
    rtol: float,
    before: CoupledSolution | None = None,
    wetting: Wetting | None = None,
) -> CoupledSolution:
    """Solve (3) with the lower bound of the pressure.

    problem: the PressureProblem of the water · v_free (6 n_bodies,) · solve: a function with the arguments of
    `fluid.numerics.bounded.solve_bounded` · before: solution of the pass before, the initial guess · wetting: that of
    the problem unless given."""
    wets = Wetting.of(problem.coupling) if wetting is None else wetting
    feels_water = len(response.free) > 0 and problem.coupling.nnz > 0

    def added_inertia(p: Array) -> Array:
        return wets.on_water(response.compliance(wets.on_bodies(p)))

    found = solve(
        problem.matrix,
        problem.rhs + wets.on_water(v_free),
        problem.guess if before is None else before.x,
        rtol,
        lower=problem.lower if before is None else before.lower,
        at_bound=problem.at_bound if before is None else before.at_bound,
        air=problem.air,
        extra=added_inertia if feels_water else None,
    )
    velocity = (v_free - response.compliance(wets.on_bodies(found.x))).reshape(-1, 6)
    acting = _acting(problem, response, found.x, velocity)
    return CoupledSolution(
        x=found.x,
        velocity=velocity,
        load=acting.load(found.x),
        problem=acting,
        iterations=found.iterations,
        at_bound=found.at_bound,
        parting=found.parting,
        lower=found.lower,
    )


def _acting(
    problem: PressureProblem, response: StructureResponse, x: Array, velocity: Array
) -> PressureProblem:
    """The problem with what the solve did not know of the load: its change over the displacement of floating bodies
    with the velocities (n, 6), and at the water line the pressure x instead of that of the last step, as far as bodies
    are held."""
    change = problem.with_waterline_of(x).other_load - problem.other_load
    share = response.held(change) if np.any(change) else 1.0
    restoring = response.restoring_load(velocity)
    return replace(problem, other_load=problem.other_load + share * change + restoring)


def start_of_water(mass: sp.csr_array, before: Array, pushed_by: Array, mean: Array) -> Array:
    """V^n (n, 6) of (4) for a second pass: the velocities `before` (n, 6) of the bodies at the start of the step, as
    far as those are compatible with the ones that the water had beside them, pushed_by (n, 6), and with the mean (n, 6)
    over the step.

    The water receives the work of F over the mean of its velocities V_w = pushed_by and V, the ledger that over
    V - L = (V^n + V)/2. With V = 2 mean - V^n and F = -m (V - V_w)/dt for an added mass m it gains

        -½ m (V - V_w)·(V^n - V_w) = -½ m (2 w - d)·d,    d = V^n - V_w,    w = mean - V_w,

    a loss as long as the block goes on as it came, which is what an inelastic start costs. Where it comes back within
    the step the water gains. d is therefore taken to the closest one without gain, |d - w| <= |w| in the norm of the
    kinetic energy of each body."""
    d, w = before - pushed_by, mean - pushed_by
    ahead = d - w
    excess = np.sqrt(np.einsum("nk,nk->n", ahead, (mass @ ahead.ravel()).reshape(-1, 6)))
    allowed = np.sqrt(np.einsum("nk,nk->n", w, (mass @ w.ravel()).reshape(-1, 6)))
    share = np.where(excess > allowed, allowed / np.where(excess > 0.0, excess, 1.0), 1.0)
    return np.where(share[:, None] < 1.0, pushed_by + w + share[:, None] * ahead, before)


def corrected_free_velocity(
    response: StructureResponse, mean_velocity: Array, x: Array, coupling: sp.csr_matrix
) -> Array:
    """V_free of a second pass, from the mean_velocity (n, 6) of the bodies under the pressure x."""
    return mean_velocity.ravel() + response.compliance(coupling.T @ x)


def defect(mass: sp.csr_array, assumed: Array, found: Array, floor: float = 0.0) -> float:
    """Coupling residual: the difference between the velocities (n, 6) that the bodies had and those that the pressure
    solve assumed:

        sqrt( E(found − assumed) / max(E(found), E(assumed), floor) ),   E(V) = ½ V·M V

    floor [J], `defect_floor`: a structure that hardly moves has no velocity to compare with.
    """
    energy = [_kinetic(mass, v) for v in (found - assumed, found, assumed)]
    scale = max(energy[1], energy[2], floor)
    return float(np.sqrt(energy[0] / scale)) if scale > 0.0 else 0.0


def defect_floor(impulse: float, scene: float) -> float:
    """Kinetic energy [J] below which the motion of the blocks is no measure of the defect: `impulse_energy` or, where
    that is less, a share of the energy of the scene [J]. A small oscillation of a floating body is compared
    with that oscillation, a structure in a wide sea with the load of the water that reaches it."""
    return max(min(impulse, DEFECT_FLOOR * scene), ROUND_OFF * scene)


def impulse_energy(mass: Array, inertia: Array, load: Array, dt: float) -> float:
    """Energy [J] that loads (n, 6) [N, N m] held over dt [s] would give to the blocks if they were loose and at rest,
    from their mass (n,) [kg] and inertia (n, 3, 3) [kg m²]."""
    force, moment = load[:, :3], load[:, 3:]
    spin = np.linalg.solve(inertia, moment[:, :, None])[:, :, 0]
    return 0.5 * dt**2 * float(np.sum(force**2 / mass[:, None]) + np.sum(moment * spin))


def _kinetic(mass: sp.csr_array, velocity: Array) -> float:
    return 0.5 * float(velocity.ravel() @ (mass @ velocity.ravel()))
