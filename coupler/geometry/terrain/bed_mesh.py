"""The mesh that ends on the bed of a terrain, made once a tank."""

from __future__ import annotations

from functools import lru_cache

from coupler.case.case import Tank
from coupler.geometry.stretches import graded


def fitted_of(tank: Tank):
    """The `FittedMesh` of a tank over a terrain, made once. Raises MeshError."""
    return _fitted(tank.lower, tank.upper, tank.cell, tank.split, tank.ground, tank.stretch)


@lru_cache(maxsize=1)
def _fitted(lower, upper, cell: float, split: str, ground, stretch: tuple):
    from fluid.mesh.fitted_mesh import fitted_mesh

    axes = None
    if stretch:
        ends = zip(lower[:2], upper[:2], "xy")
        axes = [
            graded(low, high, cell, [s for s in stretch if s.along == along]) for low, high, along in ends
        ]
    return fitted_mesh(lower, upper, cell, ground, axes=axes, split=split)
