"""Contact of blocks: restitution, sliding, toppling, oblique impact, rocking, corner impact, free spin, rest.

Spheres of the reference cases are replaced by blocks: by boxes where the answer does not depend on the shape, for a
short time by a bipyramid on its tip with the mass, the arm and the inertia of the sphere.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from coupler.commands.verify.figures import columns, named_values
from coupler.commands.verify.registry import Finding, check
from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure

G = 9.81
K = 1e8
STILL = (0.0, 0.0, 0.0)
DENSITY = 2000.0
FINE = 0.02
"""Substep in sqrt(m/K) where a single impact is measured."""


def cube(z: float, name: str = "cube", density: float = DENSITY, **more) -> Block:
    """A cube of 1 m at height z."""
    return Block(name, (0.0, 0.0, z), size=1.0, density=density, **more)


@check("P01", "restitution of a face that lands flat", "closed form of the linear spring and dashpot")
def restitution_on_the_ground():
    table = columns("dem_restitution_linear_dashpot")
    for e in (0.9, 0.5, 0.2):
        yield Finding(f"rule exact, e {e}", _rebound(ContactLaw(K, e)), e, 5e-3)
        cut = table["e_cut"][np.isclose(table["e_in"], e)][0]
        yield Finding(f"rule paper, e {e}", _rebound(ContactLaw(K, e, rule="paper")), cut, 5e-3)


def _rebound(law: ContactLaw) -> float:
    with Structure([cube(0.5 + 1e-4, velocity=(0, 0, -1.0))], law, ground=0.0, gravity=STILL) as s:
        s.advance(0.06, substep=FINE * np.sqrt(DENSITY / K))
        return float(s.velocity()[0, 2])


@check("P02", "restitution of two free blocks", "effective mass of the pair")
def restitution_of_pairs():
    for e, density in ((0.9, 2000.0), (0.5, 2000.0), (0.2, 2000.0), (0.5, 200.0), (0.5, 2e6)):
        blocks = [cube(0.5, "a", density), cube(1.5 + 1e-4, "b", velocity=(0, 0, -1.0))]
        with Structure(blocks, ContactLaw(K, e), gravity=STILL) as s:
            s.advance(0.06, substep=FINE * np.sqrt(min(density, DENSITY) / K))
            v = s.velocity()[:, 2]
        yield Finding(f"e {e}, mass ratio {density / DENSITY:g}", float(v[1] - v[0]), e, 0.01)


def on_a_slope(degrees: float, law: ContactLaw, size=1.0, **more) -> Structure:
    """A block on a floor under gravity turned by an angle about y."""
    a = np.radians(degrees)
    height = 0.5 * np.broadcast_to(size, (3,))[2]
    block = Block("block", (0, 0, height), size=size, density=DENSITY, **more)
    return Structure([block], law, ground=0.0, gravity=(G * np.sin(a), 0.0, -G * np.cos(a)))


RADIUS = 0.1


def sphere_like(velocity) -> Block:
    """A bipyramid with tips at ±R and I = 2/5 m R² about the level axes: in a short impact on its tip, a solid sphere.

    Tips at ±a level: I = m (a² + R²)/10, so a² = 3 R²."""
    a = np.sqrt(3.0) * RADIUS
    tips = np.array([[a, 0, 0], [-a, 0, 0], [0, a, 0], [0, -a, 0], [0, 0, RADIUS], [0, 0, -RADIUS]])
    return Block("body", (0, 0, RADIUS + 1e-6), vertices=tips, density=DENSITY, velocity=velocity)


@check("P03", "block and sphere on an incline of 30 degrees", "closed form")
def incline():
    with on_a_slope(30.0, ContactLaw(K, 0.3, 0.4)) as s:
        s.advance(0.2)
        before = s.velocity()[0, 0]
        s.advance(0.4)
        a = (s.velocity()[0, 0] - before) / 0.4
    exact = named_values("dem_simple_closed_forms")["block slides, incline 30deg mu=0.4: accel"]
    yield Finding("acceleration [m/s²], friction 0.4", a, exact, 5e-3)
    with on_a_slope(30.0, ContactLaw(K, 0.3, 0.6)) as s:
        s.advance(0.5)
        yield Finding("speed at friction 0.6 after 0.5 s [m/s]", s.velocity()[0, 0], 0.0, 1e-3, False)
    known = named_values("dem_simple_closed_forms")
    a, _ = _sphere_on_a_slope(0.5)
    exact = known["sphere rolls, incline 30deg mu=0.5 (mu>2/7 tan): accel"]
    yield Finding("sphere rolls: acceleration [m/s²]", a, exact, 5e-3)
    a, spin = _sphere_on_a_slope(0.1)
    exact = known["sphere slides+spins, incline 30deg mu=0.10: accel"]
    yield Finding("sphere slides and spins: acceleration [m/s²]", a, exact, 5e-3)
    yield Finding("the same: angular acceleration [rad/s²]", spin, known["same: angular accel R=0.1"], 5e-3)


def _sphere_on_a_slope(friction: float) -> tuple[float, float]:
    """Acceleration [m/s²] and angular acceleration [rad/s²] before the sphere-like body has tilted by 1e-3 rad."""
    slope = np.radians(30.0)
    gravity = (G * np.sin(slope), 0.0, -G * np.cos(slope))
    with Structure(
        [sphere_like((0, 0, 0))], ContactLaw(1e11, 0.05, friction), ground=0.0, gravity=gravity
    ) as s:
        s.advance(1e-3)
        before = s.velocity()[0]
        s.advance(3e-3)
        change = (s.velocity()[0] - before) / 3e-3
    return float(change[0]), float(change[4])


@check("P04", "block slides to rest, sphere slides until it rolls", "closed form")
def stop():
    known = named_values("dem_simple_closed_forms")
    size = (1.0, 1.0, 0.2)
    with on_a_slope(0.0, ContactLaw(K, 0.1, 0.3), size, velocity=(2.0, 0, 0)) as s:
        start = s.centre()[0, 0]
        while s.velocity()[0, 0] > 1e-3 and s.time < 2.0:
            s.advance(1e-3)
        time = s.time
        s.advance(0.1)
        way = s.centre()[0, 0] - start
    yield Finding("way [m]", way, known["block v0=2 m/s on flat mu=0.3: stop distance"], 5e-3)
    yield Finding("time [s]", time, known["block v0=2 m/s on flat mu=0.3: stop time"], 5e-3)

    speed, time = _slide_until_rolling()
    yield Finding(
        "sphere: time until it rolls [s]",
        time,
        known["sphere v0=2 m/s no spin, flat mu=0.3: time to rolling"],
        5e-3,
    )
    yield Finding("sphere: speed then [m/s]", speed, known["sphere same: final speed"], 5e-3)


def _slide_until_rolling() -> tuple[float, float]:
    """Speed [m/s] and time [s] at which a body of 1000 corners on a sphere stops sliding on level ground.

    The slip falls in proportion to the time; its last twentieth, rough from corner to corner, is left out."""
    number = np.arange(1000) + 0.5
    polar, turn = np.arccos(1.0 - 2.0 * number / 1000), np.pi * (1.0 + np.sqrt(5.0)) * number
    corners = np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], axis=1)
    ball = Block("ball", (0, 0, RADIUS), vertices=RADIUS * corners, density=DENSITY, velocity=(2.0, 0, 0))
    with Structure([ball], ContactLaw(1e6, 1.0, 0.3), ground=0.0) as s:
        slip = 2.0
        while slip > 0.1:
            s.advance(1e-3)
            slip = s.velocity()[0, 0] - RADIUS * s.velocity()[0, 4]
        time = s.time / (1.0 - slip / 2.0)
        s.advance(0.3 - s.time)
        return float(s.velocity()[0, 0]), time


@check("P05", "tilting table: topples, slides", "atan(b/h), atan(mu)", "M")
def tilting_table():
    exact = np.degrees(np.arctan(0.5))
    topples = _critical_angle((1.0, 1.0, 2.0), 0.8, lambda s: s.rotation()[0, 0, 2] > 0.1)
    yield Finding("angle at which h/b = 2 topples [deg], friction 0.8", topples, exact, 0.2, False)
    slides = _critical_angle((1.0, 1.0, 1.0), 0.5, lambda s: s.centre()[0, 0] > 2e-3)
    yield Finding("angle at which h/b = 1 slides [deg], friction 0.5", slides, exact, 0.2, False)


def _critical_angle(size, friction: float, moves) -> float:
    """Angle [deg] by bisection: settled on the level table, tilted over 1 s, watched for 4 s."""
    low, high = 25.0, 28.0
    while high - low > 0.02:
        middle = 0.5 * (low + high)
        moved = _moves_on_table(middle, size, friction, moves)
        low, high = (low, middle) if moved else (middle, high)
    return 0.5 * (low + high)


def _moves_on_table(degrees: float, size, friction: float, moves) -> bool:
    block = Block("block", (0, 0, 0.5 * size[2]), size=size, density=DENSITY)
    with Structure([block], ContactLaw(1e9, 0.3, friction), ground=0.0, gravity=STILL) as s:
        while s.time < 5.5:
            a = np.radians(degrees) * np.clip(s.time - 0.5, 0.0, 1.0)
            s.set_load(np.array([[np.sin(a), 0, -np.cos(a), 0, 0, 0]]) * block.mass * G)
            s.advance(0.02)
            if moves(s):
                return True
    return False


def _oblique(law: ContactLaw, normal: float, tangential: float) -> tuple[float, float]:
    """(v_t after / before, spin times radius after) of the sphere-like body thrown on the ground."""
    block = sphere_like((tangential, 0.0, -normal))
    with Structure([block], law, ground=0.0, gravity=STILL) as s:
        shortest = np.sqrt(block.mass / law.stiffness)
        s.advance(30.0 * shortest, substep=0.5 * FINE * shortest)
        v = s.velocity()[0]
    return float(v[0] / tangential), float(v[4] * RADIUS)


@check("P06", "oblique impact, equal stiffness along and across", "Di Maio and Di Renzo (2004), integrated")
def oblique_impact():
    table = columns("dem_oblique_impact_linear")
    friction = 0.3
    law = ContactLaw(1e11, 1.0, friction)
    for psi in (0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 10.0):
        row = np.flatnonzero(np.isclose(table["psi"], psi))[0]
        et, spin = _oblique(law, 1.0, psi * friction)
        yield Finding(f"tangential restitution at psi {psi:g}", et, table["et"][row], 0.01)
        yield Finding(
            f"spin after / (2.5 mu v_n) at psi {psi:g}", spin / (2.5 * friction), table["Jhat"][row], 0.01
        )


@check(
    "P07",
    "oblique impact in full sliding (Chung and Ooi, test 4)",
    "1 - mu (1 + e)/tan; experiment of Kharaz",
)
def full_sliding():
    friction, e = 0.092, 0.98
    measured = columns("chung_ooi_test4_et_experiment")
    law = ContactLaw(1e11, e, friction)
    for degrees in (35.0, 45.0, 60.0, 75.0):
        angle = np.radians(degrees)
        et = _oblique(law, 3.9 * np.cos(angle), 3.9 * np.sin(angle))[0]
        closed = 1.0 - friction * (1.0 + e) / np.tan(angle)
        yield Finding(f"tangential restitution at {degrees:g} deg, closed form", et, closed, 0.02)
        between = float(np.interp(degrees, measured["angle_deg"], measured["et"]))
        yield Finding("the same, measured on aluminium oxide spheres", et, between, 0.06)


@check("P08", "rocking block (Housner)", "Bull. Seismol. Soc. Am. 53 (1963) 403; exact pendulum")
def rocking():
    table = columns("dem_rocking_block")
    for slender in (2.0, 4.0, 8.0):
        row = np.flatnonzero((table["h_over_b"] == slender) & (table["theta0_over_alpha"] == 0.4))[0]
        quarter, ratio = _rock(slender, 0.4 * np.radians(table["alpha_deg"][row]))
        yield Finding(f"p t_q to the first impact, h/b {slender:g}", quarter, table["p_tq_exact"][row], 0.03)
        yield Finding(f"spin after / before the impact, h/b {slender:g}", ratio, table["r_vel"][row], 0.05)


def _rock(slender: float, tilt: float) -> tuple[float, float]:
    """(p t_q, ω after / ω before) of a block of width 1 released at a tilt [rad]."""
    turn = Rotation.from_euler("y", tilt).as_matrix()
    foot = turn @ np.array([0.5, 0.0, -0.5 * slender])
    block = Block("tower", (0, 0, -foot[2]), size=(1.0, 1.0, slender), rotation=turn, density=DENSITY)
    p = np.sqrt(3.0 * G / (4.0 * 0.5 * np.hypot(1.0, slender)))
    with Structure([block], ContactLaw(1e9, 0.05, 2.0), ground=0.0) as s:
        tilts, spins, times = [tilt], [0.0], [0.0]
        while tilts[-1] > -0.3 * tilt and s.time < 3.0 / p:
            s.advance(1e-3)
            times.append(s.time)
            spins.append(s.velocity()[0, 4])
            tilts.append(np.arctan2(s.rotation()[0, 0, 2], s.rotation()[0, 2, 2]))
    hit = int(np.argmax(np.array(tilts) <= 0.0))
    before = max(abs(w) for w in spins[: hit + 1])
    after = abs(spins[min(hit + round(0.03 / p / 1e-3), len(spins) - 1)])
    return p * times[hit], after / before


@check("P09", "corner impact, frictionless", "impulse and momentum of a rigid square block")
def corner():
    table = columns("dem_corner_impact")
    for phi, e in ((5.0, 1.0), (15.0, 1.0), (25.0, 1.0), (35.0, 1.0), (15.0, 0.6), (35.0, 0.6)):
        row = np.flatnonzero((table["phi_deg"] == phi) & (table["e"] == e))[0]
        v, w = _corner(phi, e)
        yield Finding(f"v_z after, {phi:g} deg, e {e}", v, table["vz_after"][row], 0.02, False)
        yield Finding(f"spin after, {phi:g} deg, e {e}", w, table["omega_after"][row], 0.02)


def _corner(phi: float, e: float) -> tuple[float, float]:
    """(v_z, |ω|) after an edge of a falling unit cube, speed 1, tilt phi [deg], has hit the ground."""
    turn = Rotation.from_euler("y", phi, degrees=True).as_matrix()
    foot = (turn @ np.array([0.5, 0.0, -0.5]))[2]
    block = cube(-foot + 1e-4, rotation=turn, velocity=(0, 0, -1.0))
    stiff = 1e11
    with Structure([block], ContactLaw(stiff, e, 0.0), ground=0.0, gravity=STILL) as s:
        s.advance(6e-3, substep=FINE * np.sqrt(DENSITY / stiff))
        return float(s.velocity()[0, 2]), float(np.linalg.norm(s.velocity()[0, 3:]))


@check("P10", "torque-free block flips about its middle axis", "Euler's equations, elliptic integral")
def flips():
    exact = columns("dem_torque_free_flip")["flip_time_s"]
    block = Block("b", (0, 0, 0), size=(0.4, 0.2, 0.1), density=DENSITY, spin=(0.5, 10.0, 0.0))
    with Structure([block], gravity=STILL) as s:
        found, before = [], 10.0
        while len(found) < 6 and s.time < 10.0:
            s.advance(1e-3, substep=1e-4)
            now = (s.rotation()[0].T @ s.velocity()[0, 3:])[1]
            if now * before < 0.0:
                found.append(s.time - 1e-3 * abs(now) / (abs(now) + abs(before)))
            before = now
    yield Finding("time of the first flip [s]", found[0], exact[0], 5e-3)
    yield Finding("mean spacing of five flips [s]", np.diff(found).mean(), np.diff(exact)[:5].mean(), 5e-3)


@check("P11", "ten cubes on one another at rest", "weight above / face stiffness")
def stack():
    stiff = 1e9
    blocks = [cube(i + 0.5, f"c{i}") for i in range(10)]
    with Structure(blocks, ContactLaw(stiff, 0.1), ground=0.0) as s:
        for _ in range(8):
            s.advance(0.25)
        z = s.centre()[:, 2]
        speed = np.abs(s.velocity()).max()
    depth = 1.0 - np.diff(np.append(-0.5, z))
    exact = DENSITY * G * np.arange(10, 0, -1) / stiff
    for k in (0, 4, 9):
        yield Finding(f"penetration at interface {k} [m]", depth[k], exact[k], 0.01)
    yield Finding("largest speed after 2 s [m/s]", speed, 0.0, 1e-4, False)
