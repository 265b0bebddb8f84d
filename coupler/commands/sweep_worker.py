"""A process that loads the program once and makes one run after the other: `python -m coupler.commands.sweep_worker
FOLDER [--cold]`, ids of runs line by line on standard input, how they ended as JSON on standard output.

Before the first run it goes through one step of that run itself, which loads YADE and all kernels. Every run then has
a process of its own, forked from there: one that crashes takes nothing with it. Nothing remains of that step but the
loaded modules; a test compares the files of such a run with those of a run of its own bit for bit.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Sequence
from pathlib import Path

from coupler.commands.cli import main as command
from coupler.commands.study.runner import Cost
from coupler.commands.sweep.folder import Spec, read_spec
from coupler.commands.sweep.one import make
from coupler.program.process import end_with
from coupler.program.start import one_thread


class Forked:
    """An `Execute` whose processes are forked from this one."""

    def __init__(self):
        self.child = 0

    def __call__(self, words: Sequence[str], log: Path) -> Cost:
        """Run the command in a fork; see `one.Process`."""
        began = time.perf_counter()
        sys.stdout.flush()
        parent = os.getpid()
        self.child = os.fork()
        if self.child == 0:
            _be(words, log, parent)
        _, status, used = os.wait4(self.child, 0)
        self.child = 0
        wall = time.perf_counter() - began
        code = os.waitstatus_to_exitcode(status)
        return Cost(used.ru_utime + used.ru_stime, wall, used.ru_maxrss * 1024, code)

    def stop(self, number: int, frame: object) -> None:
        """Hand SIGTERM on to the run, which ends at its next step; without one this process ends."""
        if self.child:
            os.kill(self.child, signal.SIGTERM)
        else:
            os._exit(0)


def _be(words: Sequence[str], log: Path, parent: int) -> None:
    """Become `surgebreak WORDS`; never returns."""
    code = 1
    try:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        end_with(parent)
        descriptor = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        os.dup2(descriptor, 1)
        os.dup2(descriptor, 2)
        sys.argv = ["surgebreak", *words]
        command()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 1
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def warm(spec: Spec, id: str) -> None:
    """Go through one step of a run in this process and forget it: YADE, kernels and libraries are loaded then."""
    from coupler.case.schedule import first_part
    from coupler.checks.read_case import load
    from coupler.commands.warm_up import Silent
    from coupler.run.directory import RunDirectory
    from coupler.run.run import run

    file = load(spec.case_file, spec.runs[id])
    short = min(file.case.time.end, file.case.time.step_max)
    file = load(spec.case_file, (*spec.runs[id], *first_part(file.case, short)))
    with (
        tempfile.TemporaryDirectory() as folder,
        RunDirectory.create(file, Path(folder) / "run") as directory,
    ):
        run(file.case, directory, Silent())


def serve(folder: Path, cold: bool) -> None:
    """Make the runs whose ids come in until there are no more."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)  # YADE and the runs must not print where answers are expected
    execute = Forked()
    signal.signal(signal.SIGTERM, execute.stop)
    for line in sys.stdin:
        id = line.strip()
        spec = read_spec(folder)
        warmed = 0.0
        if not cold:
            cold, began = True, time.process_time()
            try:
                warm(spec, id)
            except Exception as error:  # that run cannot begin, and reports so itself when it is made
                print(f"one step of run {id} went not well, nothing is loaded: {error}", file=sys.stderr)
            warmed = time.process_time() - began
            signal.signal(signal.SIGTERM, execute.stop)  # YADE has handlers of its own
        found = make(spec, id, execute)
        answers.write(json.dumps({"warmed": warmed, **found}) + "\n")
        answers.flush()


if __name__ == "__main__":
    one_thread()
    serve(Path(sys.argv[1]), "--cold" in sys.argv[2:])
