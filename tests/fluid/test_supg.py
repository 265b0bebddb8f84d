"""Transport by stabilised elements: exact where it must be, bounded on slivers, second order, and in the loop as good
as the transport along paths that it is the reference for."""

import subprocess
import sys

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from skfem import asm

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.domain.topology import Topology
from fluid.mesh.background import box_mesh
from fluid.numerics.solve import NotConverged
from fluid.sides import waves
from fluid.sides.inflow import Side, Sides
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from fluid.transport import forms, supg
from fluid.transport.supg import Band, Transport, ghost_penalty, midpoint_velocity, stabilisation_time
from tests.fluid.scenes import advance, column, load, rotation, tank

H = 1 / 3
MESH = box_mesh((0, 0, 0), (1, 1, 1), H)
EXAMPLES = settings(max_examples=8, deadline=None)  # the first call compiles
VECTOR = st.tuples(*[st.floats(-2, 2)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


def scene(bodies, covers="single", mesh=MESH):
    """(Topology, Band of all nodes) of the mesh less the bodies."""
    domain = cut_domain(mesh, bodies, covers)
    t = Topology.of(mesh, domain)
    return t, Band.of(domain, np.flatnonzero(t.active))


def random_boxes(seed, n):
    """n boxes at any place and turn, from plates of a thousandth of a cell to three cells."""
    random = np.random.default_rng(seed)
    size = np.exp(random.uniform(np.log(2e-4), np.log(0.6), (n, 3)))
    return ConvexBodies.boxes(random.uniform(0.1, 0.9, (n, 3)), size, Rotation.random(n, random).as_matrix())


def terms(t, band, c, dt):
    """Basis, and the fields that the forms of the transport need, of a uniform velocity c (3,)."""
    basis = forms.basis_of(band)
    velocity = np.tile(np.asarray(c, float), (len(band.nodes), 1))
    tau = stabilisation_time(velocity[band.cells].mean(axis=1), t.gradients[t.parent[band.rows]], dt)
    return basis, {"c": forms.at_points(basis, velocity), "tau": forms.per_cell(basis, tau)}


@EXAMPLES
@given(st.integers(0, 2**32 - 1), VECTOR, VECTOR, st.sampled_from(["single", "multiple"]))
def test_forms_are_exact_for_constant_and_linear_fields(seed, c, slope, covers):
    """On any cut, with volume V and f = slope·x:  Σ_i ∫ N_i c·∇f = V c·slope;  the SUPG weights of all hats sum to
    nothing;  streamline diffusion of f against f is ∫ τ (c·slope)²;  linear fields have no jump of the gradient."""
    t, band = scene(random_boxes(seed, 2), covers)
    basis, fields = terms(t, band, c, 0.05)
    one, f, volume = np.ones(len(band.nodes)), band.nodes @ slope, band.volume.sum()
    crossing = float(np.dot(c, slope))
    close = {"rtol": 1e-11, "atol": 1e-12}
    np.testing.assert_allclose(one @ asm(forms.mass, basis) @ one, volume, **close)
    galerkin = asm(forms.advection, basis, **fields)
    np.testing.assert_allclose(galerkin @ one, 0.0, atol=1e-14)
    np.testing.assert_allclose(one @ (galerkin @ f), volume * crossing, **close)
    rate, along = (asm(form, basis, **fields) for form in (forms.streamline_rate, forms.streamline_diffusion))
    np.testing.assert_allclose(one @ rate, 0.0, atol=1e-14)
    np.testing.assert_allclose(one @ along, 0.0, atol=1e-14)
    tau = fields["tau"][:, 0]
    np.testing.assert_allclose(f @ (along @ f), (tau * band.volume).sum() * crossing**2, **close)
    np.testing.assert_allclose(ghost_penalty(t, band) @ f, 0.0, atol=1e-12)


@EXAMPLES
@given(
    st.integers(0, 2**32 - 1), VECTOR, VECTOR, st.sampled_from(["single", "multiple"]), st.floats(0.1, 3.0)
)
def test_a_linear_field_in_uniform_flow_moves_exactly(seed, c, slope, covers, courant):
    """δ = -dt c·∇f at every node, to the tolerance of the solver; the anchor is felt at nodes with next to no water."""
    t, band = scene(random_boxes(seed, 2), covers)
    velocity = np.tile(c, (len(band.nodes), 1))
    dt = courant * H / np.abs(c).max()
    np.testing.assert_allclose(midpoint_velocity(t, band, velocity, dt), velocity, rtol=1e-12)
    f = (band.nodes @ slope)[:, None]
    moved = Transport.of(t, band, velocity, dt).change(f, np.ones(f.shape, bool))
    expected, scale = -dt * np.dot(c, slope), dt * np.linalg.norm(c) * np.linalg.norm(slope)
    np.testing.assert_allclose(moved, expected, rtol=1e-3, atol=1e-5 * scale)


def wall_beside_node(exponent, turn):
    """A half space whose plane passes 10^exponent of a cell from a node of the lattice."""
    R = rotation([1.0, 0.7, -0.4], turn)
    centre = np.full(3, H) + R @ np.array([2.0 + 10.0**exponent * H, 0.0, 0.0])
    return ConvexBodies.boxes([centre], [[4.0, 6.0, 6.0]], [R])


@EXAMPLES
@given(st.floats(-14, -1), st.floats(-1, 1), VECTOR, st.floats(0.05, 4.0))
def test_matrices_stay_bounded_on_slivers(exponent, turn, c, courant):
    """Whatever is left of the cells: no entry beyond that of whole cells; scaled to a unit diagonal, no direction of
    the matrix is lost; and the change of a field of order one is of order one."""
    t, band = scene(wall_beside_node(exponent, turn))
    dt = courant * H / np.abs(c).max()
    step = Transport.of(t, band, np.tile(c, (len(band.nodes), 1)), dt)
    A, whole = step.matrix.toarray(), 4.0 * H**3  # twenty-four cells around a node
    assert np.abs(A).max() < (1.0 + courant) ** 2 * whole
    assert dt * np.abs(step.advection.toarray()).max() < (1.0 + courant) ** 2 * whole
    root = np.sqrt(np.diag(A))
    scaled = A / np.outer(root, root)
    assert np.linalg.svd(scaled, compute_uv=False)[-1] > 1e-4
    f = np.random.default_rng(0).uniform(-1, 1, len(root))
    assert np.abs(np.linalg.solve(scaled, -dt * (step.advection @ f) / root) / root).max() < 100.0


def test_a_vanishing_sliver_changes_nothing():
    """Nodes that keep water move as if the last 1e-6 of a cell were not there, but for the ghost penalty that now holds
    the change smooth across the cut cells."""
    found = []
    for left in (0.0, 1e-6):
        t, band = scene(ConvexBodies.boxes([[2.0 + H + left * H, 0.5, 0.5]], [[4.0, 4.0, 4.0]]))
        x = band.nodes
        velocity = np.column_stack([np.sin(np.pi * x[:, 0]), np.cos(3 * x[:, 1]), x[:, 2] ** 2])
        change = Transport.of(t, band, velocity, 0.1).change(velocity, np.ones(x.shape, bool))
        found.append(change[x[:, 0] < H + 1e-3])
    np.testing.assert_allclose(found[1], found[0], atol=0.01 * np.abs(found[0]).max())


def test_time_of_stabilisation_has_its_limits():
    """τ = dt/2 in slow water, and half the time to cross the cell, h/(2|c|), in fast water."""
    g = MESH.gradients[:1]
    slow, fast = (stabilisation_time(np.array([[speed, 0.0, 0.0]]), g, 0.1)[0] for speed in (1e-9, 1e9))
    assert slow == pytest.approx(0.05)
    assert fast == pytest.approx(H / 2e9)


def test_a_bump_is_carried_with_second_order():
    """A Gaussian a tenth of the slab wide moves by four of its widths, Courant number 0.32; nothing comes in."""
    errors = [_translation_error(n) for n in (20, 40)]
    assert errors[1] < 0.06
    assert np.log2(errors[0] / errors[1]) > 1.7


def _translation_error(n):
    mesh = box_mesh(np.zeros(3), [1, 1 / n, 1], 1 / n)
    t, band = scene(ConvexBodies.empty(), mesh=mesh)
    bump = lambda x0, z0: np.exp(-((band.nodes[:, 0] - x0) ** 2 + (band.nodes[:, 2] - z0) ** 2) / 0.02)  # noqa: E731
    velocity = np.tile([0.4, 0.0, 0.3], (len(band.nodes), 1))
    steps, x = n, band.nodes
    step = Transport.of(t, band, velocity, 0.8 / steps)
    free = ~np.isclose(x[:, [0, 2]], 0.0).any(axis=1)[:, None]
    f, exact = bump(0.4, 0.4)[:, None], bump(0.72, 0.64)[:, None]
    for _ in range(steps):
        f = f + step.change(f, free)
    return np.linalg.norm(f - exact) / np.linalg.norm(exact)


def full(x):
    """Fill: everything is water."""
    return x[:, 2] - 100.0


def vortex(n, advection, steps, end, speed=1.0, **parameters):
    """Water with the velocity of one vortex in a closed square box after a time, and the velocity at its start."""
    water = tank([1, 1 / n, 1], 1 / n, full, advection=advection, **parameters)
    x = np.pi * water.topology.nodes
    water.velocity[:, 0] = speed * np.sin(x[:, 0]) * np.cos(x[:, 2])
    water.velocity[:, 2] = -speed * np.cos(x[:, 0]) * np.sin(x[:, 2])
    water.set_cell_velocity(water.velocity[water.topology.cells].mean(axis=1))
    start = water.velocity.copy()
    for _ in range(steps):
        advance(water, end / steps, rtol=1e-8)
    return water, start


def test_both_ways_of_transport_keep_the_same_energy_in_a_steady_vortex():
    """Steady in the equations of Euler; what is lost after two seconds at Courant number 1 is lost by the splitting,
    so that both agree to 2 %."""
    kept = []
    for advection in ("semi-lagrangian", "supg"):
        water, start = vortex(12, advection, 24, 2.0)
        kept.append(water.kinetic_energy() / (0.5e3 * water.nodal_water @ (start**2).sum(axis=1)))
    assert kept[1] == pytest.approx(kept[0], abs=0.02)
    assert min(kept) > 0.7


def test_vortices_of_taylor_and_green_decay_with_second_order():
    """Velocities fall as exp(-2 ν k² t)."""
    nu, errors = 0.05, []
    end = 0.25 / (nu * np.pi**2)
    for n, steps in ((8, 3), (16, 6)):
        water, start = vortex(n, "supg", steps, end, 0.2, viscosity=1000.0 * nu)
        exact = start * np.exp(-2 * nu * np.pi**2 * end)
        errors.append(np.linalg.norm(water.velocity - exact) / np.linalg.norm(exact))
    assert errors[1] < 0.01
    assert np.log2(errors[0] / errors[1]) > 1.7


@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_water_at_rest_stays_at_rest(covers):
    """Beside a tilted body whose faces cut the cells below the surface."""
    box = ConvexBodies.boxes([[0.5, 0.45, 0.3]], [[0.3, 0.25, 0.2]], [rotation([1, 2, 3], 0.7)])
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.63, box, covers=covers, advection="supg")
    for _ in range(30):
        advance(water, 0.01)
    assert np.abs(water.velocity).max() < 1e-9


def test_a_dam_break_runs_as_it_does_along_paths():
    """Ten cells over the width of the column, to T = t sqrt(2g/a) = 3: front within a cell, energy within 2.5 %, volume
    kept. The fast water of the front keeps its momentum beside the paths, and loses a share of its energy by that."""
    found = []
    for advection in ("semi-lagrangian", "supg"):
        a = 0.25
        water = tank([5 * a, a / 5, 2.5 * a], a / 10, column(a, 2 * a), advection=advection)
        energy = water.available_energy()
        while water.time * np.sqrt(2 * 9.81 / a) < 3.0:
            advance(water, rtol=1e-6)
        x = water.topology.nodes
        low = (water.level_set < 0) & (x[:, 2] < 0.04)
        found.append([x[low, 0].max() / a, water.available_energy() / energy])
        assert abs(water.volume_error()) < 1e-4
    front, energy = np.abs(np.subtract(*found))
    assert front < 0.1001
    assert energy < 0.025


def test_a_body_that_moves_in_the_water_feels_the_same():
    """A tilted box is driven along x below the surface, the domain changes at every step: the impulses on it along and
    across its way, most of them added mass and lift, agree to 2 %."""
    impulses = np.zeros((2, 3))
    for row, advection in enumerate(("semi-lagrangian", "supg")):
        mesh, x = box_mesh(np.zeros(3), [1, 1, 1], 0.125), 0.4
        domain = cut_domain(mesh, _tilted(x))
        water = Water(mesh, domain, lambda p: p[:, 2] - 0.67, WaterParameters(advection=advection))
        for _ in range(15):
            x += 0.5 * 0.01
            domain = cut_domain(mesh, _tilted(x), previous=domain)
            water.move_solids(domain)
            problem, pressure = advance(water, 0.01, np.array([0.5, 0, 0, 0, 0, 0]), rtol=1e-8)
            impulses[row] += load(problem, pressure)[0, :3] * problem.dt
    assert impulses[0, 0] < -1.0
    np.testing.assert_allclose(impulses[1, [0, 2]], impulses[0, [0, 2]], rtol=0.02)


def _tilted(x):
    return ConvexBodies.boxes([[x, 0.5, 0.35]], [[0.3, 0.3, 0.3]], [rotation([1, 2, 3], 0.3)])


def test_a_stream_through_the_tank_is_that_along_paths():
    """From an inflow, where velocities are given, to a sea, where some comes back: after the first second the two
    differ by less than 1 % of the stream in the mean and 5 % at the worst node."""
    alone, paths = (_stream(advection) for advection in ("supg", "semi-lagrangian"))
    wet = (alone.level_set < 0.0) & (paths.level_set < 0.0)
    assert wet.sum() > 200
    difference = np.linalg.norm(alone.velocity[wet] - paths.velocity[wet], axis=1) / 0.5
    assert np.sqrt(np.mean(difference**2)) < 0.01
    assert difference.max() < 0.05
    assert abs(alone.volume_error()) < 1e-5


def _stream(advection):
    side = lambda sign: lambda normal, _: sign * normal[:, 0] > 0.5  # noqa: E731
    mesh = box_mesh(np.zeros(3), [2, 0.1, 1], 0.1)
    inflow = Side.of(mesh, side(-1), waves.steady([1, 0, 0], 0.5, 0.5))
    sides = Sides([inflow, Side.of(mesh, side(1), level=lambda time: 0.5)])
    domain, parameters = cut_domain(mesh, ConvexBodies.empty()), WaterParameters(advection=advection)
    water = Water(mesh, domain, lambda x: x[:, 2] - 0.5, parameters, sides=sides)
    water.velocity[:, 0] = 0.5 * (water.level_set < 0.3)
    water.set_cell_velocity(np.tile([0.5, 0.0, 0.0], (len(water.topology.cells), 1)))
    while water.time < 1.0:
        advance(water, rtol=1e-7)
    return water


def _jump_in_a_stream(courant):
    """Water (a full tank with open ends) and its û (N, 3): 1 m/s up to half of its length, none beyond, carried along x
    by so many cells a step; what its transport makes of û, at the listed nodes; dt [s]."""
    h, speed, ends = 0.125, 2.0, lambda normal, _: np.abs(normal[:, 0]) > 0.5
    water = tank([2, 0.25, 0.25], h, lambda x: x[:, 2] - 100.0, is_open=ends, advection="supg")
    x, dt = water.topology.nodes, courant * h / speed
    u_hat = np.where(x[:, :1] < 1.01, [[1.0, 0.0, 0.0]], 0.0)
    u_m = np.tile([speed, 0.0, 0.0], (len(x), 1))
    return water, u_m, u_hat, supg.carried_velocity(water, dt, u_m, u_hat), dt


@pytest.mark.parametrize("courant", [0.5, 1.0, 3.0])
def test_a_jump_is_carried_without_overshoots(courant):
    """Velocities of 1 m/s and none, carried by a uniform stream, lie between these afterwards: the equation by itself
    makes 1.24 to 1.54 m/s of the jump in the first step, which adds energy at each impact."""
    water, u_m, u_hat, moved, dt = _jump_in_a_stream(courant)
    band = Band.of(water.domain, water.listed)
    alone = Transport.of(water.topology, band, u_m[band.members], dt)
    free = ~supg.rim(water, u_m)[band.members, None] & np.ones((1, 3), bool)
    unbounded = u_hat[band.members] + alone.change(u_hat[band.members], free)
    assert unbounded.max() > 1.2
    assert moved[:, 0].max() <= 1.0
    assert moved[:, 0].min() >= 0.0
    assert np.abs(moved[:, 1:]).max() == 0.0
    assert moved[:, 0].mean() > u_hat[:, 0].mean()


def test_what_is_held_at_the_rim_of_the_band_is_held_at_any_step():
    """The change is nothing in the outermost layer of the band, so that the velocity there stays, though all the water
    from which its path comes in a step of three cells has another one: the range holds what the node itself had."""
    h, speed = 0.125, 2.0
    water = tank([0.25, 0.25, 3.0], h, lambda x: x[:, 2] - 0.56, advection="supg")
    u_m = np.tile([0.0, 0.0, speed], (len(water.topology.nodes), 1))
    rim = supg.rim(water, u_m)
    assert rim[water.listed].sum() >= 9
    for inside in (0.0, 5.0):
        u_hat = np.where(rim[:, None], 1.0, inside) * [0.0, 0.0, 1.0]
        moved = supg.carried_velocity(water, 3.0 * h / speed, u_m, u_hat)
        np.testing.assert_array_equal(moved[rim[water.listed]], u_hat[water.listed][rim[water.listed]])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_water_is_held_where_it_comes_in_and_not_where_it_leaves(sign):
    """What is outside an open side is unknown, so velocities are kept at the end where the stream enters; at the other
    end they follow from the water inside, and held there they would reflect whatever arrives."""
    water, u_m, *_ = _jump_in_a_stream(1.0)
    rim = supg.rim(water, sign * u_m)
    ends = [water.topology.nodes[:, 0] == end for end in (0.0, 2.0)]
    enters, leaves = ends if sign > 0.0 else ends[::-1]
    assert rim[enters].all()
    assert not rim[leaves].any()


@pytest.mark.parametrize("cells", [3, 4])
def test_a_coarse_dam_break_gains_no_energy(cells):
    """A column of three or four cells: the front is a sheet of one cell, which the forms do not resolve. Where its
    velocity did not follow the momentum of the volume, the water gained 6.7 and 2.5 % of its energy."""
    h = 0.8 / cells
    water = tank([13 * h, 9 * h, 7 * h], h, column(1.07, 0.8), advection="supg")
    energy = water.available_energy()
    while water.time < 0.9:
        advance(water, 0.12 / cells)
        assert water.available_energy() < 1.02 * energy


def test_nodes_that_are_tied_to_one_another_only_are_solved_for():
    """Pairs of nodes whose difference counts 1 and whose sum 1e-7: GMRES with the diagonal alone stalls, as it did
    beside thin blocks between the sides of cells."""
    n, pairs = 400, 50 + 20 * np.arange(8)
    matrix = sp.diags_array([-0.49, 1.0, -0.49], offsets=[-1, 0, 1], shape=(n, n)).tolil()
    for k, one in enumerate(pairs):
        both = [one, one + 1]
        matrix[both, :] = matrix[:, both] = 0.0
        matrix[one, one] = matrix[one + 1, one + 1] = 1.0 + 1e-7 * 4**k
        matrix[one, one + 1] = matrix[one + 1, one] = -1.0
    matrix, right = sp.csr_array(matrix), np.random.default_rng(1).standard_normal(n)
    free = np.arange(n) > 5
    x = supg._solved(matrix, 1.0 / matrix.diagonal(), right * free, free)
    assert np.abs((matrix @ x - right)[free]).max() < 1e-6
    assert (x[~free] == 0.0).all()


def test_a_solver_that_does_not_converge_says_so(monkeypatch):
    monkeypatch.setattr(supg, "RESTART", 1)
    monkeypatch.setattr(supg, "MOST_RESTARTS", 1)
    monkeypatch.setattr(supg, "_incomplete_factors", lambda matrix, inverse, free: None)
    water = tank([1, 0.25, 1], 0.125, column(0.5, 0.5), advection="supg")
    advance(water)
    with pytest.raises(
        NotConverged, match=r"stabilised elements stopped after 1 iterations.*reduce time\.cfl"
    ):
        advance(water)


def test_a_transport_that_is_unknown_is_refused():
    with pytest.raises(ValueError, match="advection = 'upwind' is unknown; choose"):
        WaterParameters(advection="upwind")


def test_paths_alone_load_nothing_of_it():
    """Absent means absent: neither the forms nor this module are imported by a step that does not ask for them."""
    code = (
        "import sys\n"
        "from tests.fluid.scenes import advance, column, tank\n"
        "advance(tank([1, 0.5, 1], 0.25, column(0.5, 0.5)))\n"
        "print('fluid.transport.supg' in sys.modules, 'fluid.transport.forms' in sys.modules)\n"
        "advance(tank([1, 0.5, 1], 0.25, column(0.5, 0.5), advection='supg'))\n"
        "print('fluid.transport.supg' in sys.modules, 'fluid.transport.forms' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False", "True", "True"]
