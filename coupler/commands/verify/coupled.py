"""Water and blocks together: floating, added mass, heave, attitude."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq, curve_fit
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation
from skfem import Basis, ElementTetP1, FacetBasis, LinearForm, MeshTet
from skfem.models.poisson import laplace

from coupler.commands.verify.figures import columns
from coupler.commands.verify.registry import Finding, check
from coupler.commands.verify.scenes import DENSITY, G, around, box, level_at, tank
from fluid.mesh.background import box_mesh
from fluid.numerics.solve import solve
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import FixedPlane
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure


@check("P50", "a box afloat at its exact draught stays", "Archimedes: draught = s H")
def draught():
    size, level = np.array([0.3, 0.25, 0.2]), 0.53
    for s, n, finer in (
        (0.15, 12, 0),
        (0.5, 12, 0),
        (0.85, 12, 0),
        (0.85, 24, 0),
        (0.15, 6, 1),
        (0.85, 6, 1),
    ):
        z = level - s * size[2] + 0.5 * size[2]
        block = Block("box", (0.49, 0.52, z), size=size, density=s * DENSITY)
        with Structure([block], gravity=(0, 0, -G)) as body:
            near = [around(block.centre, size, 0.1)] if finer else []
            c = tank((1, 1, 1), (n, n, n), level_at(level), body, refined=near)
            depths = []
            while c.time < 1.0:
                c.step(0.01)
                depths.append(level - (body.centre()[0, 2] - 0.5 * size[2]))
        what = f"mean draught / H over 1 s, density ratio {s}, h = 1 m/{n}"
        what += ", halved around the box" if finer else ""
        yield Finding(what, np.mean(depths) / size[2], s, 0.01)


@check("P51", "added mass of a cube at release", "potential flow, P2 elements on graded meshes", "M")
def added_mass():
    """The edges of the cube set the accuracy: the error of linear elements falls with h^(4/3) there, 5.5 % at a/12."""
    closed, opened = (columns(f"added_mass_{kind}_tank") for kind in ("closed", "open"))
    exact = closed["ca"][closed["dim"] == 3][0], opened["ca"][opened["dim"] == 3][0]
    for is_closed, ca in ((True, exact[0]), (False, exact[1])):
        what = f"{'closed' if is_closed else 'open'} tank, h = a/16, density ratio 0.5"
        yield Finding(what, _added_mass(0.5, 48, is_closed), ca, 0.05)
    what = "closed tank, h = a/8, a/16 around the cube, density ratio 0.5"
    yield Finding(what, _added_mass(0.5, 24, True, margin=0.25), exact[0], 0.05)
    coarse = [_added_mass(s, 18, True) for s in (0.01, 0.1, 0.5, 2.5, 7.8)]
    what = "h = a/6 against linear elements on a mesh that follows the cube, density ratio 0.5"
    yield Finding(what, coarse[2], linear_elements(6), 1e-4)
    what = "h = a/6, largest / smallest ca over density ratios 0.01 to 7.8"
    yield Finding(what, max(coarse) / min(coarse), 1.0, 1e-3)
    halved = [_added_mass(0.01, 9, True, 4e-3 / 2**k, steps=5) for k in range(7)]
    what = "density ratio 0.01, largest / smallest ca while dt is halved six times"
    yield Finding(what, max(halved) / min(halved), 1.0, 0.05)


def linear_elements(cells: int) -> float:
    """ca of the cube in the closed tank by Galerkin's method with P1 elements, h = a/cells, the cube left out of the
    mesh: ca = g·K⁻¹g with K the stiffness matrix and g_i = ∮ N_i n_z dA over the cube."""
    mesh = box_mesh(np.zeros(3), (3, 3, 3), 1.0 / cells)
    is_water = (np.abs(mesh.nodes[mesh.cells].mean(axis=1) - 1.5) > 0.5).any(axis=1)
    used, corners = np.unique(mesh.cells[is_water], return_inverse=True)
    water = MeshTet(mesh.nodes[used].T.copy(), corners.reshape(-1, 4).T.copy().astype(np.int64))
    own = water.facets_satisfying(lambda x: np.abs(x - 1.5).max(axis=0) < 0.5 + 1e-9, boundaries_only=True)
    g = LinearForm(lambda v, w: w.n[2] * v).assemble(FacetBasis(water, ElementTetP1(), facets=own))
    K = laplace.assemble(Basis(water, ElementTetP1()))
    # the potential is defined up to a constant, so one node is fixed
    potential = solve(csr_array(K[1:, 1:]), g[1:], np.zeros(len(g) - 1), 1e-10).x
    return float(g[1:] @ potential)


def _added_mass(
    s: float, cells: int, closed: bool, dt: float = 1e-3, steps: int = 1, margin: float | None = None
) -> float:
    """ca = g (1 - s)/a - s from the first acceleration of a unit cube in a tank of side 3 (mean of `steps` steps).
    margin [m]: cells are halved up to there around the cube, None: nowhere."""
    block = Block("cube", (1.5, 1.5, 1.5), size=1.0, density=s * DENSITY)
    with Structure([block], gravity=(0, 0, -G)) as body:
        height, extra = (3.0, 0) if closed else (3.0 + 6.0 / cells, 2)
        fill = level_at(10.0) if closed else level_at(3.0)
        near = [] if margin is None else [around((1.5, 1.5, 1.5), (1, 1, 1), margin)]
        c = tank((3, 3, height), (cells, cells, cells + extra), fill, body, rtol=1e-10, refined=near)
        for _ in range(steps):
            c.step(dt)
        return G * (1.0 - s) / (body.velocity()[0, 2] / (steps * dt)) - s


@check("P52", "heave of a floating box in a closed tank", "linear potential flow, three refinements", "M")
def heave():
    table = columns("floating_box_heave_tank")
    for row, n in ((0, 40), (1, 40)):
        L, h, B, d, T = (table[k][row] for k in ("L", "h", "B", "d", "T1"))
        t, z = _heave(L, h, B, d, n, 2.2 * T)
        yield Finding(f"period [s], L {L:g} m, B {B:g} m, d {d:g} m, h = L/{n}", _period(t, z, T), T, 0.03)


def _heave(L: float, depth: float, B: float, d: float, n: int, until: float):
    """(t, z) of the centre of a box across a slice tank, let go 0.05 d above its place of rest."""
    cell = L / n
    size = np.array([B, 2 * cell, 2 * d])
    lift = 0.05 * d
    # the lifted box displaces less: the level is lower by its share
    level = depth - lift * B / (L - B)
    block = Block("box", (0.5 * L, cell, depth + lift), size=size, density=0.5 * DENSITY)
    height = (round(depth / cell) + round(3 * d / cell)) * cell
    # smooth tank sides hold the short box upright across the slice
    sides = [FixedPlane((0, y, 0), (0, s, 0), f"side {s}") for y, s in ((0.0, 1.0), (2 * cell, -1.0))]
    with Structure([block], ContactLaw(1e6, friction=0.0), planes=sides, gravity=(0, 0, -G)) as body:
        c = tank((L, 2 * cell, height), (n, 2, round(height / cell)), level_at(level), body, rtol=1e-8)
        t, z = [], []
        while c.time < until:
            c.step(min(0.005, c.step_size(1.0)))
            t.append(c.time)
            z.append(body.centre()[0, 2] - depth)
    return np.array(t), np.array(z)


def _period(t, z, guess: float) -> float:
    def model(t, A, T, rate, phase, c):
        return A * np.exp(-rate * t) * np.cos(2 * np.pi * t / T + phase) + c

    return float(curve_fit(model, t, z, [z[0], guess, 0.1, 0.0, 0.0])[0][1])


@check("P54", "attitude in which a square prism floats", "stable heel of a homogeneous prism", "M")
def attitude():
    table = columns("floating_square_attitude")
    for s in (0.15, 0.24, 0.4):
        exact = table["heel_deg"][np.isclose(table["s"], s)][0]
        yield Finding(f"stable heel [deg], density ratio {s}", _stable_heel(s), exact, 2.0, False)


def _stable_heel(s: float) -> float:
    """Heel [deg] in [0, 45] at which a floating prism is stable: the roll moment of still water on it changes sign."""
    heels = np.linspace(1.0, 44.0, 9)
    moments = [_roll_moment(a, s) for a in heels]
    if moments[0] <= 0.0:
        return 0.0
    if moments[-1] >= 0.0:
        return 45.0
    last = int(np.argmax(np.array(moments) <= 0.0))
    return float(brentq(lambda a: _roll_moment(a, s), heels[last - 1], heels[last], xtol=0.2))


def _roll_moment(heel: float, s: float) -> float:
    """Moment [N m] of the water about the axis of the prism, positive towards more heel, where buoyancy = weight."""
    weight = s * DENSITY * G * 0.4**2 * 0.05

    def surplus(z):
        return _still_load(z, heel)[2] - weight

    z = brentq(surplus, 0.5 - 0.2, 0.5 + 0.28, xtol=1e-5)
    return float(_still_load(z, heel)[4])


def _still_load(z: float, heel: float):
    """Force and moment (6,) of still water, level 0.5 m, on a held square prism of 0.4 m across a slice of a tank."""
    turn = Rotation.from_euler("y", heel, degrees=True).as_matrix()
    prism = box((0.5, 0.025, z), (0.4, 0.05, 0.4), turn)
    c = tank((1, 0.05, 1), (40, 2, 40), level_at(0.5), solids=[prism], rtol=1e-10)
    return c.step(1e-3).load[0]
