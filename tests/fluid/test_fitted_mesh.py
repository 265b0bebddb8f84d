"""A mesh that fits the bed: conforming, closed, exact in volume, with cells of bounded shape; water at rest on it."""

import numpy as np
import pytest
from skfem import MeshTet

from fluid.mesh.background import MeshError, box_mesh
from fluid.mesh.fitted_mesh import fitted_mesh


def wavy(x, y):
    return 0.5 * np.sin(x) + 0.4 * np.cos(1.3 * y + x)


def smallest_angle(mesh):
    """Smallest dihedral angle [degrees] of all cells."""
    n = -mesh.gradients / np.linalg.norm(mesh.gradients, axis=2, keepdims=True)
    cosine = -np.einsum("eak,ebk->eab", n, n) - 2.0 * np.eye(4)
    return np.degrees(np.arccos(cosine.max()))


def in_space(mesh):
    """The cells by the places of their corners, sorted: whatever the numbers of nodes and cells."""
    place = np.rint(mesh.nodes * 1e6).astype(np.int64) @ np.array([1, 10**7, 10**14])
    return sorted(map(tuple, np.sort(place[mesh.cells], axis=1)))


@pytest.mark.parametrize("split", ["kuhn", "mirrored"])
def test_a_level_bed_gives_the_cells_of_a_box(split):
    fitted = fitted_mesh((0, 0, -9), (4, 3, 2), 0.5, lambda x, y: 0 * x, split=split)
    assert in_space(fitted.mesh) == in_space(box_mesh((0, 0, 0), (4, 3, 2), 0.5, split=split))
    assert fitted.layer == 0.5
    assert fitted.lowered == 0


@pytest.mark.parametrize("follow", [0.0, 0.2, 0.5])
def test_the_cells_fill_the_space_over_the_bed(follow):
    """Closed surface, volume between the lid and the planes through the corners of the bed, no face but on the box and
    the bed: so the cells share whole faces everywhere."""
    fitted = fitted_mesh((0, 0, -1), (16, 6, 3), 0.5, wavy, follow=follow)
    m = fitted.mesh
    x = m.nodes[m.boundary_faces]
    area = 0.5 * np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    assert np.abs(area.sum(axis=0)).max() < 1e-12 * np.abs(area).sum()
    on_box = [
        (x[:, :, k] == end).all(axis=1) for k, ends in enumerate([(0, 16), (0, 6), (3,)]) for end in ends
    ]
    assert np.all(np.sum(on_box, axis=0) + fitted.bed_face == 1)
    assert area[fitted.bed_face, 2].sum() == pytest.approx(-16 * 6)
    under = np.einsum("fk,fk->f", area[fitted.bed_face], x[fitted.bed_face].mean(axis=1) * [0, 0, 1])
    assert m.cell_volume.sum() == pytest.approx(3 * 16 * 6 + under.sum(), rel=1e-12)
    bed = m.nodes[fitted.on_bed]
    assert np.allclose(bed[:, 2], wavy(bed[:, 0], bed[:, 1]), atol=1e-14)
    assert m.cell_volume.min() > 0.4 * fitted.layer * 0.25 / 6
    assert smallest_angle(m) > 15.0
    assert MeshTet(m.nodes.T.copy(), m.cells.T.copy()).is_valid()


def test_a_gentle_bed_is_followed_by_whole_bricks():
    """On a beach all cells but those under the lid have the volume of a brick's sixth, whatever the depth."""
    fitted = fitted_mesh((0, 0, 0), (40, 1, 3), 0.5, lambda x, y: x / 20)
    m = fitted.mesh
    low = m.nodes[m.cells][:, :, 2].max(axis=1) < 3.0
    assert np.allclose(m.cell_volume[low], 0.125 / 6)
    assert low.mean() > 0.5


def test_land_above_the_lid_is_left_out():
    fitted = fitted_mesh((0, 0, -2), (20, 4, 1), 0.5, lambda x, y: 0.4 * (x - 10))
    m = fitted.mesh
    assert fitted.lowered > 0
    assert np.isnan(fitted.bed[-1]).all()
    assert m.bounds[1, 0] < 14.0
    assert m.bounds[0, 2] == -4.0


def test_what_cannot_be_a_mesh_is_refused_with_the_place():
    box = (0, 0, -1), (10, 5, 2), 0.5
    with pytest.raises(MeshError, match=r"4 m per metre .* at \(4.5, 0\).*smooth"):
        fitted_mesh(*box, lambda x, y: np.where(x > 4.7, 1.0, -1.0))
    with pytest.raises(MeshError, match=r"no elevation at \(5, 2\).*fill"):
        fitted_mesh(*box, lambda x, y: np.where((x == 5) & (y == 2), np.nan, -1.0))
    with pytest.raises(MeshError, match=r"nowhere lower than 1\.75 m"):
        fitted_mesh(*box, lambda x, y: 0 * x + 1.9)
    with pytest.raises(MeshError, match="more slender"):
        fitted_mesh(*box[:2], (2.0, 0.5, 0.1), lambda x, y: 0 * x)
