"""Bodies that lie near one another: which pairs are found, and which faces have another surface before them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fluid.cut.bodies import ConvexBodies
from fluid.cut.facing import facing, near_bodies


def by_hand(low, high, loose, reach):
    """All pairs one by one."""
    return [
        [
            b
            for b in range(len(low))
            if b != a
            and (loose[a] or loose[b])
            and (low[a] <= high[b] + reach).all()
            and (low[b] <= high[a] + reach).all()
        ]
        for a in range(len(low))
    ]


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("seed", range(3))
def test_every_near_pair_is_found_once_and_in_order(axis, seed):
    """Boxes of very different sizes, one as long as them all, spread along each of the axes; some touch exactly."""
    random = np.random.default_rng(seed)
    spread = np.where(np.arange(3) == axis, 40.0, 6.0)
    low = np.round(random.uniform(0.0, spread, (150, 3)))
    high = low + np.round(random.uniform(0.0, 3.0, (150, 3)))
    high[7] = low[7] + spread
    loose = random.uniform(size=150) < 0.5
    for reach in (0.0, 1.0):
        start, members = near_bodies(low, high, loose, reach)
        found = [members[start[a] : start[a + 1]].tolist() for a in range(150)]
        assert found == by_hand(low, high, loose, reach)
    assert start[-1] > 100


def test_no_bodies_and_none_near():
    start, members = near_bodies(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, bool), 1.0)
    assert start.tolist() == [0]
    assert len(members) == 0
    low = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]])
    start, members = near_bodies(low, low + 1.0, np.ones(2, bool), 1.0)
    assert start.tolist() == [0, 0, 0]
    assert len(members) == 0


def faced_by_hand(bodies, body, centroid, normal, reach, bounds, loose):
    """Whether the ray from a centroid along the normal, as long as `reach`, meets another body or, where the own one is
    loose, a side of the tank."""
    end = centroid + reach * normal
    steep = np.abs(normal) > 0.5
    if loose[body] and (((end > bounds[1]) | (end < bounds[0])) & steep).any():
        return True
    for other in range(len(bodies)):
        own = slice(bodies.plane_start[other], bodies.plane_start[other + 1])
        along, room = bodies.normals[own] @ normal, bodies.cut_offsets()[own] - bodies.normals[own] @ centroid
        with np.errstate(divide="ignore"):
            first = np.where(along < 0.0, room / along, 0.0).max(initial=0.0)
            last = np.where(along > 0.0, room / along, reach).min(initial=reach)
        if other != body and (loose[body] or loose[other]) and first <= last:
            return True
    return False


@pytest.mark.parametrize("seed", range(3))
def test_faces_with_another_surface_before_them_are_those_whose_ray_meets_one(seed):
    """Turned boxes close to one another and to the sides of a tank, some grown, some drawn in, half of them loose."""
    random = np.random.default_rng(seed)
    n = 40
    centre = random.uniform(0.4, 3.6, (n, 3))
    turned = Rotation.from_quat(random.normal(size=(n, 4))).as_matrix()
    bodies = ConvexBodies.boxes(centre, random.uniform(0.2, 0.9, (n, 3)), turned)
    bodies = bodies.grown(random.uniform(-0.01, 0.02, len(bodies.normals)))
    loose, bounds = random.uniform(size=n) < 0.5, np.array([[0.0] * 3, [4.0] * 3])
    body = np.repeat(np.arange(n), np.diff(bodies.plane_start))
    normal = bodies.normals.copy()
    outwards = bodies.cut_offsets() - np.einsum("pk,pk->p", normal, centre[body])
    centroid = centre[body] + outwards[:, None] * normal
    reach = random.uniform(0.02, 0.6, len(body))
    found, plane = facing(bodies, (body, centroid, normal), reach, bounds, loose)
    polygons = zip(body, centroid, normal, reach)
    expected = [faced_by_hand(bodies, b, c, m, r, bounds, loose) for b, c, m, r in polygons]
    assert found.tolist() == expected
    assert plane.tolist() == list(range(len(body)))
    assert 0.1 < found.mean() < 0.9
