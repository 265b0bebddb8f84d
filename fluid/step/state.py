"""The state of the water as arrays: saved after a step and restored later, in this process or in a new one.

What follows from the mesh and from the solids is left out: whoever restores makes the same domain first.  A step after
`restore` gives what it would have given after `save`, bit for bit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from array_types import Array
from fluid.domain.cell_vectors import CellVectors
from fluid.domain.topology import Graph
from fluid.surface.volume import Flux

NODAL = (
    "level_set",
    "velocity",
    "acceleration",
    "pressure",
    "end_pressure",
    "nodal_water",
    "displaced",
    "at_bound",
    "ventilated",
    "given_by_films",
)
OF_CELLS = ("remainder", "kick_remainder", "cell_velocity")
OF_BODIES = ("pushed_by",)
NUMBERS = {
    "time": float,
    "steps": int,
    "conserved_volume": float,
    "initial_volume": float,
    "film_volume": float,
    "film_potential": float,
    "_late_energy": float,
    "_domain_is_new": bool,
}
SIDES = ("entered", "left", "energy")
OF_AIR = (
    "label",
    "reference",
    "rate",
    "end_pressure",
    "mean_pressure",
    "turned",
    "name",
    "names",
    "lost",
    "entrained",
    "gone",
    "let_go",
)


class NotAfterAStep(RuntimeError):
    """The solids were moved after the last step: its volume flux belongs to the domain before."""


class OtherWater(ValueError):
    """A state does not fit the mesh or the domain of the water that is to take it over."""


def save(water) -> dict[str, Array]:
    """Everything of a Water that changes in time, by name: references, since a step replaces the arrays that it
    changes.  Raises NotAfterAStep."""
    if water.flux.capacity is not water.topology.node_volume:
        raise NotAfterAStep("the state of the water can be saved after a step, before the solids move on")
    arrays = {name: np.asarray(getattr(water, name)) for name in (*NODAL, *OF_BODIES, *NUMBERS)}
    for name in OF_CELLS:
        listed = getattr(water, name)
        arrays |= {f"{name}_cells": listed.cells, name: listed.values}
    arrays |= {"listed": water.listed, "layer_start": water.layer_start}
    arrays |= {
        "graph_nodes": water.flux.graph.nodes,
        "flux_nodes": water.flux.nodes,
        "flux": rate_of_listed(water.flux),
    }
    arrays["cells"] = np.array(len(water.topology.cells))
    arrays["flux_velocity"] = water.flux.velocity[water.cell_velocity.cells]
    arrays["flux_dt"] = np.array(water.flux.dt)
    if water.sides is not None:
        arrays |= {name: np.array(getattr(water.sides, name)) for name in SIDES}
        arrays["absorbed"] = water.sides.absorbed
    if water.air is not None:
        arrays |= {f"air_{name}": np.array(getattr(water.air, name)) for name in OF_AIR}
    if water.slits is not None:
        arrays |= {"slit_name": water.slits.name, "slit_flow": water.slits.flow}
    return arrays


def rate_of_listed(flux) -> Array:
    """Rates (edges,) [m³/s] of the flux, zero along edges out of nodes that it does not list."""
    g, listed = flux.graph, np.zeros(len(flux.graph.nodes), bool)
    listed[g.row[flux.nodes]] = True
    return np.where(np.repeat(listed, np.diff(g.start)), flux.rate, 0.0)


def restore(water, domain, arrays) -> None:
    """Back to a saved state on `domain`, the same as the one that it was saved on.  Raises OtherWater."""
    _check(domain, arrays, water.sides, water.air)
    water.set_domain(domain)
    for name in (*NODAL, *OF_BODIES, "listed", "layer_start"):
        setattr(water, name, np.array(arrays[name]))
    for name in OF_CELLS:
        setattr(water, name, CellVectors(np.array(arrays[f"{name}_cells"]), np.array(arrays[name])))
    of_flux = CellVectors(water.cell_velocity.cells, np.array(arrays["flux_velocity"]))
    for name, kind in NUMBERS.items():
        setattr(water, name, kind(arrays[name]))
    water.graph = Graph.of(water.topology, np.array(arrays["graph_nodes"]))
    water.renumbered, water.left_behind, water.report = None, None, None
    water.flux = Flux(
        nodes=np.array(arrays["flux_nodes"]),
        graph=water.graph,
        rate=np.array(arrays["flux"]),
        velocity=of_flux.field(len(water.topology.cells)),
        water=water.nodal_water - water.displaced,
        capacity=water.topology.node_volume,
        room=water.topology.room,
        now=water.cell_velocity,
        dt=float(arrays["flux_dt"]),
    )
    if water.sides is not None:
        for name in SIDES:
            setattr(water.sides, name, float(arrays[name]))
        water.sides.absorbed = np.array(arrays["absorbed"])
    if water.air is not None:
        held = {name: np.array(arrays[f"air_{name}"]) for name in OF_AIR}
        water.air = replace(water.air, **{name: v if v.ndim else v.item() for name, v in held.items()})
    if "slit_name" in arrays:
        from fluid.pressure.slits import Slits

        water.slits = Slits.remembered(np.array(arrays["slit_name"]), np.array(arrays["slit_flow"]))


def _check(domain, arrays, sides, air) -> None:
    wanted = {
        *NODAL,
        *OF_CELLS,
        *(f"{name}_cells" for name in OF_CELLS),
        *OF_BODIES,
        *NUMBERS,
        "cells",
        "listed",
        "layer_start",
        "graph_nodes",
        "flux_nodes",
        "flux",
        "flux_velocity",
        "flux_dt",
    }
    wanted |= {*SIDES, "absorbed"} if sides is not None else set()
    wanted |= {f"air_{name}" for name in OF_AIR} if air is not None else set()
    missing = sorted(wanted - set(arrays))
    if missing:
        raise OtherWater(f"not the state of this water: {', '.join(missing)} missing")
    nodes, cells = len(arrays["level_set"]), int(arrays["cells"])
    if (nodes, cells) != (len(domain.nodes), len(domain.cells)):
        raise OtherWater(
            f"the state has {nodes} nodes and {cells} cells, the domain {len(domain.nodes)} and {len(domain.cells)}; "
            "it belongs to another mesh, or its solids stand elsewhere"
        )
