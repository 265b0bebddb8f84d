"""Flow out of a pocket that the mesh does not resolve: through orifices to the open air and narrow cracks between
blocks.

Cracks are those through which water would flow by a lumped conductance (`fluid.pressure.slits`): with air at both ends
the same opening lets air through, by the law of an orifice of its area (`gas.py`, equation 3).

The flow goes with the root of the difference of pressure, and a wide orifice evens out a pocket in far less than a
step. So it is found together with the pressure to which it leads, for all pockets and openings at once
(`Openings.evened`):

    V_a,k + dt Σ q(P_k, P_other) = V_a,k^n,        V_a,k = V_k (1 + P_k/p_a)^(1/γ).                          (1)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Array
from fluid.air.gas import EVEN, SMALLEST_VOLUME, Gas
from fluid.air.pockets import OPEN_AIR
from fluid.domain.point_location import Places
from fluid.numerics.solve import NotConverged
from fluid.pressure.slits import DISCHARGE

MOST_PASSES = 200
"""Passes of the iteration for (1); each at least halves what is missing of the logarithm of the pressures."""
CLOSE = 1e-9
"""It ends where no pressure changes by more than this share of the largest one, or by so many pascals."""


@dataclass(frozen=True)
class Vent:
    """An orifice to the open air.

    place (3,) [m], a point in the pocket; for a vent that moves with a body, in the frame of the body ·
    area [m²] · discharge coefficient C_d · body that it moves with, -1: none."""

    place: Array
    area: float
    discharge: float = DISCHARGE
    body: int = -1

    def now(self, bodies) -> Array:
        """Place (3,) [m] of the vent at the present position of the bodies (`ConvexBodies`)."""
        if self.body < 0:
            return self.place
        b = self.body
        return bodies.centre[b] + bodies.rotation[b] @ self.place


@dataclass(frozen=True)
class Openings:
    """Ways of the air between pockets, and between them and the open air: all those of the same two ends as one.

    one, other (W,): pockets 0 ... K-1; other -1: the open air · area (W,) [m²]: effective, C_d A."""

    one: Array
    other: Array
    area: Array

    @classmethod
    def of(cls, water, label) -> Openings:
        """Vents and cracks of the pockets with the labels (N,)."""
        total: dict[tuple[int, int], float] = {}
        for one, other, area in _ways(water, label):
            way = max(one, other) - 1, min(one, other) - 1
            total[way] = total.get(way, 0.0) + area
        ends = np.array(sorted(total), np.int64).reshape(-1, 2)
        return cls(
            ends[:, 0], ends[:, 1], np.array([total[one, other] for one, other in ends.tolist()], float)
        )

    def __len__(self) -> int:
        return len(self.area)

    def ends(self, values) -> tuple[Array, Array]:
        """Values (K,) of the pockets at both ends (W,); zero in the open air."""
        padded = np.append(values, 0.0)
        return padded[self.one], padded[self.other]

    def mean(self, values) -> Array:
        """Mean (W,) of values (K,) of the pockets at the ends; the open air has none."""
        one, other = self.ends(values)
        return np.where(self.other < 0, one, 0.5 * (one + other))

    def laplacian(self, conductance, count: int) -> Array:
        """Flows (K,) out of the pockets over their pressures (K,), as a matrix (K, K); conductance (W,)."""
        out = np.zeros((count + 1, count + 1))
        np.add.at(out, (self.one, self.one), conductance)
        np.add.at(out, (self.other, self.other), conductance)
        np.add.at(out, (self.one, self.other), -conductance)
        np.add.at(out, (self.other, self.one), -conductance)
        return out[:count, :count]

    def evened(self, gas: Gas, reference, volume, dt) -> tuple[Array, Array]:
        """Pressure (K,) [Pa] and reference volume (K,) [m³] that solve (1) for a time dt [s], one or (K,).

        reference (K,) [m³] before, volume (K,) [m³] after. Content and flow are taken linear between the pressures of
        the last pass and zero: a matrix that keeps every pressure between those of closed pockets and of the open air.
        """
        p = gas.pressure(reference, volume)
        volume = np.maximum(volume, SMALLEST_VOLUME)
        for _ in range(MOST_PASSES):
            there = np.where(np.abs(p) < EVEN, EVEN, p)
            own = gas.excess(there, volume) / there
            leak = np.reshape(dt, (-1, 1)) * self.laplacian(gas.conductance(*self.ends(p), self.area), len(p))
            before, p = p, np.linalg.solve(np.diag(own) + leak, reference - volume)
            if np.abs(p - before).max() <= CLOSE * max(np.abs(p).max(), 1.0):
                return p, reference - leak @ p
        raise NotConverged(
            f"the flow of trapped air through {len(self)} openings was not found in {MOST_PASSES} passes: the "
            f"pressures still changed by {np.abs(p - before).max():.3g} Pa of {np.abs(p).max():.3g} Pa",
            np.array([np.abs(p - before).max()]),
        )


def pockets_at(water, points, label=None) -> Array:
    """Label (m,) of the air at points (m, 3) [m]: that of a dry corner of the cell that holds each point, -1 where
    there is none. label (N,): of the air at the nodes, None: at the end of the last step."""
    label = water.air.label if label is None else label
    return label[Places.of(water, points, beyond=True).corners].max(axis=1)


def _ways(water, label):
    """(label, label, effective area [m²]) of every vent and crack of a pocket; label (N,) of the air at the nodes."""
    if water.vents:
        bodies = water.domain.memory.bodies
        places = np.array([vent.now(bodies) for vent in water.vents])
        low, high = water.mesh.bounds
        within = np.flatnonzero(((places >= low) & (places <= high)).all(axis=1))
        found = pockets_at(water, places[within], label) if len(within) else ()
        for at, pocket in zip(within, found):
            if pocket > OPEN_AIR:
                yield int(pocket), OPEN_AIR, water.vents[at].area * water.vents[at].discharge
    if water.slits is not None and len(water.slits):
        d = water.slits.difference.tocsc()
        for s in range(len(water.slits)):
            rows = slice(d.indptr[s], d.indptr[s + 1])
            node, weight = d.indices[rows], d.data[rows]
            ends = [label[node[weight * sign > 0.0]].max(initial=-1) for sign in (1.0, -1.0)]
            if min(ends) >= OPEN_AIR and ends[0] != ends[1]:
                yield int(ends[0]), int(ends[1]), float(water.slits.area[s])
