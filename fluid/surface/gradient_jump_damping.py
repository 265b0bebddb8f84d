"""Damping of velocity of single nodes along the surface of calm water on meshes with obtuse cells.

Where all cells have the same shape, the pressure of a wave and the motion of the surface by the velocity are transposes
of each other to good accuracy.  Elsewhere the surface and velocities along it that alternate from node to node amplify
each other: by 0.005 to 0.015 a step in still water, with and without solids.  The gradient of every such velocity jumps
at the faces of the cells.  These jumps (Burman and Hansbo, Comput. Methods Appl. Mech. Eng. 193 (2004) 1437)
are damped:

    u_i ← u_i - c/m_i Σ_F V_F [∇u]·[∇N_i] / γ_F,      γ_F = Σ |∇N_a|² of both cells,      m_i = Σ_e W_e / 4,      (1)

over the faces F between wholly wet cells near the surface, W_e their water, V_F the smaller of both.  Symmetric and
positive: it only takes energy, and none from a velocity that is linear in space, whatever the cells (the difference to
the mean of a cell, `damp_waterline`, takes a fifth of a wave of 32 uneven cells in five periods).  As
|[∇u]|² ≤ γ_F Σ u_a² over the corners of both cells, no eigenvalue of the sum is above 16: up to c = 1/8 nothing grows,
on slivers either.
"""

from __future__ import annotations

import numpy as np

from kernels.decorators import helper, inner, kernel


@kernel
def damp_gradient_jumps(cell_list, phi, wet, weight, deep, u, fluid, neighbours):
    """Equation (1) with c = weight, in place on u (N, 3) [m/s], over the listed cells that reach up to φ > deep [m].

    fluid: FluidCells · neighbours (M, 4) of the cells across their faces."""
    cells, parent, g, volume = fluid.cells, fluid.parent, fluid.gradients, fluid.volume
    chosen = _whole_near(cell_list, phi, wet, deep, cells)
    mass, push = np.zeros(u.shape[0]), np.zeros(u.shape)
    for e in cell_list:
        if chosen[e] > 0:
            for a in range(4):
                mass[cells[e, a]] += 0.25 * volume[e]
    slope = np.zeros((2, 3, 3))
    for e in cell_list:
        for a in range(4):
            f = neighbours[e, a]
            if f > e and chosen[e] > 0 and chosen[f] > 0 and chosen[e] + chosen[f] > 2:
                _push_face(e, f, u, cells, parent, g, min(volume[e], volume[f]), slope, push)
    for i in range(u.shape[0]):
        if mass[i] > 0.0:
            for k in range(3):
                u[i, k] -= weight * push[i, k] / mass[i]


@helper
def _whole_near(cell_list, phi, wet, deep, cells):
    """(M,): 2 for wholly wet listed cells that reach up to φ > deep, 1 for deeper ones, 0 for all others."""
    chosen = np.zeros(cells.shape[0], np.int8)
    for e in cell_list:
        highest, whole = -np.inf, True
        for a in range(4):
            highest = max(highest, phi[cells[e, a]])
            whole = whole and wet[cells[e, a]]
        if whole:
            chosen[e] = 2 if highest > deep else 1
    return chosen


@inner
def _push_face(e, f, u, cells, parent, g, water, slope, push):
    """Add V_F [∇u]·[∇N_i] / γ_F of the face between cells e and f to push (N, 3); slope (2, 3, 3): work space."""
    size = 0.0
    for side in range(2):
        c = e if side == 0 else f
        for k in range(3):
            for d in range(3):
                slope[side, k, d] = 0.0
        for a in range(4):
            for d in range(3):
                gad = g[parent[c], a, d]
                size += gad * gad
                for k in range(3):
                    slope[side, k, d] += u[cells[c, a], k] * gad
    for side in range(2):
        c, sign = (e, water / size) if side == 0 else (f, -water / size)
        for a in range(4):
            for k in range(3):
                total = 0.0
                for d in range(3):
                    total += (slope[0, k, d] - slope[1, k, d]) * g[parent[c], a, d]
                push[cells[c, a], k] += sign * total
