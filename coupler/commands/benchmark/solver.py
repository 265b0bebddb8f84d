"""Solvers for the pressure on systems of the water, alone and with a wall of blocks inside (`part.py solver UNKNOWNS`).

Each preconditioner is set up, then used by the same conjugate gradients to 1e-8, once from zero and once from a guess
with an error of some per cent, like that of the pressure of the previous step. CPU seconds, the best of REPEATS.
"""

from __future__ import annotations

import time

import numpy as np

REPEATS = 3
RTOL = 1e-8
PRECONDITIONERS = ("multigrid", "smoothed aggregation", "classical AMG", "diagonal")


def preconditioner(name: str, A):
    """A function r ↦ M⁻¹ r."""
    if name == "multigrid":
        from fluid.numerics.multigrid import Multigrid

        return Multigrid(A)
    if name == "diagonal":
        inverse = 1.0 / A.diagonal()
        return lambda r: inverse * r
    import pyamg

    if name == "classical AMG":
        return pyamg.ruge_stuben_solver(A, max_coarse=300).aspreconditioner(cycle="V").matvec
    # prolongation weights from row sums: estimated spectral radii would differ from run to run
    smooth = ("jacobi", {"weighting": "local"})
    levels = pyamg.smoothed_aggregation_solver(A, max_coarse=300, smooth=smooth, improve_candidates=None)
    return levels.aspreconditioner(cycle="V").matvec


def pressure_system(unknowns: int, wall: bool):
    """Half full tank 3.22 m x 1 m x 1 m with a box, its surface tilted; the wall stands across it, of 5 x 5 blocks."""
    from fluid.cut.bodies import ConvexBodies
    from fluid.domain.physical_domain import cut_domain
    from fluid.mesh.background import box_mesh
    from fluid.step.water import Water

    cell = (3.22 * 0.5 / unknowns) ** (1.0 / 3.0)
    mesh = box_mesh((0.0, 0.0, 0.0), (3.22, 1.0, 1.0), cell)
    centre, size = [[2.476, 0.5, 0.25]], [[0.161, 0.403, 0.5]]
    if wall:
        at = (np.arange(5) + 0.5) / 5.0
        centre, size = [[1.6, y, z] for y in at for z in at], [[0.1, 0.2, 0.2]] * 25
    domain = cut_domain(mesh, ConvexBodies.boxes(centre, size), "multiple" if wall else "single")
    water = Water(mesh, domain, lambda x: x[:, 2] - 0.5 + 0.06 * (x[:, 0] - 1.6))
    return water.predict(water.stable_step())


def response(problem, wall: bool):
    """v ↦ G D⁻¹ Gᵀ v of free blocks of 2400 kg/m3, None without a wall."""
    if not wall:
        return None
    G = problem.coupling
    mass = 2400.0 * 0.1 * 0.2 * 0.2
    inertia = mass / 12.0 * np.array([0.08, 0.05, 0.05])
    compliance = problem.dt / np.tile(np.concatenate([np.full(3, mass), inertia]), G.shape[1] // 6)
    Gt = G.T.tocsr()
    return lambda v: G @ (compliance * (Gt @ v))


def solver(unknowns: int, wall: bool = False) -> dict:
    """Seconds and iterations of every preconditioner on one system."""
    problem = pressure_system(unknowns, wall)
    extra = response(problem, wall)
    found = {"unknowns": len(problem.rhs), "wall": wall, "solvers": {}}
    for name in PRECONDITIONERS:
        found["solvers"][name] = _measured(name, problem.matrix, problem.rhs, extra)
    return found


def _measured(name: str, A, b, extra) -> dict:
    from fluid.numerics.solve import solve

    setup, M = _timed(lambda: preconditioner(name, A))
    cold, first = _timed(lambda: solve(A, b, np.zeros(len(b)), RTOL, extra, kept=[M]))
    guess = first.x * (1.0 + 0.02 * np.sin(40.0 * np.arange(len(b)) / len(b)))
    warm, second = _timed(lambda: solve(A, b, guess, RTOL, extra, kept=[M]))
    iterations = (first.iterations, second.iterations)
    return {"setup": setup, "cold": cold, "warm": warm, "iterations": iterations}


def _timed(work):
    best, result = np.inf, None
    for _ in range(REPEATS):
        began = time.process_time()
        result = work()
        best = min(best, time.process_time() - began)
    return best, result
