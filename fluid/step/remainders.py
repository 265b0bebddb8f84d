"""The part u' of the velocity of cells that nodes cannot represent (subscales), and what of it lives on.

u'_e = β (u'_e + (1-θ) dt r_e)                    carried into the step, swept out by the water that crosses the cell
u'_e ← s (u'_e + Π(∇x) - ∇x_e)                    left after the pressure x
r_e = s (Π(∇x) - ∇x_e)/(θ dt)                     its rate for the next step

with x in units of ρ/dt, Π: weighted mean; s = 1 in deep cells, in fast ones near the surface a share in steps that are
cut short (`kept_near_the_surface`), 0 else.
"""

from __future__ import annotations

import numpy as np

from fluid.domain.cell_vectors import CellVectors, first_from
from fluid.step import speeds
from kernels.decorators import inner, ranged
from kernels.threads import over

LAYER = 1e-6
"""What limits of depth, in cell sizes, lack of whole numbers, so that no layer of nodes under level water that ends at
such a layer lies on one: round-off would decide for each cell."""
MEMORY_DEPTH = 2.0 - LAYER
"""Cells nearer to the surface than this, in cell sizes, keep nothing in calm water: there it feeds surface noise."""
FAST = (1.0, 3.0)
"""Speeds in √(g h) of a cell near the surface from the first of which it keeps a part of the share of
`kept_near_the_surface`, and from the second the whole."""
ROUND_OFF = 1e-9
"""Steps shorter than that of Courant number 1 by no more than this, relative to it, are not cut short."""


def carried_remainder(water, dt, theta, cells):
    """u'_e = β (u'_e + (1-θ) dt r_e) (n, 3) of the listed cells, with β = 1/(1 + (n + m s) dt), n = 4 ν/l_e²,
    s = 2 |u_e|/l_e, m = min(1, |u'_e| (n + s)/|r_e|): the remainder that lives on.

    It is swept out of the cell in the time that the water takes to cross it, and viscosity stops it (dynamic subscales;
    Codina, Principe, Guasch, Badia, Comput. Methods Appl. Mech. Eng. 196 (2007) 2413). In steady flow the pressure
    makes up for that, |r_e| = (n + s) |u'_e|, and m = 1. Water that has moved by less than a quarter of a cell since it
    turned round, |u'_e| s/|r_e| = 4 |way|/l_e, has not yet left it: without m a box that swings by a fiftieth of a cell
    loses 0.4 % of its amplitude a period at its edges."""
    t, p = water.topology, water.parameters
    if not p.subscale_memory:
        return np.zeros((len(cells), 3))
    held = (*water.remainder, water.kick_remainder.values)
    nu = p.viscosity / p.density
    return carry_remainder(cells, held, (1.0 - theta) * dt, water.velocity, dt, nu, t.cells, t.size)


def carry_remainder(cell_list, held, kick_time, u, dt, nu, cells, size):
    """β (u' + kick_time r) (n, 3) of the listed cells (n,); nu: kinematic viscosity [m²/s].

    held: cells (k,) that have u' (k, 3) [m/s] and r (k, 3) [m/s²]; in others both are zero. Both lists ascend."""
    out = np.empty((len(cell_list), 3))
    over(_carry_remainder, len(cell_list), cell_list, held, (kick_time, dt, nu), u, cells, size, out)
    return out


@ranged
def _carry_remainder(first, last, cell_list, held, numbers, u, cells, size, out):
    with_one, remainder, kick = held
    kick_time, dt, nu = numbers
    row, end = first_from(with_one, cell_list[first] if first < last else 0), np.uint64(with_one.shape[0])
    for place in range(first, last):
        s = np.uint64(place)
        cell = cell_list[s]
        e = np.uint64(cell)
        while row < end and with_one[row] < cell:
            row += np.uint64(1)
        if row == end or with_one[row] != cell:
            out[s, 0], out[s, 1], out[s, 2] = 0.0, 0.0, 0.0
            continue
        own, rate = 0.0, 0.0
        for k in range(3):
            own += remainder[row, k] * remainder[row, k]
            rate += kick[row, k] * kick[row, k]
        if own == 0.0 and rate == 0.0:  # near the surface: nothing to carry, whatever the velocity
            out[s, 0], out[s, 1], out[s, 2] = 0.0, 0.0, 0.0
            continue
        square = 0.0
        for k in range(3):
            mean = 0.25 * (u[cells[e, 0], k] + u[cells[e, 1], k] + u[cells[e, 2], k] + u[cells[e, 3], k])
            square += mean * mean
        stopped, swept = 4.0 * nu / (size[e] * size[e]), 2.0 * np.sqrt(square) / size[e]
        steady = (stopped + swept) * np.sqrt(own)
        moved = 1.0 if steady * steady >= rate else steady / np.sqrt(rate)
        beta = 1.0 / (1.0 + (stopped + moved * swept) * dt)
        for k in range(3):
            out[s, k] = beta * (remainder[row, k] + kick_time * kick[row, k])


def left_in_cells(water, kept, gradient, mean, u, dt):
    """u' [m/s] of the wet cells after this step and its rate -(∇x - Π∇x)/(θ ρ) [m/s²] for the next kick; u (N, 3) [m/s]
    after the pressure."""
    t, cells = water.topology, kept.wet_cells
    if not water.parameters.subscale_memory:
        return CellVectors.none(), CellVectors.none()
    remainder, rate = np.empty((len(cells), 3)), np.empty((len(cells), 3))
    below = (t.in_cells(kept.level_set), -MEMORY_DEPTH * water.mesh.spacing)
    near = (
        kept_near_the_surface(water, kept.theta, kept.crossing, dt),
        u,
        water.parameters.gravity,
        t.node_size,
    )
    state = (below, near, (mean, gradient), kept.remainder, kept.theta * dt, t.fluid_cells)
    over(_leave, len(cells), cells, *state, (remainder, rate))
    return CellVectors(cells, remainder), CellVectors(cells, rate)


@ranged
def _leave(first, last, cell_list, below, near, slopes, before, time, fluid, made):
    """u' + Π∇x - ∇x [m/s] of the listed cells and its rate, (Π∇x - ∇x)/time [m/s²]: in full where φ < deep at all
    corners, a share of both in other fast cells under water, zero in slow ones and in cells with a dry corner.

    below: φ (N,), deep [m] · near: the share, u (N, 3) [m/s], gravity [m/s²], size (N,) [m] of the cells at the nodes ·
    slopes: Π∇x (N, 3) and ∇x (n, 3) of the listed cells [m/s] · before: u' (n, 3)."""
    (phi, deep), (most, u, gravity, size), (mean, gradient) = below, near, slopes
    cells, share, share_row = fluid.cells, fluid.share, fluid.share_row
    remainder, rate = made
    for s in range(first, last):
        e = np.uint64(cell_list[s])
        highest = max(max(phi[cells[e, 0]], phi[cells[e, 1]]), max(phi[cells[e, 2]], phi[cells[e, 3]]))
        lives_on = 1.0
        if highest >= deep:
            wet_and_cut_short = highest < 0.0 and most > 0.0
            lives_on = most * _fast(u, gravity * size[cells[e, 0]], cells, e) if wet_and_cut_short else 0.0
        t, row = np.uint64(s), share_row[e]
        for k in range(3):
            remainder[t, k], rate[t, k] = 0.0, 0.0
            if lives_on > 0.0:
                left = 0.0
                for a in range(4):
                    left += share[row, a] * mean[cells[e, a], k]
                left -= gradient[t, k]
                remainder[t, k] = lives_on * (before[t, k] + left)
                rate[t, k] = lives_on * left / time


@inner
def _fast(u, gh, cells, e):
    """Ramp over FAST of the speed |u|/√(g h) in the middle of cell e."""
    square = 0.0
    for k in range(3):
        middle = 0.25 * (u[cells[e, 0], k] + u[cells[e, 1], k] + u[cells[e, 2], k] + u[cells[e, 3], k])
        square += middle * middle
    return min(1.0, max(0.0, (np.sqrt(square / gh) - FAST[0]) / (FAST[1] - FAST[0])))


def kept_near_the_surface(water, theta: float, crossing: float, dt: float) -> float:
    """Share of the remainder that fast cells near the surface keep in a step of dt [s].

    In steady flow, pressure and divergence of u are coupled by τ = θ dt in cells that keep nothing, and by τ = T + θ dt
    in those that keep the share T/(T + dt). With T = θ_1 dt_1 - θ dt, where dt_1 is the step at Courant number 1 and
    θ_1 its θ, τ does not depend on the step; T = 0 in this step and longer ones. With τ = θ dt alone the pressure has
    wiggles beside free edges, the more, the shorter the step. crossing: `speeds.crossing`."""
    at_courant_1 = min(speeds.longest_step(water), water.mesh.spacing / max(crossing, 1e-12))
    if dt > (1.0 - ROUND_OFF) * at_courant_1:
        return 0.0
    longer = max(speeds.theta(water, at_courant_1, crossing) * at_courant_1 - theta * dt, 0.0)
    return longer / (longer + dt)
