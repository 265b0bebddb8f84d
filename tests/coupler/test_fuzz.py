"""Hundreds of wrong inputs with fixed seeds: every one is taken, or refused with a message and exit code 2, in time.

More of them: `pytest -m nightly tests/coupler/test_fuzz.py`. A failure names its input, the seed that makes it again.
"""

import random
import tomllib

import meshio
import numpy as np
import pytest

from coupler.case.inflow_records import RecordError, levels_of, record_of
from coupler.case.structure import BlockFile
from coupler.case.water import RecordInflow
from coupler.checks.read_case import load
from coupler.checks.remarks import remarks
from coupler.commands.explain_run import explanation_of_run
from coupler.commands.report.command import report
from coupler.geometry.block_files import blocks_from_file
from coupler.geometry.mesh_files import read_mesh
from coupler.geometry.parts import parts_of
from coupler.run.forecast import forecast
from coupler.run.resume import prepare
from tests.coupler import fuzz
from tests.coupler.test_resume import COUPLED, STREAM

PARTS = """\
[case]
title = "one of each"
[time]
end = "0.1 s"
[tank]
lower = [0, 0, 0]
upper = [6, 4, 4]
cell = 0.5
[water]
covers = "multiple"
[[water.fill]]
lower = [0, 0, 0]
upper = [1, 4, 1]
[[solid]]
name = "ramp"
vertices = [[5, 0, 0], [6, 0, 0], [6, 0, 1], [5, 4, 0], [6, 4, 0], [6, 4, 1]]
[structure]
density = "2 t/m3"
[[structure.building]]
lower = [2, 1, 0]
size = [1.5, 1.5, 2]
wall_thickness = 0.25
block = [0.5, 0.5]
[[structure.building.opening]]
wall = "x-"
lower = [0.5, 0]
size = [0.5, 1]
[[structure.column]]
foot = [4.5, 0.5, 0]
height = 1.5
drums = 3
radius = 0.3
sides = 6
[[structure.arch]]
foot = [4.2, 3, 1]
span = 1
thickness = 0.2
width = 0.4
voussoirs = 5
[[structure.rubble]]
lower = [1.1, 2.6, 0.1]
size = [0.8, 0.8, 0.8]
count = 3
diameter = [0.2, 0.3]
[[structure.block]]
name = "driven"
vertices = [[1.2, 0.2, 0.5], [1.6, 0.2, 0.5], [1.2, 0.6, 0.5], [1.2, 0.2, 0.9]]
rotation = {axis = [0, 0, 1], angle = "10 deg"}
[structure.ground]
material = "rock"
[contact]
friction = 0.5
[[contact.pair]]
materials = ["block", "rock"]
friction = 0.7
[joints]
strength = "0.5 MPa"
opening_at_failure = "2 mm"
law = "bilinear"
[[motion]]
block = "driven"
velocity = [0, 0, 0.1]
[[gauge]]
kind = "patch"
name = "p"
at = [0.5, 2, 0.5]
radius = 0.1
normal = [1, 0, 0]
[[gauge]]
kind = "loads"
name = "l"
on = "building"
[[gauge]]
kind = "motion"
name = "m"
of = "driven"
[study]
[[study.quantity]]
name = "q"
table = "history/gauges.csv"
column = "m_centre_z"
against = "exact"
value = "2 * time.end"
[[study.ladder]]
name = "dt"
key = "time.step_max"
values = [0.02, 0.01]
"""
CASES = [tomllib.loads(text) for text in (COUPLED, STREAM, PARTS)]
SMALL = 5000
"""Blocks up to which a case that was taken is forecast as well, which builds its structure: a building in courses of a
millimetre is no mistake, and takes its time."""


def use(folder, *overrides):
    """What `surgebreak check` does with a case."""
    file = load(folder, overrides)
    remarks(file.case)
    if sum(len(part.blocks) for part in parts_of(file.case)) <= SMALL:
        forecast(file.case, place=folder)


def tried(count, seed, one):
    """Verdicts on inputs 0 .. count - 1; an input that is neither taken nor refused fails with its number."""
    found = []
    for number in range(count):
        rng = random.Random(f"{seed}-{number}")
        try:
            found.append(fuzz.verdict(lambda rng=rng: one(rng)))
        except Exception as error:
            error.add_note(f"input {seed}-{number}")
            raise
    return found


def cases(count, seed, folder):
    def one(rng):
        table = fuzz.mutated_table(rng.choice(CASES), rng)
        text = fuzz.document(table)
        use(fuzz.write(folder, fuzz.torn(text.encode(), rng) if rng.random() < 0.2 else text))

    return tried(count, seed, one)


def overrides(count, seed, folder):
    def one(rng):
        table = rng.choice(CASES)
        use(fuzz.write(folder, fuzz.document(table)), fuzz.override(table, rng))

    return tried(count, seed, one)


RECORD = b"# a wave\ntime,level,velocity\n0,0.5,0\n0.1,0.6,0.2\n0.2,0.55,0.1\n0.5,0.5,0\n"


def records(count, seed, folder):
    path = folder / "wave.csv"

    def one(rng):
        path.write_bytes(fuzz.torn(RECORD, rng))
        try:
            record_of(RecordInflow(kind="record", side="x-", path=str(path)))
            levels_of(str(path))
        except RecordError as error:
            error.exit_code = 2  # `check` tells it with the key of the case
            raise

    return tried(count, seed, one)


def drawings(folder):
    """A tetrahedron in files of many formats, as cells and as a surface."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    cells = meshio.Mesh(points, [("tetra", [[0, 1, 2, 3]])])
    faces = meshio.Mesh(points, [("triangle", [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])])
    found = {}
    for ending in (
        ".msh",
        ".vtk",
        ".vtu",
        ".stl",
        ".obj",
        ".ply",
        ".off",
        ".mesh",
        ".inp",
        ".su2",
        ".med",
        ".xdmf",
    ):
        path = folder / f"whole{ending}"
        (faces if ending in (".stl", ".obj", ".ply", ".off") else cells).write(path)
        found[ending] = path.read_bytes()
    return found


def meshes(count, seed, folder):
    whole = drawings(folder)

    def one(rng):
        ending = rng.choice(sorted(whole))
        path = folder / f"torn{ending}"
        path.write_bytes(fuzz.torn(whole[ending], rng))
        read_mesh(path)
        blocks_from_file(BlockFile(path=str(path)))

    return tried(count, seed, one)


def runs(count, seed, folder, dry):
    def one(rng):
        run = fuzz.fresh(dry, folder / "run")
        spoilt = fuzz.spoil(run, rng)
        reported = []
        for read in (lambda: prepare(run, ["time.end='0.2 s'"], True, [].append), lambda: explanation_of_run(run),
                     lambda: report(run, False)):  # fmt: skip
            try:
                reported.append(fuzz.verdict(read))
            except Exception as error:
                error.add_note(spoilt)
                raise

    return tried(count, seed, one)


@pytest.fixture
def quick_readers(monkeypatch):
    """Readers that go in circles are given up sooner."""
    monkeypatch.setattr("coupler.geometry.mesh_files.PATIENCE", 0.2)


def mixed(verdicts, taken=1):
    """Some were refused, and some of the changes did no harm: otherwise nothing was tried."""
    assert verdicts.count("refused") > len(verdicts) // 10
    assert verdicts.count("taken") >= taken


def test_cases(tmp_path):
    mixed(cases(120, "cases", tmp_path))


def test_overrides(tmp_path):
    mixed(overrides(60, "overrides", tmp_path))


def test_records(tmp_path):
    mixed(records(300, "records", tmp_path))


def test_meshes(tmp_path, quick_readers):
    mixed(meshes(120, "meshes", tmp_path))


def test_run_directories(dry, tmp_path):
    assert runs(40, "runs", tmp_path, dry).count("taken") == 40


@pytest.mark.nightly
@pytest.mark.timeout(3000)
@pytest.mark.parametrize("seed", range(3))
def test_many_more(dry, tmp_path, quick_readers, seed):
    """A few minutes each."""
    mixed(cases(1500, f"more-cases-{seed}", tmp_path))
    mixed(overrides(700, f"more-overrides-{seed}", tmp_path))
    mixed(records(3000, f"more-records-{seed}", tmp_path))
    mixed(meshes(1500, f"more-meshes-{seed}", tmp_path))
    runs(300, f"more-runs-{seed}", tmp_path, dry)
