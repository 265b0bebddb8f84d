"""Water at rest, or just set free, by the pressure of a domain alone: ∫ grad p . grad q = ∫ rho g . grad q."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from fluid.domain.coupling_matrix import wetted_coupling
from fluid.mesh.gradients import gradients

RHO_G = 9810.0


def laplace(domain, wet):
    """K (N, N) and ∫ rho g . grad N (N,) over the cells wet (M,) bool."""
    g, _ = gradients(domain.nodes, domain.cells)
    n, cells = len(domain.nodes), domain.cells[wet]
    stiffness = np.einsum("e,eac,ebc->eab", domain.volume, g, g)[wet]
    rows, columns = np.repeat(cells, 4, axis=1).ravel(), np.tile(cells, (1, 4)).ravel()
    K = sp.coo_matrix((stiffness.ravel(), (rows, columns)), shape=(n, n)).tocsr()
    b = np.zeros(n)
    np.add.at(b, cells.ravel(), (-RHO_G * domain.volume[:, None] * g[:, :, 2])[wet].ravel())
    return K, b


def pressure(domain, level, more=None):
    """p (N,) [Pa] with p = 0 on the levels (M,) [m] that the cells see, all of them planes of nodes.

    more: matrix (N, N) added to K, or None."""
    wet = domain.nodes[domain.cells][:, :, 2].max(axis=1) <= level + 1e-9
    K, b = laplace(domain, wet)
    if more is not None:
        K = (K + more).tocsr()
    free = free_nodes(domain, level, wet)
    A = K[free][:, free]
    scale = sp.diags_array(1 / np.sqrt(A.diagonal()))
    p = np.zeros(len(b))
    p[free] = scale @ spsolve((scale @ A @ scale).tocsc(), scale @ b[free])
    return p


def free_nodes(domain, level, wet):
    """(N,) bool: nodes of wet cells below their level."""
    at_node = np.zeros(len(domain.nodes))
    at_node[domain.cells] = level[:, None]
    free = np.zeros(len(domain.nodes), dtype=bool)
    free[domain.cells[wet]] = True
    return free & (np.abs(domain.nodes[:, 2] - at_node) > 1e-9)


def hydrostatic(domain, level):
    """rho g (level - z) (N,) at the nodes of wet cells, 0 elsewhere; level (M,) of the cells."""
    wet = domain.nodes[domain.cells][:, :, 2].max(axis=1) <= level + 1e-9
    at_node = np.zeros(len(domain.nodes))
    at_node[domain.cells] = level[:, None]
    return np.where(free_nodes(domain, level, wet), RHO_G * (at_node - domain.nodes[:, 2]), 0.0)


def forces(domain, p):
    """Force (n_bodies, 3) [N] of the pressure p (N,) on every body."""
    return -(wetted_coupling(domain).T @ p).reshape(-1, 6)[:, :3]
