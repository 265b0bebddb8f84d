"""Parts of cells down to 1e-24 of their volume change neither the condition of the pressure matrix nor its result."""

from dataclasses import dataclass

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.spatial.transform import Rotation

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain, wetted_coupling
from fluid.mesh.background import box_mesh
from fluid.mesh.gradients import gradients
from fluid.numerics.solve import solve
from tests.fluid.scenes import advance, tank

H = 1 / 6
MESH = box_mesh((0, 0, 0), (1, 1, 1), H)
RHO_G = 9810.0


def floor(tilt, delta):
    """A half space of solid whose top passes a layer of nodes by delta cells (tilt 0), or a single row of them."""
    turn = Rotation.from_euler("x", tilt, degrees=True).as_matrix()
    point = np.array([0.5, 0.5, 0.5 - delta * H])
    return ConvexBodies.boxes([point - 5 * turn[:, 2]], [[99, 99, 10]], turn[None])


@dataclass(frozen=True)
class AtRest:
    """Least share of a cell, condition of the scaled matrix, iterations of the solver, relative error of the load on
    the floor, and largest acceleration left over in a cell in g."""

    share: float
    condition: float
    iterations: int
    load_error: float
    acceleration: float


def at_rest(bodies) -> AtRest:
    """∫ grad p . grad q = ∫ rho g . grad q with p = 0 on the top of the mesh, under a full cube of water."""
    domain = cut_domain(MESH, bodies)
    g, _ = gradients(domain.nodes, domain.cells)
    local = np.einsum("e,eac,ebc->eab", domain.volume, g, g)
    rows, columns = np.repeat(domain.cells, 4, axis=1).ravel(), np.tile(domain.cells, (1, 4)).ravel()
    K = sp.coo_matrix((local.ravel(), (rows, columns)), shape=(len(domain.nodes),) * 2).tocsr()
    b = np.zeros(len(domain.nodes))
    np.add.at(b, domain.cells.ravel(), (-RHO_G * domain.volume[:, None] * g[:, :, 2]).ravel())
    used = (K.diagonal() > 0) & (domain.nodes[:, 2] < 1 - 1e-9)
    A = sp.csr_array(K[used][:, used])
    scale = sp.diags_array(1 / np.sqrt(A.diagonal()))
    found = solve(A, b[used], np.zeros(used.sum()), 1e-12)
    p = np.zeros(len(b))
    p[used] = found.x
    exact = np.where(used, RHO_G * (1 - domain.nodes[:, 2]), 0)
    G = wetted_coupling(domain)
    error = np.abs(G.T @ (p - exact)).max() / np.abs(G.T @ exact).max()
    left = np.einsum("ea,eac->ec", p[domain.cells], g) / RHO_G + [0, 0, 1]
    share = (domain.volume / MESH.cell_volume[domain.parent_cell]).min()
    condition = np.linalg.cond((scale @ A @ scale).toarray())
    return AtRest(share, condition, found.iterations, error, np.abs(left).max())


@pytest.mark.parametrize("tilt", [0, 20])
def test_condition_and_hydrostatics_are_independent_of_the_cut(tilt):
    """Natural conditions on the cut faces: no threshold, no penalty, a diagonal scaling suffices."""
    found = [at_rest(floor(tilt, 10.0**-k)) for k in range(1, 9)]
    assert found[-1].share < 1e-20
    for one in found:
        assert one.condition < 1.1 * found[0].condition
        assert one.iterations <= found[0].iterations + 2
        assert one.load_error < 1e-13
        assert one.acceleration < 1e-8


@pytest.mark.parametrize("exponent", [2, 5, 8])
def test_water_at_rest_over_slivers(exponent):
    """The whole step: no motion but round-off where parts of 1e-6, 1e-15 and 1e-24 of a cell lie on the floor."""
    water = tank((1, 1, 1), H, lambda x: x[:, 2] - 0.87, floor(20, 10.0**-exponent))
    for _ in range(4):
        advance(water, rtol=1e-12)
    assert np.abs(water.velocity[water.level_set < 0]).max() < 1e-7
