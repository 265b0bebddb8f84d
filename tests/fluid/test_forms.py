"""The kernels of the step equal the scikit-fem forms to round-off: on whole cells, and on cells that any number of
bodies cuts, with one set of unknowns a node or one per part of the water."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from skfem import asm

from fluid.cut.bodies import ConvexBodies
from fluid.domain.graph import Graph
from fluid.domain.moments import nodal_water
from fluid.domain.physical_domain import cut_domain, wetted_coupling
from fluid.domain.topology import Topology
from fluid.mesh.background import Background, box_mesh
from fluid.numerics.solve import solve
from fluid.pressure.damping import Waterline, damp_divergence, damp_waterline
from fluid.pressure.projection import (
    WetCells,
    cell_gradient,
    cell_velocity,
    inflow,
    nodal_mean,
    pressure_matrix,
)
from fluid.transport import forms
from fluid.viscous.kernels import Walls, wall_stress
from fluid.viscous.strain import NodeCorners, StrainEdges, edge_strain, spread_stress
from tests.fluid import reference_forms
from tests.fluid.scenes import tank

MESH = box_mesh((0, 0, 0), (1, 1, 1), 1 / 6)
EXAMPLES = settings(max_examples=12, deadline=None)  # the first call compiles

CUTS = given(
    n=st.integers(0, 3), seed=st.integers(0, 2**32 - 1), covers=st.sampled_from(["single", "multiple"])
)


def cut(n, seed, covers):
    """The unit cube less n boxes at any place and turn: plates and rods of a thousandth of a cell to three of them."""
    random = np.random.default_rng(seed)
    centre = random.uniform(0.1, 0.9, (n, 3))
    size = np.exp(random.uniform(np.log(2e-4), np.log(0.5), (n, 3)))
    turn = Rotation.random(n, random).as_matrix() if n else None
    bodies = ConvexBodies.boxes(centre, size, turn) if n else ConvexBodies.empty()
    return cut_domain(MESH, bodies, covers)


def laid_out(domain):
    """(Topology, all its cells, random node values (N, 3))."""
    t = Topology.of(MESH, domain)
    return t, np.arange(len(t.cells)), np.random.default_rng(0).normal(size=(len(t.nodes), 3))


def same(found, expected, tolerance=1e-13):
    """To round-off of the largest entry."""
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * np.abs(expected).max())


@EXAMPLES
@CUTS
def test_pressure_matrix_is_the_stiffness_form(n, seed, covers):
    domain = cut(n, seed, covers)
    t, _, _ = laid_out(domain)
    dofs = np.flatnonzero(t.active)
    graph, nowhere = Graph.of(t, dofs), np.zeros(len(t.nodes), bool)
    found, anchored, _ = pressure_matrix(
        graph, -np.ones(len(t.nodes)), dofs, nowhere, 0.02, np.zeros(len(t.nodes))
    )
    expected = 0.02 * asm(reference_forms.stiffness, forms.basis_of(domain)).tocsr()[dofs][:, dofs]
    difference = abs(found - expected)
    assert difference.max() <= 1e-13 * abs(expected).max()
    assert not anchored.any()


@EXAMPLES
@CUTS
def test_right_hand_side_of_the_pressure(n, seed, covers):
    domain = cut(n, seed, covers)
    t, cells, u = laid_out(domain)
    basis = forms.basis_of(domain)
    mean = cell_velocity(cells, u, np.zeros((0, 3)), t.fluid_cells)
    found = inflow(cells, mean, t.fluid_cells, len(u))
    same(found, asm(reference_forms.inflow, basis, u=forms.at_points(basis, u)))


@EXAMPLES
@CUTS
def test_nodal_volume_and_what_the_pressure_takes_off_the_momentum(n, seed, covers):
    """Σ_e w_e ∇p / Σ_e w_e times the volume of the node is ∫ ∇p N_i dV.  Shares below 1e-9 count as that in the kernel,
    so that no node is without a gradient."""
    domain = cut(n, seed, covers)
    t, cells, f = laid_out(domain)
    basis, vector = forms.basis_of(domain), reference_forms.vector_basis_of(domain)
    volume = asm(reference_forms.lumped, basis)
    n = len(t.nodes)
    same(nodal_water(cells, 0.0, -np.ones(n), t.parts, n), volume)
    same(t.node_volume, volume)
    expected = asm(reference_forms.pressure_gradient, vector, p=basis.interpolate(f[:, 0])).reshape(-1, 3)
    gradient = cell_gradient(cells, np.ascontiguousarray(f[:, 0]), t.cells, t.parent, t.gradients)
    mean = nodal_mean(WetCells(cells, np.ones(len(cells))), gradient, t.fluid_cells, n)
    same(mean * volume[:, None], expected, 1e-8)


@EXAMPLES
@CUTS
def test_divergence_damping(n, seed, covers):
    """Lumped mass times the change of u is -c ∫ l² (div u)(div v) dV, where no cell is left out."""
    domain = cut(n, seed, covers)
    t, cells, u = laid_out(domain)
    vector = reference_forms.vector_basis_of(domain)
    size = forms.per_cell(vector, t.size)
    expected = -0.05 * asm(
        reference_forms.grad_div, vector, u=vector.interpolate(reference_forms.by_component(u)), l=size
    )
    damped, everywhere = u.copy(), np.ones(len(cells))
    line = Waterline(-np.ones(len(u)), t.beside_solid, -np.inf)
    damp_divergence(WetCells(cells, everywhere), 0.05, line, damped, t.fluid_cells)
    mass = np.bincount(t.cells.ravel(), np.repeat(0.25 * t.volume, 4), minlength=len(u))
    # the change of a node next to a sliver is huge, its mass tiny: compare what they make together
    scale = np.abs(expected).max() + np.abs(mass[:, None] * u).max()
    np.testing.assert_allclose(
        (damped - u) * mass[:, None], expected.reshape(-1, 3), rtol=0, atol=1e-13 * scale
    )


@pytest.mark.parametrize("split", ["kuhn", "mirrored"])
@pytest.mark.parametrize("flat", [1.0, 10.0, 100.0])
def test_divergence_damping_gains_no_energy_in_flat_cells(flat, split):
    """The motion that it amplifies most, found by applying it again and again, does not grow, and any motion keeps its
    momentum."""
    even = np.linspace(0.0, 1.0, 5)
    mesh = box_mesh(None, None, axes=(even / flat, even, even), split=split)
    t = Topology.of(mesh, cut_domain(mesh, ConvexBodies.empty(), "single"))
    u = np.random.default_rng(0).normal(size=(len(t.nodes), 3))
    cells, line = np.arange(len(t.cells)), Waterline(-np.ones(len(u)), t.beside_solid, -np.inf)
    momentum, energy = t.node_volume @ u, t.node_volume @ (u * u).sum(axis=1)
    for _ in range(40):
        before = energy
        damp_divergence(WetCells(cells, np.ones(len(cells))), 0.05, line, u, t.fluid_cells)
        energy = t.node_volume @ (u * u).sum(axis=1)
        assert energy <= before * (1.0 + 1e-13)
    np.testing.assert_allclose(t.node_volume @ u, momentum, rtol=0, atol=1e-13 * t.node_volume.sum())


def test_divergence_damping_of_a_flat_cell_is_the_term_at_its_bound():
    """Nodes of a single flat cell: the change is -|e| c (div u) ∇N / m with c = 1/(2 Σ|∇N|²) instead of c_L l²."""
    nodes = np.array([[0.0, 0, 0], [0.01, 0, 0], [0, 1, 0], [0, 0, 1]])
    mesh = Background.from_arrays(nodes, np.array([[0, 1, 2, 3]]))
    t = Topology.of(mesh, cut_domain(mesh, ConvexBodies.empty(), "single"))
    u = np.random.default_rng(0).normal(size=(4, 3))
    steep = np.array([[-100.0, -1, -1], [100, 0, 0], [0, 1, 0], [0, 0, 1]])[np.argsort(t.cells[0])]
    expected = u - 4.0 * (u * steep).sum() * steep / (2.0 * (steep**2).sum())
    line = Waterline(-np.ones(4), t.beside_solid, -np.inf)
    damp_divergence(WetCells(np.arange(1), np.ones(1)), 0.05, line, u, t.fluid_cells)
    np.testing.assert_allclose(u, expected, rtol=0, atol=1e-12)


@EXAMPLES
@CUTS
def test_viscous_stress(n, seed, covers):
    domain = cut(n, seed, covers)
    t, cells, u = laid_out(domain)
    rate, weight = np.zeros_like(u), 2.0 * 0.7 * t.volume
    edges, corners = _unshared_edges(weight), _corners(t, cells)
    strain = edge_strain(cells, weight, edges, u, t.hats)
    spread_stress(cells, weight, edges, corners, strain, t.hats, rate)
    vector = reference_forms.vector_basis_of(domain)
    stiffness = asm(reference_forms.viscous, vector, mu=0.7)
    same(-rate, (stiffness @ reference_forms.by_component(u)).reshape(-1, 3))


def _unshared_edges(weight):
    """Edges that each cell has for itself: nothing is smoothed, as in the forms."""
    return StrainEdges.of(np.repeat(np.arange(len(weight))[:, None], 6, axis=1), weight)


def _corners(t, cells):
    return NodeCorners.of(cells, t.cells, np.arange(len(t.nodes)), len(t.nodes))


@EXAMPLES
@CUTS
def test_stress_on_wetted_faces(n, seed, covers):
    """Symmetric Nitsche terms at bodies at rest, with a penalty that differs from face to face."""
    domain = cut(n, seed, covers)
    if len(domain.face_cell) == 0:
        return
    t, cells, u = laid_out(domain)
    basis, normal = reference_forms.vector_surface_basis_of(domain)
    penalty = np.random.default_rng(1).uniform(1.0, 50.0, len(domain.face_cell))
    hat = np.ascontiguousarray(np.moveaxis(_hats(domain), 0, 2))
    arm = domain.face_points - domain.body_centre[domain.face_body][:, None]
    area = np.repeat(domain.face_area[:, None] / 3.0, 3, axis=1)
    normals, drag = np.ascontiguousarray(domain.face_normal), np.zeros(len(penalty))
    walls = Walls(
        domain.face_cell.astype(np.int64),
        domain.face_cell.astype(np.int64),  # every cell is listed
        domain.face_body.astype(np.int64),
        normals,
        hat,
        arm,
        area,
        penalty,
        drag,
    )
    rate, load = np.zeros_like(u), np.zeros((domain.n_bodies, 6))
    still = np.zeros((domain.n_bodies, 6))
    weight = 2.0 * 0.7 * t.volume
    edges, corners = _unshared_edges(weight), _corners(t, cells)
    strain = edge_strain(cells, weight, edges, u, t.hats)
    flux = np.zeros_like(strain)
    wall_stress(walls, 0.7, u, still, edges, (strain, flux), t.cells, rate, load)
    spread_stress(cells, weight, edges, corners, flux, t.hats, rate)
    form = asm(reference_forms.nitsche, basis, mu=0.7, n=normal, penalty=forms.per_cell(basis, penalty))
    reached = form.shape[0] // 3  # scikit-fem numbers nodes up to the highest one of its cells
    same(-rate[:reached], (form @ reference_forms.by_component(u[:reached])).reshape(-1, 3))
    assert not rate[reached:].any()


def _hats(domain):
    """Hat functions (4, S, 3) at the points of the wetted polygons, from scikit-fem."""
    basis, _ = reference_forms.surface_basis(domain)
    return np.array([np.asarray(field[0]) for field in basis.basis])


@EXAMPLES
@CUTS
def test_coupling_of_every_body(n, seed, covers):
    """All six columns of G of each body: its motion along and about each axis, on its own faces."""
    domain = cut(n, seed, covers)
    if len(domain.face_cell) == 0:
        return
    basis, normal = reference_forms.surface_basis(domain)
    G = wetted_coupling(domain).toarray()[: basis.N]
    scale = np.abs(G).max()
    for body in range(domain.n_bodies):
        own = normal * (domain.face_body == body)[None, :, None]
        centre = tuple(domain.body_centre[body])
        for axis, along in enumerate(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))):
            pushed = asm(reference_forms.push, basis, n=own, m=along)
            turned = asm(reference_forms.twist, basis, n=own, m=along, centre=centre)
            found = G[:, 6 * body + axis], G[:, 6 * body + 3 + axis]
            np.testing.assert_allclose(found, (pushed, turned), rtol=0, atol=1e-12 * scale)


@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_projection_is_stabilised_by_the_pressure(covers):
    """The nodal velocity after a step balances mass with PSPG: ∫ u·∇q dV - ∫ τ R·∇q dV = 0 with τ = dt and the part
    R = (∇x - Π∇x)/ρ of the pressure gradient that nodes cannot hold."""
    plate = ConvexBodies.boxes(
        [[0.52, 0.5, 0.5]], [[0.03, 0.6, 0.7]], [Rotation.from_rotvec([0.1, 0.2, 0]).as_matrix()]
    )
    water = tank([1, 1, 1], 1 / 6, lambda x: x[:, 2] - 10.0, plate, covers=covers)
    t, dt = water.topology, 0.01
    water.velocity[:] = np.random.default_rng(3).normal(size=water.velocity.shape)
    problem = water.predict(dt)
    x = np.zeros(len(t.nodes))
    x[problem.dofs] = solve(problem.matrix, problem.rhs, problem.guess, 1e-12).x
    cells, star = problem.predicted.wet_cells, problem.predicted.u_star
    gradient = cell_gradient(cells, x, t.cells, t.parent, t.gradients) / problem.density
    mean = nodal_mean(WetCells(cells, np.ones(len(cells))), gradient, t.fluid_cells, len(x))
    basis = forms.basis_of(water.domain)
    left = np.repeat(gradient.T[:, :, None], 4, axis=2)
    tau = forms.per_cell(basis, np.full(len(t.cells), dt))
    stabilised = asm(reference_forms.pspg, basis, tau=tau, R=left - forms.at_points(basis, mean))
    unbalanced = asm(reference_forms.inflow, basis, u=forms.at_points(basis, star - dt * mean))
    # what is left is the compliance of the closed tank, 1e-8 of the pressure matrix
    np.testing.assert_allclose(unbalanced + stabilised, 0.0, atol=1e-6 * np.abs(unbalanced).max())
    assert (
        np.abs(stabilised).max()
        > 0.01 * np.abs(asm(reference_forms.inflow, basis, u=forms.at_points(basis, star))).max()
    )


def test_the_water_line_is_found_among_the_cells_near_solids():
    """Damping goes over these alone, and gives the digits that it gives if all wet cells are looked at; beside a
    solid the velocity changes."""
    post = ConvexBodies.boxes([[0.52, 0.37, 0.4]], [[0.15, 0.25, 0.8]])
    water = tank([1.0, 0.75, 1.0], 0.125, lambda x: x[:, 2] - 0.5 - 0.2 * x[:, 0], post)
    t, wet = water.topology, water.level_set < 0.0
    rows = np.flatnonzero(wet[t.cells].any(axis=1))
    cells, line = WetCells(rows, np.ones(len(rows))), Waterline(water.level_set, t.beside_solid, -0.25)
    before = np.random.default_rng(7).normal(size=t.nodes.shape)
    of_all, of_some = before.copy(), before.copy()
    damp_waterline(cells, 0.3, line, wet, of_all, t.fluid_cells)
    damp_waterline(cells, 0.3, line, wet, of_some, t.fluid_cells, t.cells_near_solids)
    np.testing.assert_array_equal(of_some, of_all)
    changed = (of_all != before).any(axis=1)
    assert 0 < changed.sum() < wet.sum()
    assert len(t.cells_near_solids) < len(t.cells)
