"""One random scene, run in a separate process as a user would run it, and its verdict.

passed: the run ended or used up its processor time, and its files keep all limits · refused: the case was not accepted,
each message with file, line and key, or the run was refused because a random scene may ask too much · failed: any other
result
"""

from __future__ import annotations

import json
import re
import resource
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

from coupler.commands.stress.drawn.judge import measures
from coupler.commands.stress.registry import Measure, Verdict
from coupler.program.errors import ExitCode
from coupler.program.process import run_module, trouble
from coupler.step.step_limits import ONE_PASS

CPU_SECONDS = 120
"""Processor time after which a scene that does not end by itself is killed, and counts as failed."""
WALL_SECONDS = 3600
"""Wall time [s] after which a scene that hangs counts as failed; beside other programs a good one may take minutes."""
WATER = 1000.0
"""Density [kg/m³] of water where the case has none."""
MISTAKE = re.compile(r"case\.toml(:\d+)?: [a-z][\w.\[\]-]*: .{20,}")
"""A message about a case: file, line, key and a reason."""
TOO_WEAK = "the structure cannot carry its own weight and the load at the start"
TOO_SOFT = "is too soft for the weight or the speed of the blocks"
"""Messages with which a run may refuse a drawn scene: strengths are drawn without knowing what they will carry, and
contact may take its stiffness from joints of such a strength."""


@dataclass(frozen=True)
class Trial:
    """Result of one run: verdict, what was printed, figures, processor and wall seconds, time reached [s]."""

    verdict: Verdict
    message: str
    measures: list[Measure]
    cpu_s: float
    wall_s: float
    reached: float | None

    @property
    def kind(self) -> str:
        """Kind of a failure: the same for the same fault, whatever the numbers and names in its message."""
        missed = [m.quantity.split(" (")[0] for m in self.measures if not m.kept]
        if missed:
            return "not kept: " + missed[0]
        words = re.sub(r"[^A-Za-z ]+", " ", re.sub(r"'[^']*'|\([^)]*\)|\S*\d\S*", " ", self.message))
        return " ".join(words.split()[:8])


def trial(case: Path, output: Path, still: bool) -> Trial:
    """Run a case directory into a new directory."""
    began = time.perf_counter()
    try:
        done = run_module(
            "coupler.commands.cli",
            "run",
            case,
            "--output",
            output,
            capture_output=True,
            text=True,
            timeout=WALL_SECONDS,
            preexec_fn=_within_processor_time,
        )
    except subprocess.TimeoutExpired:
        return Trial("failed", f"not done after {WALL_SECONDS} s", [], 0.0, time.perf_counter() - began, None)
    summary = _summary(output)
    figures = summary.get("figures", {})
    spent = (summary.get("cpu_seconds", 0.0), time.perf_counter() - began, figures.get("time"))
    if done.returncode == ExitCode.BAD_CASE:
        refused, why = _refusal(done.stderr)
        return Trial("refused" if asked_too_much(why, summary.get("case", {})) else refused, why, [], *spent)
    if done.returncode in (ExitCode.DONE, ExitCode.STOPPED):
        found = list(measures(output, still))
        verdict: Verdict = "passed" if all(m.kept for m in found) else "failed"
        return Trial(verdict, "" if done.returncode == 0 else "stopped at its processor time", found, *spent)
    if done.returncode == -signal.SIGXCPU:
        return Trial("failed", f"still computing after {CPU_SECONDS} s of processor time", [], *spent)
    message = summary.get("exit_reason") or trouble(done.returncode, done.stderr)
    return Trial(
        "refused" if asked_too_much(message, summary.get("case", {})) else "failed", message, [], *spent
    )


def _within_processor_time() -> None:
    """Limit the processor time of the child process, so that the system ends a run that never stops."""
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS + 10))


def asked_too_much(message: str, case: dict) -> bool:
    """Whether a run was refused for what a drawn scene may ask. A stiffness of its own makes contact stiff enough, and
    one pass is enough for blocks heavier than the water (`check` remarks on lighter ones, P58 has the growth)."""
    return (
        TOO_WEAK in message
        or (TOO_SOFT in message and "stiffness" not in case.get("contact", {}))
        or (ONE_PASS in message and _is_light(case))
    )


def _is_light(case: dict) -> bool:
    """Whether a block of the case is lighter than its water."""
    structure, water = case["structure"], case["water"].get("density") or WATER
    parts = [part for rows in structure.values() if isinstance(rows, list) for part in rows]
    own = [part["density"] for part in parts if part.get("density") is not None]
    return min([structure["density"], *own]) < water


def _refusal(stderr: str) -> tuple[Verdict, str]:
    """Whether every message printed about a case gives the place and the reason."""
    lines = [line for line in stderr.splitlines() if line.strip()]
    mistakes = [line for line in lines if not line.startswith("surgebreak: ")]
    right = bool(mistakes) and all(MISTAKE.search(line) for line in mistakes)
    return ("refused" if right else "failed"), " | ".join(mistakes or lines)


def _summary(output: Path) -> dict:
    path = output / "run.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
