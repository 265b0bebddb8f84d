"""What the fluxes of a step carry: volume and momentum at the nodes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from fluid.numerics.fields import is_nothing
from fluid.step.kick import kicked
from fluid.transport.surface_momentum import Carried
from fluid.transport.swept_volume import swept

if TYPE_CHECKING:
    from fluid.step.water import Water


def carried_by_fluxes(water: Water, dt: float, theta: float, kick) -> Carried:
    """What the fluxes make of volume and momentum in dt [s], carried on the domain of the last projection; kick
    (N,): `kick_factor`."""
    found = _by_fluxes(water, dt, theta, kick)
    if not is_nothing(water.given_by_films) and water.given_by_films.any():
        found = replace(found, water=found.water + dt * water.given_by_films)
    found = found if water.renumbered is None else found.handed_on(water.renumbered)
    if water.slits is None:
        return found
    return replace(found, water=found.water + water.slits.carried(dt))


def _by_fluxes(water: Water, dt: float, theta: float, kick) -> Carried:
    """What they make of it on the domain where the velocity was projected, before solids moved on."""
    u, a, phi, t = water.left_behind or (water.velocity, water.acceleration, water.level_set, water.topology)
    p, flux = water.parameters, water.flux.over(t, dt)
    if water.left_behind is not None:
        kick = water.kick_factor_of(a, t.node_size, water.fastest())
    u_hat, u_m = kicked(u, a, kick, dt, 1.0 - theta, 0.5 if p.theta < 1.0 else 0.0)
    found, moved = Carried.by(flux, dt, u_hat, a, p.gravity, p.viscosity / p.density, t.node_size)
    if p.advection == "supg":
        found = found.near_the_surface()
    return replace(found, swept=swept(t, flux, phi, u_m, moved, dt))
