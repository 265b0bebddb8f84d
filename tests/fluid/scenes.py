"""Small scenes shared by the tests of the water."""

from __future__ import annotations

import numpy as np

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.numerics.bounded import solve_pressure
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from fluid.transport.advection import Fields, carried


def tank(size, cell, fill, bodies=None, is_open=None, covers="single", split="kuhn", **parameters) -> Water:
    """Water in the box [0, size] with cells of the given size; fill as in Water."""
    mesh = box_mesh(np.zeros(3), size, cell, split=split)
    domain = cut_domain(mesh, ConvexBodies.empty() if bodies is None else bodies, covers)
    return Water(mesh, domain, fill, WaterParameters(**parameters), is_open)


def advance(water: Water, dt=None, body_velocity=None, rtol=1e-9):
    """One step with bodies at a prescribed velocity (6 n_bodies,); returns (problem, x)."""
    problem = water.predict(water.stable_step() if dt is None else dt)
    moved = 0.0 if body_velocity is None else problem.coupling @ body_velocity
    found = solve_pressure(problem, rtol, moved)
    if body_velocity is None:
        problem = problem.with_waterline_of(found.x)
    water.correct(problem, found.x, found.parting)
    return problem, found.x


def load(problem, x):
    """Force and moment on each body, (n_bodies, 6) [N, N m]."""
    return problem.load(x)


def rotation(axis, angle):
    """Rotation matrix about an axis (3,) by an angle [rad] (Rodrigues)."""
    k = np.asarray(axis, float) / np.linalg.norm(axis)
    K = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def column(width, height):
    """Fill: a column of water against the wall x = 0 across the tank."""
    return lambda x: np.maximum(x[:, 0] - width, x[:, 2] - height)


def transport(topology, listed, dt, u_m, u, phi, on_open_side):
    """u (N, 3) and φ (N,) after dt at the listed nodes (n,), carried by u_m (N, 3) → (n, 4)."""
    return carried(topology, listed, dt, u_m, Fields.of(u, phi), on_open_side)
