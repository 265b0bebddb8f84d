"""Flow out of a pocket that the mesh does not resolve: through orifices to the open air and narrow cracks between
blocks.

Cracks are those through which water would flow by a lumped conductance (`fluid.pressure.slits`): with air at both ends
the same opening lets air through, by the law of an orifice of its area (`gas.py`, equation 3).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from array_types import Array
from fluid.air.pockets import OPEN_AIR
from fluid.domain.point_location import Places
from fluid.pressure.slits import DISCHARGE


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


def pockets_at(water, points) -> Array:
    """Label (m,) of the air at points (m, 3) [m]: that of a dry corner of the cell that holds each point, -1 where
    there is none."""
    corners = Places.of(water, points, beyond=True).corners
    return water.air.label[corners].max(axis=1)


def leaked(water, vents, volume, dt: float):
    """The `Air` after the flow through vents and cracks in dt [s]; volume (K,) [m³] of the pockets."""
    air, gas = water.air, water.air.gas
    if len(air) == 0:
        return air
    reference = air.reference.copy()
    for one, other, area in _ways(water, vents):
        for inside, beyond in ((one, other), (other, one)):
            if inside <= OPEN_AIR:
                continue
            k = inside - 1
            outside = 0.0
            if beyond > OPEN_AIR:
                outside = float(gas.pressure(reference[beyond - 1], volume[beyond - 1]))
                if gas.pressure(reference[k], volume[k]) <= outside:
                    continue  # booked from the other side
            lost = gas.leaked(reference[k], volume[k], outside, area, dt)
            reference[k] += lost
            if beyond > OPEN_AIR:
                reference[beyond - 1] -= lost
    lost = float((gas.energy(air.reference, volume) - gas.energy(reference, volume)).sum())
    return replace(air, reference=reference, lost=air.lost + lost)


def _ways(water, vents):
    """(label, label, effective area [m²]) of every vent and crack of a pocket."""
    if vents:
        bodies = water.domain.memory.bodies
        places = np.array([vent.now(bodies) for vent in vents])
        low, high = water.mesh.bounds
        within = ((places >= low) & (places <= high)).all(axis=1)
        for at, label in zip(
            np.flatnonzero(within), pockets_at(water, places[within]) if within.any() else ()
        ):
            if label > OPEN_AIR:
                yield int(label), OPEN_AIR, vents[at].area * vents[at].discharge
    if water.slits is not None and len(water.slits):
        d = water.slits.difference.tocsc()
        for s in range(len(water.slits)):
            rows = slice(d.indptr[s], d.indptr[s + 1])
            node, weight = d.indices[rows], d.data[rows]
            ends = [water.air.label[node[weight * sign > 0.0]].max(initial=-1) for sign in (1.0, -1.0)]
            if min(ends) >= OPEN_AIR and ends[0] != ends[1]:
                yield int(ends[0]), int(ends[1]), float(water.slits.area[s])
