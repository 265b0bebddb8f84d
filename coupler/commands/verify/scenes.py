"""Scenes shared by the cases with water: a tank, its contents, and their coupling."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from coupler.geometry.solids import BOX_CORNERS, BOX_FACES
from coupler.run.clock import Clock
from coupler.scene.fill import start_level
from coupler.step.coupled_step import CoupledStepper
from coupler.step.immersion import Immersion
from fluid.domain.covers import OPENINGS
from fluid.mesh.background import box_mesh
from fluid.mesh.refinement import InBox, refined_mesh
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water

G = 9.81
DENSITY = 1000.0


def box(centre, size, rotation=None) -> tuple[np.ndarray, tuple]:
    """A fixed box for `tank`: vertices (8, 3) [m] and faces."""
    turn = np.eye(3) if rotation is None else rotation
    return np.asarray(centre) + (0.5 * np.asarray(size) * BOX_CORNERS) @ turn.T, BOX_FACES


def graded(low: float, high: float, fine: tuple[float, float], h: float, most: float, growth: float = 1.2):
    """Coordinates from low to high [m]: steps of h within `fine`, growing outside it up to `most`."""
    middle = np.linspace(*fine, round((fine[1] - fine[0]) / h) + 1)

    def away(length):
        if length <= 0.0:
            return np.zeros(0)
        steps = np.minimum(h * growth ** np.arange(1, 1000), most)
        steps = steps[: np.searchsorted(np.cumsum(steps), length) + 1]
        return np.cumsum(steps) * length / steps.sum()

    return np.concatenate([fine[0] - away(fine[0] - low)[::-1], middle, fine[1] + away(high - fine[1])])


def around(centre, size, margin: float, levels: int = 1) -> InBox:
    """Finer cells up to a margin [m] around an upright box."""
    half = 0.5 * np.asarray(size, float) + margin
    return InBox(tuple(np.asarray(centre) - half), tuple(np.asarray(centre) + half), levels)


def tank(
    size,
    cells,
    fill: Callable | list,
    structure=None,
    solids=(),
    rtol: float = 1e-9,
    is_open=None,
    is_smooth=None,
    covers: str = "single",
    openings: str = "all",
    split: str = "kuhn",
    refined: Sequence = (),
    axes=None,
    **parameters,
) -> CoupledStepper:
    """Water in [0, size] on cells (nx, ny, nz) with blocks and fixed solids; is_open, is_smooth: see `Water`;
    split: see `box_mesh`; openings: of multiple covers, as in a case; refined: regions of `fluid.mesh.refinement`;
    axes: three coordinate arrays of graded bricks in place of cells.

    fill: as in `Water`, or boxes (lower (3,), upper (3,)) filled like those of a case, which end at walls."""
    mesh = box_mesh(np.zeros(3), size, np.asarray(size, float) / np.asarray(cells), axes, split)
    mesh = refined_mesh(mesh, refined) if refined else mesh
    immersion = Immersion(mesh, structure, list(solids), covers, connection=OPENINGS[openings])
    parameters = WaterParameters(**({"density": DENSITY, "gravity": G} | parameters))
    if not callable(fill):
        fill = start_level(fill, (np.zeros(3), np.asarray(size, float)), mesh, immersion.domain)
    water = Water(mesh, immersion.domain, fill, parameters, is_open, is_smooth)
    return CoupledStepper(water, structure, immersion, rtol=rtol, step_max=1.0, clock=Clock())


def slice_sides(normal, centre):
    """Sides normal to y of a slice of a wide flow; they are free of friction."""
    return np.abs(normal[:, 1]) > 0.5


def top(normal, centre):
    """The open top of a tank."""
    return normal[:, 2] > 0.5


def level_at(z: float) -> Callable:
    """Fill up to z."""
    return lambda x: x[:, 2] - z


def column(width: float, height: float) -> Callable:
    """A column of water at the wall x = 0, over the whole depth of the tank."""
    return lambda x: np.maximum(x[:, 0] - width, x[:, 2] - height)
