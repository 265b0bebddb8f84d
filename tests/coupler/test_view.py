"""Pictures, films and figures from the files of a run, each in a process of its own as users make them."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from coupler.commands.view import figure_files
from coupler.commands.view.__main__ import main, pixels, rate
from coupler.commands.view.plots import (
    LINES_PER_PANEL,
    STYLE,
    by_component,
    common,
    grouped,
    of_each_block,
    panel,
    plots,
    plt,
    prefixed,
)
from coupler.program import extras
from coupler.results.fields import WaterWriter
from coupler.results.history import HistoryTable, by_block, read_history
from tests.coupler.synthetic_run import tank_mesh, write_run

ROOT = Path(__file__).parents[2]
pytest.importorskip("PIL", reason="the extra `view` is not installed")
if not all((Path(p) / "pyvista").exists() for p in sys.path if p.endswith("site-packages")):
    pytest.skip("the extra `view` is not installed", allow_module_level=True)


def render(*arguments, **environment):
    """Run `python -m coupler.commands.view` as the command does."""
    command = [sys.executable, "-m", "coupler.commands.view", *map(str, arguments)]
    return subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, env=os.environ | environment, check=False
    )


def colours(path):
    """Shares of pixels that are clearly blue (water) and clearly sand to red (blocks), colour bars left out."""
    from PIL import Image

    picture = np.asarray(Image.open(path).convert("RGB")).astype(int)
    scene = picture[: int(0.85 * len(picture))]
    red, blue = scene[..., 0], scene[..., 2]
    return np.mean(blue - red > 25), np.mean(red - blue > 20)


@pytest.mark.parametrize(("water", "blocks"), [(True, True), (True, False), (False, True)])
def test_a_still_shows_what_the_run_has(tmp_path, water, blocks):
    """Blue where there is water, sand to red where there are blocks, and neither where there is none."""
    run = write_run(tmp_path / "run", [0.0, 2.0], water, blocks, cell=2.0)
    done = render(run, "--still", "--size", "320x180")
    assert done.returncode == 0, done.stderr
    blue, sand = colours(run / "pictures" / "still_2.000s.png")
    assert (blue > 0.05) == water
    assert (sand > 0.03) == blocks


def test_a_still_of_a_run_over_terrain_shows_the_ground(tmp_path):
    """The bed of the maps, greener than all else, is there where the run has maps and not where it has none."""
    from PIL import Image

    run = write_run(tmp_path / "run", [0.0], water=False, cell=2.0)

    def green():
        assert render(run, "--still", "--size", "320x180").returncode == 0
        (picture,) = (run / "pictures").glob("still_*.png")
        red, green, blue = np.asarray(Image.open(picture).convert("RGB")).astype(int).transpose(2, 0, 1)
        return np.mean((green > red) & (green - blue > 10))

    assert green() < 0.01
    (run / "maps").mkdir()
    rows = [" ".join(f"{0.2 * i:g}" for i in range(13))] * 6
    head = "ncols 13\nnrows 6\nxllcenter 0\nyllcenter 0\ncellsize 5\nNODATA_value -9999\n"
    (run / "maps" / "bed.asc").write_text(head + "\n".join(rows) + "\n")
    (run / "effective.json").write_text(json.dumps({"tank": {"lower": [0, 0, 0]}}))
    assert green() > 0.1


def test_film_and_figures(tmp_path):
    """An H.264 film with a frame for each step and a second's hold, and each history in three formats."""
    run = write_run(tmp_path / "run", [0.0, 1.0, 2.0], cell=2.0)
    done = render(run, "--film", "--plots", "--size", "321x181", "--fps", "10")
    assert done.returncode == 0, done.stderr
    pictures = run / "pictures"
    assert sorted(p.name for p in pictures.iterdir()) == sorted(
        ["film.mp4", *(f"{name}.{end}" for name in ("energy", "load") for end in ("pdf", "png", "svg"))]
    )
    code = "import imageio_ffmpeg, json, sys; r = imageio_ffmpeg.read_frames(sys.argv[1]); print(json.dumps(next(r)))"
    about = subprocess.run(
        [sys.executable, "-c", code, str(pictures / "film.mp4")],
        capture_output=True,
        text=True,
        check=True,
    )
    film = json.loads(about.stdout)
    assert film["codec"] == "h264"
    assert film["size"] == [320, 180]
    assert film["duration"] == pytest.approx(1.3, abs=0.11)


def test_stills_of_one_call_are_those_of_a_call_each(tmp_path):
    """A report draws its stills in one scene: nothing of one instant may be left in the picture of the next."""
    run = write_run(tmp_path / "run", [0.0, 1.0, 2.0], cell=2.0)
    of_a_page = ("--still", "--size", "160x90", "--plots", "--for-page", "--to", tmp_path / "together")
    assert render(run, "--time", "0", "--time", "2", *of_a_page).returncode == 0
    assert (
        render(run, "--still", "--size", "160x90", "--time", "2", "--to", tmp_path / "alone").returncode == 0
    )
    drawn = {path.name: path.read_bytes() for path in (tmp_path / "together").iterdir()}
    assert set(drawn) == {"still_0.000s.png", "still_2.000s.png", "energy.svg", "load.svg"}
    assert drawn["still_2.000s.png"] == (tmp_path / "alone" / "still_2.000s.png").read_bytes()


def test_a_page_gets_the_smaller_format_of_a_large_figure(tmp_path, monkeypatch):
    """A line of many points has a large SVG; beside that there is a PNG, of which the page takes the smaller."""
    monkeypatch.setattr(figure_files, "LARGE", 20_000)
    for name, points in (("few", 10), ("many", 3000)):
        drawing, axis = plt.subplots()
        axis.plot(np.random.default_rng(1).random(points))
        figure_files.save(drawing, tmp_path / name, figure_files.FOR_A_PAGE)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["few.svg", "many.png", "many.svg"]


def test_a_run_that_is_still_being_written_can_be_looked_at(tmp_path):
    """The writer goes on while the viewer has the file open: neither stops the other."""
    nodes, cells = tank_mesh((4.0, 2.0, 2.0), 0.5)
    writer = WaterWriter(tmp_path / "fields.vtkhdf")
    for k in range(3):
        writer.append(0.1 * k, nodes, cells, {"level_set": nodes[:, 2] - 1.0}, {})
    command = [sys.executable, "-m", "coupler.commands.view", str(tmp_path), "--still", "--size", "160x90"]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as viewer:
        while viewer.poll() is None:
            writer.append(0.1 * k, nodes, cells, {"level_set": nodes[:, 2] - 1.0}, {})
            k += 1
        assert viewer.returncode == 0, viewer.stderr.read()
    assert k > 4


def test_pictures_need_neither_side_of_the_solver(tmp_path):
    """VTK crashes in a process that holds YADE: nothing on the way to a picture may import it, or the fluid."""
    run = write_run(tmp_path / "run", [0.0, 1.0], cell=4.0)
    code = (
        "import sys; from coupler.commands.view.__main__ import main; code = main(sys.argv[1:]);"
        "loaded = {m.split('.')[0] for m in sys.modules};"
        "print(sorted(loaded & {'yade', 'yade_scripts', 'fluid', 'skfem', 'numba'}), code)"
    )
    command = [sys.executable, "-c", code, str(run), "--still", "--plots", "--size", "160x90"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[] 0"


def test_what_cannot_be_shown_is_said(tmp_path):
    """No such run; a case; a run without fields; a run whose first step is not written yet."""
    (tmp_path / "case").mkdir()
    (tmp_path / "case" / "case.toml").write_text("")
    for run, said in (
        (tmp_path / "none", "no such run directory"),
        (tmp_path / "case", f"a case; name one of its runs, in {tmp_path / 'case' / 'runs'}/"),
        (tmp_path, "neither fields.vtkhdf nor blocks.vtkhdf"),
    ):
        done = render(run)
        assert done.returncode == 2
        assert said in done.stderr
        assert "Traceback" not in done.stderr
    WaterWriter(tmp_path / "fields.vtkhdf")
    assert "has not reached its first output" in render(tmp_path).stderr


def test_a_killed_run_is_shown_and_said_to_be_one(tmp_path):
    """After a kill run.json still says "running"; only the missing process tells."""
    run = write_run(tmp_path / "run", [0.0, 1.0], cell=4.0)
    with subprocess.Popen([sys.executable, "-c", ""]) as ended:
        ended.wait()
    for process, killed in ((ended.pid, True), (os.getpid(), False)):
        (run / "run.json").write_text(json.dumps({"status": "running", "process": process}))
        done = render(run, "--still", "--size", "160x90")
        assert done.returncode == 0, done.stderr
        assert ("the run was killed" in done.stdout) == killed


def test_a_still_shows_the_struck_side_although_the_lee_broke_first(tmp_path):
    """The synthetic building stands at x = 28 to 48 m, y = 7 to 17 m; its water starts at x = 0 to 15 m. The first
    break is behind it, at one end or the other; with water from x+ and no break either end is as good."""
    wanted = []
    for name, sides, place, azimuth in (
        ("left", ["x-"], [45.0, 14.0, 1.0], 118.0),
        ("right", ["x-"], [45.0, 9.0, 1.0], -118.0),
        ("stands", ["x+"], None, -62.0),
        ("collapse", [], [45.0, 14.0, 1.0], 118.0),
    ):
        run = write_run(tmp_path / name, [0.0], cell=4.0)
        case = {"water": {"inflow": [{"side": side} for side in sides]}}
        verdict = {"first_break": place and {"place": place}}
        (run / "run.json").write_text(json.dumps({"case": case, "figures": {"verdict": verdict}}))
        wanted.append((run, azimuth))
    code = (
        "import sys; from pathlib import Path; from coupler.commands.view.run_files import open_run;"
        "from coupler.commands.view.camera import side_of; from coupler.commands.view.captions import struck_side;"
        "print(*(side_of(struck_side(open_run(Path(run)))) for run in sys.argv[1:]))"
    )
    command = [sys.executable, "-c", code, *(str(run) for run, _ in wanted)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert [float(word) for word in done.stdout.split()] == [azimuth for _, azimuth in wanted]


def test_layers_of_water_are_drawn_from_far_to_near(tmp_path):
    """Translucent triangles hide what is drawn after them: in the order of the cells two layers made a mosaic."""
    run = write_run(tmp_path / "run", [0.0], cell=4.0)
    code = (
        "import sys, numpy as np; from coupler.commands.view.run_files import open_run;"
        "from coupler.commands.view.scene import water_surface; eye = np.array([50.0, -80.0, 30.0]);"
        "x = water_surface(open_run(sys.argv[1]).water.at(0.0), eye).points.reshape(-1, 3, 3).astype(float);"
        "front = np.einsum('ti,ti->t', eye - x[:, 0], np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]));"
        "print(np.diff(np.linalg.norm(x.mean(axis=1) - eye, axis=1)).max(), len(x), front.min())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(run)], cwd=ROOT, capture_output=True, text=True, check=True
    )
    nearer, triangles, front = map(float, done.stdout.split())
    assert nearer < 1e-4  # coordinates are 32-bit
    assert triangles > 100
    assert front > -1e-3, "a triangle seen from behind is drawn for nothing"


def test_a_section_is_filled():
    """Half of a cube of water of 2 m, of a block and of a solid, each cut in its middle; ground of 1 m under a bed."""
    code = """
import numpy as np, pyvista as pv
from types import SimpleNamespace as S
from coupler.commands.view import section
grid = pv.ImageData(dimensions=(3, 3, 3)).to_tetrahedra()
n = grid.n_points
x = np.array(grid.points, float)
water = S(nodes=x, cells=grid.cells_dict[10].astype(int), level_set=x[:, 2] - 1.5,
          velocity=np.ones((n, 3)), fraction=np.ones(grid.n_cells))
y, at = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.7, 0.0])
cut = section.with_section(pv.PolyData(), water, y, at)
print(round(cut.area, 6), round(float(cut["speed"].max()), 6))
water.fraction[:] = 0.3
inside = pv.Box((0.5, 1.5, 0, 2, 0.25, 1))
inside.cell_data["solid"] = np.zeros(6, int)
bent = pv.merge([pv.Box((0, 1, 0, 2, 0, 1)), pv.Box((0, 2, 0, 2, 1, 2))]).extract_surface(algorithm="dataset_surface")
bent.cell_data["solid"] = np.zeros(bent.n_cells, int)
print(*(round(section.with_section(pv.PolyData(), water, y, at, [body]).area, 6) for body in (inside, bent)))
block = pv.Box((0, 2, 0, 1, 0, 3))
block.cell_data["block"] = np.zeros(6, int)
block.cell_data["damage"] = np.full(6, 0.5)
half = section.solid_behind_cut(block, (y, at))
print(round(half.area - 2 * (2 * 0.7 + 3 * 0.7) - 2 * 3, 6), half.cell_data["damage"].min())
print(round(section.closed_behind_cut(pv.Box((0, 2, 0, 1, 0, 3)).triangulate(), (y, at)).volume, 6))
bed = pv.Plane(center=(1, 1, 1), i_size=2, j_size=2)
print(round(section.ground_behind_cut(bed, (y, at), 0.0).area, 6))
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    cut, around, half, solid, ground = (tuple(map(float, line.split())) for line in done.stdout.splitlines())
    assert cut == (3.0, pytest.approx(3**0.5, rel=1e-5)), "2 m of width, 1.5 m of depth"
    assert around == (pytest.approx(3.0 - 0.75), 0.0), (
        "around a box; none in cells mostly inside of a body with a notch"
    )
    assert half == (pytest.approx(6.0, abs=1e-5), 0.5), "the face of the cut has the damage of its block"
    assert solid == (pytest.approx(2 * 0.7 * 3),)
    assert ground == (pytest.approx(2 * 0.7 + 2 * 1),), "the bed that is kept, and the ground in the plane"


def test_round_off_is_not_drawn(tmp_path):
    """A block that moves along z alone has 1e-17 m in x and y: no lines for those."""
    table = HistoryTable(tmp_path / "gauges.csv", [(n, "m", n) for n in ("time", "x", "z")])
    for k in range(3):
        table.append(time=k, x=1e-17 * k, z=0.1 * k)
    table.close()
    assert grouped(read_history(tmp_path / "gauges.csv")) == [("m", ["z"])]


def test_an_axis_says_what_its_lines_have_in_common():
    assert common(["house_force_x", "house_force_z"]) == "house force"
    assert common(["front_level", "beside_level"]) == "level"
    assert common(["first_x", "second_x"]) == ""
    assert common(["largest_damage"]) == "largest damage"


def test_missing_extra_is_named_with_the_command_that_adds_it(tmp_path, monkeypatch, capsys):
    """Without VTK the solver still works; only pictures say what they need."""
    monkeypatch.setitem(extras.EXTRAS, "view", ("a_package_that_is_nowhere",))
    assert main([str(tmp_path)]) == 1
    reported = capsys.readouterr().err
    assert "a_package_that_is_nowhere is not installed" in reported
    assert "./surgebreak render" in reported


@pytest.mark.parametrize(
    ("read", "text"), [(pixels, "1280"), (pixels, "10x10"), (pixels, "axb"), (rate, "0"), (rate, "x")]
)
def test_bad_options_are_refused(read, text):
    """argparse turns these into one line and exit code 2."""
    import argparse

    with pytest.raises(argparse.ArgumentTypeError, match=text):
        read(text)


def test_a_reader_who_has_enough_ends_the_pictures_quietly(tmp_path):
    """`surgebreak render RUN | head -1` leaves no message about a broken pipe."""
    run = write_run(tmp_path / "run", [0.0], cell=4.0)
    words = [sys.executable, "-m", "coupler.commands.view", str(run), "--still", "--size", "160x90"]
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as view:
        view.stdout.close()
        assert view.stderr.read() == ""
    assert view.returncode == 4


def test_each_component_of_a_load_shows_its_parts_beside_their_sum(tmp_path):
    """A panel of all contact forces and one of all sums: what struck could not be told from what pressed, and where
    contact was all there is, the line of the sum hid it."""
    parts = ("pressure", "contact", "total")
    names = [f"{part}_{what}" for part in parts for what in ("force_x", "force_z", "moment_y")]
    units = ["N m" if "moment" in name else "N" for name in names]
    table = HistoryTable(
        tmp_path / "loads_pier.csv", [("time", "s", ""), *((n, u, n) for n, u in zip(names, units))]
    )
    for k in range(3):
        table.append(time=k, **{n: 0.0 if n == "pressure_force_x" else 50.0 * k for n in names})
    table.close()
    history = read_history(tmp_path / "loads_pier.csv")
    panels = by_component(history)
    assert panels == [
        ("N", ["contact_force_x", "total_force_x"]),
        ("N", ["pressure_force_z", "contact_force_z", "total_force_z"]),
        ("N m", ["pressure_moment_y", "contact_moment_y", "total_moment_y"]),
    ]
    with plt.rc_context(STYLE):
        axis = plt.figure().subplots()
        panel(axis, history, *panels[0])
    contact, total = axis.lines
    assert (contact.get_label(), total.get_label(), axis.get_ylabel()) == ("contact", "total", "force x [N]")
    assert total.get_zorder() < contact.get_zorder()
    assert total.get_linewidth() > 2.0 * contact.get_linewidth()


def test_panels_hold_whole_vectors_of_like_size(tmp_path):
    """Lines that would lie flat on the axis beside larger ones get a panel of their own; x, y, z stay together."""
    names = ["pull_x", "pull_y", "pull_z", "small_x", "small_y", "small_z", "push_x", "push_y", "push_z"]
    table = HistoryTable(tmp_path / "gauges.csv", [("time", "s", ""), *((n, "N", n) for n in names)])
    for k in range(3):
        table.append(time=k, **{n: k * (0.1 if n.startswith("small") else 50.0) for n in names})
    table.close()
    units, panels = zip(*grouped(read_history(tmp_path / "gauges.csv")))
    assert units == ("N", "N")
    assert panels == (names[:3] + names[6:], names[3:6])


def test_depths_and_places_of_blocks_have_panels_of_their_own(tmp_path):
    """On the axis of a block that is carried over 2 m the depth of 0.1 m at a gauge is a flat line."""
    places = [f"top_centre_{axis}" for axis in "xyz"]
    table = HistoryTable(
        tmp_path / "gauges.csv", [("time", "s", ""), *((n, "m", n) for n in ("H1_level", *places))]
    )
    for k in range(3):
        table.append(time=k, H1_level=0.05 * k, top_centre_x=1.0 + k, top_centre_y=0.5, top_centre_z=0.5)
    table.close()
    assert grouped(read_history(tmp_path / "gauges.csv")) == [("m", ["H1_level"]), ("m", places)]


def test_a_figure_of_many_panels_goes_on_where_a_page_of_paper_ends():
    """A figure taller than A4 would be shrunk until its letters cannot be read."""
    from coupler.commands.view.plots import LOW_PANEL, PANEL, TALLEST, leaves

    panels = [("N", ["a"])] * 5 + [("1", ["b"])] * 4
    found = leaves(panels)
    assert [panel for leaf in found for panel in leaf] == panels
    heights = [sum(LOW_PANEL if unit == "1" else PANEL for unit, _ in leaf) for leaf in found]
    assert max(heights) <= TALLEST
    assert len(found) == 2


@pytest.mark.parametrize("number", [2, LINES_PER_PANEL + 1])
def test_loads_of_each_block_are_a_line_each_or_no_figure(tmp_path, number):
    """One line ran through the rows of all blocks, up and down at every time."""
    (tmp_path / "history").mkdir()
    path = tmp_path / "history" / "loads_wall_blocks.csv"
    columns = [("time", "s", "t"), ("block", "", "name"), ("f_x", "N", "f"), ("f_y", "N", "nothing")]
    with HistoryTable(path, columns) as table:
        for time in (0.1, 0.2):
            for k in range(number):
                table.append(time=time, block=f"b{k}", f_x=time + k, f_y=0.0)
    history = read_history(path)
    made, panels = of_each_block(history, by_block(history))
    assert panels == [("N", [f"f_x_b{k}" for k in range(number)])]
    assert made["time"].tolist() == [0.1, 0.2]
    assert made["f_x_b1"].tolist() == [1.1, 1.2]
    assert [p.name for p in plots(tmp_path, tmp_path)] == (["loads_wall_blocks.pdf"] if number == 2 else [])


def test_moments_are_drawn_with_a_prefix_as_forces_are():
    """400 kN m stood as 400000 N m on the axis under forces in kN, and in kN m in the tables of the report."""
    assert prefixed("N m", 4.0e5) == (1, "kN·m")
    assert prefixed("N", 4.0e5) == (1, "kN")
