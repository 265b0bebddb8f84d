"""Jobs of PBS, SGE and others: the scripts that are written, time limits, runs whose job ends before they do.

There is no free PBS in Debian 12: `qsub` and `qdel` are replaced by scripts that run a job here, as the tests of
dask-jobqueue do. The last test has a real Grid Engine.
"""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from coupler.commands.sweep import time_limit
from coupler.commands.sweep.dask import CLUSTERS, Dask, jobqueue
from coupler.commands.sweep.folder import read_spec
from coupler.commands.sweep.options import keywords
from coupler.commands.sweep.results import collect
from coupler.program.errors import BadCase
from coupler.program.extras import absent
from coupler.program.process import environment

from .arm import CASE, WEAK
from .sge_here import GridEngine
from .until import until

needs_dask = pytest.mark.skipif(bool(absent("dask")), reason="no dask-jobqueue")
SWEEP = """
[sweep]
table = "rows.csv"
[[sweep.quantity]]
name = "place"
table = "history/gauges.csv"
column = "arm_centre_z"
"""
TABLE = f"""\
time.end,joints.strength,structure.block[1].velocity[2]
10 ms,{WEAK},0.01
0.4 s,1e6,0.02
"""
CANNOT_STAND, LONG = 0, 1


class Spec:
    def __init__(self, folder, threads=1):
        self.folder, self.threads = folder, threads


def script(kind, tmp_path, *options, threads=1):
    words = Dask(Spec(tmp_path, threads), kind, 2, options).words()
    job = getattr(jobqueue(), CLUSTERS[kind]).job_cls
    return job(scheduler="tcp://there:1", name="worker", **words).job_script()


@needs_dask
def test_ctrl_c_is_still_a_keyboard_interrupt_with_dask_jobqueue(monkeypatch):
    """Its import has Ctrl-C end the program with code 0, as if the sweep were done."""
    for name in [name for name in sys.modules if name.startswith("dask_jobqueue")]:
        monkeypatch.delitem(sys.modules, name)
    before = signal.getsignal(signal.SIGINT)
    jobqueue()
    assert signal.getsignal(signal.SIGINT) is before


@needs_dask
@pytest.mark.parametrize(
    ("kind", "lines"),
    [
        ("pbs", ["#PBS -l select=1:ncpus=2:mem=1908MB", "#PBS -l walltime=01:00:00", "#PBS -o {logs}/"]),
        ("sge", ["#$ -l h_rt=01:00:00", "#$ -o {logs}/"]),
        ("lsf", ["#BSUB -n 2", "#BSUB -W 01:00", "#BSUB -o {logs}/worker-%J.out"]),
        ("oar", ["#OAR -l /nodes=1/core=2,walltime=01:00:00"]),
        ("slurm", ["#SBATCH --cpus-per-task=2", "#SBATCH --mem=2G", "#SBATCH -t 01:00:00"]),
        ("htcondor", ["RequestCpus = MY.DaskWorkerCores", "MY.DaskWorkerCores = 2"]),
    ],
)  # fmt: skip
def test_scripts_ask_for_what_a_run_needs(kind, lines, tmp_path):
    """A job of two threads makes one run at a time: dask would give it two, each with two threads."""
    written = script(kind, tmp_path, threads=2)
    for line in lines:
        assert line.format(logs=tmp_path / "jobs") in written
    assert "--nthreads 2" not in written.partition("--nthreads 1")[2]
    assert "--nthreads 1" in written
    assert sys.executable in written


@needs_dask
def test_a_job_gets_the_program_the_limit_and_the_lines_of_the_user(tmp_path, monkeypatch):
    """Batch systems hand no variables on; lists are given by an option again and again."""
    monkeypatch.setenv("SURGEBREAK_YADE", "/home/me/it's here")
    monkeypatch.setenv("LD_LIBRARY_PATH", "/home/me/lib")
    written = script(
        "pbs", tmp_path, "walltime=00:10:00", "queue=short", "job_extra_directives=-m n",
        "job_extra_directives=-l place=excl", "job_script_prologue=module load python",
    )  # fmt: skip
    assert "#PBS -q short\n" in written
    assert "#PBS -m n\n#PBS -l place=excl\n" in written
    body = written[: written.index(sys.executable)]
    shown = 'echo "$SURGEBREAK_YADE|$LD_LIBRARY_PATH|$SURGEBREAK_JOB_ENDS"'
    printed = subprocess.run(
        ["sh"],
        input=f"module() {{ echo loaded $2; }}\n{body}\n{shown}\n",
        capture_output=True,
        text=True,
        check=True,
    )
    loaded, variables = printed.stdout.splitlines()
    yade, libraries, ends = variables.split("|")
    assert (loaded, yade, libraries) == ("loaded python", "/home/me/it's here", "/home/me/lib")
    assert float(ends) - time.time() == pytest.approx(600.0 - 90.0, abs=30.0)


@pytest.mark.parametrize(
    ("kind", "text", "expected"),
    [
        ("pbs", "01:30:00", 5400.0),
        ("pbs", "30:00", 1800.0),
        ("pbs", "90", 90.0),
        ("slurm", "90", 5400.0),
        ("slurm", "2-00:00:30", 172830.0),
        ("lsf", "1:30", 5400.0),
        ("lsf", "90", 5400.0),
        ("oar", "2", 7200.0),
    ],
)
def test_limits_are_read_as_the_batch_system_reads_them(kind, text, expected):
    """Manuals: qsub(1B), sbatch(1), bsub -W, oarsub(1)."""
    assert time_limit.seconds(kind, text) == expected


@pytest.mark.parametrize("text", ["an hour", "1:2:3:4", "", "-10", "1h30"])
def test_a_limit_that_cannot_be_read_is_refused(text):
    with pytest.raises(ValueError, match="write it as 01:30:00"):
        time_limit.seconds("pbs", text)


def test_an_option_twice_is_refused_unless_it_is_a_list():
    assert keywords(["time=30", "setup=a=1", "setup=b"], ["setup"]) == {"time": 30, "setup": ["a=1", "b"]}
    with pytest.raises(BadCase, match=r"--option time: given twice \(30, 40\); .* repeated are setup"):
        keywords(["time=30", "time=40"], ["setup"])


QSUB = """#!/bin/sh
# Runs the job in a session of its own, as a node would; its number is that of the process.
setsid sh "$1" > {jobs}/job.out 2>&1 &
echo $! >> {jobs}/ids
echo $!.here
"""
QDEL = """#!/bin/sh
for job in "$@"; do kill -9 -- -${job%.here} 2> /dev/null; done
"""


def case_in(folder):
    folder.mkdir()
    (folder / "case.toml").write_text(CASE + SWEEP, encoding="utf-8")
    (folder / "rows.csv").write_text(TABLE, encoding="utf-8")
    return folder


def begin(case, *words, variables):
    command = [sys.executable, "-m", "coupler.cli", "sweep", str(case), *words]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    return subprocess.Popen(command, env=environment() | variables, text=True, **pipes)


def place_of(case, row):
    spec = read_spec(case / "runs" / "sweep")
    return spec.place(spec.rows[row].id)


def has_checkpoint(case):
    """One that is whole: what is being written has another name."""
    return any((case / "runs" / "sweep" / "runs").glob("*/checkpoints/[0-9]*.h5"))


def process_in(case):
    """Process of the long run, when it has begun in a job."""
    path = place_of(case, LONG) / "run.json"
    return json.loads(path.read_text())["process"] if path.exists() else None


def hold_until_its_time_is_over(process):
    variables = Path(f"/proc/{process}/environ").read_bytes().split(b"\0")
    ends = next(float(v.partition(b"=")[2]) for v in variables if v.startswith(time_limit.VARIABLE.encode()))
    os.kill(process, signal.SIGSTOP)
    time.sleep(max(0.0, ends + 3.0 - time.time()))
    os.kill(process, signal.SIGCONT)


def check(case, printed, lives):
    """All rows are there, and the long run went on from its checkpoints, in so many jobs at least."""
    here = collect(read_spec(case / "runs" / "sweep"))
    assert here.column("outcome") == ["cannot stand", "done"], printed
    summary = json.loads((place_of(case, LONG) / "run.json").read_text())
    times = [resumed["time"] for resumed in summary["resumed"]]
    assert len(times) >= lives - 1  # more on a busy machine, where jobs do not get far in their time
    assert times == sorted(times)
    assert times[0] > 0.0
    assert summary["figures"]["time"] == pytest.approx(0.4)
    log = (case / "runs" / "sweep" / "runs" / f"{place_of(case, LONG).name}.log").read_text()
    assert "another process runs" not in log


@needs_dask
@pytest.mark.nightly
@pytest.mark.timeout(900)
def test_a_run_whose_job_is_killed_goes_on_in_another(tmp_path):
    """Its node is lost in the middle of the run, without a word to anybody."""
    programs, jobs = tmp_path / "bin", tmp_path / "jobs"
    for folder in (programs, jobs):
        folder.mkdir()
    for name, text in (("qsub", QSUB.replace("{jobs}", str(jobs))), ("qdel", QDEL)):
        (programs / name).write_text(text, encoding="utf-8")
        (programs / name).chmod(0o755)
    case = case_in(tmp_path / "case")
    variables = {"PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}
    sweep = begin(case, "--engine", "dask-pbs", "--jobs", "1", variables=variables)
    try:
        until(lambda: has_checkpoint(case), "a checkpoint of the long run")
        os.killpg(int((jobs / "ids").read_text().split()[0]), signal.SIGKILL)
        printed, _ = sweep.communicate(timeout=600)
    finally:
        sweep.kill()
    assert sweep.returncode == 0, printed
    assert len((jobs / "ids").read_text().split()) == 2
    check(case, printed, lives=2)


@needs_dask
@pytest.mark.nightly
@pytest.mark.timeout(1500)
@pytest.mark.skipif(bool(GridEngine.missing()), reason=GridEngine.missing())
def test_grid_engine_runs_over_their_time_limit_and_deleted_ones_go_on(tmp_path):
    """A real Grid Engine: the first job is deleted with qdel. In the second one the run is held up until
    its time is over: it writes a checkpoint before Grid Engine would kill it, and goes on in a third job."""
    case = case_in(tmp_path / "case")
    with GridEngine(tmp_path / "sge") as engine:
        options = ("--option", "queue=all.q", "--option", "walltime=00:01:20")
        sweep = begin(case, "--engine", "dask-sge", "--jobs", "1", *options, variables=engine.variables)
        try:
            until(lambda: has_checkpoint(case), "a checkpoint of the long run")
            first = process_in(case)
            engine.output_of("qdel", "-u", "root")
            until(lambda: process_in(case) not in (first, None), "the long run in a second job")
            hold_until_its_time_is_over(process_in(case))
            printed, _ = sweep.communicate(timeout=1200)
        finally:
            sweep.kill()
        assert not engine.output_of("qstat").strip(), "jobs are left in the queue"
    assert sweep.returncode == 0, printed
    check(case, printed, lives=3)
