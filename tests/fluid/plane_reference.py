"""Water of two levels set free through openings of a wall, in the plane: P2 triangles graded towards the edges.

∇²p = 0 in the water, p = 0 on both levels, ∂p/∂n = -ρ g n_z on walls: the pressure in the instant in which the
openings appear. Gradings down to a five-hundredth of the opening leave an error below 1e-3 of the load."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from skfem import Basis, BilinearForm, ElementTriP2, FacetBasis, LinearForm, MeshTri, condense, solve
from skfem.helpers import dot, grad


def released(wall: float, thickness: float, openings, levels, finest: float) -> tuple[float, float]:
    """Force on the wall and rate at which the flow from left to right grows, per width.

    wall [m]: x of its middle in the tank 0..1 · openings: (low, high) [m] each · levels: left and right [m], the tank
    ends at the left one · finest [m]: triangles at the edges -> force / (ρ g) [m²], growth of the flow / g [m]."""
    left, right = wall - thickness / 2, wall + thickness / 2
    edges = [z for opening in openings for z in opening]
    x, z = _graded([0, left, right, 1], finest), _graded([0, *levels, *edges], finest)
    mesh = _water(MeshTri.init_tensor(x, z), left, right, openings, levels)
    basis = Basis(mesh, ElementTriP2())
    A = BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(basis)
    b = LinearForm(lambda v, w: -grad(v)[1]).assemble(basis)
    at_left = basis.get_dofs(lambda x: (np.abs(x[1] - levels[0]) < 1e-9) & (x[0] < left + 1e-9)).all()
    at_right = basis.get_dofs(lambda x: (np.abs(x[1] - levels[1]) < 1e-9) & (x[0] > right - 1e-9)).all()
    p = solve(*condense(A, b, D=np.concatenate([at_left, at_right])))
    force = 0.0
    for sign, place in ((1, left), (-1, right)):
        faces = mesh.facets_satisfying(lambda x, at=place: np.abs(x[0] - at) < 1e-9, boundaries_only=True)
        force += (
            sign * LinearForm(lambda v, w: v).assemble(FacetBasis(mesh, ElementTriP2(), facets=faces)) @ p
        )
    return float(force), float((b - A @ p)[at_right].sum())


def _water(mesh, left, right, openings, levels):
    """Only the triangles with water in them."""
    x, z = mesh.p[:, mesh.t].mean(axis=1)
    solid = (x > left) & (x < right)
    for low, high in openings:
        solid &= (z < low) | (z > high)
    air = (x > right) & (z > levels[1])
    return mesh.restrict(np.flatnonzero(~solid & ~air))


def _graded(points, finest, coarsest=0.04, ratio=1.35):
    """Increasing coordinates that start with `finest` steps at every point and grow away from it."""
    points, found = sorted(set(points)), []
    for low, high in pairwise(points):
        step, steps = min(finest, (high - low) / 8), [0.0]
        while steps[-1] < (high - low) / 2:
            steps.append(steps[-1] + step)
            step = min(step * ratio, coarsest)
        half = np.array(steps) * (high - low) / 2 / steps[-1]
        found += [*(low + half), *(high - half[-2:0:-1])]
    return np.array([*found, points[-1]])
