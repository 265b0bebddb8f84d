"""Domains that are cut, and whose covers are searched, only near moved bodies: the same as made afresh, bit for bit."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fluid.cut import cut_arrays
from fluid.cut import openings as contacts
from fluid.cut.bodies import ConvexBodies
from fluid.domain.covers import Connection, components, without_pockets
from fluid.domain.incidence import first_rows
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import Background, box_mesh

N = 6
H = 1 / N
SHARP = Connection(inner=0.1, face=0.2)
BOX = box_mesh((0, 0, 0), (1, 1, 1), H)


def jittered():
    """General tetrahedra in the cube: inner nodes off the lattice."""
    x = BOX.nodes.copy()
    move = np.random.default_rng(0).uniform(-0.15, 0.15, x.shape) * H
    move[(x < 1e-9) | (x > 1 - 1e-9)] = 0
    return Background.from_arrays(x + move, BOX.cells)


GENERAL = jittered()


def assert_same(domain, full):
    """Every array of the domain, and the contacts that the next cut starts from."""
    for f in dataclasses.fields(full):
        if f.name != "memory":
            np.testing.assert_array_equal(getattr(domain, f.name), getattr(full, f.name), err_msg=f.name)
    for a, b in zip(domain.memory.contacts, full.memory.contacts):
        np.testing.assert_array_equal(a, b)


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 12),
    thinnest=st.sampled_from([0.01, 0.1]),
    share=st.sampled_from([0.0, 0.3, 1.0]),
    general=st.booleans(),
    connection=st.sampled_from([None, SHARP, Connection(face=0.5)]),
)
def test_a_domain_made_from_the_one_before_equals_a_new_one(seed, n, thinnest, share, general, connection):
    """Bodies of all thicknesses, overlapping, through the sides, thin walls across the cube; some move, slightly (as in
    a step) or far, some turn, some grow. Thresholds compare areas over the whole mesh, also those that were kept."""
    random = np.random.default_rng(seed)
    mesh = GENERAL if general else BOX
    size = random.uniform(thinnest, 0.5, (n, 3))
    size[0] = [2, 2, 0.3 * H]
    reference = ConvexBodies.boxes(np.zeros((n, 3)), size)
    centre, turn = random.uniform(0, 1, (n, 3)), Rotation.random(n, rng=random)
    growth = np.zeros(6 * n)
    domain = cut_domain(mesh, reference.moved(centre, turn.as_matrix()), "multiple", connection=connection)
    for step in range(3):
        moved = random.random(n) < share
        far = H * 10.0 ** random.uniform(-4, 0.5)
        centre = centre + moved[:, None] * random.normal(0, far, (n, 3))
        turn = Rotation.from_rotvec(moved[:, None] * random.normal(0, 0.1, (n, 3))) * turn
        growth = np.where(np.repeat(random.random(n) < 0.2, 6), 1e-3 * H * step, growth)
        bodies = reference.moved(centre, turn.as_matrix()).grown(growth)
        domain = cut_domain(mesh, bodies, "multiple", previous=domain, connection=connection)
        assert_same(domain, cut_domain(mesh, bodies, "multiple", connection=connection))


def test_only_cells_near_the_moved_body_are_searched(monkeypatch):
    """Of two bodies at opposite corners one moves: the contacts of the other are not found again."""
    searched = []
    find = contacts._find

    def counted(cells, *rest):
        searched.append(len(cells))
        find(cells, *rest)

    monkeypatch.setattr(contacts, "_find", counted)
    size = [[0.2, 0.2, 0.2], [0.6, 0.6, 0.3]]
    domain = cut_domain(BOX, ConvexBodies.boxes([[0.15, 0.15, 0.15], [0.6, 0.6, 0.8]], size), "multiple")
    cut_domain(
        BOX,
        ConvexBodies.boxes([[0.16, 0.15, 0.15], [0.6, 0.6, 0.8]], size),
        "multiple",
        previous=domain,
    )
    assert 0 < searched[1] < 0.4 * searched[0]


def test_a_step_without_motion_searches_nothing(monkeypatch):
    domain = cut_domain(BOX, ConvexBodies.boxes([[0.5, 0.5, 0.5]], [[0.3, 2, 2]]), "multiple")
    searched = []
    monkeypatch.setattr(contacts, "_find", lambda cells, *rest: searched.append(len(cells)))
    again = cut_domain(BOX, domain.memory.bodies, "multiple", previous=domain)
    assert searched == [0]
    assert_same(again, domain)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), least=st.sampled_from([0.0, 0.5, 1.0, 3.0]))
def test_pockets_are_the_components_below_the_limit(seed, least):
    """Against the definition: add up the volume of every component of the whole mesh."""
    random = np.random.default_rng(seed)
    cells = np.sort(random.choice(40, (12, 4)), axis=1)
    volume = random.choice([1e-6, 0.2, 0.5, 1.5], 12)
    label = components(cells, 40)
    expected = np.bincount(label, volume)[label] >= least
    np.testing.assert_array_equal(without_pockets(cells, volume, 40, least), expected)


@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_bodies_that_leave_the_tank_leave_the_whole_mesh(covers):
    inside = ConvexBodies.boxes([[0.5, 0.5, 0.5]], [[0.3, 0.3, 0.3]])
    domain = cut_domain(BOX, inside, covers)
    gone = cut_domain(BOX, inside.moved([[5.0, 5.0, 5.0]]), covers, previous=domain)
    np.testing.assert_array_equal(gone.volume, BOX.cell_volume)
    np.testing.assert_array_equal(gone.cells, BOX.cells)


@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_a_domain_does_not_depend_on_the_room_that_the_cut_begins_with(covers, monkeypatch):
    """Room that is too small is doubled in the middle of a cell; what stood in it before is in nothing that is
    returned."""
    random = np.random.default_rng(5)
    bodies = ConvexBodies.boxes(random.uniform(0, 1, (9, 3)), random.uniform(0.1, 0.5, (9, 3)))
    full = cut_domain(GENERAL, bodies, covers)
    monkeypatch.setattr(cut_arrays, "ROOM", cut_arrays.Room(0, 0, 0, 0, 0))
    monkeypatch.setattr(cut_arrays, "SPARE", 1)
    monkeypatch.setattr(cut_arrays, "np", SimpleNamespace(**(vars(np) | {"empty": np.ones})))
    domain = cut_domain(GENERAL, bodies, covers)
    for f in dataclasses.fields(full):
        if f.name != "memory":
            np.testing.assert_array_equal(getattr(domain, f.name), getattr(full, f.name), err_msg=f.name)


def test_old_rows_and_new_rows_are_those_of_the_cells():
    """First rows of cells in an ascending list, against a search; centroids, against means of corners and moments."""
    parents = np.sort(np.random.default_rng(1).integers(0, 50, 80)).astype(np.uint32)
    np.testing.assert_array_equal(first_rows(parents, 60), np.searchsorted(parents, np.arange(61)))
    domain = cut_domain(GENERAL, ConvexBodies.boxes([[0.5, 0.5, 0.5]], [[0.3, 0.3, 0.3]]), "multiple")
    whole = domain.part < 0
    corners = GENERAL.nodes[GENERAL.cells[domain.parent_cell[whole]]]
    np.testing.assert_allclose(domain.centroid[whole], corners.mean(axis=1), rtol=1e-14)
    moments = domain.memory.cuts.moments[domain.part[~whole], 1:4]
    np.testing.assert_array_equal(domain.centroid[~whole], moments)
