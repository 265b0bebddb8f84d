"""What is carried on one side of a thin wall never reaches the other, whatever the velocity."""

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fluid.cut.bodies import ConvexBodies
from fluid.domain.covers import components
from fluid.domain.physical_domain import cut_domain
from fluid.domain.topology import Topology
from fluid.transport.advection import feet
from tests.fluid.scenes import transport
from tests.fluid.test_thin_walls import BOX, MESH, H, bricks, plate, side_growth


def parted(mesh, bodies, normal, point):
    """Topology of the water that the bodies part, and the side 0 or 1 of every node."""
    domain = cut_domain(mesh, bodies, "multiple")
    t = Topology.of(mesh, domain)
    side = np.full(len(t.nodes), -1)
    side[t.cells] = ((domain.centroid - point) @ normal > 0)[:, None]
    assert components(domain.cells, len(domain.nodes)).max() == 1
    return t, side


def wild(seed, n, courant):
    """Velocities (N, 3) in all directions, up to `courant` cells in a unit of time, with a mean through the wall."""
    rng = np.random.default_rng(seed)
    return courant * H * (rng.normal(size=(n, 3)) / 2 + rng.normal(size=3))


def check_sides(t, side, seed, courant):
    """Three steps: a tracer keeps its two values to the bit, a velocity its two directions; all feet on their side."""
    u = wild(seed, len(t.nodes), courant)
    listed = np.flatnonzero(t.active)
    fields = [side == 1, np.where(side == 1, 3.0, -7.0), side == 0, np.where(side == 1, -7.0, 3.0)]
    fields = np.column_stack(fields).astype(float)
    start = fields.copy()
    for _ in range(3):
        velocity, level = (np.ascontiguousarray(f) for f in (fields[:, :3], fields[:, 3]))
        fields[listed] = transport(t, listed, 1.0, u, velocity, level, np.zeros(len(u), bool))
    np.testing.assert_allclose(fields[listed], start[listed], rtol=1e-13, atol=0)
    cell, _ = feet(listed, -1.0, 1.0, 3, u, t.paths)
    np.testing.assert_array_equal(side[t.cells[cell]], np.repeat(side[listed][:, None], 4, axis=1))


@settings(max_examples=25, deadline=None)
@given(
    thickness=st.floats(0.01, 1.2),
    at=st.floats(0.35, 0.65),
    tilt=st.floats(-20, 20),
    yaw=st.floats(-20, 20),
    courant=st.floats(0.1, 20),
    seed=st.integers(0, 10**6),
    general=st.booleans(),
)
def test_plates_across_the_tank(thickness, at, tilt, yaw, courant, seed, general):
    """A hundredth of a cell thick and more, paths up to many cells long."""
    bodies, normal, point = plate(thickness, at, tilt, yaw)
    t, side = parted(MESH if general else BOX, bodies, normal, point)
    check_sides(t, side, seed, courant)


@settings(max_examples=10, deadline=None)
@given(angle=st.sampled_from([0.0, 1e-7, 1e-4]), courant=st.floats(0.5, 10), seed=st.integers(0, 10**6))
def test_bonded_walls(angle, courant, seed):
    """Five by five blocks with noisy joints, closed by their state."""
    bodies = side_growth(bricks(5, 0.3 * H, 0.0, angle, seed), angle + 1e-7)
    t, side = parted(MESH, bodies, np.array([1.0, 0, 0]), np.array([0.52, 0.5, 0.5]))
    check_sides(t, side, seed, courant)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10**6), courant=st.floats(0.5, 10))
@example(seed=759, courant=1.0)
def test_closed_boxes(seed, courant):
    """The water within six plates, turned any way, and the water round them: two waters of the exact volumes.

    The centroid of a cell does not tell on which side it lies: with seed 759 two cells outside reach round an edge of
    the box, and the middle of their water falls within it."""
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    thickness, inner, centre, size = 0.2 * H, 3.0 * H, [], []
    for axis in range(3):
        for sign in (-1, 1):
            c, d = np.zeros(3), np.full(3, inner + 2 * thickness)
            c[axis], d[axis] = sign * (inner + thickness) / 2, thickness
            centre.append(turn @ c + 0.5)
            size.append(d)
    domain = cut_domain(MESH, ConvexBodies.boxes(centre, size, np.repeat(turn[None], 6, axis=0)), "multiple")
    t = Topology.of(MESH, domain)
    water = components(domain.cells, len(domain.nodes))
    volume = sorted(np.bincount(water, domain.volume))
    np.testing.assert_allclose(volume, [inner**3, 1 - (inner + 2 * thickness) ** 3], rtol=1e-9)
    side = np.full(len(t.nodes), -1)
    side[t.cells] = water[:, None]
    check_sides(t, side, seed, courant)
