"""Outflow through the open sides of the tank in a step: they are at the pressure of the air, and no water returns.

    W_i^left = dt ∮ N_i s (u·n)⁺ dA,        E_left = ρ dt ∮ s (½ u² - g·x) (u·n)⁺ dA                          (1)

over the open faces, with the velocity at the beginning of the step and the share s of water around the nodes, both
linear on a face, g·x zero at the floor of the tank; no node loses more than it holds.  The rule is exact to degree 4.
Taken at the nodes alone, the flux of energy, a cubic of u, is up to 20 % too large at the foot of an outlet, where u
doubles within a cell; and nodes that are partly full, the high ones, would empty as fast as full ones.

What the fluxes carry to a node of an open side beyond its capacity leaves, too, and a node deeper than DEEP cells lets
out this alone: the velocity of a node is the mean of the cells around it, half a cell inside, and where the flow grows
towards the side (1) is less than what the pressure drives out. Between two open sides three cells apart it was 0.6 of
it; the correction of the volume put the rest back at the surface, and falling water gained 5 % of its energy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Array

_NEAR, _FAR = 0.445948490915965, 0.091576213509771
_POINTS = np.array(
    [
        [1 - 2 * _NEAR, _NEAR, _NEAR],
        [_NEAR, 1 - 2 * _NEAR, _NEAR],
        [_NEAR, _NEAR, 1 - 2 * _NEAR],
        [1 - 2 * _FAR, _FAR, _FAR],
        [_FAR, 1 - 2 * _FAR, _FAR],
        [_FAR, _FAR, 1 - 2 * _FAR],
    ]
)
_WEIGHTS = np.array([0.223381589678011] * 3 + [0.109951743655322] * 3)
"""Rule of degree 4 on a triangle (Dunavant, Int. J. Numer. Meth. Eng. 21 (1985) 1129)."""

DEEP = 2.0
"""Cells below the surface from which on the volume that a node of an open side lets out is what it receives."""


@dataclass(frozen=True)
class Outflow:
    """volume (N,) [m³] that leaves each node · its energy [J], kinetic and potential."""

    volume: Array
    energy: float

    @classmethod
    def of(cls, water, dt: float, carried) -> Outflow | None:
        """Equation (1) over dt [s] from nodes that hold `carried` (N,) [m³]; None where nothing leaves."""
        faces, area = water.walls.open_faces, water.walls.open_area
        holds = (water.nodal_water[faces] > 0.0).any(axis=1)
        faces, area = faces[holds], area[holds]
        if len(faces) == 0:
            return None
        p, t = water.parameters, water.topology
        share = np.clip(water.nodal_water[faces] / np.maximum(t.node_volume[faces], 1e-300), 0.0, 1.0)
        u = np.einsum("qa,fak->fqk", _POINTS, water.velocity[faces])
        x = np.einsum("qa,fak->fqk", _POINTS, t.nodes[faces])
        speed = np.maximum(np.einsum("fqk,fk->fq", u, area), 0.0)
        rate = dt * _WEIGHTS * speed * np.einsum("qa,fa->fq", _POINTS, share)
        head = p.density * (0.5 * np.einsum("fqk,fqk->fq", u, u) - water.below_floor(x))
        volume, energy = np.zeros(len(carried)), np.zeros(len(carried))
        np.add.at(volume, faces, np.einsum("fq,qa->fa", rate, _POINTS))
        np.add.at(energy, faces, np.einsum("fq,qa->fa", rate * head, _POINTS))
        rim = np.unique(faces)
        beyond = np.maximum(carried[rim] - t.node_volume[rim], 0.0)
        deep = water.level_set[rim] < -DEEP * t.node_size[rim]
        leaves = np.where(deep, beyond, np.maximum(volume[rim], beyond))
        leaves = np.minimum(leaves, np.maximum(carried[rim], 0.0))
        if not leaves.any():
            return None
        u = water.velocity[rim]
        at_node = p.density * (0.5 * np.einsum("nk,nk->n", u, u) - water.nodes_below_floor[rim])
        head = np.where(volume[rim] > 0.0, energy[rim] / np.maximum(volume[rim], 1e-300), at_node)
        kept = np.zeros(len(carried))
        kept[rim] = leaves
        return cls(kept, float(leaves @ head))
