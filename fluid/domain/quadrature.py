"""Four-point rules on the fluid part of each cell.

A part with volume V, centroid c and second moment S (about c) gets points with equal positive weights V/4

    x_q = r + B (y_c + R s_q),   y_c = B^-1 (c - r),   R = (B^-1 (S/V) B^-T)^(1/2) symmetric,
    s_q = (1,1,1), (1,-1,-1), (-1,1,-1), (-1,-1,1),

where B maps the regular tetrahedron with corners s_q to the cell and r is the centre of the cell. The rule is exact
for polynomials of degree 2, hence for all P1-P1 forms; on a full cell it is the usual four-point rule. Cut
and full cells have the same number of points, so one scikit-fem basis serves all.

Points may lie a little outside the part: do not sample discontinuous fields there.
"""

from __future__ import annotations

import numpy as np
from skfem import CellBasis, ElementTetP1, MeshTet

from array_types import Array

# Corners of the regular tetrahedron with unit covariance of the four points.
CORNERS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
# The usual degree-2 rule: barycentric (a, b, b, b).
FULL_NEAR = (5.0 + 3.0 * np.sqrt(5.0)) / 20.0
FULL_FAR = (5.0 - np.sqrt(5.0)) / 20.0
# A thin part can have a second moment that is zero or negative by round-off in one direction.
MATRIX = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])


def quadrature_rule(domain) -> tuple[Array, Array]:
    """X (3, M, 4), W (M, 4) in the reference coordinates of each cell, for
    skfem.CellBasis(MeshTet(nodes.T, cells.T), ElementTetP1(), quadrature=(X, W))."""
    n = len(domain.cells)
    barycentric = np.empty((n, 4, 3))
    barycentric[:] = np.where(np.arange(4)[:, None] == np.arange(1, 4)[None], FULL_NEAR, FULL_FAR)
    weight = np.full((n, 4), 1.0 / 24.0)
    cut = np.flatnonzero(domain.is_cut)
    corners = domain.nodes[domain.cells[cut]]
    edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    points = part_points(corners, domain.volume[cut], domain.centroid_of(cut), domain.second_of(cut))
    offset = np.swapaxes(points - corners[:, :1], 1, 2)
    barycentric[cut] = np.swapaxes(np.linalg.solve(edges, offset), 1, 2)
    weight[cut] = (domain.volume[cut] / np.abs(np.linalg.det(edges)) / 4)[:, None]
    return np.ascontiguousarray(np.moveaxis(barycentric, 2, 0)), weight


def part_points(corners, volume, centroid, second) -> Array:
    """Points (k, 4, 3) [m] of the parts of cells corners (k, 4, 3): volume (k,), centroid (k, 3) [m],
    second (k, 6) [m5] central. Weights volume / 4."""
    centre = corners.mean(axis=1)
    # B s_q + r = corner q, hence B = 1/4 sum_q (corner_q - r) s_q^T.
    B = np.einsum("kqi,qj->kij", corners - centre[:, None], CORNERS) / 4
    inverse = np.linalg.inv(B)
    covariance = second[:, MATRIX] / volume[:, None, None]
    root = symmetric_root(inverse @ covariance @ np.swapaxes(inverse, 1, 2))
    y = np.einsum("kij,kj->ki", inverse, centroid - centre)[:, None] + np.einsum("kij,qj->kqi", root, CORNERS)
    return centre[:, None] + np.einsum("kij,kqj->kqi", B, y)


def symmetric_root(S) -> Array:
    """Symmetric square root of (k, 3, 3); eigenvalues below zero (round-off of thin parts) count as zero."""
    value, vector = np.linalg.eigh((S + np.swapaxes(S, 1, 2)) / 2)
    scaled = vector * np.sqrt(np.maximum(value, 0.0))[:, None]
    return scaled @ np.swapaxes(vector, 1, 2)


def cell_basis(domain) -> CellBasis:
    """scikit-fem basis (P1) whose integrals run over the fluid part of every cell."""
    mesh = MeshTet(
        domain.nodes.T.copy(), domain.cells.T.astype(np.int64, order="C"), sort_t=False, validate=False
    )
    return CellBasis(mesh, ElementTetP1(), quadrature=quadrature_rule(domain))
