"""Free and rocking motion of single blocks, and the strength of one joint, against exact figures."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from coupler.commands.verify.figures import columns
from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.spin import SpinCorrection
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters

G = 9.81
STILL = (0.0, 0.0, 0.0)


def first_flip(substep):
    """Time at which the body-axis spin about the middle axis changes sign, and the relative change of energy then."""
    block = Block("b", STILL, size=(0.4, 0.2, 0.1), density=2000.0, spin=(0.5, 10.0, 0.0))
    with Structure([block], gravity=STILL) as s:
        start = s.energies()["kinetic"]
        before = now = 10.0
        while now > 0.0:
            before = now
            s.advance(0.002, substep=substep)
            now = (s.rotation()[0].T @ s.velocity()[0, 3:])[1]
        return s.time - 0.002 * now / (now - before), s.energies()["kinetic"] / start - 1.0


def test_spin_about_the_middle_axis_flips_at_the_time_of_eulers_equations():
    """0.4 x 0.2 x 0.1 m, spin (0.5, 10, 0) rad/s: the spin about y changes sign at 0.698 s. With the torque that moves
    YADE's rotation to the middle of the step its energy error is a millionth."""
    expected = columns("dem_torque_free_flip")["flip_time_s"][0]
    (coarse, gained), (fine, gained_less) = first_flip(2e-4), first_flip(1e-4)
    assert coarse == pytest.approx(expected, rel=3e-3)
    assert abs(fine - expected) < 0.7 * abs(coarse - expected)
    assert abs(gained_less) < abs(gained) < 1e-6


BRICK = Block("b", STILL, size=(0.4, 0.2, 0.1), density=2000.0, spin=(2.0, 5.0, -3.0))
MOMENT = np.array([6.0, -8.0, 5.0])


def turned_by_euler(time, start):
    """Places (3, 3) of the brick under the moment: Ṙ = ω x R, ω = R I⁻¹ Rᵀ L, L = I ω_0 + M (t - start)."""

    def rate(t, R):
        R = R.reshape(3, 3)
        L = BRICK.inertia @ BRICK.spin + MOMENT * (t - start)
        return np.cross(R @ np.linalg.solve(BRICK.inertia, R.T @ L), R.T).T.ravel()

    return solve_ivp(rate, (0.0, time), np.eye(3).ravel(), rtol=1e-11, atol=1e-11).y[:, -1].reshape(3, 3)


def test_a_brick_under_a_moment_turns_to_second_order_in_the_substep():
    """Velocities are those half a substep before the places, so that the moment acts from there on."""
    errors = []
    for substep in (2e-3, 1e-3):
        with Structure([BRICK], gravity=STILL) as s:
            s.set_load(np.concatenate([np.zeros(3), MOMENT])[None])
            s.advance(0.4, substep=substep)
            errors.append(np.linalg.norm(s.rotation()[0] - turned_by_euler(0.4, -0.5 * substep)))
    assert errors[0] == pytest.approx(4.0 * errors[1], rel=0.05)
    assert errors[1] < 1e-3


def test_the_correction_of_the_spin_is_that_of_its_equation():
    """dt τ = (exp(-dt/2 ω) - 1) L⁺, ω that of the middle of the substep, which has half of the moment that acts in it;
    YADE reports a spin whose axes are those of the end of the substep before, half a substep ahead of it. What was
    added last is taken back."""
    R, v, dt, last = Rotation.from_rotvec((0.3, -0.5, 0.8)).as_matrix(), np.zeros((1, 6)), 2e-3, 1e-3
    v[0, 3:] = BRICK.spin
    F = np.concatenate([np.zeros(3), 1e3 * MOMENT])[None]
    correction = SpinCorrection(BRICK.inertia[None], np.array([True]))
    lent = np.array([[1e-3, 2e-3, -3e-3]])
    correction.restore(lent)
    given = F.copy()
    correction.add(np.array([0]), R[None], v, dt, last, given)
    I = R @ BRICK.inertia @ R.T
    before = Rotation.from_rotvec(-0.5 * last * BRICK.spin).apply(I @ BRICK.spin)
    spin = np.linalg.solve(I, before + 0.5 * dt * F[0, 3:])
    after = before + dt * F[0, 3:]
    wanted = Rotation.from_rotvec(-0.5 * dt * spin).apply(after) - after
    np.testing.assert_allclose(correction.save()[0], wanted, rtol=1e-9)
    np.testing.assert_allclose((given - F)[0, 3:], (wanted - lent[0]) / dt, rtol=1e-9)


def tilted_about_its_corner(angle, size, density):
    """A block turned by `angle` [rad] about y with its lowest edge on the ground."""
    R = Rotation.from_euler("y", angle).as_matrix()
    foot = R @ np.array([0.5 * size[0], 0.0, -0.5 * size[2]])
    return Block("tower", (0.0, 0.0, -foot[2]), size=size, rotation=R, density=density)


@pytest.mark.parametrize("share", [0.2, 0.6])
def test_a_rocking_block_meets_the_ground_after_its_quarter_period(share):
    """Housner's block, h/b = 2, released at a share of the tipping angle: p t of the exact pendulum."""
    ref = columns("dem_rocking_block")
    row = np.flatnonzero((ref["h_over_b"] == 2.0) & (ref["theta0_over_alpha"] == share))[0]
    alpha, p = np.arctan(0.5), np.sqrt(3 * G / (4 * np.hypot(0.5, 1.0)))
    block = tilted_about_its_corner(share * alpha, (1.0, 1.0, 2.0), 2000.0)
    law = ContactLaw(stiffness=1e10, restitution=0.1, friction=5.0)
    with Structure([block], law, ground=0.0) as s:
        before = now = share * alpha
        while now > 0.0:
            before = now
            s.advance(0.002)
            now = np.arctan2(s.rotation()[0, 0, 2], s.rotation()[0, 2, 2])
        time = s.time - 0.002 * now / (now - before)
    assert p * time == pytest.approx(ref["p_tq_exact"][row], rel=0.02)


@pytest.mark.parametrize("tilt", [5.0, 15.0])
def test_an_edge_that_strikes_a_smooth_ground_turns_the_block(tilt):
    """Cube at unit speed without friction, e = 1: J = 2 / (1/m + d²/I); speed and spin afterwards."""
    ref = columns("dem_corner_impact")
    row = np.flatnonzero((ref["phi_deg"] == tilt) & (ref["e"] == 1.0))[0]
    placed = tilted_about_its_corner(np.radians(tilt), (1.0, 1.0, 1.0), 1000.0)
    centre = placed.centre + np.array([0.0, 0.0, 1e-4])
    block = Block("cube", centre, size=1.0, rotation=placed.rotation, density=1000.0, velocity=(0, 0, -1.0))
    law = ContactLaw(stiffness=1e11, restitution=1.0, friction=0.0)
    with Structure([block], law, ground=0.0, gravity=STILL) as s:
        s.advance(2e-3, substep=2e-6)
        v = s.velocity()[0]
    assert v[2] == pytest.approx(ref["vz_after"][row], abs=0.01)
    assert abs(v[4]) == pytest.approx(ref["omega_after"][row], rel=0.01)
    assert np.abs(v[[0, 1, 3, 5]]).max() < 1e-6


def face_force(s, z, turn):
    """Force and moment about mid-face on the upper block, lifted by z [m] and turned by `turn` [rad] for the first
    time: the joint remembers no earlier opening and has reached this one slowly."""
    x, R = s._motion.x, s._motion.R
    R[1] = Rotation.from_rotvec((0.0, turn, 0.0)).as_matrix()
    x[1] = np.array([0.0, 0.0, 1.0 + z]) + R[1] @ np.array([0.0, 0.0, 0.5])
    s.joints.largest[:] = 0.0
    s.joints.forces(x, s.velocity(), R, np.zeros((2, 6)), advance=True)
    f = s.internal_force()[1]
    return f[2], abs((f[3:] + np.cross(x[1] - (0.0, 0.0, 1.0), f[:3]))[1])


def moment_at(s, law, axial, turn):
    """Moment [N m] at the height where the joint carries the axial load [N]."""
    span = turn + 2.0 * axial / law.closing_stiffness
    z = brentq(lambda z: face_force(s, z, turn)[0] - axial, -span, span, xtol=1e-15)
    return face_force(s, z, turn)[1]


@pytest.mark.parametrize("ratio", [1.0, 10.0])
def test_a_joint_under_axial_load_carries_the_moment_of_its_face(ratio):
    """M_max/(b h² T_max) against the face integral, for n = N/(b h T_max) and both closing stiffnesses."""
    ref = columns("coh_joint_Mmax_vs_N")
    law = JointParameters(1e6, 1e-3, closing_ratio=ratio, points=10, damping=0.0)
    blocks = [Block("a", (0, 0, 0.5), size=1.0, fixed=True), Block("b", (0, 0, 1.5), size=1.0)]
    with Structure(blocks, None, law, gravity=STILL) as s:
        for n in (0.0, 0.2, 0.5):
            row = np.flatnonzero((ref["kc_over_K0"] == ratio) & (ref["n"] == n))[0]
            peak = ref["r_peak"][row] * law.opening_at_failure
            found = max(moment_at(s, law, n * law.strength, share * peak) for share in (0.94, 1.0, 1.06))
            assert found / law.strength == pytest.approx(ref["mmax"][row], rel=0.01)
