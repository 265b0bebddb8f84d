"""Threads share the work of a step and change nothing: a run has the same bits at any number of them."""

import copy
import os
import signal
import subprocess
import sys
import threading
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
import pytest

import kernels.threads as kernels
import surgebreak
from coupler.commands.benchmark import command, machine
from coupler.commands.benchmark import threads as measured
from coupler.commands.warm_up import CASE, PARTS
from coupler.program import threads
from coupler.program.provenance import ROOT
from fluid.mesh.arrays import Corners
from fluid.numerics.fields import copied
from kernels import team
from kernels.decorators import ranged, released

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


def _bytes_of(number, place, divided, scene=SCENE, least=5):
    divided.setenv(threads.VARIABLE, str(number))
    surgebreak.Case(scene).run(place / str(number))
    histories = sorted((place / str(number) / "history").glob("*.csv"))
    assert len(histories) >= least
    return {path.name: path.read_bytes() for path in histories}


def test_a_coupled_run_has_the_same_bytes_at_one_to_four_threads(tmp_path, divided):
    """Water falls against a wall whose joints break and lifts a block: transport, cut, pressure, contact, books."""
    alone = _bytes_of(1, tmp_path, divided)
    for number in (2, 3, 4):
        assert _bytes_of(number, tmp_path, divided) == alone
        assert len(kernels._team.workers) >= number - 1


@pytest.mark.parametrize(
    "shear",
    [
        {"walls": "friction", "manning": 0.03},
        {"walls": "friction", "roughness": "1 cm"},
        {"walls": "no-slip", "viscosity": "5 Pa s"},
    ],
    ids=["manning", "log law", "viscosity"],
)
def test_water_that_rubs_has_the_same_bytes_at_one_and_three_threads(tmp_path, divided, shear):
    """The viscous stage with a bed, with rough blocks, and with blocks that the liquid sticks to."""
    scene = copy.deepcopy(SCENE)
    scene["time"] |= {"end": "0.04 s", "output_every": "20 ms"}
    scene["water"] |= shear
    alone = _bytes_of(1, tmp_path, divided, scene)
    taken = surgebreak.Run(tmp_path / "1").history("energy")["shear_dissipation"]
    assert taken[-1] > 0.0
    assert _bytes_of(3, tmp_path, divided, scene) == alone


FALL = tomllib.loads(PARTS["structure"])
FALL["time"] = {"end": "0.1 s", "step_max": "10 ms", "output_every": "50 ms"}
FALL["joints"]["strength"] = "2 kPa"
FALL["structure"]["block"] = [
    {"name": f"falling{k}", "centre": [1.0 + 0.1 * k, 0.5, 0.8 + 0.4 * k], "size": [0.3] * 3, "density": 500,
     "velocity": [0, 0, -3]} for k in range(3)
]  # fmt: skip


def test_a_structure_without_water_has_the_same_bytes_at_one_to_four_threads(tmp_path, divided):
    """Blocks fall upon a wall whose joints break: contacts in several ranges for each thread, and joints."""
    alone = _bytes_of(1, tmp_path, divided, FALL, 3)
    intact = surgebreak.Run(tmp_path / "1").history("structure")["joints_intact"]
    assert intact[-1] < intact[0]
    for number in (2, 3, 4):
        assert _bytes_of(number, tmp_path, divided, FALL, 3) == alone


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


@pytest.mark.parametrize("taken_back", [False, True])
def test_a_kernel_that_fails_on_another_thread_fails_here(divided, monkeypatch, taken_back):
    """The first failing range tells, whichever fails first: this thread may take the last one back before another has
    begun with it. And the threads are there for the next one."""
    kernels.use(3)

    def kernel(first, last):
        if first > 0:
            time.sleep(0.02)
            raise ValueError(f"row {first}")
        return last

    with monkeypatch.context() as patched:
        if taken_back:
            patched.setattr(team, "_took_back", lambda plan, number: number == 2)
        with pytest.raises(ValueError, match="row 4"):
            kernels.over(kernel, 12, weight=10)
    assert kernels.over(lambda first, last: (first, last), 12, weight=10) == [(0, 4), (4, 8), (8, 12)]


@released
def _squares(first, last, failing, out):
    """The squares of a range, and its length."""
    found = np.empty(last - first)
    for i in range(first, last):
        if i == failing:
            raise ValueError("a row that fails")
        found[i - first] = float(i) * i
        out[i] = found[i - first]
    return found, last - first


def _squares_are_right():
    out = np.zeros(100)
    found = kernels.over(_squares, 100, -1, out, pieces=1)
    expected = np.arange(100.0) ** 2
    assert len(found) == kernels.in_use()
    assert sum(length for _, length in found) == 100
    np.testing.assert_array_equal(np.concatenate([part for part, _ in found]), expected)
    np.testing.assert_array_equal(out, expected)


def test_what_parts_return_comes_in_their_order(divided):
    """Arrays and numbers, at any number of threads, more than there are rows or cores as well."""
    for number in (1, 2, 3, 7, 2, 1):
        kernels.use(number)
        _squares_are_right()
    assert [length for _, length in kernels.over(_squares, 0, -1, np.zeros(0))] == [0]
    kernels.use(5)
    assert [length for _, length in kernels.over(_squares, 3, -1, np.zeros(3))] == [1, 1, 1]


def test_more_ranges_than_threads_come_in_their_order(divided):
    """As for rows of unequal cost: whichever thread is through takes the next range."""
    for number, pieces, parts in ((3, 4, 12), (2, 4, 8), (3, 50, 100), (1, 4, 1)):
        kernels.use(number)
        out = np.zeros(100)
        for _ in range(20):
            found = kernels.over(_squares, 100, -1, out, pieces=pieces)
            assert len(found) == parts
            np.testing.assert_array_equal(np.concatenate([part for part, _ in found]), np.arange(100.0) ** 2)


def test_a_compiled_kernel_that_fails_on_another_thread_fails_here(divided):
    """In its first, its middle and its last part; the threads are there for the next one."""
    kernels.use(3)
    for failing in (0, 40, 99):
        with pytest.raises(ValueError, match="a row that fails"):
            kernels.over(_squares, 100, failing, np.zeros(100))
        _squares_are_right()


def test_python_code_on_the_threads_may_share_loops_itself(divided):
    """Those loops run on the thread that asks, as long as the threads are in use."""
    kernels.use(3)

    def inner(first, last):
        out = np.zeros(100)
        kernels.over(_squares, 100, -1, out)
        return out[first:last].sum()

    assert sum(kernels.over(inner, 100, weight=10)) == (np.arange(100.0) ** 2).sum()


def test_two_callers_at_once_get_what_each_asked_for(divided):
    """One of them has the threads at a time."""
    kernels.use(3)

    def call(k):
        for _ in range(300):
            out = np.zeros(50 + k)
            kernels.over(_squares, 50 + k, -1, out)
            np.testing.assert_array_equal(out, np.arange(50.0 + k) ** 2)
        return k

    with ThreadPoolExecutor(4) as callers:
        assert list(callers.map(call, range(4))) == [0, 1, 2, 3]


@ranged
def _slow(first, last, turns, out):
    for i in range(first, last):
        x = 1.0
        for _ in range(turns):
            x = x * 1.0000001 + 1e-9
        out[i] = x


def test_ctrl_c_ends_a_loop_when_all_of_its_parts_are_done(divided):
    """No thread goes on writing into fields that the caller may change."""
    kernels.use(3)
    whole, out = np.zeros(3), np.zeros(3)
    kernels.over(_slow, 3, 1000, whole)
    kernels.over(_slow, 3, 100_000_000, whole)
    for python in (False, True):
        out[:] = 0.0
        loop = (lambda *args: _slow(*args)) if python else _slow
        press = threading.Timer(0.1, signal.raise_signal, [signal.SIGINT])
        press.start()
        with pytest.raises(KeyboardInterrupt):
            kernels.over(loop, 3, 100_000_000, out, weight=10)
        press.join()
        np.testing.assert_array_equal(out, whole)
        _squares_are_right()


def test_threads_without_work_do_not_use_the_processor(divided):
    """They look for a fraction of a millisecond, and then sleep; the next loop wakes them."""
    kernels.use(3)
    for _ in range(3):
        _squares_are_right()
        began = time.process_time()
        time.sleep(0.3)
        assert time.process_time() - began < 0.1
    _squares_are_right()


IN_ANOTHER_PROCESS = """
import numpy as np
import kernels.threads as threads
threads.use(3, least=1)
threads.zeros((100,))
assert (threads.marked(np.arange(100) % 3 == 0) == np.arange(0, 100, 3)).all()
print(sum(threads._marked.stats.cache_hits.values()), len(threads._team.workers))
"""


def test_kernels_in_the_cache_hold_no_addresses_of_the_process_that_compiled_them(tmp_path):
    """The second process takes them from there, shares their loops among threads of its own, and ends by itself."""
    place = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    for hits in (0, 1):
        done = subprocess.run(
            [sys.executable, "-c", IN_ANOTHER_PROCESS], env=place, cwd=ROOT, capture_output=True, timeout=200
        )
        assert done.returncode == 0, done.stderr.decode()
        assert done.stdout.split() == [str(hits).encode(), b"2"]


def test_a_process_that_is_forked_off_has_threads_of_its_own(divided):
    """Those of its parent are not there; waiting for them would never end."""
    kernels.use(3)
    kernels.over(lambda first, last: last, 9, weight=10)
    _squares_are_right()
    child = os.fork()
    if child == 0:
        same = kernels.over(lambda first, last: last - first, 9, weight=10) == [3, 3, 3]
        _squares_are_right()
        os._exit(0 if same and len(kernels._team.workers) == 2 else 1)
    assert os.waitpid(child, 0)[1] == 0
    _squares_are_right()


def test_lists_of_marked_entries_and_copies_are_those_of_numpy(divided):
    """Copies of every type and order of fields, and lists of none, some and all of the entries."""
    rng = np.random.default_rng(3)
    for number in (1, 3):
        kernels.use(number)
        for count, share in ((500, 0.3), (500, 1.0), (0, 0.0), (64, 1.0), (1000, 0.01), (500, 0.0)):
            mask = rng.random(count) < share
            np.testing.assert_array_equal(kernels.marked(mask), np.flatnonzero(mask))
        for given in (rng.normal(size=(200, 3)), rng.normal(size=333)[::2], mask, np.arange(70)):
            copy = copied(given)
            np.testing.assert_array_equal(copy, given)
            assert copy.dtype == given.dtype
            assert not np.shares_memory(copy, given)


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


def test_the_benchmark_counts_what_threads_share_and_what_kernels_move(monkeypatch):
    """A coarse tank: times for every number of threads, a serial share between none and all, Amdahl's law, and as many
    bytes for a field of known size as it has."""
    monkeypatch.setattr(measured, "REPEATS", 1)
    monkeypatch.setattr(measured, "STEPS", 1)
    monkeypatch.setattr(measured, "BEFORE", 0.02)
    monkeypatch.setattr(measured, "TRIAD", 1000)
    monkeypatch.setattr(machine, "TURNS", 100)
    monkeypatch.setattr(machine, "EMPTY", 5)
    monkeypatch.setattr(measured, "cores", lambda: 2)
    found = measured.threads(9000)
    assert found["wall"].keys() == {"1", "2"}
    assert 0.0 < found["serial"] < 1.0
    assert found["machine"].keys() == {"1", "2"}
    assert all(seconds > 0.0 for spent in found["machine"].values() for seconds in spent.values())
    told = [line.what for line in command._machine(found["machine"])]
    assert len(told) == 4
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


@ranged
def _one(first, last, out):
    for i in range(first, last):
        out[i] = 1.0


@ranged
def _two(first, last, out):
    for i in range(first, last):
        out[i] = 2.0


def test_the_benchmark_names_what_lies_between_shared_loops(monkeypatch):
    """Two loops with ten milliseconds of Python between them, and none after: that piece is the largest, what it takes
    to watch the loops does not count, and pieces between the same loops are of one kind."""
    monkeypatch.setattr(measured, "STEPS", 1)

    def work():
        for pause in (0.01, 0.0):
            kernels.over(_one, 5000, np.zeros(5000))
            until = time.process_time() + pause
            while time.process_time() < until:
                pass
            kernels.over(_two, 5000, np.zeros(5000))

    shared, pieces = measured.least_times(work)
    names = [(piece.after, piece.before) for piece in pieces]
    assert names == [(None, "_one"), ("_one", "_two"), ("_two", "_one"), ("_one", "_two"), ("_two", None)]
    assert shared > 0.0
    assert pieces[1].seconds > 0.009
    told = measured.largest(pieces)
    assert told[0][:3] == ("_one", "_two", 2.0)
    assert told[0][3] == pytest.approx(sum(piece.seconds for piece in (pieces[1], pieces[3])))
