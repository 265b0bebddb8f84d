"""White water where water is torn, the way to the north, a camera among the blocks, and pictures of cases."""

import json
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from coupler.commands.view.foam import FAST, TORN, differences, foam
from coupler.program.process import run_module
from coupler.program.provenance import ROOT
from tests.coupler.synthetic_run import BOX_FACES, box_vertices, tank_mesh, write_run

NODES, CELLS = tank_mesh((4.0, 4.0, 4.0), 1.0)
LEVEL = NODES[:, 2] - 2.3


def test_differences_are_those_of_linear_velocities():
    """u = (3 z, 0, 4 z): |∇u| = 5 in every cell; the six tetrahedra of a cube fill it, so that h is its edge."""
    z = NODES[:, 2]
    found, volume = differences(NODES, CELLS[:, [0, 1, 2, 3]], np.stack([3 * z, 0 * z, 4 * z], axis=1))
    edge = np.cbrt(6.0 * np.abs(volume))
    np.testing.assert_allclose(found[volume > 0], 5.0 * edge[volume > 0])
    np.testing.assert_allclose(edge, 1.0)


def test_only_fast_water_that_is_torn_is_white():
    """Still, fast but even, torn but slow, and both; and nothing away from the surface."""
    fast = np.tile([8.0, 0.0, 0.0], (len(NODES), 1))
    shear = np.stack([2.0 * NODES[:, 2], 0 * NODES[:, 0], 0 * NODES[:, 0]], axis=1)
    surface = np.abs(LEVEL) < 1.0

    def of(velocity):
        return foam(NODES, CELLS, LEVEL, velocity, 10.0)

    assert not of(0.0 * fast).any()
    assert not of(fast).any()
    assert not of(0.1 * shear).any(), "a slow eddy"
    white = of(fast + 3.0 * shear)
    assert (white[surface] == 1.0).all()
    assert not white[~surface].any()
    torn = (2.0 / 10.0 - TORN[0]) / (TORN[1] - TORN[0])
    assert FAST[1] < 0.8
    np.testing.assert_allclose(of(fast + shear)[surface], torn)


def told(code):
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout + done.stderr


ROOM = """
import numpy as np, pyvista as pv
from coupler.commands.view.inside import inside, NoInside
box = lambda *b: pv.Box(b).cast_to_unstructured_grid().extract_surface(algorithm=None)
walls = [box(0, 6, -0.2, 0, 0, 3), box(0, 6, 4, 4.2, 0, 3), box(-0.2, 0, -0.2, 4.2, 0, 3), box(6, 6.2, -0.2, 4.2, 0, 3)]
"""


def test_the_camera_stands_in_the_room_with_its_back_to_the_wall():
    """A room of 6 m x 4 m without a roof: towards x- it stands on its middle line, a fifth of the way from the wall at
    x = 6; never outside."""
    code = ROOM + "c = inside(pv.merge(walls), 180.0); print(*c.position, *(c.focus - c.position))"
    x, y, z, *ahead = map(float, told(code).split())
    assert 4.5 < x < 6.0
    assert y == pytest.approx(2.0, abs=0.5)
    assert 0.2 < z < 2.0
    assert ahead[0] < 0.0
    assert ahead[1:] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_a_wall_alone_has_no_inside():
    assert "no place among the blocks" in told(ROOM + "inside(walls[0], 0.0)")


def test_north_turns_with_the_terrain(tmp_path):
    """The file of a terrain has y to the north; a terrain turned by 90 degrees has it towards x-."""
    (tmp_path / "run.json").write_text('{"case": {"terrain": {"turn": 1.5707963267948966}}}')
    code = (
        "from types import SimpleNamespace as S; from pathlib import Path;"
        "from coupler.commands.view.captions import north_of;"
        f"print(*north_of(S(directory=Path({str(tmp_path)!r}))), north_of(S(directory=Path('/nowhere'))))"
    )
    x, y, without = told(code).split()
    assert (float(x), float(y)) == pytest.approx((-1.0, 0.0), abs=1e-12)
    assert without == "None"


def test_lines_of_a_caption_are_about_as_long_as_one_another(tmp_path):
    """No size such as 20 m x 10 m x 12 m is cut off at its last word where two lines are needed anyway."""
    title = "A water column of 10 m breaks a building of 20 m x 10 m x 12 m"
    (tmp_path / "run.json").write_text(json.dumps({"case": {"case": {"title": title}}}), encoding="utf-8")
    code = (
        "from types import SimpleNamespace as S; from pathlib import Path;"
        "from coupler.commands.view.captions import caption_of;"
        f"print(caption_of(S(directory=Path({str(tmp_path)!r}), water=None, blocks=None), 57))"
    )
    lines = told(code).splitlines()
    assert " ".join(lines) == title
    assert len(lines) == 2
    assert abs(len(lines[0]) - len(lines[1])) < 10


def test_a_caption_of_several_lines_stands_above_the_tank(tmp_path):
    """Its lower lines ran over the rim: room was kept for one of them."""
    run = write_run(tmp_path / "run", [0.0], cell=4.0)
    (run / "run.json").write_text(json.dumps({"case": {"case": {"title": "A long title of a case " * 3}}}))
    code = (
        "import itertools; from coupler.commands.view.run_files import open_run;"
        "from coupler.commands.view.scene import Scene;"
        f"scene = Scene(open_run({str(run)!r}), (640, 360), soft=False); scene.draw(0.0);"
        "text, seen = scene.plotter.actors['caption'], scene.plotter.renderer; size = [0.0, 0.0];"
        "text.GetSize(seen, size); scene.picture();"
        "places = [];\n"
        "for p in itertools.product(*zip(scene.lower, scene.upper)):\n"
        "    seen.SetWorldPoint(*p, 1.0); seen.WorldToDisplay(); places.append(seen.GetDisplayPoint()[1])\n"
        "print(len(scene.caption.splitlines()), 360 * 0.985 - size[1], max(places)); scene.close()"
    )
    lines, below, rim = map(float, told(code).split())
    assert lines == 3
    assert rim < below


def test_pressures_of_trapped_air_stand_below_the_caption(tmp_path):
    """They were written over its second and third line."""
    run = write_run(tmp_path / "run", [0.0], cell=4.0)
    (run / "run.json").write_text(json.dumps({"case": {"case": {"title": "A long title of a case " * 3}}}))
    code = (
        "from coupler.commands.view.run_files import open_run; from coupler.commands.view.scene import Scene;"
        f"scene = Scene(open_run({str(run)!r}), (640, 360), soft=False); scene.draw(0.0);"
        "[scene._tell(k, f'air {k}: 5 kPa', 'black') for k in (0, 1)]; scene.picture();"
        "seen, ends = scene.plotter.renderer, [];\n"
        "for name in ('caption', 'pocket0_told', 'pocket1_told'):\n"
        "    text, size = scene.plotter.actors[name], [0.0, 0.0]; text.GetSize(seen, size)\n"
        "    top = 360 * text.GetPositionCoordinate().GetValue()[1]; ends += [top, top - size[1]]\n"
        "print(*ends); scene.close()"
    )
    ends = list(map(float, told(code).split()))
    assert ends == sorted(ends, reverse=True), "top and lower end of each, one below the other"


def test_the_picture_of_a_case_has_a_legend_that_can_be_read(tmp_path):
    """Names had the pale colours of what they name, in letters of a fourth of the picture, and half of it was empty."""
    faces = box_vertices((4.0, 1.0, 1.0))[np.array(BOX_FACES)]
    triangles = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    part, nothing = np.zeros(len(triangles), int), np.zeros((0, 2, 3))
    place, picture = tmp_path / "blocks.npz", tmp_path / "case.png"
    np.savez(
        place, triangles=triangles, part=part, names=["crate"], edges=nothing, lines=nothing, size=[4, 1, 1]
    )
    done = run_module("coupler.commands.view.drawing", place, picture, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    image = np.asarray(Image.open(picture).convert("RGB")).astype(int)
    inked = (image.sum(axis=2) < 150).nonzero()
    assert len(inked[0]) > 200, "letters in the colour of ink"
    drawn = (image < 250).any(axis=2)
    assert drawn.any(axis=1).mean() > 0.6
    assert drawn.any(axis=0).mean() > 0.6
