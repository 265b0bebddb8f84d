"""Water in cells that hold both solid and surface: exact, as if the air were one more solid."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.domain.topology import Topology
from fluid.mesh.background import box_mesh
from fluid.surface.volume import nodal_volume

N = 4
BOX = box_mesh((0, 0, 0), (1, 1, 1), 1 / N)
SEEDS = given(
    seed=st.integers(0, 2**32 - 1), n=st.integers(1, 6), covers=st.sampled_from(["single", "multiple"])
)
EXAMPLES = settings(max_examples=30, deadline=None)


def blocks(random, n):
    """Centres, sizes and turns of blocks from thin plates to ones that fill cells."""
    return random.uniform(0, 1, (n, 3)), random.uniform(0.02, 0.6, (n, 3)), Rotation.random(n, rng=random)


def placed(centre, size, turn):
    return ConvexBodies.boxes(np.zeros((len(size), 3)), size).moved(centre, turn.as_matrix())


@EXAMPLES
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 6), covers=st.sampled_from(["single", "multiple"]))
def test_the_tetrahedra_of_a_cell_fill_its_fluid_part(seed, n, covers):
    """∫ dV and ∫ N_a dV over the fans are those of the fluid part; whole cells have none."""
    domain = cut_domain(BOX, placed(*blocks(np.random.default_rng(seed), n)), covers)
    t = Topology.of(BOX, domain)
    of = np.repeat(np.arange(len(t.cells)), np.diff(domain.fan_start))
    moments = np.zeros(t.cells.shape)
    np.add.at(moments, of, domain.fan_volume[:, None] * domain.fan_corners.mean(axis=1))
    cut = domain.is_cut
    assert (np.diff(domain.fan_start)[~cut] == 0).all()
    np.testing.assert_allclose(moments[cut], (t.volume[:, None] * t.share[t.share_row])[cut], atol=1e-14)


@EXAMPLES
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 6))
def test_water_below_a_plane_is_what_a_solid_above_the_plane_leaves(seed, n):
    """The level set of a plane is linear in every cell: the volume at the nodes is that of a cut with one more block,
    whose underside is the plane.  Blocks that drown, emerge and cross the plane under any angle."""
    random = np.random.default_rng(seed)
    centre, size, turn = blocks(random, n)
    normal = Rotation.from_rotvec(random.uniform(-0.5, 0.5, 3)).as_matrix() @ [0.0, 0.0, 1.0]
    level = random.uniform(0.2, 0.8)
    upright, _ = Rotation.align_vectors(normal[None], [[0.0, 0.0, 1.0]])
    air = np.full(3, 0.5) + (level - 0.5) * normal + 5.0 * normal
    with_air = placed(
        np.vstack([centre, air]), np.vstack([size, [10.0] * 3]), Rotation.concatenate([turn, upright])
    )
    t = Topology.of(BOX, cut_domain(BOX, placed(centre, size, turn), "single"))
    expected = Topology.of(BOX, cut_domain(BOX, with_air, "single")).node_volume
    water = nodal_volume(t, (t.nodes - 0.5) @ normal - (level - 0.5))
    np.testing.assert_allclose(water, expected, atol=1e-12)
