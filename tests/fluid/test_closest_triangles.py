"""Layers of nodes and distances handed on through them: what one loop finds, on any number of threads."""

import numpy as np
import pytest

import kernels.threads as threads
from fluid.cut.bodies import ConvexBodies
from fluid.domain.layers import layers_around
from fluid.domain.physical_domain import cut_domain
from fluid.domain.topology import Topology
from fluid.mesh.arrays import Corners
from fluid.mesh.background import Background, box_mesh
from fluid.surface import closest_triangles
from fluid.surface.closest_triangles import Surface, squared_distance, squared_distances
from fluid.surface.level_set import EXACT_LAYERS, FAR, redistance, surface_cells, surface_triangles
from kernels.decorators import plain

H = 1.0 / 14
DEPTH = 6


@plain
def _square(p, t):
    """`squared_distance`, which only kernels can call."""
    return squared_distance(p, t)


@pytest.fixture
def number():
    """Sets the number of threads, which divide every loop, however short."""
    yield lambda n: threads.use(n, least=1)
    threads.use(1)


def _rough(x):
    """A surface with drops and holes, of waves of a few cells."""
    wave = np.random.default_rng(3).uniform(4.0, 30.0, (12, 3))
    return x[:, 2] - 0.5 + 0.06 * np.sin(x @ wave.T + np.arange(12)).sum(axis=1)


@pytest.fixture(scope="module", params=["bricks", "moved"])
def topology(request):
    """Cells of bricks; and the same with moved nodes, some of them obtuse."""
    mesh = box_mesh((0, 0, 0), (1, 1, 1), H)
    if request.param == "moved":
        x = mesh.nodes.copy()
        move = np.random.default_rng(1).uniform(-0.25 * H, 0.25 * H, x.shape)
        move[(x < 1e-9) | (x > 1 - 1e-9)] = 0
        mesh = Background.from_arrays(x + move, mesh.cells)
    t = Topology.of(mesh, cut_domain(mesh, ConvexBodies.empty()))
    assert t.is_obtuse == (request.param == "moved")
    return t


def _of_one_loop(seed, start, around):
    order, ends = [int(i) for i in np.flatnonzero(seed)], [0, int(seed.sum())]
    for layer in range(DEPTH):
        for i in order[ends[layer] : ends[layer + 1]]:
            order += [j for j in dict.fromkeys(around[start[i] : start[i + 1]].tolist()) if j not in order]
        ends.append(len(order))
    return order, ends


def test_layers_have_the_order_of_one_loop(topology, number):
    seed = np.abs(_rough(topology.nodes)) < 0.2 * H
    order, ends = _of_one_loop(seed, *topology.around)
    for n in (1, 2, 3, 4, 7):
        number(n)
        found = layers_around(seed, DEPTH, *topology.around)
        assert found.order.tolist() == order
        assert found.start.tolist() == ends
        place = np.full(len(seed), -1)
        place[order] = np.arange(len(order))
        np.testing.assert_array_equal(found.place, place)


def _scene(t):
    phi = _rough(t.nodes)
    cut = surface_cells(phi, t)
    front = np.zeros(len(phi), bool)
    front[t.cells[cut]] = True
    return layers_around(front, DEPTH, *t.around), Surface(*surface_triangles(cut, phi, t.nodes, t.cells))


def _handed_on(t, layers, surface):
    """Two sweeps over each layer, node by node: what each holds is seen by all that come later."""
    start, around = t.around
    best, closest = np.full(len(t.nodes), np.inf), np.full(len(t.nodes), -1)

    def test(i, k):
        d = _square(t.nodes[i], surface.triangles[k])
        if d < best[i]:
            best[i], closest[i] = d, k

    for k, e in enumerate(surface.owner):
        for i in t.cells[e]:
            test(i, k)
    for begin, end in zip(layers.start[1:], layers.start[2:]):
        for i in 2 * layers.order[begin:end].tolist():
            for j in around[start[i] : start[i + 1]]:
                if closest[j] >= 0:
                    test(i, closest[j])
    return best[layers.order]


def test_distances_are_those_of_one_loop(topology, number, monkeypatch):
    """Bit for bit, although the parts of a layer begin at other nodes each time. Without the second look at nodes
    behind other parts they would not be."""
    t = topology
    layers, surface = _scene(t)
    expected, mesh = _handed_on(t, layers, surface), Corners(t.nodes, t.cells)
    for n in (1, 2, 3, 4, 7):
        number(n)
        found = squared_distances(layers, surface, mesh, t.around, None)
        np.testing.assert_array_equal(found, expected)
    monkeypatch.setattr(closest_triangles, "_mend", lambda *_: None)
    assert (squared_distances(layers, surface, mesh, t.around, None) != expected).any()


def test_a_level_set_has_the_same_bits_on_any_number_of_threads(topology, number):
    """Nodes of the first layers go on from the triangle handed to them."""
    t, found = topology, []
    for n in (1, 2, 3, 4):
        number(n)
        found.append(redistance(t, _rough(t.nodes), t.node_size, rescale=True))
    for other in found[1:]:
        np.testing.assert_array_equal(other, found[0])


def test_the_layers_beside_the_surface_find_the_closest_triangle_of_all(topology):
    """A drop of nine cells. Of 50 nodes one ends at a triangle from which all around are farther, up to 0.12 cells
    beyond the closest; what neighbours hand on is too far from two of three nodes, by up to 0.24 cells."""
    t = topology
    phi = np.linalg.norm(t.nodes - [0.47, 0.52, 0.49], axis=1) - 4.5 * H
    cut = surface_cells(phi, t)
    front = np.zeros(len(phi), bool)
    front[t.cells[cut]] = True
    layers, surface = (
        layers_around(front, EXACT_LAYERS, *t.around),
        surface_triangles(cut, phi, t.nodes, t.cells)[0],
    )
    beside = layers.order[layers.start[1] :]
    exact = np.sqrt([min(_square(x, triangle) for triangle in surface) for x in t.nodes[beside]])
    exact = np.minimum(exact, FAR * t.node_size[beside])
    excess = np.abs(redistance(t, phi, t.node_size, rescale=False)[beside]) - exact
    assert excess.min() > -1e-12
    assert (excess > 1e-6 * H).mean() < 0.03
    assert excess.max() < 0.13 * H


def test_a_triangle_without_area_ends_no_search():
    """Level water up to a layer of nodes of which round-off wets one in ten: the surface passes through cells beside
    the layer in triangles of which two corners coincide. Nodes that were handed one of these stopped there, up to 0.24
    cells beyond the surface."""
    mesh = box_mesh((0, 0, 0), (1, 1, 1), 0.1)
    t = Topology.of(mesh, cut_domain(mesh, ConvexBodies.empty()))
    height, film = t.nodes[:, 2] - 0.7, np.random.default_rng(19).random(len(t.nodes)) < 0.1
    phi = np.where(np.abs(height) < 1e-9, np.where(film, -1e-10, 1e-17), height)
    near = np.abs(height) < 0.25
    np.testing.assert_allclose(redistance(t, phi, t.node_size, rescale=False)[near], height[near], atol=1e-9)
