"""Threads share the work of a step and change nothing: a run has the same bits at any number of them."""

import os
import tomllib
from functools import partial

import numpy as np
import pytest

import fluid.numerics.threads as kernels
import surgebreak
from coupler.commands.benchmark import threads as measured
from coupler.commands.warm_up import CASE
from coupler.program import threads
from fluid.mesh.arrays import Corners
from kernel_decorators import ranged

SCENE = tomllib.loads(CASE)
SCENE["time"] = {"end": "0.12 s", "step_max": "20 ms", "output_every": "60 ms"}
SCENE["water"]["fill"][0]["upper"] = [0.9, 1, 0.8]
SCENE["joints"]["strength"] = "2 kPa"


@pytest.fixture
def divided(monkeypatch):
    """Every loop is divided, however short; afterwards one thread works as before."""
    monkeypatch.setattr(kernels, "use", partial(kernels.use, least=1))
    yield monkeypatch
    monkeypatch.undo()
    kernels.use(1)


def _bytes_of(number, place, divided):
    divided.setenv(threads.VARIABLE, str(number))
    surgebreak.Case(SCENE).run(place / str(number))
    histories = sorted((place / str(number) / "history").glob("*.csv"))
    assert len(histories) >= 5
    return {path.name: path.read_bytes() for path in histories}


def test_a_coupled_run_has_the_same_bytes_at_one_to_four_threads(tmp_path, divided):
    """Water falls against a wall whose joints break and lifts a block: transport, cut, pressure, contact, books."""
    alone = _bytes_of(1, tmp_path, divided)
    for number in (2, 3, 4):
        assert _bytes_of(number, tmp_path, divided) == alone
        assert len(kernels._team.workers) >= number - 1


def test_sums_into_nodes_do_not_depend_on_where_ranges_end(divided):
    """Numbers of any order and size: lists in which all blocks reach everywhere, and lists with runs left out."""
    rng = np.random.default_rng(5)
    near = np.sort(rng.integers(0, 4000, (5000, 1)), axis=0) + rng.integers(0, 9, (5000, 4))
    for cells in (near.astype(np.uint32), rng.integers(0, 4009, (5000, 4)).astype(np.uint32)):
        listed = np.flatnonzero(rng.random(5000) < 0.7)
        value, found = rng.normal(size=len(listed)) * 10.0 ** rng.integers(-9, 9, len(listed)), []
        for number in (1, 2, 5):
            kernels.use(number)
            out = np.zeros(4009)
            reach = kernels.reach_of_cells(listed, cells)
            kernels.owning(_added, len(out), reach, len(listed), listed, cells, value, out)
            found.append(out)
        expected = np.zeros(4009)
        np.add.at(expected, cells[listed].ravel(), np.repeat(value, 4))
        for out in found:
            np.testing.assert_array_equal(out, expected)


@ranged
def _added(first, last, runs, cell_list, cells, value, out):
    for run in range(runs.shape[0]):
        for s in range(runs[run, 0], runs[run, 1]):
            for a in range(4):
                if first <= cells[cell_list[s], a] < last:
                    out[cells[cell_list[s], a]] += value[s]


def test_a_kernel_that_fails_on_another_thread_fails_here(divided):
    """And the threads are there for the next one."""
    kernels.use(3)

    def kernel(first, last):
        if first > 0:
            raise ValueError(f"row {first}")
        return last

    with pytest.raises(ValueError, match="row 4"):
        kernels.over(kernel, 12)
    assert kernels.over(lambda first, last: (first, last), 12) == [(0, 4), (4, 8), (8, 12)]


def test_a_process_that_is_forked_off_has_threads_of_its_own(divided):
    """Those of its parent are not there; waiting for them would never end."""
    kernels.use(3)
    kernels.over(lambda first, last: last, 9)
    child = os.fork()
    if child == 0:
        same = kernels.over(lambda first, last: last - first, 9) == [3, 3, 3]
        os._exit(0 if same and len(kernels._team.workers) == 2 else 1)
    assert os.waitpid(child, 0)[1] == 0


def test_the_command_s_number_counts_before_the_variable_and_that_before_the_cores(monkeypatch):
    """Without either all cores of the process work; scripts and tests start with one thread."""
    monkeypatch.delenv(threads.VARIABLE)
    assert threads.threads() == 1
    threads.take_threads(None)
    assert threads.threads() == threads.cores()
    monkeypatch.setenv(threads.VARIABLE, "3")
    threads.take_threads(None)
    assert threads.threads() == 3
    threads.take_threads(2)
    assert threads.threads() == 2
    with pytest.raises(threads.BadThreads, match="--threads 0: at least 1"):
        threads.take_threads(0)
    monkeypatch.setenv(threads.VARIABLE, "all")
    with pytest.raises(threads.BadThreads, match="SURGEBREAK_THREADS=all: a whole number"):
        threads.threads()


def test_control_groups_give_less_time_than_the_machine_has_cores(tmp_path):
    """Containers: half of a core counts as one, one and a half as one, and the outer group limits the inner one."""
    own = tmp_path / "cgroup"
    own.write_text("0::/outer/inner\n")
    inner = tmp_path / "root" / "outer" / "inner"
    inner.mkdir(parents=True)
    assert threads._quota(tmp_path / "root", own) is None
    (inner / "cpu.max").write_text("max 100000\n")
    (inner.parent / "cpu.max").write_text("150000 100000\n")
    assert threads._quota(tmp_path / "root", own) == 1.5
    (inner / "cpu.max").write_text("50000 100000\n")
    assert threads._quota(tmp_path / "root", own) == 0.5


def test_the_benchmark_counts_what_threads_share_and_what_kernels_move(monkeypatch):
    """A coarse tank: times for every number of threads, a serial share between none and all, Amdahl's law, and as many
    bytes for a field of known size as it has."""
    monkeypatch.setattr(measured, "REPEATS", 1)
    monkeypatch.setattr(measured, "STEPS", 1)
    monkeypatch.setattr(measured, "BEFORE", 0.02)
    monkeypatch.setattr(measured, "TRIAD", 1000)
    monkeypatch.setattr(measured, "cores", lambda: 2)
    found = measured.threads(9000)
    assert found["wall"].keys() == {"1", "2"}
    assert 0.0 < found["serial"] < 1.0
    assert measured.amdahl(0.0, 16) == 16.0
    assert measured.amdahl(0.1, 10) == pytest.approx(1.0 / 0.19)
    found = measured.roofline(1500)
    assert all(seconds >= 0.0 and moved > 0.0 for seconds, moved in found["kernels"].values())
    listed, field, out = np.arange(50), np.zeros((200, 3)), np.zeros(50)
    moved = measured._bytes("_fast", (0, 50, listed, field, 2.0, out), 200, 1000)
    assert moved == listed.nbytes + field.nbytes / 4 + out.nbytes
    runs = np.array([[0, 50]])
    moved = measured._bytes("_inflow", (0, 200, runs, listed, np.zeros((1000, 4))), 200, 1000)
    assert moved == runs.nbytes + listed.nbytes + 1000 * 32 / 20
    bundle = Corners(np.zeros((200, 3)), np.zeros((1000, 4)))
    moved = measured._bytes("_fast", (0, 50, bundle, out), 200, 1000, ("nodes", "shape"))
    assert moved == bundle.nodes.nbytes / 4 + out.nbytes
    assert measured._bytes("_fast", (0, 50, (bundle, out)), 200, 1000) > moved + bundle.cells.nbytes / 5
