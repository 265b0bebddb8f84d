"""A sphere in water: how its heave decays, and how fast it falls through a viscous liquid.

The sphere is a convex polyhedron with the volume of the sphere.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import argrelextrema

from coupler.commands.verify.figures import columns
from coupler.commands.verify.registry import Finding, check
from coupler.commands.verify.scenes import graded, level_at, top
from coupler.run.clock import Clock
from coupler.step.coupled_step import CoupledStepper
from coupler.step.immersion import Immersion
from fluid.mesh.background import box_mesh
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.generators.sphere import sphere_vertices
from yade_scripts.dynamics.structure import Structure


def _scene(axes, level, body, parameters: WaterParameters, smooth=None) -> CoupledStepper:
    mesh = box_mesh(None, None, axes=axes)
    immersion = Immersion(mesh, body, [], "single")
    water = Water(mesh, immersion.domain, level, parameters, None, smooth)
    return CoupledStepper(water, body, immersion, rtol=1e-8, step_max=1.0, clock=Clock())


@check(
    "P53", "heave of a half-submerged sphere dies away", "linear potential flow (case of Kramer 2021)", "M"
)
def heave_decay():
    """Dropped 0.2 R, in a tank 3.6 m wide for the open water of the theory. Waves of its period come back from the
    walls after the fourth extremum; longer ones are faster, and the sphere raises the mean level: in 2.4 m both lift
    the third extremum by 0.02."""
    exact = columns("sphere_heave_decay_linear")
    rows = argrelextrema(np.abs(exact["z_over_H0"]), np.greater)[0][:4]
    t, z = _heave(0.15, 5.0, 1.62)
    found_t, found_z = _extrema(t, z)
    period = exact["t_s"][rows[1]]
    yield Finding("period [s], R/h = 5", found_t[1], period, 0.03)
    for k, row in enumerate(rows):
        name = ("first", "second", "third", "fourth")[k]
        yield Finding(
            f"{name} extremum over the drop height", found_z[k], exact["z_over_H0"][row], 0.05, False
        )


def _heave(radius: float, cells: float, until: float):
    """(t, z/H0) of a sphere of half the density of water let go 0.2 R above its place of rest; h = R/cells."""
    h, half, depth = radius / cells, 1.8, 0.6
    across = graded(-half, half, (-1.6 * radius, 1.6 * radius), h, 0.08)
    up = graded(0.0, depth + 1.6 * radius, (depth - 1.6 * radius, depth + 1.6 * radius), h, 0.08)
    density, g, drop = 998.2, 9.82, 0.2 * radius
    block = Block(
        "sphere", (0.0, 0.0, depth + drop), vertices=sphere_vertices(radius, 320), density=0.5 * density
    )
    with Structure([block], gravity=(0, 0, -g)) as body:
        c = _scene((across, across, up), level_at(depth), body, WaterParameters(density=density, gravity=g))
        t, z = [0.0], [1.0]
        while t[-1] < until:
            c.step(min(0.006, c.step_size(1.0)))
            t.append(c.time)
            z.append((body.centre()[0, 2] - depth) / drop)
    return np.array(t), np.array(z)


def _extrema(t, z):
    """Times [s] and values of the turning points, by a parabola through three points each."""
    rows = np.flatnonzero((z[1:-1] - z[:-2]) * (z[2:] - z[1:-1]) < 0.0) + 1
    fits = [np.polyfit(t[i - 1 : i + 2] - t[i], z[i - 1 : i + 2], 2) for i in rows]
    places = np.array([-b / (2.0 * a) for a, b, _ in fits])
    return t[rows] + places, np.array([np.polyval(f, s) for f, s in zip(fits, places)])


@check(
    "P55", "sphere falls in a viscous liquid", "ten Cate et al., Phys. Fluids 14 (2002) 4012, digitised", "M"
)
def falling_sphere():
    """Box of 10 x 10 x 16 cm, no-slip sides; the gap below the sphere is eight diameters at the start."""
    cases = (("11p6", 962.0, 0.113, 4), ("11p6", 962.0, 0.113, 8), ("1p5", 970.0, 0.373, 4))
    for name, density, viscosity, cells in cases:
        speed, height = columns(f"tencate_Re{name}_velocity"), columns(f"tencate_Re{name}_height")
        t, v, gap = _fall(density, viscosity, cells)
        what = f"Re {name.replace('p', '.')}, D/h = {cells}"
        fastest = np.abs(speed["uz_mps"]).max()
        yield Finding(f"{what}: largest speed [m/s]", np.abs(v).max(), fastest, 0.05)
        exact = _first_below(height["t_s"], height["gap_over_d"], 4.0)
        yield Finding(f"{what}: time to a gap of 4 D [s]", _first_below(t, gap, 4.0), exact, 0.04)


def _first_below(t, gap, limit: float) -> float:
    """Time at which the gap falls to the limit, between two rows."""
    i = int(np.argmax(gap < limit))
    return float(t[i - 1] + (t[i] - t[i - 1]) * (gap[i - 1] - limit) / (gap[i - 1] - gap[i]))


def _fall(density: float, viscosity: float, cells: int):
    """(t, v [m/s], gap/D) of a sphere of 15 mm and 1120 kg/m³ until the gap to the bottom is 3.9 D."""
    D, side, height = 0.015, 0.1, 0.16
    h = D / cells
    across = graded(-0.5 * side, 0.5 * side, (-0.9 * D, 0.9 * D), h, 0.015, 1.3)
    up = graded(0.0, height, (2.6 * D, height), h, 0.015, 1.3)
    settings = WaterParameters(density=density, viscosity=viscosity, walls="no-slip")
    block = Block("sphere", (0.0, 0.0, 8.5 * D), vertices=sphere_vertices(0.5 * D), density=1120.0)
    with Structure([block]) as body:
        c = _scene((across, across, up), level_at(1.0), body, settings, top)
        t, v, gap = [0.0], [0.0], [8.0]
        while gap[-1] > 3.9:
            c.step(c.step_size(1.0) * min(1.0, 0.1 + c.time / 0.02))
            t.append(c.time)
            v.append(body.velocity()[0, 2])
            gap.append(body.centre()[0, 2] / D - 0.5)
    return np.array(t), np.array(v), np.array(gap)
