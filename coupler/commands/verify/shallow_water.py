"""The shallow-water equations on a grid of squares with walls: when a front should arrive where nothing is deep.

∂h/∂t + ∇·(h u) = 0,    ∂(h u)/∂t + ∇·(h u u) + ∇(g h²/2) = -g n² |u| u / h^(1/3)                        (1)

Finite volumes: states at the faces by limited slopes of h and u (minmod; none beside walls), fluxes of HLL with the
velocity along the face taken from upstream, two steps of Heun (Toro, Shock-Capturing Methods for Free-Surface Shallow
Flows, 2001). Walls mirror the state beside them. Jumps of the surface have the speed of theory on any squares, since
volume and momentum are conserved."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from array_types import Array

DRY = 1e-6
"""Depth [m] below which water stands still."""
COURANT = 0.4


class Flow(NamedTuple):
    """Depth h [m] and discharges qx, qy [m²/s] of all squares (nx, ny)."""

    h: Array
    qx: Array
    qy: Array


def depths(
    depth, solid, cell: float, end: float, places: Mapping[str, tuple[int, int]], manning: float, g: float
) -> dict[str, Array]:
    """Depths [m] over the time "t" [s] until `end` at places (row, column) by name, from rest.

    depth (nx, ny) [m] · solid (nx, ny) bool: walls · cell [m] · manning: n [s/m^(1/3)]. Water leaves at the last row;
    the other sides are walls."""
    flow, time = Flow(depth.copy(), np.zeros_like(depth), np.zeros_like(depth)), 0.0
    rows = [[time, *(flow.h[at] for at in places.values())]]
    while time < end:
        fastest = np.maximum(*(np.abs(q) for q in _velocity(flow))) + np.sqrt(g * flow.h)
        dt = COURANT * cell / float(fastest[~solid].max())
        once = _advanced(flow, solid, dt / cell, g)
        twice = _advanced(once, solid, dt / cell, g)
        flow = Flow(*(0.5 * (a + b) for a, b in zip(flow, twice)))
        u, v = _velocity(flow)
        held = 1.0 + dt * g * manning**2 * np.hypot(u, v) / np.maximum(flow.h, DRY) ** (4.0 / 3.0)
        flow = Flow(flow.h, flow.h * u / held, flow.h * v / held)
        time += dt
        rows.append([time, *(flow.h[at] for at in places.values())])
    return dict(zip(("t", *places), np.array(rows).T))


def _velocity(flow: Flow) -> tuple[Array, Array]:
    wet = np.maximum(flow.h, DRY)
    return np.where(flow.h > DRY, flow.qx / wet, 0.0), np.where(flow.h > DRY, flow.qy / wet, 0.0)


def _advanced(flow: Flow, solid, step: float, g: float) -> Flow:
    """After an explicit step; step [s/m]: its length over that of a square."""
    h, qx, qy = _change(flow, solid, g, is_open=True)
    k, ky, kx = _change(Flow(flow.h.T, flow.qy.T, flow.qx.T), solid.T, g, is_open=False)
    changed = (flow.h + step * (h + k.T), flow.qx + step * (qx + kx.T), flow.qy + step * (qy + ky.T))
    return Flow(np.maximum(changed[0], 0.0), changed[1], changed[2])


def _change(flow: Flow, solid, g: float, is_open: bool) -> Flow:
    """What flows into each square along the rows less what flows out, over the length of a face; is_open: water leaves
    at the end of the rows."""
    u, v = _velocity(flow)
    beside = solid.copy()
    beside[1:] |= solid[:-1]
    beside[:-1] |= solid[1:]
    fields = (flow.h, u, v)
    slopes = [np.where(beside, 0.0, _slope(f)) for f in fields]
    before = [np.concatenate([f[:1], f + 0.5 * s]) for f, s in zip(fields, slopes)]
    after = [np.concatenate([f - 0.5 * s, f[-1:]]) for f, s in zip(fields, slopes)]
    wall_before = np.concatenate([np.ones_like(solid[:1]), solid])
    wall_after = np.concatenate([solid, np.full_like(solid[:1], not is_open)])
    for one, other, wall in ((before, after, wall_before), (after, before, wall_after)):
        for k, sign in enumerate((1.0, -1.0, 1.0)):
            one[k] = np.where(wall, sign * other[k], one[k])
    fluxes = _fluxes(*before, *after, g)
    return Flow(*(np.where(solid, 0.0, flux[:-1] - flux[1:]) for flux in fluxes))


def _slope(f) -> Array:
    """Limited difference from square to square along the rows, minmod; none at both ends."""
    step, found = np.diff(f, axis=0), np.zeros_like(f)
    back, ahead = step[:-1], step[1:]
    found[1:-1] = np.where(back * ahead > 0.0, np.sign(back) * np.minimum(np.abs(back), np.abs(ahead)), 0.0)
    return found


def _fluxes(h, u, v, h_after, u_after, v_after, g: float) -> tuple[Array, Array, Array]:
    """HLL with the speeds of Toro's two-rarefaction estimate; h, u, v and h_after ...: both sides of each face."""
    c, c_after = np.sqrt(g * h), np.sqrt(g * h_after)
    middle = np.maximum(0.5 * (c + c_after) + 0.25 * (u - u_after), 0.0)
    between = 0.5 * (u + u_after) + c - c_after
    slow = np.where(h > DRY, np.minimum(u - c, between - middle), u_after - 2.0 * c_after)
    fast = np.where(h_after > DRY, np.maximum(u_after + c_after, between + middle), u + 2.0 * c)
    width = np.where(fast - slow > 1e-12, fast - slow, 1.0)

    def mixed(f, f_after, jump):
        inside = (fast * f - slow * f_after + slow * fast * jump) / width
        return np.where(slow >= 0.0, f, np.where(fast <= 0.0, f_after, inside))

    mass = mixed(h * u, h_after * u_after, h_after - h)
    push = (h * u * u + 0.5 * g * h * h, h_after * u_after**2 + 0.5 * g * h_after**2)
    return mass, mixed(*push, h_after * u_after - h * u), mass * np.where(mass > 0.0, v, v_after)
