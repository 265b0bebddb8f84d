"""Parts that stand on the terrain: their foot, their footing, and the ground as blocks meet it."""

from types import SimpleNamespace

import numpy as np
import pytest

from coupler.checks.on_land import land_remarks
from coupler.checks.read_case import load
from coupler.geometry.parts import parts_of
from coupler.geometry.solids import solids_of
from coupler.geometry.terrain import standing
from coupler.geometry.terrain.bed_mesh import fitted_of
from coupler.geometry.terrain.standing import corners_of, ground_surface, ground_under
from coupler.program.errors import BadCase
from yade_scripts.contact.ground import surface_at

SLOPE = 0.4
HEAD = """
[case]
title = "on a slope"
[time]
end = "0.8 s"
[tank]
lower = [0, 0, -1]
upper = [24, 12, 14]
cell = "1 m"
[terrain]
path = "slope.csv"
"""
HOUSE = """
[structure]
[[structure.building]]
name = "h"
on = "terrain"
lower = [8, 3, 0.3]
size = [5, 4, 3]
turn = "30 deg"
wall_thickness = "0.5 m"
block = ["1.5 m", "1 m"]
[contact]
[joints]
strength = "1 MPa"
opening_at_failure = "2 mm"
"""


def loaded(tmp_path, text, *sets, rows=None):
    rows = rows or [f"{x},{y},{SLOPE * x}" for x in range(25) for y in range(13)]
    (tmp_path / "slope.csv").write_text("x,y,z\n" + "\n".join(rows) + "\n")
    (tmp_path / "case.toml").write_text(HEAD + text)
    return load(tmp_path, sets)


def test_house_stands_on_the_highest_ground_under_it_and_its_footing_reaches_the_lowest(tmp_path):
    case = loaded(tmp_path, HOUSE).case
    corners = corners_of((8, 3), (5, 4), np.pi / 6)
    np.testing.assert_allclose(corners.mean(axis=0), [10.5, 5.0])
    np.testing.assert_allclose(corners[1] - corners[0], [5 * np.cos(np.pi / 6), 2.5])
    low, high = ground_under(case.tank, corners)
    np.testing.assert_allclose(
        [low, high], SLOPE * np.array([corners[:, 0].min(), corners[:, 0].max()]), atol=1e-6
    )
    blocks = np.concatenate([b.world_vertices() for part in parts_of(case) for b in part.blocks])
    assert blocks[:, 2].min() == pytest.approx(high + 0.3)
    (footing,) = solids_of(case)
    assert footing.name == "h-footing"
    assert footing.vertices[:, 2].max() == pytest.approx(high + 0.3)
    assert footing.vertices[:, 2].min() == pytest.approx(low - 0.5)
    plan = np.unique(np.round(footing.vertices[:, :2], 9), axis=0)
    np.testing.assert_allclose(plan, np.unique(np.round(corners, 9), axis=0), atol=1e-8)


@pytest.mark.parametrize("split", ["kuhn", "mirrored"])
def test_blocks_meet_the_triangles_on_which_the_water_ends(split, tmp_path):
    """Of a ground that is plane on no square, so that a diagonal the wrong way shows."""
    rows = [f"{x},{y},{np.sin(x) + np.cos(1.7 * y + x)}" for x in range(25) for y in range(13)]
    case = loaded(
        tmp_path,
        "",
        "water.fill=[{lower=[0, 0, -2], upper=[24, 12, 4]}]",
        "tank.lower=[0, 0, -2]",
        f"tank.split={split}",
        rows=rows,
    ).case
    surface, fitted = ground_surface(case), fitted_of(case.tank)
    row = surface.as_row(0)
    corners = fitted.mesh.nodes[fitted.mesh.boundary_faces[fitted.bed_face]]
    share = np.random.default_rng(1).dirichlet([1, 1, 1], len(corners))
    places = np.einsum("fk,fkd->fd", share, corners) - surface.point
    normal = np.zeros(3)
    for place, outward in zip(places, fitted.mesh.boundary_normal[fitted.bed_face]):
        assert surface_at(row, place[0], place[1], normal) == pytest.approx(place[2], abs=1e-12)
        np.testing.assert_allclose(normal, -outward, atol=1e-12)
    assert row.upright <= -fitted.mesh.boundary_normal[fitted.bed_face, 2].max() + 1e-12


def test_block_slides_down_the_slope_by_the_law_of_friction(tmp_path):
    """s = 1/2 g (sin a - mu cos a) t²: over the borders of the triangles as on one plane."""
    a = np.arctan(SLOPE)
    up = np.array([-np.sin(a), 0.0, np.cos(a)])
    centre = np.array([14.0, 6.0, 14.0 * SLOPE]) + 0.4 * up
    block = f"""
[structure]
[[structure.block]]
name = "b"
centre = [{centre[0]}, {centre[1]}, {centre[2]}]
size = [1.1, 1.0, 0.8]
rotation = {{ axis = [0, 1, 0], angle = {-a} }}
[contact]
stiffness = "50 MN/m"
friction = 0.2
"""
    from coupler.scene.build import build_structure

    with build_structure(loaded(tmp_path, block).case) as structure:
        g = 9.81 * (np.sin(a) - 0.2 * np.cos(a))
        structure.advance(0.2)
        start, t0 = structure.centre()[0].copy(), 0.2
        structure.advance(0.6)
        way = start - structure.centre()[0]
        speed = -structure.velocity()[0, :3]
    down = np.array([np.cos(a), 0.0, np.sin(a)])
    assert way @ down == pytest.approx(0.5 * g * (0.8**2 - t0**2), rel=0.02)
    assert speed @ down == pytest.approx(g * 0.8, rel=0.02)
    assert abs(way @ up) < 2e-3


def test_standing_on_no_terrain_is_refused(tmp_path):
    with pytest.raises(BadCase) as error:
        loaded(tmp_path, HOUSE, "terrain=absent")
    assert "structure.building[0].on: there is no section [terrain] to stand on" in error.value.lines[0]


def test_a_footing_looks_at_the_terrain_between_the_columns_of_the_mesh_too(monkeypatch):
    """A mound and a hole that no column of the mesh sees: the bed of the mesh is flat, the foot counts from the mound
    and the footing reaches below the hole."""
    monkeypatch.setattr(standing, "bed_at", lambda tank, x, y: np.zeros(len(x)))
    tank = SimpleNamespace(ground=lambda x, y: np.where(x > 0.6, 0.5, np.where(x < 0.2, -0.3, 0.0)))
    assert ground_under(tank, corners_of((0, 0, 0), (1, 1, 1), 0.0)) == (-0.3, 0.5)


def test_blocks_that_begin_in_the_terrain_are_refused(tmp_path):
    """A house 0.7 m deep in a slope, without `on`, was thrown 124 m within half a second by its contacts. Its lowest
    corner uphill is at x = 13.1 m, where the ground is 5.26 m high."""
    loose = HOUSE.replace('on = "terrain"\n', "").replace("lower = [8, 3, 0.3]", "lower = [8, 3, {}]")
    with pytest.raises(
        BadCase, match=r"'h' reaches 0\.\d+ m into the terrain at \(1[0-9.]+, [0-9.]+\) m"
    ) as told:
        loaded(tmp_path, loose.format(4.7))
    assert 'stand there on a footing with on = "terrain"' in str(told.value)
    corners = corners_of((8, 3), (5, 4), np.pi / 6)
    clear = SLOPE * corners[:, 0].max()
    assert loaded(tmp_path, loose.format(clear + 1e-6)).case
    with pytest.raises(BadCase, match="into the terrain"):
        loaded(tmp_path, loose.format(clear - 0.01))
    fixed = '[structure]\n[[structure.block]]\nname = "pile"\ncentre = [10, 5, 4]\nsize = [1, 1, 4]\nfixed = true\n'
    assert loaded(tmp_path, fixed + '[contact]\nstiffness = "1 GN/m"\n').case


WAVE = """
[water]
[[water.fill]]
lower = [0, 0, -1]
upper = [2, 12, 0.5]
[[water.inflow]]
kind = "bore"
side = "x-"
ahead = 0.5
level = 7
absorbs = true
"""


def test_a_house_above_the_water_or_in_thin_water_is_remarked_on(tmp_path):
    """Its foot stands 0.3 m over the highest ground under it, at z = 5.6 m."""

    def said(level, *sets):
        made = loaded(tmp_path, HOUSE + WAVE, f"water.inflow[0].level={level}", *sets).case
        return [text for text in land_remarks(made)]

    foot = min(b.world_vertices()[:, 2].min() for b in parts_of(loaded(tmp_path, HOUSE).case)[0].blocks)
    (thin,) = said(foot + 1.5)
    assert f"at 'h' water up to z = {foot + 1.5:.3g} m is 1.5 m deep, 1.5 cells of 1 m: under 3 cells" in thin
    assert "around" in thin
    assert said(foot + 3.1) == []
    (dry,) = said(foot - 0.1)
    assert (
        f"'h' stands above all levels of the water (z = {foot - 0.1:.3g} m): only what runs up can reach it"
        in dry
    )
    assert said(foot - 0.1, "water.fill[0].upper[2]=10") == []
    assert list(land_remarks(loaded(tmp_path, HOUSE).case)) == [], "no water"
