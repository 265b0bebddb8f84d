"""Bodies lighter and heavier than water, released in a full, closed tank: the added mass is in the pressure solve.

Stepping water and body in turn diverges below a density ratio of about the added mass coefficient; here the first
acceleration must be g (1 - s)/(s + ca) at any ratio s. Reference: potential flow, coupler/reference/
added_mass_closed_tank.csv (cube of side a in a cubic tank of side 3a: ca = 0.7177).
"""

import numpy as np
import pytest

from coupler.step.coupled_step import CoupledStepper
from coupler.step.immersion import Immersion
from fluid.mesh.background import box_mesh
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from tests.fakes import FreeBody, no_clock

G = 9.81
CA = 0.7177


def full_tank(body, cells):
    mesh = box_mesh((0, 0, 0), (3, 3, 3), 3 / cells)
    immersion = Immersion(mesh, body, [], "single")
    water = Water(
        mesh,
        immersion.domain,
        lambda x: np.full(len(x), -1.0),
        WaterParameters(gravity=G),
    )
    return CoupledStepper(water, body, immersion, rtol=1e-10, step_max=1.0, clock=no_clock)


def added_mass(ratio, cells):
    """ca from the first acceleration: a = g (1 - s)/(s + ca)."""
    body = FreeBody.cube(side=1.0, centre=(1.5, 1.5, 1.5), density=1000.0 * ratio, gravity=G)
    coupling = full_tank(body, cells)
    coupling.step(1e-3)
    return G * (1 - ratio) / (body.velocity()[0, 2] / 1e-3) - ratio


@pytest.mark.parametrize("ratio", [0.01, 0.1, 0.5, 2.5, 7.8])
def test_the_first_acceleration_shows_one_added_mass_at_any_density_ratio(ratio):
    """The mesh has an added mass of its own; which body feels it must not matter."""
    assert added_mass(ratio, 9) == pytest.approx(added_mass(0.3, 9), rel=1e-4)


def test_the_added_mass_tends_to_the_exact_one_from_below():
    """Elements are a subspace: they underestimate it; halving the cells takes more than 40 % off the error."""
    coarse, fine = added_mass(0.1, 9), added_mass(0.1, 18)
    assert coarse < fine < CA
    assert CA - fine < 0.6 * (CA - coarse)
    assert fine == pytest.approx(CA, rel=0.2)


def test_a_body_of_the_density_of_water_stays():
    """Its weight is the hydrostatic load, exactly, wherever it cuts the mesh."""
    body = FreeBody.cube(side=1.0, centre=(1.43, 1.57, 1.49), density=1000.0, gravity=G)
    coupling = full_tank(body, 10)
    coupling.step(0.01)
    assert np.abs(body.velocity()).max() < 1e-7 * G * 0.01


def test_a_light_body_keeps_its_acceleration_while_the_step_is_halved():
    """No step length at which the coupling becomes unstable: ratio 0.01, dt from 4 ms down."""
    found = []
    for dt in (4e-3, 2e-3, 1e-3, 5e-4):
        body = FreeBody.cube(side=1.0, centre=(1.5, 1.5, 1.5), density=10.0, gravity=G)
        coupling = full_tank(body, 9)
        for _ in range(4):
            coupling.step(dt)
        found.append(body.velocity()[0, 2] / (4 * dt))
    assert np.ptp(found) < 0.05 * np.mean(found)


def test_momentum_given_by_the_water_is_momentum_received():
    """Over several steps: m Δv = Σ dt F + weight, to round-off of the exchange."""
    body = FreeBody.cube(side=1.0, centre=(1.4, 1.5, 1.6), density=300.0, gravity=G)
    coupling = full_tank(body, 8)
    impulse = np.zeros(3)
    for _ in range(5):
        record = coupling.step(2e-3)
        impulse += record.dt * (record.load[0, :3] + body.mass[0] * np.array([0, 0, -G]))
    assert body.mass[0] * body.velocity()[0, :3] == pytest.approx(impulse, rel=1e-12, abs=1e-9)
