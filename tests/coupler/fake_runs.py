"""Runs of a study that come from a formula instead of a computation: the process is replaced, everything else is real.

A run with time.step_max = h gives the value 2 (1 + h²) at a cost of 1 s/h; what a study should find is then known.
"""

import json
from pathlib import Path

from coupler.case.case import Case, effective
from coupler.checks.read_case import load
from coupler.commands.study.runner import Cost
from coupler.program.errors import ExitCode
from coupler.results.history import HistoryTable

CASE = """\
[case]
title = "fake"
[time]
end = 4
step_max = 0.1
[structure]
[[structure.block]]
name = "box"
size = [1, 1, 1]
centre = [0, 0, 0.5]
[contact]
stiffness = 1e6

[study]
[[study.quantity]]
name = "exact"
table = "history/gauges.csv"
column = "value"
against = "exact"
value = "structure.block[0].size[2] * 2"
[[study.quantity]]
name = "measured"
table = "history/gauges.csv"
column = "value"
against = "measured"
value = 2.02
band = 0.1
[[study.quantity]]
name = "finest"
table = "history/gauges.csv"
column = "value"
take = "mean"
against = "finest"
ladder = "dt"
[[study.ladder]]
name = "dt"
key = "time.step_max"
values = [0.4, 0.2, "100 ms"]
larger = [0.05]
[[study.ladder]]
name = "rule"
key = "contact.rule"
values = ["exact", "paper"]
[[study.off]]
name = "friction"
set = ["contact.friction=0"]
"""


SUMMARY = {
    "exit_code": 0,
    "started": "2026-01-31T12:00:00+00:00",
    "ended": "2026-01-31T12:01:00+00:00",
    "process": 1,
    "command": ["surgebreak"],
    "case_file": "case.toml",
    "overrides": [],
    "modules": {},
    "versions": {},
    "machine": {"system": "", "processor": "", "cores": 1, "threads": "1"},
}
"""What run.json of any run holds, but for how it ended, its figures and its case."""


class FakeProcesses:
    """Stands in for `measure`. calls: settings that were run · broken: steps whose runs fail, with the reason ·
    stop_after: calls after which Ctrl-C is pressed · compiling: CPU seconds that compilation takes in the next run."""

    def __init__(self):
        self.calls, self.broken, self.stop_after, self.compiling = [], {}, None, 0.0

    def __call__(self, command: list[str], log: Path) -> Cost:
        place = Path(command[command.index("--output") + 1])
        if place.name == "first_step":
            return Cost(1.0, 1.0, 0, 0)
        if self.stop_after is not None and len(self.calls) >= self.stop_after:
            raise KeyboardInterrupt
        self.calls.append(command)
        if "compare" in command:
            write_comparison(place)
            return Cost(5.0, 9.0, 10**8, ExitCode.DONE)
        sets = [command[i + 1] for i, word in enumerate(command) if word == "--set"]
        case = load(command[command.index("run") + 1], sets).case
        reason = self.broken.get(case.time.step_max, "")
        write_run(place, case, reason)
        compiled = json.dumps({"compile_seconds": self.compiling})
        Path(command[command.index("run") - 1]).write_text(compiled, encoding="utf-8")
        self.compiling = 0.0
        return Cost(
            3.0 + 1.0 / case.time.step_max, 9.0, 10**8, ExitCode.DIVERGED if reason else ExitCode.DONE
        )


def write_comparison(place: Path) -> None:
    """What `surgebreak compare` leaves, of one law of ours and one of YADE: off by 1 % and 4 % a multiple."""
    place.mkdir()
    rows = [
        {
            "law": law,
            "multiple": multiple,
            "substep": 1e-5 * multiple,
            "stock": stock,
            "cpu_seconds": 1.0 / multiple,
            "peak_force": 2.0 * (1.0 + share * multiple),
            "dissipated": 1.0,
        }
        for law, stock, share in (("polynomial", False, 0.01), ("cohfrict", True, 0.04))
        for multiple in (2, 1)
    ]
    (place / "comparison.json").write_text(json.dumps({"laws": rows}), encoding="utf-8")


def write_run(place: Path, case: Case, reason: str) -> None:
    """The files of a run that a study reads."""
    h, friction = case.time.step_max, case.contact.friction
    (place / "history").mkdir(parents=True)
    with HistoryTable(
        place / "history" / "gauges.csv", [("time", "s", "time"), ("value", "1", "v")]
    ) as table:
        for k in range(5):
            table.append(time=float(k), value=2.0 * (1.0 + h**2))
    with HistoryTable(
        place / "history" / "coupling.csv", [("time", "s", "time"), ("passes", "1", "p")]
    ) as table:
        table.append(time=0.0, passes=1)
        table.append(time=1.0, passes=2)
    cost = 1.0 / h + (0.25 if friction else 0.0)
    figures = {
        "steps": 4,
        "cpu_seconds": {"structure": cost - 0.5, "set-up": 0.75, "other": 0.5},
        "size": {"blocks": 1},
    }
    ended = {"status": "diverged" if reason else "done", "exit_reason": reason or "reached the end"}
    (place / "run.json").write_text(
        json.dumps(SUMMARY | ended | {"figures": figures, "case": effective(case)}), encoding="utf-8"
    )
