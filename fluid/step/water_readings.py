"""What can be read from the water between its steps: volume, energies, momentum and trapped air."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp

from array_types import Array, Floats, Ints
from fluid.domain.physical_domain import PhysicalDomain
from fluid.domain.topology import Topology
from fluid.mesh.background import Background
from fluid.numerics.fields import nothing
from fluid.numerics.sums import kinetic_energy, total
from fluid.pressure.displaced import taken_from_nodes
from fluid.pressure.pressure_bound import wall_area
from fluid.sides.walls import Walls
from fluid.step.parameters import WaterParameters
from fluid.step.potential import level_energy, potential_energy

if TYPE_CHECKING:
    from fluid.air.cushions import Air
    from fluid.sides.inflow import Sides


class WaterReadings:
    """The part of `Water` that reads and changes nothing; `Water` itself holds the state and takes the steps."""

    mesh: Background
    domain: PhysicalDomain
    topology: Topology
    parameters: WaterParameters
    sides: Sides | None
    air: Air | None
    walls: Walls
    listed: Ints
    level_set: Floats
    velocity: Floats
    pressure: Floats
    nodal_water: Floats
    displaced: Floats
    film_volume: float
    film_potential: float
    conserved_volume: float
    initial_volume: float
    coupling: sp.csr_array
    nodes_below_floor: Floats
    farther: Floats
    moved_on: Floats
    pushed_by: Floats
    moved_by_end: Floats
    _summed: tuple[tuple, float]
    _late_energy: float
    _lowest: float
    _wall_area: Array | None

    def volume(self) -> float:
        """Water in the tank [m³]; balances, limits and histories of a step all ask for it."""
        water, displaced, in_films = of = self.nodal_water, self.displaced, self.film_volume
        if any(one is not other for one, other in zip(self._summed[0], of)):
            self._summed = of, total(water) - total(displaced) - in_films
        return self._summed[1]

    @property
    def handled_volume(self) -> float:
        """Water at the start and what came in since [m³]: the scale of volume errors."""
        return self.initial_volume + (0.0 if self.sides is None else self.sides.entered)

    def wall_area(self) -> Array:
        """Area (N,) [m²] of the walls around each node, found once for a domain (`pressure_bound.py`)."""
        if self._wall_area is None:
            self._wall_area = wall_area(self.mesh, self.domain)
        return self._wall_area

    def displacement(self, dt: float) -> Array:
        """Volume (N,) [m³] that the bodies have displaced at the nodes since the cells were cut, at the end of a step
        dt [s]; negative where they have left volume free.

        Surface and pressure are those at the end of a step. With the volume of the cut alone the level of a pool would
        follow a body that floats in it a step late, which lets it swing higher and higher."""
        way = self.moved_on + dt * self.pushed_by
        return self.taken_by(way)

    def taken_by(self, way) -> Array:
        """Volume (N,) [m³] that bodies displace at the nodes over a motion (n_bodies, 6) [m, rad]; `nothing` without
        one."""
        if not way.any():
            return nothing(len(self.level_set))
        return taken_from_nodes(self.domain, self.coupling, self.level_set, way)

    def volume_error(self) -> float:
        """(volume - conserved volume) / handled volume: the error that the step could not correct."""
        return (self.volume() - self.conserved_volume) / max(self.handled_volume, 1e-300)

    def momentum(self) -> Array:
        """∫ ρ u dV (3,) [kg m/s]."""
        return self.parameters.density * (self.nodal_water @ self.velocity)

    def kinetic_energy(self) -> float:
        """½ ρ Σ W_i |u_i|² [J]."""
        return kinetic_energy(self.parameters.density, self.nodal_water, self.velocity)

    def potential_energy(self) -> float:
        """-∫ ρ g·x dV [J] above the floor of the tank (`potential.py`), at the time of the velocity (`_late`)."""
        return potential_energy(self) - self._late_energy

    def available_energy(self) -> float:
        """Kinetic energy, and the potential energy above that of the same water at a level between the solids where
        they stand; where sides are open, of what stays below their lowest edge of it [J]."""
        return self.kinetic_energy() + max(self.potential_energy() - level_energy(self), 0.0)

    def energy_through_sides(self) -> float:
        """Energy [J] that came in through inflows and seas, less what left, at the time of the velocity."""
        return 0.0 if self.sides is None else self.sides.energy

    def air_energy(self) -> float:
        """Energy [J] of trapped air that the water can recover, and the part lost so far; 0 without trapped air."""
        if self.air is None:
            return 0.0
        return self.air.lost + float(self.air.gas.energy(self.air.reference, self.pocket_volumes()).sum())

    def pocket_volumes(self) -> Array:
        """Volume (K,) [m³] of the pockets of trapped air at the end of the last step."""
        assert self.air is not None  # without trapped air nothing asks for its pockets
        return self.air.volumes(self.topology, self.level_set, self.coupling @ self.moved_by_end.ravel())

    def pocket_bounds(self, pocket: int) -> Array:
        """Lower and upper corner (2, 3) [m] of the box around the nodes of a pocket, 0 ... K-1."""
        assert self.air is not None  # see above
        nodes = self.topology.nodes[self.air.label == pocket + 1]
        return np.array([nodes.min(axis=0), nodes.max(axis=0)])

    def head(self) -> Array:
        """½ ρ u² - ρ g·x + p (N,) [J/m³] at the nodes."""
        p = self.parameters
        kinetic = 0.5 * p.density * np.einsum("ij,ij->i", self.velocity, self.velocity)
        return kinetic - p.density * self.nodes_below_floor + self.pressure

    def below_floor(self, x) -> Array:
        """g·x (...) [m²/s²] of places x (..., 3) [m], zero at the floor of the tank and negative above it: what leaves
        the tank takes energy with it, wherever the tank lies."""
        return x @ self.parameters.weight - self._lowest
