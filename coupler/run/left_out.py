"""Work that a run skipped, counted while it runs: means over its steps, from numbers that the steps have already
computed.

Only cells of the mesh that water reaches are assembled, only bodies that moved are cut again, and only intact joints
and active contacts are evaluated; `explain_run` describes the difference in words. Stored in run.json under
figures.work.
"""

from __future__ import annotations

import sys

HEAVY = (
    "fluid", "yade_scripts", "yade", "scipy", "numba", "h5py", "skfem", "pint", "matplotlib", "pyvista",
    "vtkmodules",
)  # fmt: skip
"""Packages of this program and others that take time or memory to load."""


def imports() -> dict[str, bool]:
    """Whether this process has loaded each module of HEAVY."""
    return {name: name in sys.modules for name in HEAVY}


def note_work(work: dict[str, float], coupling, record, joints, steps: int) -> None:
    """Carry step number `steps` into the means: work += (counts - work) / steps. joints: JointCounts or None."""
    counts = _of_water(coupling, record) if coupling.water is not None else {}
    if joints is not None:
        counts |= _of_structure(coupling.structure, joints)
    for name, count in counts.items():
        before = work.get(name, 0.0)
        work[name] = before + (count - before) / steps


def _of_water(coupling, record) -> dict[str, int]:
    """Cells in the mesh, outside solids, with water; bodies in it, those cut again; pressure solves."""
    water, topology = coupling.water, coupling.water.topology
    return {
        "mesh_cells": len(water.mesh.cells),
        "cells": len(topology.cells),
        "wet_cells": water.report.wet_cells,
        "bodies": water.domain.n_bodies,
        "bodies_cut": record.bodies_cut,
        "passes": record.passes,
    }


def _of_structure(structure, joints) -> dict[str, int]:
    """Blocks, those that meet others by contact; joints, those that hold; contacts that touch."""
    return {
        "blocks": structure.n,
        "loose_blocks": int(structure.loose().sum()),
        "joints": joints.intact + joints.broken,
        "live_joints": joints.intact,
        "contacts": len(structure.contacts()),
    }
