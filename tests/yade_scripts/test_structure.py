"""Joined blocks in YADE: traction and work of a joint, bending, momentum, damage, hand-over, tangent, restoring."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from coupler.commands.verify.figures import columns
from tests.yade_scripts.ledger import balance
from yade_scripts.blocks.block import Block, BlockError
from yade_scripts.blocks.generators.column import column_of_boxes
from yade_scripts.blocks.generators.wall import wall_of_blocks
from yade_scripts.contact.law import ContactLaw
from yade_scripts.contact.state import sum_on_blocks
from yade_scripts.dynamics.structure import NotFinite, Structure
from yade_scripts.joints.cohesion import JointParameters
from yade_scripts.yade_side.scene import SceneInUse

LAW = JointParameters(strength=1e6, opening_at_failure=1e-3, damping=0.0)
STILL = (0.0, 0.0, 0.0)


def pulled(law=LAW, **motion):
    return [
        Block("a", (0, 0, 0.5), size=1.0, fixed=True),
        Block("b", (0, 0, 1.5), size=1.0, driven=True, **motion),
    ]


@pytest.mark.parametrize(("direction", "stretch"), [((0, 0, 1), 1.0), ((1, 0, 0), 1.0), ((1, 0, 0), 0.7)])
def test_pulled_joint_follows_the_law_and_takes_its_work_of_separation(direction, stretch):
    """Opening or sliding at constant speed: force T(β δ) β A, total work 9/16 T_max δ_f A."""
    law = JointParameters(1e6, 1e-3, shear_ratio=stretch, damping=0.0)
    beta = 1.0 if direction[2] else stretch
    speed = 0.01
    with Structure(pulled(velocity=speed * np.array(direction)), None, law, gravity=STILL) as s:
        for _ in range(10):
            s.advance(0.01)
            r = beta * speed * s.time / 1e-3
            force = s.reaction()[1, :3] @ direction
            assert force == pytest.approx(6.75e6 * beta * r * (1 - r) ** 2, rel=1e-5, abs=1e-2)
        s.advance(0.1)
        assert not s.joint_table().alive.any()
        e = s.energies()
        assert e["driving_work"] == pytest.approx(law.work_of_separation, rel=1e-4)
        assert e["joint_dissipated"] == pytest.approx(law.work_of_separation, rel=1e-4)
        assert s.law_dissipation() == pytest.approx(law.work_of_separation, rel=1e-12)
        assert s.joint_table().mode_mix[0] == pytest.approx(0.0 if direction[2] else 1.0, abs=1e-9)
        assert 0.0 < s.joint_table().failure_time[0] < s.time


def test_the_energy_of_a_motion_belongs_to_the_time_of_its_places():
    """Velocities are half a substep older than places. A block thrown up keeps the sum of the energy of its motion and
    its height times weight to round-off; without the half substep of weight it would change by g v dt a kilogram."""
    block = Block("a", (0, 0, 5.0), size=1.0, velocity=(1.0, 0.0, 3.0))
    with Structure([block], ContactLaw(1e7), substep=1e-3) as s:
        energy = []
        for _ in range(5):
            s.advance(0.1)
            height = float(s.centre()[0, 2])
            energy.append(s._energy_sums.of_motion(np.array([0])) + s.mass[0] * 9.81 * height)
    assert np.ptp(energy) < 1e-9 * energy[0]


def test_unloading_goes_to_the_origin():
    """Half-open, back to zero: no force is left, the damage stays, and only the secant energy comes back."""
    with Structure(pulled(velocity=(0, 0, 0.01)), None, LAW, gravity=STILL) as s:
        s.advance(0.05)
        damage = s.joint_table().damage[0]
        s.drive("b", velocity=(0, 0, -0.01))
        s.advance(0.05)
        assert damage == pytest.approx(0.5, rel=1e-2)
        assert s.joint_table().damage[0] == pytest.approx(damage, rel=1e-2)
        assert abs(s.reaction()[1, 2]) < 1e-3 * 1e6
        e = s.energies()
        assert e["driving_work"] == pytest.approx(s.law_dissipation(), rel=2e-2)


def test_bending_of_a_joint_matches_the_exact_hinge():
    """Rotation about the compressed edge: moment of the 3 x 3 Gauss points against 27/4 (r/3 - r²/2 + r³/5)."""
    ref = columns("coh_hinge_moment")
    omega = 0.01
    blocks = pulled(spin=(0, -omega, 0), velocity=np.cross((0, -omega, 0), (0.5, 0.0, 0.5)))
    law = JointParameters(1e6, 1e-3, closing_ratio=1.0, damping=0.0)
    with Structure(blocks, None, law, gravity=STILL) as s:
        for r in (0.2, 0.46, 0.8):
            s.advance(r * 1e-3 / omega - s.time)
            f = s.reaction()[1]
            about_edge = f[3:] + np.cross(s.centre()[1] - (-0.5, 0.0, 1.0), f[:3])
            exact = np.interp(r, ref["r"], ref["m_gauss_3"]) * 1e6
            assert abs(about_edge[1]) == pytest.approx(exact, rel=5e-3)


def test_momentum_of_a_free_wall_is_kept_to_round_off():
    """Joint forces act at the mid point of the pair: linear and angular momentum stay, whatever breaks."""
    rng = np.random.default_rng(3)
    blocks = [
        Block(b.name, b.centre, size=b.size, velocity=rng.normal(size=3), spin=0.3 * rng.normal(size=3))
        for b in wall_of_blocks("w", (0, -0.5, 0), (3.0, 1.0, 3.0), (1.0, 1.0, 1.0))
    ]

    def momenta(s):
        v = s.velocity()
        p = (s.mass[:, None] * v[:, :3]).sum(axis=0)
        spin = np.einsum("nij,nj->ni", s.inertia(), v[:, 3:])
        return p, (np.cross(s.centre(), s.mass[:, None] * v[:, :3]) + spin).sum(axis=0)

    with Structure(blocks, None, JointParameters(1e5, 1e-2, damping=0.0), gravity=STILL) as s:
        p0, L0 = momenta(s)
        s.advance(0.2)
        p1, L1 = momenta(s)
        assert not s.joint_table().alive.all()
    np.testing.assert_allclose(p1, p0, rtol=0, atol=1e-12 * np.abs(p0).max() * 10)
    np.testing.assert_allclose(L1, L0, rtol=0, atol=1e-4 * np.abs(L0).max())


def test_a_bonded_pair_tells_the_stable_step_of_its_eigenvalue_problem():
    """The cheap bound never exceeds 0.4 * 2/ω_max of the assembled matrices, and is no less than 0.6 of it."""
    blocks = wall_of_blocks("w", (0, -0.25, 0), (4.0, 0.5, 3.0), (1.0, 0.5, 1.0))
    with Structure(blocks, None, LAW, ground=0.0, gravity=STILL) as s:
        K, C = s.tangent()
        M = np.zeros((6 * s.n, 6 * s.n))
        for i in range(s.n):
            M[6 * i : 6 * i + 3, 6 * i : 6 * i + 3] = s.mass[i] * np.eye(3)
            M[6 * i + 3 : 6 * i + 6, 6 * i + 3 : 6 * i + 6] = s.inertia()[i]
        omega = np.sqrt(eigh(K.toarray(), M, eigvals_only=True)[-1])
        dt, what = s.stable_substep()
        assert 0.6 * 0.8 / omega < dt <= 0.8 / omega * (1 + 1e-12)
        assert "joint" in what
        assert C.nnz == 0 or abs(C).max() == 0.0


def test_tangent_is_the_derivative_of_the_force():
    """Moving one block by ε changes the forces by -K ε (joints closed or freshly open), and rigid motion by nothing."""
    blocks = wall_of_blocks("w", (0, -0.25, 0), (2.0, 0.5, 2.0), (1.0, 0.5, 1.0))
    with Structure(blocks, None, LAW, gravity=STILL) as s:
        K, _ = s.tangent()
        step = np.zeros((s.n, 6))
        step[1] = 1e-9 * np.array([1.0, -2.0, -0.5, 0.3, 0.2, 0.1])
        rigid = np.zeros((s.n, 6))
        rigid[:, :3] = (0.3, 0.2, 0.1)
        assert np.abs(K @ rigid.ravel()).max() < 1e-9 * abs(K).max()
        x = s._motion.x.copy()
        s._motion.x[1] += step[1, :3]
        s._motion.R[1] = Rotation.from_rotvec(step[1, 3:]).as_matrix() @ s._motion.R[1]
        force = s.internal_force().ravel()
        s._motion.x[:] = x
        np.testing.assert_allclose(force, -(K @ step.ravel()), rtol=0, atol=1e-4 * np.abs(force).max())


def test_ledger_of_a_wall_broken_by_a_block():
    """Impact at 12 m/s: joints break, blocks slide on one another; energies close to 1e-3 of the impact's."""
    blocks = [
        *wall_of_blocks("w", (0, -0.25, 0), (3.0, 0.5, 3.0), (1.0, 0.5, 1.0)),
        Block("shot", (1.5, -1.0, 1.5), size=0.6, density=5000.0, velocity=(0, 12.0, 0)),
    ]
    with Structure(blocks, ContactLaw(), JointParameters(2e5, 2e-3, damping=0.0), ground=0.0) as s:
        start = s.energies()
        for _ in range(8):
            s.advance(0.01, substep=0.5 * s.stable_substep()[0])
        end = s.energies()
        assert (~s.joint_table().alive).sum() >= 3
        assert end["joint_dissipated"] == pytest.approx(s.law_dissipation(), rel=0.02)
    assert balance(end) == pytest.approx(balance(start), abs=1e-3 * start["kinetic"])
    assert min(end["dashpot"], end["friction"], end["joint_dissipated"]) > 0.0


def test_contact_takes_over_from_a_broken_joint_without_a_jump():
    """A column at rest loses a joint under compression: same face stiffness, so nothing moves by more than a few µm."""
    blocks = column_of_boxes("c", (0, 0, 0), (1.0, 1.0, 4), 4)
    law = JointParameters(2e5, 1e-3, damping=0.3)
    with Structure(blocks, ContactLaw(friction=0.6), law, ground=0.0) as s:
        s.advance(1.2)
        before = s.centre()
        depth = 2400.0 * 9.81 * 2 / law.closing_stiffness
        s.joints.largest[s.joints.joint_of == 1] = 1.01e-3
        report = s.advance(0.002)
        assert report.broken.tolist() == [1]
        s.advance(0.1)
        assert np.abs(s.centre() - before).max() < 0.05 * depth
        assert len(s.contacts()) > 0


def test_intact_blocks_cost_no_contacts_and_a_fallen_piece_does_not_sink():
    """Two joined blocks thrown on the ground: their own joint carries them, the ground still stops them."""
    blocks = [
        Block(b.name, b.centre, size=b.size) for b in column_of_boxes("c", (0, 0, 0.3), (1.0, 1.0, 1), 2)
    ]
    with Structure(
        blocks, ContactLaw(stiffness=1e8), JointParameters(1e7, 1e-3, damping=0.02), ground=0.0
    ) as s:
        assert len(s.joint_table()) == 1
        for _ in range(20):
            s.advance(0.05)
        assert s.joint_table().alive.all()
        assert s.centre()[:, 2] == pytest.approx([0.25, 0.75], abs=5e-3)


def test_a_joined_column_on_a_ground_without_joints_stands_on_its_contact():
    """`ground = False`: only the foot touches the ground, by contact from the first substep; it carries the weight."""
    law = JointParameters(1e6, 1e-3, damping=0.1, ground=False)
    with Structure(column_of_boxes("c", (0, 0, 0), (1.0, 1.0, 3), 3), ContactLaw(), law, ground=0.0) as s:
        assert len(s.joint_table()) == 2
        s.advance(0.3)
        assert np.abs(s.centre()[:, 2] - [0.5, 1.5, 2.5]).max() < 1e-4
        assert len(s.contacts()) == 9


def test_load_work_and_mean_velocity():
    """A constant force on a free block: work F·x, mean velocity x/dt, exact for the leapfrog."""
    with Structure([Block("b", (0, 0, 0), size=1.0, density=1000.0)], gravity=STILL) as s:
        F = np.zeros((1, 6))
        F[0] = (1000.0, 0, 0, 0, 0, 50.0)
        s.set_load(F)
        start = s.energies()
        for _ in range(5):
            x0 = s.centre()
            report = s.advance(0.1, substep=0.001)
            np.testing.assert_allclose(report.mean_velocity[0, :3], (s.centre() - x0)[0] / 0.1, rtol=1e-12)
        end = s.energies()
        assert s.velocity()[0, 0] == pytest.approx(0.5, rel=1e-9)
        assert balance(end) == pytest.approx(balance(start), abs=1e-6 * end["kinetic"])


def test_torque_free_spin_keeps_energy_and_momentum():
    """An elongated free block about its middle axis (unstable): the tumbling keeps L and energy."""
    block = Block("b", (0, 0, 0), size=(0.4, 1.0, 2.0), spin=(0.01, 5.0, 0.01))
    with Structure([block], gravity=STILL) as s:
        L0 = s.inertia()[0] @ s.velocity()[0, 3:]
        e0 = s.energies()["kinetic"]
        s.advance(3.0, substep=5e-4)
        L1 = s.inertia()[0] @ s.velocity()[0, 3:]
        assert s.energies()["kinetic"] == pytest.approx(e0, rel=5e-3)
        np.testing.assert_allclose(L1, L0, atol=2e-3 * np.linalg.norm(L0))


def test_restore_repeats_the_step():
    """Save, advance, restore, advance: the same to round-off, with contacts sliding and joints damaged."""
    blocks = [
        *wall_of_blocks("w", (0, -0.25, 0), (3.0, 0.5, 3.0), (1.0, 0.5, 1.0)),
        Block("shot", (1.5, -0.7, 1.5), size=0.6, density=5000.0, velocity=(0, 12.0, 0)),
    ]
    with Structure(blocks, ContactLaw(), JointParameters(2e5, 2e-3, damping=0.0), ground=0.0) as s:
        s.advance(0.012)
        for _ in range(3):
            saved = s.save()
            first = s.advance(0.005)
            x, v, e = s.centre(), s.velocity(), s.energies()
            s.restore(saved)
            again = s.advance(0.005)
            np.testing.assert_array_equal(s.centre(), x)
            np.testing.assert_array_equal(s.velocity(), v)
            assert again.broken.tolist() == first.broken.tolist()
            assert s.energies() == e


def test_contacts_act_and_react():
    """Forces of all contacts between free blocks sum to nothing."""
    blocks = column_of_boxes("c", (0, 0, 0), (1.0, 1.0, 3), 3)
    with Structure(blocks, ContactLaw(stiffness=1e8), gravity=STILL) as s:
        F = np.zeros((3, 6))
        F[0, 2], F[2, 2] = 1e4, -1e4
        s.set_load(F)
        s.advance(0.2)
        c = s.contacts()
        total = sum_on_blocks(c, c.elastic_forces(), s.centre())
        np.testing.assert_allclose(total[:, :3].sum(axis=0), 0.0, atol=1e-8)
        assert total[2, 2] == pytest.approx(1e4, rel=0.05)


def test_map_coordinates_lose_no_digits():
    """The same pull at (500 km, 4000 km): computed about a local origin."""
    far = np.array([5e5, 4e6, 0.0])
    blocks = [
        Block("a", far + np.array([0, 0, 0.5]), size=1.0, fixed=True),
        Block("b", far + np.array([0, 0, 1.5]), size=1.0, driven=True, velocity=(0, 0, 0.01)),
    ]
    with Structure(blocks, None, LAW, gravity=STILL) as s:
        s.advance(0.02)
        assert s.reaction()[1, 2] == pytest.approx(6.75e6 * 0.2 * 0.8**2, rel=1e-6)
        np.testing.assert_allclose(s.centre()[1], far + np.array([0, 0, 1.5002]), atol=1e-9)


def test_joints_of_any_convex_polyhedron():
    """A prism split along its diagonal: the inclined joint is found; without contact it pulls like any other."""
    low = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1]], float)
    high = np.array([[0, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [0, 1, 1]], float)
    blocks = []
    for name, v in (("low", low), ("high", high)):
        centre = v.mean(axis=0)
        blocks.append(Block(name, centre, vertices=v))
    with Structure(blocks, None, LAW, gravity=STILL) as s:
        table = s.joint_table()
        assert table.area == pytest.approx([np.sqrt(2.0)])
        s.advance(0.01)
        assert np.abs(s.velocity()).max() < 1e-9


def test_errors_name_what_is_wrong():
    block = Block("b", (0, 0, 0), size=1.0)
    with pytest.raises(BlockError, match="'b'"):
        Structure([block, block])
    with Structure([block]) as s:
        with pytest.raises(SceneInUse, match="close"):
            Structure([block])
        with pytest.raises(NotFinite, match="load"):
            s.set_load(np.full((1, 6), np.nan))
    with Structure([block]) as again:
        assert again.n == 1


def test_displaced_blocks_start_a_closed_ledger():
    """A joint opened by hand holds its energy and its damage's; released, it swings without any loss but damage."""
    blocks = [Block("a", (0, 0, 0.5), size=1.0, fixed=True), Block("b", (0, 0, 1.5), size=1.0)]
    with Structure(blocks, None, LAW, gravity=STILL) as s:
        s.displace(np.array([1]), np.array([[0.0, 0.0, 2e-4]]), np.eye(3)[None])
        e = s.energies()
        assert e["joint_stored"] == pytest.approx(0.5 * 6.75e9 * 0.8**2 * 4e-8, rel=1e-9)
        assert e["joint_dissipated"] == pytest.approx(s.law_dissipation(), rel=1e-9)
        assert e["friction"] == pytest.approx(0.0, abs=1e-9)
        s.advance(0.05)
        assert balance(s.energies()) == pytest.approx(balance(e), rel=1e-9)
        assert s.energies()["kinetic"] + s.energies()["joint_stored"] <= e["joint_stored"] * 1.02
