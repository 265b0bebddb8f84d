"""The pressure solve with the structure inside, on a pipe of water with a piston (exact in closed form)."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from coupler.step import exchange
from coupler.step.coupling_rows import Wetting
from coupler.step.pressure_with_structure import (
    StructureResponse,
    corrected_free_velocity,
    defect,
    defect_floor,
    impulse_energy,
    mass_matrix,
    solve_coupled,
    start_of_water,
)
from coupler.step.record import StepRecord
from tests.fakes import direct_solve, no_clock, piston_column

WATER = 1000.0  # mass of the water in the pipe [kg]


def piston(mass, dt, stiffness=0.0, damping=0.0, driven=False, driven_velocity=0.0):
    n6 = sp.csr_array((6, 6))
    K = n6 + sp.diags_array([stiffness] + [0.0] * 5)
    C = n6 + sp.diags_array([damping] + [0.0] * 5)
    velocity = np.zeros((1, 6))
    velocity[0, 0] = driven_velocity
    M = mass_matrix(np.array([mass]), np.eye(3)[None])
    return StructureResponse(M, K, C, dt, np.array([driven]), velocity)


def push(force):
    load = np.zeros((1, 6))
    load[0, 0] = force
    return load


@given(ratio=st.floats(1e-4, 1e4), dt=st.floats(1e-5, 0.1))
@settings(max_examples=50, deadline=None)
def test_a_pushed_piston_accelerates_with_its_own_and_the_waters_mass(ratio, dt):
    """Added mass is implicit: right at any density ratio and any step, in one solve."""
    response = piston(ratio * WATER, dt)
    v_free = response.free_velocity(np.zeros((1, 6)), push(50.0))
    found = solve_coupled(piston_column(dt=dt), response, v_free, direct_solve, 1e-12)
    assert found.velocity[0, 0] == pytest.approx(50.0 * dt / (WATER * (1 + ratio)), rel=1e-7)


def test_power_leaving_the_water_is_the_power_given_to_the_structure():
    """-Gᵀp is the adjoint of how the body moves the water: F·V = -∫p V·n to round-off."""
    problem = piston_column()
    response = piston(300.0, 0.01, stiffness=1e7, damping=1e3)
    v_free = response.free_velocity(np.ones((1, 6)), push(10.0))
    found = solve_coupled(problem, response, v_free, direct_solve, 1e-12)
    flux = problem.coupling @ found.velocity.ravel()
    assert found.load.ravel() @ found.velocity.ravel() == pytest.approx(-found.x @ flux, rel=1e-12)


def test_the_momentum_of_water_and_piston_changes_by_the_outside_force_alone():
    dt, mass = 0.01, 250.0
    problem = piston_column(dt=dt)
    response = piston(mass, dt)
    found = solve_coupled(
        problem, response, response.free_velocity(np.zeros((1, 6)), push(80.0)), direct_solve, 1e-12
    )
    water = WATER * found.velocity[0, 0]  # the water moves with the piston as one body
    assert mass * found.velocity[0, 0] + water == pytest.approx(80.0 * dt, rel=1e-10)


def test_a_stiff_support_carries_the_load_instead_of_the_inertia():
    """With dt K far above M/dt the piston hardly moves: a bonded wall is not taken for a loose block."""
    dt, stiffness = 0.01, 1e12
    response = piston(100.0, dt, stiffness=stiffness)
    found = solve_coupled(
        piston_column(dt=dt),
        response,
        response.free_velocity(np.zeros((1, 6)), push(50.0)),
        direct_solve,
        1e-12,
    )
    assert found.velocity[0, 0] == pytest.approx(50.0 / (dt * stiffness), rel=1e-3)


def test_a_driven_piston_keeps_its_velocity_and_feels_the_whole_pressure():
    dt, speed = 0.01, -0.3
    response = piston(100.0, dt, driven=True, driven_velocity=speed)
    found = solve_coupled(
        piston_column(dt=dt),
        response,
        response.free_velocity(np.zeros((1, 6)), push(0.0)),
        direct_solve,
        1e-12,
    )
    assert found.velocity[0, 0] == speed
    assert found.load[0, 0] == pytest.approx(-WATER * speed / dt, rel=1e-9)


def test_the_known_part_of_the_pressure_pushes_the_body_and_not_the_water_again():
    dt = 0.01
    problem = piston_column(dt=dt, known=200.0)
    response = piston(100.0, dt)
    known_force = -(problem.coupling.T @ problem.known).reshape(1, 6)
    found = solve_coupled(
        problem, response, response.free_velocity(np.zeros((1, 6)), known_force), direct_solve, 1e-12
    )
    assert found.velocity[0, 0] == pytest.approx(known_force[0, 0] * dt / (WATER + 100.0), rel=1e-9)
    assert found.load[0, 0] == pytest.approx(100.0 * found.velocity[0, 0] / dt, rel=1e-9)


def test_a_second_pass_with_what_the_body_did_leaves_a_right_first_pass_unchanged():
    """The correction is a fixed point: W equal to the assumed V changes nothing."""
    problem, response = piston_column(), piston(100.0, 0.01, stiffness=1e6)
    first = solve_coupled(
        problem, response, response.free_velocity(np.zeros((1, 6)), push(50.0)), direct_solve, 1e-12
    )
    again = corrected_free_velocity(response, first.velocity, first.x, problem.coupling)
    second = solve_coupled(problem, response, again, direct_solve, 1e-12)
    assert second.x == pytest.approx(first.x, rel=1e-10)
    assert defect(response.mass, first.velocity, second.velocity) < 1e-10


def test_the_second_pass_moves_towards_a_body_that_is_stiffer_than_assumed():
    """A support the matrix does not know of is felt through W: the force rises towards the exact one."""
    problem, assumed = piston_column(), piston(100.0, 0.01)
    first = solve_coupled(
        problem, assumed, assumed.free_velocity(np.zeros((1, 6)), push(50.0)), direct_solve, 1e-12
    )
    held = np.zeros((1, 6))  # the elements found that the body cannot move at all
    second = solve_coupled(
        problem,
        assumed,
        corrected_free_velocity(assumed, held, first.x, problem.coupling),
        direct_solve,
        1e-12,
    )
    assert abs(second.velocity[0, 0]) < abs(first.velocity[0, 0])


def test_defect_is_the_share_of_the_kinetic_energy_norm():
    M = mass_matrix(np.array([2.0]), np.eye(3)[None])
    found = np.array([[1.0, 0, 0, 0, 0, 0]])
    assert defect(M, 0.9 * found, found) == pytest.approx(0.1)
    assert defect(M, 0.0 * found, 0.0 * found) == 0.0


def test_a_structure_that_hardly_moves_has_no_defect_to_speak_of():
    """Against the energy of the scene a micrometre per second is rest, whatever share of it was missed."""
    M = mass_matrix(np.array([1000.0]), np.eye(3)[None])
    found = np.array([[1e-6, 0, 0, 0, 0, 0]])
    assert defect(M, 0.0 * found, found) == 1.0
    assert defect(M, 0.0 * found, found, floor=1.0) < 1e-4


def test_the_motion_that_counts_as_none_goes_by_the_load_or_by_the_scene():
    """Of 2 kg and 3 kg m2 under 10 N and 6 N m for 0.1 s: 0.25 J and 0.06 J. A thousandth of a small scene is less."""
    load = np.array([[10.0, 0, 0, 0, 0, 6.0]])
    impulse = impulse_energy(np.array([2.0]), 3.0 * np.eye(3)[None], load, 0.1)
    assert impulse == pytest.approx(0.31)
    assert defect_floor(impulse, 1e9) == pytest.approx(0.31)
    assert defect_floor(impulse, 1.0) == pytest.approx(1e-3)


def test_the_floor_of_a_step_counts_load_and_weight_of_free_blocks_that_water_touches():
    """Of three blocks of 2 kg one is held and one is dry: 0.1 s of 30 N of water and of 20 N of weight, (3² + 2²)/4 J,
    and nothing of the others."""
    weight = np.zeros((3, 6))
    weight[:, 2] = -20.0
    structure = SimpleNamespace(
        n=3, mass=np.full(3, 2.0), inertia=lambda: np.tile(np.eye(3), (3, 1, 1)), weight_now=lambda: weight
    )
    between = exchange.Exchange(None, structure, None, rtol=1e-8, clock=no_clock, pause=lambda: None)
    load = np.zeros((4, 6))  # of a fixed solid, too
    load[[0, 1, 3], 0] = 30.0
    free = np.array([True, False, True])
    assert between._defect_floor(load, 0.1, free, 1e9) == pytest.approx((3.0**2 + 2.0**2) / 4.0)


def test_round_off_of_a_scene_at_rest_is_no_defect():
    """No load, and velocities of 1e-12 m/s in a scene of 1 J: nothing was missed."""
    M = mass_matrix(np.array([2.0]), np.eye(3)[None])
    found = np.array([[1e-12, 0, 0, 0, 0, 0]])
    assert defect(M, -found, found, defect_floor(0.0, 1.0)) < 1e-5


@given(st.integers(0, 2**31), st.integers(0, 6), st.integers(0, 4))
@settings(max_examples=30, deadline=None)
def test_short_rows_give_both_products_of_the_coupling(seed, dofs, bodies):
    """G V and Gᵀ p of any sparse G, empty ones too."""
    random = np.random.default_rng(seed)
    dense = random.normal(size=(dofs, 6 * bodies)) * (random.random((dofs, 6 * bodies)) < 0.3)
    wets = Wetting.of(sp.csr_array(dense))
    p, V = random.normal(size=dofs), random.normal(size=6 * bodies)
    assert wets.on_bodies(p) == pytest.approx(dense.T @ p, abs=1e-12)
    assert wets.on_water(V) == pytest.approx(dense @ V, abs=1e-12)


def test_a_driven_body_takes_along_what_hangs_on_it():
    """A spring k between a driven body at 0.4 m/s and a free one at rest: (m/dt + dt k) V = dt k 0.4."""
    dt, mass, k = 0.01, 100.0, 1e6
    K = np.zeros((12, 12))
    K[np.ix_([0, 6], [0, 6])] = k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    M = mass_matrix(np.array([50.0, mass]), np.tile(np.eye(3), (2, 1, 1)))
    velocity = np.zeros((2, 6))
    velocity[0, 0] = 0.4
    response = StructureResponse(
        M, sp.csr_array(K), sp.csr_array((12, 12)), dt, np.array([True, False]), velocity
    )
    found = response.free_velocity(velocity, np.zeros((2, 6))).reshape(2, 6)
    assert found[0, 0] == 0.4
    assert found[1, 0] == pytest.approx(dt * k * 0.4 / (mass / dt + dt * k), rel=1e-12)


@pytest.mark.parametrize("stiffness", [0.0, 1e4, 1e9])
def test_the_velocity_at_the_end_is_the_one_whose_mean_was_found(stiffness):
    """A body that was at 2 m/s and moved by nothing on the whole came back; a stiff spring holds it at the mean."""
    dt, substep = 0.01, 1e-4
    response = piston(300.0, dt, stiffness=stiffness)
    before, mean = np.zeros((1, 6)), np.zeros((1, 6))
    before[0, 0], mean[0, 0] = 2.0, 0.01
    end = response.at_end(mean, before, substep)
    assert (end - response.lead(end, before, substep))[0] == pytest.approx(mean[0], abs=1e-3)
    if stiffness == 0.0:
        assert end[0, 0] == pytest.approx(-1.94, rel=0.01)
    if stiffness == 1e9:
        assert end[0, 0] == pytest.approx(0.0, abs=0.05)


@pytest.mark.parametrize(
    ("before", "water", "mean", "start"),
    [
        (
            [5.0, 0.0],
            [5.0, 0.0],
            [-1.0, 0.0],
            [5.0, 0.0],
        ),  # the water moves with it: it turns round with it, too
        ([5.0, 0.0], [0.0, 0.0], [4.0, 0.0], [5.0, 0.0]),  # thrown, it goes on as it came
        ([-4.0, 0.0], [0.0, 0.0], [0.5, 0.0], [0.0, 0.0]),  # thrown, it comes back: the water begins at rest
        ([-3.0, 0.0], [1.0, 0.0], [1.5, 0.0], [1.0, 0.0]),
        ([4.0, -3.0], [0.0, 0.0], [1.0, 0.0], [1.0 + 0.5**0.5, -(0.5**0.5)]),  # at the bed, and along it
    ],
)
def test_a_second_pass_begins_where_the_water_gains_nothing(before, water, mean, start):
    """Beside a body that comes back within the step water that was at rest does not turn round: its work, with the mean
    of its own velocities, is no more than what the ledger gives it. One of two bodies is left alone."""
    rows = np.zeros((4, 2, 6))
    rows[:3, 0, ::2][:, :2] = before, water, mean
    rows[:, 1] = 2.0
    M = mass_matrix(np.array([3.0, 2.0]), np.tile(np.eye(3), (2, 1, 1)))
    found = start_of_water(M, *rows[:3])
    assert found[0, [0, 2]] == pytest.approx(start)
    assert (found[0, [1, 3, 4, 5]] == 0.0).all()
    assert (found[1] == 2.0).all()
    d, w = found[0] - rows[1, 0], rows[2, 0] - rows[1, 0]
    assert (2.0 * w - d) @ d >= -1e-12


@pytest.mark.parametrize("substeps", [1, 2, 100])
def test_a_body_afloat_swings_alike_whatever_its_substeps(substeps):
    """ω dt = 0.3 over 400 steps: the load is that of the place at the start, less what half of the way takes off. Taken
    off over half of the way in steps of one substep too, it was left with a hundredth of a hundredth of its swing."""
    dt, mass, k, place, velocity, reached = 0.01, 2.0, 1800.0, 0.01, np.zeros((1, 6)), []
    heave = np.zeros((1, 3, 3))
    heave[0, 0, 0] = k
    nothing = sp.csr_array((6, 6))
    M = mass_matrix(np.array([mass]), np.eye(3)[None])
    response = StructureResponse(
        M, nothing, nothing, dt, np.zeros(1, bool), np.zeros((1, 6)), heave, dt / substeps
    )
    load = np.zeros((1, 6))
    for _ in range(400):
        load[0, 2] = -k * place
        end = response.free_velocity(velocity, load).reshape(1, 6)
        force = load + response.restoring_load(end)
        mean = velocity + 0.5 * (1.0 + 1.0 / substeps) * dt * force / mass
        assert mean[0, 2] == pytest.approx(
            (end - response.lead(end, velocity, dt / substeps))[0, 2], rel=1e-9
        )
        velocity, place = velocity + dt * force / mass, place + dt * mean[0, 2]
        reached.append(abs(place))
    assert max(reached[-40:]) == pytest.approx(max(reached[:40]), rel=0.02)


def test_a_force_is_held_as_far_as_a_body_does_not_give_way_to_it():
    """Loose, on a spring that lets it go two thirds of its way in the step, fixed, and moved as a motion imposes."""
    dt, mass = 0.1, np.full(4, 3.0)
    stiffness = np.zeros((24, 24))
    stiffness[6, 6] = 0.5 * mass[1] / dt**2
    driven, velocity = np.array([False, False, True, True]), np.zeros((4, 6))
    velocity[3, 2] = 1.0
    M = mass_matrix(mass, np.tile(np.eye(3), (4, 1, 1)))
    response = StructureResponse(M, sp.csr_array(stiffness), sp.csr_array((24, 24)), dt, driven, velocity)
    force = np.zeros((4, 6))
    force[:, 0] = 7.0
    np.testing.assert_allclose(response.held(force)[:, 0], [0.0, 1.0 / 3.0, 1.0, 0.0], atol=1e-12)


def test_tied_loose_and_held_bodies_answer_a_force_by_their_own_equations():
    """Bodies 0, 1, 2 in a chain of springs far stiffer than they are heavy, 3 tied to 4, which is held, 5 loose: what
    is left of each row of a free body is round-off of its products, and 4 does not move."""
    rng, n, stiffness = np.random.default_rng(3), 6, np.zeros((36, 36))
    for a, b in ((2, 0), (0, 1), (3, 4)):
        spring = np.zeros((6, 36))
        spring[:, 6 * a : 6 * a + 6], spring[:, 6 * b : 6 * b + 6] = rng.normal(size=(2, 6, 6))
        stiffness += 1e6 * spring.T @ spring
    driven, force = np.arange(n) == 4, rng.normal(size=6 * n)
    M = mass_matrix(rng.uniform(1.0, 3.0, n), np.tile(np.eye(3), (n, 1, 1)))
    response = StructureResponse(
        M, sp.csr_array(stiffness), sp.csr_array((36, 36)), 0.1, driven, np.zeros((n, 6))
    )
    found, free = response.compliance(force), np.repeat(~driven, 6)
    matrix = (M / 0.1).toarray() + 0.1 * stiffness
    size = np.abs(matrix) @ np.abs(found) + np.abs(force)
    assert (np.abs(matrix @ found - force) <= 1e-13 * size)[free].all()
    assert (found[~free] == 0.0).all()


def test_defect_of_a_body_that_stood_still_is_whole():
    """The larger of what was found and what was assumed is the measure: neither alone may vanish."""
    M = mass_matrix(np.array([2.0]), np.eye(3)[None])
    moving, still = np.array([[1.0, 0, 0, 0, 0, 0]]), np.zeros((1, 6))
    assert defect(M, moving, still) == pytest.approx(1.0)
    assert defect(M, still, moving) == pytest.approx(1.0)


class _Gate:
    """A block of 1 kg whose joint breaks at 30 N; unbroken it does not move, broken it is free."""

    n, fixed, still, joints = 1, np.zeros(1, bool), np.zeros(1, bool), ()
    mass = np.ones(1)

    def __init__(self):
        self.restore(False)

    def inertia(self):
        return np.eye(3)[None]

    def weight_now(self):
        return np.zeros((1, 6))

    def restore(self, broken):
        self.broken, self.speed = broken, 0.0

    def velocity(self):
        return np.zeros((1, 6))

    def set_load(self, load):
        self.force = float(load[0, 0])

    def advance(self, dt):
        self.broken = self.broken or self.force > 30.0
        self.speed = self.force * dt if self.broken else 0.0
        moved = np.array([[self.speed, 0, 0, 0, 0, 0]])
        return SimpleNamespace(substeps=1, dt_s=dt, mean_velocity=moved, opening_rate=0.0, impulses=None)

    def joint_damage(self):
        return np.zeros(1), np.array([not self.broken])


@pytest.mark.parametrize(
    ("before_it_moves", "share", "sea", "broken"),
    [
        (100.0, 1.0, 1.0, True),
        (100.0, 1.0, 1e11, True),
        (35.0, 1.0, 1.0, True),
        (35.0, 0.5, 1e6, True),
        (25.0, 1.0, 1.0, False),
    ],
)
def test_a_wall_that_breaks_before_it_moves_does_not_hold_because_it_would_move(
    before_it_moves, share, sea, broken, monkeypatch
):
    """Water pushes with F before the gate moves, and with nothing once it moves as fast as F alone would make it: the
    second pass takes the gate to be gone, so that it holds. A house stood by that, under 1.4 MN on its timber wall.
    share: of that speed that the solution assumes; with half of it, in a wide sea [J], a pass halves the defect. The
    widest sea changes nothing: a thousandth of its energy is far more than the gate can have, and once hid the miss."""
    gate, dt = _Gate(), 1.0

    def solution(problem, response, v_free, *_):
        push = before_it_moves * (1.0 - v_free[0] / before_it_moves)
        return SimpleNamespace(
            load=np.array([[push, 0, 0, 0, 0, 0]]), velocity=share * v_free.reshape(1, 6), x=np.zeros(1), iterations=1,
            problem=problem,
        )  # fmt: skip

    monkeypatch.setattr(exchange, "solve_coupled", solution)
    monkeypatch.setattr(exchange, "corrected_free_velocity", lambda r, after, x, c: after.ravel())
    monkeypatch.setattr("coupler.step.coupling_rows.Wetting.of", lambda coupling: None)
    water, solids = SimpleNamespace(pushed_by=np.zeros((1, 6))), SimpleNamespace(n_solids=0)
    between = exchange.Exchange(water, gate, solids, rtol=1e-8, clock=no_clock, pause=lambda: None)
    response = SimpleNamespace(
        lead=lambda velocity, before, substep: np.zeros((1, 6)),
        at_end=lambda mean, before, substep: mean,
        mass=sp.eye_array(6).tocsr(),
    )
    first = sp.eye_array(6).tocsr(), response, np.zeros(6)
    monkeypatch.setattr(between, "_response", lambda *_: first)
    monkeypatch.setattr(between, "_answer", lambda *_: response)
    monkeypatch.setattr(between, "_afloat", lambda problem: (problem, None))
    problem = SimpleNamespace(dt=dt, coupling=sp.csr_matrix(np.ones((1, 6))))
    record = StepRecord(time=0.0, dt=dt)
    start = SimpleNamespace(structure=False)
    found, moved, _ = between.take(problem, record, start, now=0.0, most=2, tolerance=0.02, energy=sea)
    assert gate.broken == broken
    assert record.passes <= 4
    if broken:
        assert moved[0, 0] == pytest.approx(found.load[0, 0])
        assert found.load[0, 0] > 30.0
    if before_it_moves == 100.0:  # half-way both agree: 50 N, 50 m/s
        assert record.defect < 1e-9
        assert found.load[0, 0] == pytest.approx(50.0)
