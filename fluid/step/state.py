"""The state of the water as arrays: saved after a step and restored later, in this process or in a new one.

What follows from the mesh and from the solids is left out: whoever restores makes the same domain first.  A step after
`restore` gives what it would have given after `save`, bit for bit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from array_types import Array
from fluid.domain.cell_vectors import CellVectors
from fluid.domain.graph import Graph
from fluid.surface.volume import FluxAhead

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
    flux = water.flux
    if flux.capacity is not water.topology.node_volume or flux.now is not water.cell_velocity:
        raise NotAfterAStep("the state of the water can be saved after a step, before the solids move on")
    arrays = {name: np.asarray(getattr(water, name)) for name in (*NODAL, *OF_BODIES, *NUMBERS)}
    for name in OF_CELLS:
        listed = getattr(water, name)
        arrays |= {f"{name}_cells": listed.cells, name: listed.values}
    arrays |= {"listed": water.listed, "layer_start": water.layer_start}
    arrays |= {
        "graph_nodes": flux.graph.nodes,
        "flux_nodes": flux.nodes,
        "flux_before": flux.before,
        "flux_dt": np.array(flux.dt),
    }
    arrays["cells"] = np.array(len(water.topology.cells))
    if water.sides is not None:
        arrays |= {name: np.array(getattr(water.sides, name)) for name in SIDES}
        arrays["absorbed"] = water.sides.absorbed
    if water.air is not None:
        arrays |= {f"air_{name}": np.array(getattr(water.air, name)) for name in OF_AIR}
    if water.slits is not None:
        arrays |= {"slit_name": water.slits.name, "slit_flow": water.slits.flow}
    return arrays


def restore(water, domain, arrays) -> None:
    """Back to a saved state on `domain`, the same as the one that it was saved on.  Raises OtherWater."""
    _check(domain, arrays, water.sides, water.air)
    water.set_domain(domain)
    for name in (*NODAL, *OF_BODIES, "listed", "layer_start"):
        setattr(water, name, np.array(arrays[name]))
    for name in OF_CELLS:
        setattr(water, name, CellVectors(np.array(arrays[f"{name}_cells"]), np.array(arrays[name])))
    for name, kind in NUMBERS.items():
        setattr(water, name, kind(arrays[name]))
    water.graph = Graph.of(water.topology, np.array(arrays["graph_nodes"]))
    water.renumbered, water.left_behind, water.report = None, None, None
    water.flux = FluxAhead(
        nodes=np.array(arrays["flux_nodes"]),
        graph=water.graph,
        now=water.cell_velocity,
        before=np.array(arrays["flux_before"]),
        dt=float(arrays["flux_dt"]),
        water=water.nodal_water - water.displaced,
        capacity=water.topology.node_volume,
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
        "flux_before",
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
