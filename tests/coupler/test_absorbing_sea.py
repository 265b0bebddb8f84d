"""A solitary wave runs out of an absorbing sea: what comes back is measured at a gauge on its way."""

from dataclasses import replace

import numpy as np
import pytest

from coupler.checks.read_case import load
from coupler.geometry.solid_ground import raised_by
from coupler.geometry.tank_mesh import bed_along, bed_under, mesh_of
from coupler.run.clock import Clock
from coupler.scene.build import build
from coupler.scene.build_water import AbsorbingSideBlocked, _following
from fluid.mesh.background import box_mesh
from fluid.mesh.fitted_mesh import fitted_mesh
from fluid.readings.gauges import levels

CASE = """
[case]
title = "solitary wave out of the tank"
[time]
end = "19 s"
step_max = "0.1 s"
[tank]
lower = [0, 0, 0]
upper = [24, 0.5, 1.5]
cell = "0.25 m"
[water]
[[water.fill]]
lower = [0, 0, 0]
upper = [24, 0.5, 1]
[[water.inflow]]
kind = "solitary"
side = "x-"
level = 1
height = 0.1
crest = "4 s"
absorbs = true
[[water.sea]]
side = "x+"
level = 1
absorbs = true
"""


@pytest.mark.nightly
def test_at_most_a_twentieth_of_a_solitary_wave_comes_back(tmp_path):
    """Measured 12 m before the side, where the wave and what it leaves behind have passed when that arrives."""
    (tmp_path / "case.toml").write_text(CASE)
    scene = build(load(tmp_path).case, Clock())
    c, found = scene.coupling, []
    while c.time < 19.0:
        c.step(min(c.water.stable_step(), 0.1))
        found.append((c.time, levels(c.water, [(12.0, 0.25)])[0] - 1.0))
    time, level = np.array(found).T
    crest = level[time < 11.0].max()
    assert crest > 0.09
    assert np.abs(level[time > 12.5]).max() < 0.05 * crest


BEACH = """
[case]
title = "a beach beside a sea that absorbs"
[time]
end = "1 s"
[tank]
lower = [0, 0, -4]
upper = [10, 3, 3]
cell = "1 m"
open = ["z+"]
[terrain]
path = "beach.asc"
origin = [0, 0]
[water]
[[water.fill]]
lower = [0, 0, -4]
upper = [10, 3, LEVEL]
[[water.sea]]
side = "x-"
level = LEVEL
absorbs = true
"""


def beach(folder, slope: float, level: float):
    """A tank over ground that rises inwards from z = -2 m at the side x- on."""
    x, y = np.arange(-1.0, 12.0), np.arange(-1.0, 5.0)
    rows = np.tile(np.clip(-2.0 + slope * x, -2.5, 2.8), (len(y), 1))
    head = f"ncols {len(x)}\nnrows {len(y)}\nxllcenter {x[0]}\nyllcenter {y[0]}\ncellsize 1\n"
    (folder / "beach.asc").write_text(head + "\n".join(" ".join(f"{z:g}" for z in row) for row in rows))
    (folder / "case.toml").write_text(BEACH.replace("LEVEL", f"{level:g}"))
    return load(folder).case


def test_lines_enter_a_fitted_mesh_at_its_bed():
    def slope(x, y):
        return -1.0 + 0.3 * x - 0.1 * y

    mesh = fitted_mesh((0, 0, -2), (6, 4, 3), 0.5, slope).mesh
    places = np.array([[0.5, 0.5], [0.77, 3.1], [0.0, 4.0], [5.9, 0.01], [6.5, 1.0], [3.0, -0.1]])
    np.testing.assert_allclose(bed_under(mesh, places)[:4], slope(*places[:4].T), atol=1e-12)
    assert np.isnan(bed_under(mesh, places)[4:]).all()
    assert (bed_under(box_mesh((0, 0, -3), (2, 2, 1), 0.5), [[0.5, 0.5], [1.3, 0.2]]) == -3.0).all()


def test_absorbing_side_stands_on_the_bed_where_it_reads_the_water(tmp_path):
    """The bed a cell inside is 0.3 m higher than at the side: with the lower one a dry place was asked for its velocity
    in the ground, and water at rest seemed to be 0.3 m too low."""
    case = beach(tmp_path, 0.3, 0.0)
    scene = build(case, Clock())
    absorber = scene.coupling.water.sides.absorbers()[0]
    bed = -2.0 + 0.3 * absorber.places[:, 0]
    np.testing.assert_allclose(absorber.bed, bed, atol=1e-6)
    assert np.all(absorber.bed > bed_along(case.tank, "x-")[1:-1, 1] + 0.25)
    scene.coupling.water.predict(0.01)
    assert absorber.height == pytest.approx(0.0, abs=1e-9)
    assert absorber.speed == pytest.approx(0.0, abs=1e-9)


def test_absorbing_side_goes_on_when_the_water_has_left_it(tmp_path):
    """A ground of which only the strip at the side is below the sea: where the water is read it is dry."""
    scene = build(beach(tmp_path, 0.9, -1.5), Clock())
    absorber = scene.coupling.water.sides.absorbers()[0]
    assert (levels(scene.coupling.water, absorber.places) == 0.0).all()
    for _ in range(3):
        scene.coupling.step(0.02)
    assert np.isfinite(scene.coupling.water.velocity).all()


def test_absorbing_side_before_ground_up_to_the_lid_is_refused(tmp_path):
    case = beach(tmp_path, 0.3, 0.0)
    mesh = mesh_of(case.tank)
    beyond = replace(mesh, axes=(mesh.axes[0][0] + np.array([0.0, 20.0]), *mesh.axes[1:]))
    with pytest.raises(
        AbsorbingSideBlocked, match=r"side x- absorbs, but 20 m inside.*reaches its upper side"
    ):
        _following(case, case.water.sea[0], None, beyond)


HALF_FULL = """
[case]
title = "a sea beside a tank that is partly dry"
[time]
end = "1 s"
[tank]
lower = [0, 0, 0]
upper = [13, 2, 6.5]
cell = "0.5 m"
[water]
[[water.fill]]
lower = [0, 0, 0]
upper = [4.5, 2, 4]
[[water.sea]]
side = "y-"
level = 5
absorbs = true
"""


def test_an_absorbing_sea_stands_at_the_start_as_the_water_beside_it_lets_it(tmp_path):
    """It was at its own level for the start, and sank to what the dry floor leaves of it in the first step: a twentieth
    of the water was gone, and the run ended."""
    (tmp_path / "case.toml").write_text(HALF_FULL)
    coupling = build(load(tmp_path).case, Clock()).coupling
    water = coupling.water
    for _ in range(3):
        coupling.step(1e-3)
    assert water.volume() == pytest.approx(water.conserved_volume, rel=1e-3)
    assert water.sides.absorbers()[0].height < -0.5


def test_an_absorbing_sea_beside_water_at_its_level_is_left_at_it(tmp_path):
    """To the last digit: reading the level rounds."""
    (tmp_path / "case.toml").write_text(HALF_FULL.replace("upper = [4.5, 2, 4]", "upper = [13, 2, 5]"))
    side = build(load(tmp_path).case, Clock()).coupling.water.sides.absorbers()[0]
    assert (side.height, side.speed) == (0.0, 0.0)


ABOVE_THE_SEA = """
[case]
title = "water that stands above a sea that absorbs"
[time]
end = "1 s"
[tank]
lower = [0, 0, 0]
upper = [6, 1, 2]
cell = "0.375 m"
[water]
[[water.fill]]
lower = [0, 0, 0]
upper = [6, 1, 1.15]
[[water.sea]]
side = "x+"
level = 0.7
absorbs = true
"""


def test_water_above_a_sea_that_absorbs_stays_on_its_side(tmp_path):
    """Drawn at once by the 0.7 m/s to which the long wave leads, it came off the side down to the floor, while its
    volume left as if it had followed: within 9 ms, in steps of 0.3 ms, 5 % of the energy was gained."""
    (tmp_path / "case.toml").write_text(ABOVE_THE_SEA)
    coupling = build(load(tmp_path).case, Clock()).coupling
    water = coupling.water
    for _ in range(40):
        record = coupling.step(3e-4)
    x, _, z = water.topology.nodes.T
    beside = (x > 5.9) & (z < 0.1)
    assert water.pressure[beside].min() > 0.7 * 1000.0 * 9.81 * 1.15
    assert record.balance.energy_error < 1e-3


BED_OF_SOLIDS = """
[case]
title = "a sea over a bed of wedges"
[time]
end = "1 s"
[tank]
lower = [0, 0, 0]
upper = [4, 3, 2]
cell = "0.5 m"
[water]
[[water.fill]]
lower = [0, 0, 0]
upper = [4, 3, 1.2]
[[water.sea]]
side = "y-"
level = 1.2
absorbs = true
[[solid]]
name = "left"
vertices = [[0, 0, -0.5], [0, 0, 0.1], [0, 3, -0.5], [0, 3, 0.1],
  [2.12, 0, -0.5], [2.12, 0, 0.7], [2.12, 3, -0.5], [2.12, 3, 0.7]]
[[solid]]
name = "right"
vertices = [[4, 0, -0.5], [4, 0, 1.5], [4, 3, -0.5], [4, 3, 1.5],
  [2.12, 0, -0.5], [2.12, 0, 0.7], [2.12, 3, -0.5], [2.12, 3, 0.7]]
"""


def box(lower, upper):
    """A box as (vertices, faces)."""
    corners = np.array(
        [[(lower, upper)[(k >> axis) & 1][axis] for axis in range(3)] for k in range(8)], float
    )
    return corners, [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]


def test_solids_that_stand_on_the_bed_or_on_one_another_are_ground():
    solids = [box([0, 0, 1], [1, 1, 2]), box([0, 0, 0], [2, 2, 1]), box([0, 0, 2.5], [2, 2, 3])]
    places = np.array([[0.5, 0.5], [1.5, 0.5], [2.5, 0.5]])
    np.testing.assert_allclose(raised_by(np.zeros(3), places, solids), [2.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(raised_by(np.full(3, -0.5), places, solids), -0.5)
    wedge = box([0, 0, -1], [4, 2, 1])
    wedge[0][:, 2] += 0.25 * wedge[0][:, 0]
    np.testing.assert_allclose(raised_by(np.zeros(3), places, [wedge]), 1.0 + 0.25 * places[:, 0])


def test_an_absorbing_sea_over_a_bed_of_solids_leaves_still_water_still(tmp_path):
    """The floor of the tank counted as the bed, so that water at the level of the sea seemed half a metre too low, and
    1 m/s came in; one place of sixteen lies beside the seam of the two solids, where the depth was read down to the
    floor."""
    (tmp_path / "case.toml").write_text(BED_OF_SOLIDS)
    coupling = build(load(tmp_path).case, Clock()).coupling
    absorber = coupling.water.sides.absorbers()[0]
    x = absorber.places[:, 0]
    seam = np.abs(x - 2.12).min()
    assert 0.0 < seam < 0.05 * 0.5
    np.testing.assert_allclose(
        absorber.bed, np.where(x < 2.12, 0.1 + 0.6 * x / 2.12, 1.5 - 0.8 * (4.0 - x) / 1.88)
    )
    for _ in range(3):
        coupling.step(0.01)
    assert absorber.speed == pytest.approx(0.0, abs=1e-6)
    speed = np.linalg.norm(coupling.water.velocity, axis=1)[coupling.water.nodal_water > 0.0].max()
    assert speed < 1e-6
