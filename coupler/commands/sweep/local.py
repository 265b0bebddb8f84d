"""Runs on this machine: a number of worker processes, each of which makes one run after the other."""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable
from functools import partial

from coupler.commands.sweep.folder import Spec
from coupler.program.process import end_with, environment
from coupler.program.threads import VARIABLE, cores

Tell = Callable[[dict], None]


class Local:
    """Hands runs to workers; `stop` lets the present ones write a checkpoint and end."""

    def __init__(self, spec: Spec, jobs: int):
        self.spec, self.jobs = spec, jobs
        self.waiting: queue.SimpleQueue[str] = queue.SimpleQueue()
        self.done: queue.SimpleQueue[dict | None] = queue.SimpleQueue()
        self.workers: list[subprocess.Popen] = []
        self.stopping = False

    def make(self, ids: Iterable[str], tell: Tell) -> None:
        """Make the runs and `tell` how each ended. Raises KeyboardInterrupt when all have stopped after Ctrl-C."""
        ids = list(ids)
        for id in ids:
            self.waiting.put(id)
        hands = [threading.Thread(target=self._work, daemon=True) for _ in range(min(self.jobs, len(ids)))]
        for hand in hands:
            hand.start()
        working = len(hands)
        interrupted = False
        while working:
            try:
                found = self.done.get()
            except KeyboardInterrupt:
                if interrupted:
                    self._kill()
                    raise
                interrupted = True
                self.stop()
                continue
            if found is None:
                working -= 1
            else:
                tell(found)
        if interrupted:
            raise KeyboardInterrupt

    def stop(self) -> None:
        """No further runs; the present ones end at their next step."""
        self.stopping = True
        for worker in self.workers:
            if worker.poll() is None:
                worker.terminate()

    def _kill(self) -> None:
        for worker in self.workers:
            if worker.poll() is None:
                os.killpg(worker.pid, 9)

    def _work(self) -> None:
        """Work of one thread: keep a worker process busy, and replace it if it dies."""
        worker, cold = None, False
        try:
            while not self.stopping:
                try:
                    id = self.waiting.get_nowait()
                except queue.Empty:
                    break
                worker = worker or self._start(cold)
                found = _ask(worker, id)
                if found is None:
                    found = _lost(id, worker.wait())
                    worker, cold = None, True
                self.done.put(found)
        finally:
            if worker is not None:
                worker.stdin.close()
                worker.wait()
            self.done.put(None)

    def _start(self, cold: bool) -> subprocess.Popen:
        """A worker in a session of its own: Ctrl-C of the terminal reaches it through `stop` alone. If this process is
        killed, the worker lets its run write a checkpoint and end, as `stop` does."""
        log = (self.spec.folder / "runs" / "worker.log").open("a", encoding="utf-8")
        words = [sys.executable, "-m", "coupler.commands.sweep_worker", str(self.spec.folder)]
        variables = environment() | {VARIABLE: str(self.spec.threads)}
        with log:
            worker = subprocess.Popen(
                [*words, *(["--cold"] if cold else [])],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                env=variables,
                text=True,
                start_new_session=True,
                preexec_fn=partial(end_with, os.getpid()),
            )
        self.workers.append(worker)
        return worker


def _ask(worker: subprocess.Popen, id: str) -> dict | None:
    """How a run ended that a worker made; None where the worker is gone."""
    try:
        worker.stdin.write(f"{id}\n")
        worker.stdin.flush()
        line = worker.stdout.readline()
    except OSError:
        return None
    return json.loads(line) if line else None


def _lost(id: str, code: int) -> dict:
    """The report of a run whose worker died. The run itself may still be going on; the next call finds out."""
    return {
        "id": id,
        "outcome": "crashed",
        "reason": f"its worker process ended with {code}",
        "cpu_seconds": 0.0,
    }


def free_cores(threads: int) -> int:
    """Number of runs with so many threads each for which this machine has cores, at least one."""
    return max(1, cores() // threads)
