"""The shift of the surface that brings the volume of the nodes to what it is to be."""

import numpy as np
import pytest
from numpy.random import default_rng as rng

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.fitted_mesh import fitted_mesh
from fluid.mesh.refinement import OnBed, refined_mesh
from fluid.numerics.fields import places_of
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from fluid.surface.shift import rows_of_shift

SLOPE, LEVEL = 0.25, 0.5


def bed(x, _):
    return SLOPE * x


def on_a_beach(levels):
    """Water at rest on a slope of 1:4, in cells seven times as long as high."""
    fitted = fitted_mesh((0, 0, 0), (3, 0.8, 1), (0.4, 0.4, 0.06), bed)
    finer = [OnBed(bed, LEVEL - 0.1, LEVEL + 0.1, 0.1, levels)] if levels else []
    mesh = refined_mesh(fitted.mesh, finer, fitted.lattice)
    return Water(
        mesh, cut_domain(mesh, ConvexBodies.empty(), "single"), lambda x: x[:, 2] - LEVEL, WaterParameters()
    )


@pytest.mark.parametrize("kappa", [1.0, 5.0])
@pytest.mark.parametrize("levels", [0, 1, 2])
def test_water_that_one_node_lacks_raises_the_surface_and_by_no_more_than_alone(levels, kappa):
    """c ψ + κ K ψ = r spreads r as heat is conducted: for r = c s at one node, 0 ≤ ψ ≤ s everywhere.

    K has positive entries opposite obtuse angles, with which what one node lacks lowers the surface at others. Worse,
    the part of K between the nodes of a band may have negative eigenvalues: conjugate gradients then once in a while
    made a decimetre of a tenth of a millimetre, and a run-up that was going back jumped up by a cell."""
    water = on_a_beach(levels)
    t = water.topology
    assert t.is_obtuse
    graph = water.graph_for(water.listed)
    near = np.abs(water.level_set[water.listed]) < 3.0 * t.node_size[water.listed]
    band = np.sort(water.listed[near])
    place, c, random = places_of(band, len(t.nodes)), 0.1 * t.node_volume[band] / t.node_size[band], rng(0)
    rows = rows_of_shift(band, place, graph.edges, c, kappa, t.node_size)
    for node in random.integers(0, len(band), 20):
        wanted = np.zeros(len(band))
        wanted[node] = c[node]
        found = rows.shift(wanted, 1e-9, 2000)
        assert 0.0 < found[node] <= 1.0
        assert -1e-6 * found[node] < found.min()
        assert found.max() <= found[node]
