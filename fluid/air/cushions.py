"""The air in a step: each pocket takes part in the pressure solve with one unknown.

All nodes of a pocket have its pressure, so their hat functions add up to one function, N_k = Σ N_j over its nodes.
Tested with it, the mass balance of the water (`fluid.pressure.projection`) gives the rate [m³/s] at which water and
bodies compress it,

    R_k = ∫ u*·∇N_k dV + (G V)_k - (dt/ρ) Σ_i k_ij (X_k - x_i)/ϑ_ij,        G_k = Σ_j G_j,                    (1)

and its pressure over the step is that of its gas (`gas.py`) in the middle of it,

    X_k + known_k = P(V' + dt R^n/2) + dt S ((R_k - R^n)/4 + (θ_k - 1/2) R_k),        S = -dP/dV there,         (2)

with V' the volume above the surface as the step has already moved it, and with the bodies where their last velocity
takes them.  In equal steps the surface moves with R^n + (R^n - R^{n-1})/2, so that V' + dt R^n/2 advances by dt R^n
from step to step: leapfrog, which with 1/4 is neutral at any ratio of the step and the period.  (P taken from V^n,
before the surface moved, drove every cushion that fewer than some 24 steps a period resolve, to three to thirty times
its energy.)

With γ_k = θ_k - 1/4 and C = 1/(γ_k S dt) this is a row like all others, symmetric and positive; the pressure of
the pocket enters it at the crossing of every edge to its nodes as zero does where the air is open:

    (C + Σ s) X_k - Σ s x_i = ∫ u*·∇N_k dV + (G V)_k + C (P(V' + dt R^n/2) - known_k) - R^n/(4 γ_k),         (3)

with s = (dt/ρ) k_ij/ϑ_ij.  So neither a stiff cushion nor a soft one limits the step, and a pocket loads a body in the
same way as water does.  θ_k is 1/2, which keeps the energy of a cushion that the steps resolve; where R changed its
sign from one step to the next it is 1 for a step, so that a cushion too stiff to be resolved comes to rest.  Where no
earlier step has a rate, R^n is (V^n - V')/dt; a pocket that merges, parts or is closed off has V' = V^n - dt R^n.

Air that leaves through openings (`leaks.py`) is taken off R_k in (2), as the volume it has in the pocket,

    W_k = Σ g_kl (P_k - P_l),        P = X + known,        g = (V/V_a) q/(P_k - P_l),                        (4)

P = 0 in the open air, with g at a pressure half way between that over the last step and the one to which (2) and the
law of the openings lead at the last rate R^n.  The conductances g θ_k/γ_k add a symmetric, positive matrix to (3);
the flow does not give energy, and is exact where it is steady.  What left is found at the end of the step from the
volumes then.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from array_types import Array
from fluid.air.gas import SMALLEST_VOLUME, Gas
from fluid.air.leaks import Openings
from fluid.air.pockets import OPEN_AIR, SLIVER, Descent, bricks, labelled, volumes, without
from fluid.domain.coupling_matrix import wetted_coupling
from fluid.pressure.projection import SMALLEST_CUT
from kernels.decorators import kernel

RESOLVED, SETTLING = 0.5, 1.0
"""θ_k of (2)."""


@dataclass(frozen=True)
class Opened:
    """A pocket, or a part of one, that the open air has reached: place (3,) [m] of the middle of its nodes · volume
    [m³] and gauge pressure [Pa] before."""

    place: Array
    volume: float
    pressure: float


@dataclass(frozen=True, kw_only=True)
class Air:
    """State of the K pockets between two steps, in the order of their labels.

    gas · label (N,) of the air at each node (`pockets.py`) · reference (K,) [m³] of the gas · rate (K,) [m³/s], R of
    the last step · end_pressure (K,) [Pa] that belongs to the acceleration at the end of that step · mean_pressure (K,)
    [Pa] over the step · turned (K,) bool: R changed its sign, or no earlier step has one · name (K,): permanent number,
    from 1 · names: how many have been given · lost [J]: energy so far of air that escaped or was mixed, or of bubbles
    that were released · entrained [m³]: reference volume of pockets that opened within the water so far · gone: pockets
    that the water has filled so far · let_go: pockets released so far because they became too small
    (`Gas.smallest`) · opened: those that the open air has reached in the last step."""

    gas: Gas
    label: Array
    reference: Array
    rate: Array
    end_pressure: Array
    mean_pressure: Array
    turned: Array
    name: Array
    names: int = 0
    lost: float = 0.0
    entrained: float = 0.0
    gone: int = 0
    let_go: int = 0
    opened: tuple[Opened, ...] = ()

    @classmethod
    def at_start(cls, gas: Gas, topology, phi, lets_air_out) -> Air:
        """Air at the pressure of the atmosphere everywhere; phi (N,) [m] of the water."""
        label, count = labelled(topology, phi, lets_air_out)
        reference = volumes(topology, phi, label, count)
        small = reference < gas.smallest * bricks(topology, label, count)
        (label, count), reference = without(label, small), reference[~small]
        return cls(
            gas=gas,
            label=label,
            reference=reference,
            rate=np.zeros(count),
            end_pressure=np.zeros(count),
            mean_pressure=np.zeros(count),
            turned=np.ones(count, bool),
            name=1 + np.arange(count),
            names=count,
        )

    def __len__(self) -> int:
        return len(self.reference)

    def volumes(self, topology, phi, taken) -> Array:
        """Volume (K,) [m³] of the pockets; taken (N,) [m³] that bodies took from the nodes since the cells were cut."""
        found = volumes(topology, phi, self.label, len(self))
        there = self.label > OPEN_AIR
        return found - np.bincount(self.label[there] - 1, taken[there], minlength=len(self))[: len(self)]

    def carried(self, source, known) -> Air:
        """The same air on new nodes; source (N,) is the old node of each, known (N,) bool tells whether there is
        one."""
        return replace(self, label=np.where(known, self.label[source], -1))

    def at_pockets(self, nodal) -> Array:
        """Values (K,) of the pockets from nodal values (N,), which are equal at all nodes of a pocket."""
        out = np.zeros(len(self))
        there = np.flatnonzero(self.label > OPEN_AIR)
        out[self.label[there] - 1] = nodal[there]
        return out

    def nodal(self, values) -> Array:
        """Nodal values (N,): values (K,) at the nodes of their pockets, zero elsewhere."""
        out = np.zeros(len(self.label))
        there = self.label > OPEN_AIR
        out[there] = values[self.label[there] - 1]
        return out


@dataclass(frozen=True, kw_only=True)
class Cushions:
    """The K pockets of a step.

    air: their contents, with the labels of the new surface · volume (K,) [m³] and pressure (K,) [Pa], P^n, at the
    beginning · middle (K,) [Pa] P(V' + dt R^n/2) · stiffness (K,) [Pa/m³] S · theta (K,) · known (K,) [Pa] part of
    the pressure that is not sought · links csr (n, K) s of (3) [m³/(s Pa)] · openings through which air leaves · leak
    (K, K) [m³/(s Pa)]: g θ_k/γ_k of (4), None without openings."""

    air: Air
    volume: Array
    pressure: Array
    middle: Array
    stiffness: Array
    theta: Array
    openings: Openings | None = None
    leak: Array | None = None
    known: Array = field(default_factory=lambda: np.zeros(0))
    links: sp.csr_array | None = None

    @classmethod
    def of(cls, air: Air, topology, before, phi, lets_air_out, taken, moving, dt: float) -> Cushions:
        """Pockets below the new surface phi (N,) [m] from those below `before` (N,) [m], dt [s] earlier.

        taken (N,) [m³]: as in `Air.volumes`; the old pockets are measured with it · moving (N,) [m³/s]: what the bodies
        take in addition."""
        t, gas = topology, air.gas
        before_volume = air.volumes(t, before, taken)
        label, count = labelled(t, phi, lets_air_out)
        descent, reference, volume = _handed_on(air, before_volume, t, phi, label, count)
        opened = _opened(air, before_volume, descent, label, t.nodes)
        small = reference < gas.smallest * bricks(t, label, count)
        let_go = air.let_go
        if small.any():
            let_go += int((descent.share[:, small] >= SLIVER).any(axis=0).sum())
            label, count = without(label, small)
            descent, reference, volume = _handed_on(air, before_volume, t, phi, label, count)
        same, anew = descent.only >= 0, descent.share.sum(axis=0) == 0.0
        out_of_water = anew & (descent.fresh == 0.0)
        name, names = _names(air, descent)
        pressure = gas.pressure(reference, volume)
        set_free = gas.energy(air.reference, before_volume).sum() - gas.energy(reference, volume).sum()
        now = replace(
            air,
            label=label,
            reference=reference,
            rate=descent.share.T @ air.rate,
            end_pressure=np.where(same, _of_parent(air.end_pressure, descent.only), pressure),
            mean_pressure=np.where(same, _of_parent(air.mean_pressure, descent.only), pressure),
            turned=_of_parent(air.turned, descent.only) | ~same,
            name=name,
            names=names,
            lost=air.lost + float(set_free),
            entrained=air.entrained + float(reference[out_of_water].sum()),
            gone=air.gone + int(descent.gone.sum()),
            let_go=let_go,
            opened=opened,
        )
        ahead = np.where(same, now.volumes(t, phi, taken + dt * moving), volume - dt * now.rate)
        first = now.turned & (now.rate == 0.0)
        now = replace(now, rate=np.where(first, (volume - ahead) / dt, now.rate))
        theta = np.where(now.turned & ~first, SETTLING, RESOLVED)
        half_way = ahead + 0.5 * dt * now.rate
        stiffness, middle = gas.stiffness(reference, half_way), gas.pressure(reference, half_way)
        return cls(air=now, volume=volume, pressure=pressure, middle=middle, stiffness=stiffness, theta=theta)

    def __len__(self) -> int:
        return len(self.pressure)

    def leaking(self, openings: Openings, dt: float) -> Cushions:
        """The cushions whose air leaves through these openings over dt [s]."""
        if len(openings) == 0:
            return self
        air, gas, span = self.air, self.air.gas, self.theta * dt
        ahead = self.volume * np.exp(-span * air.rate / np.maximum(self.volume, SMALLEST_VOLUME))
        one, other = openings.ends(openings.evened(gas, air.reference, ahead, span)[0])
        last = np.subtract(*openings.ends(air.mean_pressure))
        lower = np.minimum(one, other)
        conductance = gas.conductance(
            lower + 0.5 * (np.abs(one - other) + np.abs(last)), lower, openings.area
        )
        thinner = openings.mean(self.volume / np.maximum(air.reference, SMALLEST_VOLUME))
        weighted = conductance * thinner * openings.mean(self.theta / self.implicit)
        return replace(self, openings=openings, leak=openings.laplacian(weighted, len(self)))

    def beside(self, graph, phi, dofs, theta: float, kick, scale: float) -> Cushions:
        """The cushions with their links to the wet nodes dofs (n,), and with the known part of the pressure.

        graph, phi: as in `pressure_matrix`, scale = dt/ρ · kick (N,): share of the last acceleration that is carried
        over, of which the pressure of the pocket is a part."""
        g = graph
        column = np.full(len(phi), -1, np.int64)
        column[dofs] = np.arange(len(dofs))
        row, pocket, value = _links(
            dofs, column, g.row, g.start, g.neighbour, g.stiffness, phi, self.air.label, scale
        )
        links = sp.csr_array((value, (row, pocket)), shape=(len(dofs), len(self)))
        total = links.sum(axis=0)
        there = np.abs(total) > 0.0
        carried = np.where(there, (links.T @ kick[dofs]) / np.where(there, total, 1.0), 1.0)
        known = (1.0 - theta) * np.clip(carried, 0.0, 1.0) * self.air.end_pressure
        return replace(self, known=known, links=links)

    def lowest(self, dt: float) -> float:
        """Lowest pressure [Pa] of any air in the step, open air included; twice the predicted drop of a pocket is
        allowed for, less by the air that comes in through openings."""
        rate = self.air.rate
        if self.leak is not None:
            rate = rate - np.minimum(self.theta * (self.leak @ self.pressure), 0.0)
        ahead = self.pressure + 2.0 * self.stiffness * dt * np.minimum(rate, 0.0)
        return float(min(ahead.min(initial=0.0), 0.0))

    @property
    def implicit(self) -> Array:
        """γ_k (K,) of (3)."""
        return self.theta - 0.25

    def compliance(self, dt: float) -> Array:
        """C (K,) [m³/(s Pa)] of (3)."""
        return 1.0 / (self.implicit * self.stiffness * dt)

    def source(self, dt: float) -> Array:
        """Right hand side (K,) [m³/s] of (3) without the flow of the water and the bodies."""
        out = self.compliance(dt) * (self.middle - self.known) + self._carried_rate()
        return out if self.leak is None else out - self.leak @ self.known

    def _carried_rate(self):
        return -0.25 * self.air.rate / self.implicit

    def matrix(self, matrix, dt: float):
        """The matrix (n, n) of the water with the rows of the pockets behind it, csr (n + K, n + K)."""
        assert self.links is not None  # `beside` has set them
        total = np.asarray(self.links.sum(axis=0)).ravel()
        own = sp.diags_array(self.compliance(dt) + total)
        if self.leak is not None:
            own = sp.csr_array(own + sp.csr_array(self.leak))
        return sp.csr_array(sp.block_array([[matrix, -self.links], [-self.links.T, own]], format="csr"))

    def within(self, problem, rhs, coupling, void, domain):
        """The PressureProblem of the water with the pockets as its last unknowns.

        rhs (N,) [m³/s]: ∫ u*·∇N_j dV of all nodes · coupling csr (N, m): G without the polygons of the void cells
        (v,), which lie in the air whole."""
        dt, none = problem.dt, np.full(len(self), -np.inf)
        rows = sp.csr_array(self.sums(coupling))
        label = self.air.label[domain.cells[void]].max(axis=1) if len(void) else np.zeros(0, np.int64)
        for k in np.unique(label[label > OPEN_AIR]) - 1:
            polygons = np.isin(domain.face_cell, void[label == k + 1])
            all_hats = sp.csr_array(wetted_coupling(domain, polygons)).sum(axis=0).reshape(1, -1)
            one = sp.csr_array(([1.0], ([k], [0])), shape=(len(self), 1))
            rows = sp.csr_array(rows + one @ sp.csr_array(all_hats))
        return replace(
            problem,
            matrix=self.matrix(problem.matrix, dt),
            rhs=np.concatenate([problem.rhs, self.sums(rhs) + self.source(dt)]),
            coupling=sp.csr_array(sp.vstack([problem.coupling, rows], format="csr")),
            known=np.concatenate([problem.known, self.known]),
            guess=np.concatenate([problem.guess, self.pressure - self.known]),
            dofs=np.concatenate([problem.dofs, self.nodes()]),
            bound=None if problem.bound is None else np.concatenate([problem.bound, none]),
            at_bound=np.concatenate([problem.at_bound, np.zeros(len(self), bool)]),
            pockets=len(self),
        )

    def sums(self, nodal):
        """Sums over the nodes of each pocket of nodal values (N,) or of the rows of a sparse (N, m): (K,) or csr (K,
        m)."""
        return self._summing @ nodal

    @property
    def _summing(self):
        label = self.air.label
        there = np.flatnonzero(label > OPEN_AIR)
        return sp.csr_array((np.ones(len(there)), (label[there] - 1, there)), shape=(len(self), len(label)))

    def nodes(self) -> Array:
        """One node (K,) of each pocket."""
        label = self.air.label
        there = np.flatnonzero(label > OPEN_AIR)[::-1]
        node = np.zeros(len(self), np.int64)
        node[label[there] - 1] = there
        return node

    def after(self, x, theta: float, dt: float) -> Air:
        """The air after a step with the unknown part x (K,) [Pa] of its pressure."""
        mean_pressure = x + self.known
        rate = self.compliance(dt) * (mean_pressure - self.middle) - self._carried_rate()
        if self.leak is not None:
            rate = rate + self.leak @ mean_pressure
        turned = (rate * self.air.rate < 0.0) & ~self.air.turned
        return replace(
            self.air, rate=rate, end_pressure=x / theta, mean_pressure=mean_pressure, turned=turned
        )

    def leaked(self, air: Air, volume, dt: float) -> Air:
        """The air after what left through the openings over the step; volume (K,) [m³] of the pockets at its end."""
        if self.openings is None:
            return air
        before = air.reference
        _, reference = self.openings.evened(air.gas, before, volume, dt)
        lost = float(air.gas.lost_energy(before, self.volume, reference, volume).sum())
        return replace(air, reference=reference, lost=air.lost + lost)


def _handed_on(air: Air, before, topology, phi, label, count: int):
    """The Descent of the pockets labelled now (N,), their reference volumes and their volumes (K,) [m³] at the
    beginning of the step.

    before (O,) [m³]: volumes of the old ones. Air that the water has just closed off has the pressure of the open
    air."""
    descent = Descent.of(air.label, len(air), label, count, topology.node_volume)
    reference = descent.share.T @ air.reference + descent.fresh
    volume = descent.share.T @ before + descent.fresh
    anew = descent.share.sum(axis=0) == 0.0
    if anew.any():
        volume[anew] = reference[anew] = volumes(topology, phi, label, count)[anew]
    return descent, reference, volume


def _opened(air: Air, before, descent: Descent, label, nodes) -> tuple[Opened, ...]:
    """What the open air reaches now of the old pockets with volumes (O,) [m³]; label (N,) of the air now."""
    out = []
    pressure = air.gas.pressure(air.reference, before)
    for k in np.flatnonzero(descent.opened > 0.0):
        place = nodes[(air.label == k + 1) & (label == OPEN_AIR)].mean(axis=0)
        out.append(Opened(place, float(descent.opened[k] * before[k]), float(pressure[k])))
    return tuple(out)


def _of_parent(values, only):
    """Values (K,) for the new pockets, from values (O,) of the old pocket of each; those of the first where there is
    none."""
    return values[only] if len(values) else np.zeros(len(only), values.dtype)


def _names(air: Air, descent: Descent) -> tuple[Array, int]:
    """Names (K,) of the pockets: the name of the old pocket with most of the air in each, or a new one where that is
    taken."""
    taken, names = set(), air.names
    name = np.zeros(descent.share.shape[1], np.int64)
    for k in range(len(name)):
        amount = descent.share[:, k] * air.reference
        parent = int(amount.argmax()) if len(amount) and amount.max() > 0.0 else -1
        if parent >= 0 and parent not in taken:
            taken.add(parent)
            name[k] = air.name[parent]
        else:
            names += 1
            name[k] = names
    return name, names


@kernel
def _links(dofs, column, graph_row, start, neighbour, stiffness, phi, label, scale):
    """Row, pocket and s of (3) of the edges from wet nodes to nodes of pockets."""
    capacity, n = 1024, 0
    row_of, pocket, value = np.empty(capacity, np.int64), np.empty(capacity, np.int64), np.empty(capacity)
    for r in range(dofs.shape[0]):
        i = dofs[r]
        row = graph_row[i]
        for s in range(start[row], start[row + 1]):
            j = neighbour[s]
            if column[j] >= 0 or phi[j] < 0.0 or label[j] <= 0:
                continue
            if n == capacity:
                capacity *= 2
                row_of = np.concatenate((row_of, np.empty_like(row_of)))
                pocket = np.concatenate((pocket, np.empty_like(pocket)))
                value = np.concatenate((value, np.empty_like(value)))
            cut = max(phi[i] / (phi[i] - phi[j]), SMALLEST_CUT)
            row_of[n], pocket[n], value[n] = r, label[j] - 1, -scale * stiffness[s] / cut
            n += 1
    return row_of[:n].copy(), pocket[:n].copy(), value[:n].copy()
