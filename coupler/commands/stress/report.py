"""Outcomes as a table that grows scene by scene, and as JSON, one object per line."""

from __future__ import annotations

import json

from coupler.commands.stress.registry import Measure, Outcome, Scene
from coupler.commands.stress.runner import chosen, run
from coupler.program.errors import ExitCode

FORM = "{:5} {:10} {:66} {:8} {:>7} {:>7}"
HEAD = ("scene", "group", "what", "verdict", "cpu s", "wall s")


def stress(words: list[str], quick: bool, as_json: bool, only_list: bool) -> ExitCode:
    """Run the scenes asked for and print each outcome as it comes; DIVERGED if one failed."""
    asked = chosen(words, quick)
    if only_list:
        print(listing(asked))
        return ExitCode.DONE
    if not as_json:
        print(FORM.format(*HEAD).rstrip())
    outcomes = []
    for scene in asked:
        outcomes.append(run(scene))
        print(json.dumps(outcomes[-1].as_row()) if as_json else shown(outcomes[-1]), flush=True)
    if not as_json:
        print(totals(outcomes))
    return ExitCode.DIVERGED if any(o.verdict == "failed" for o in outcomes) else ExitCode.DONE


def shown(outcome: Outcome) -> str:
    """A row for the scene, one below it for each measure, and the output."""
    o = outcome
    verdict = o.verdict if o.verdict != "failed" else "FAILED"
    head = FORM.format(o.id, o.group, o.title, verdict, f"{o.cpu_s:.1f}", f"{o.wall_s:.1f}")
    below = [_measure(m) for m in o.measures] + ([f"      {o.message}"] if o.message else [])
    return "\n".join([head, *below])


def _measure(m: Measure) -> str:
    unit = "" if m.unit == "1" else f" {m.unit}"
    limit = "" if m.limit is None else f" (at most {m.limit:.3g}{unit})"
    return f"      {m.quantity}: {m.value:.3g}{unit}{limit}{'' if m.kept else '  <- not kept'}"


def totals(outcomes: list[Outcome]) -> str:
    """How many of each verdict, and the time."""
    count = {v: sum(o.verdict == v for o in outcomes) for v in ("passed", "refused", "failed")}
    message = ", ".join(f"{number} {verdict}" for verdict, number in count.items())
    failed = [o.id for o in outcomes if o.verdict == "failed"]
    return (
        f"{message}{': ' + ', '.join(failed) if failed else ''}; {sum(o.cpu_s for o in outcomes):.1f} CPU s"
    )


def listing(scenes: list[Scene]) -> str:
    """Every scene with its group, cost, and whether it may be refused."""
    ends = {"never": "", "may": "  (may be refused)", "must": "  (must be refused)"}
    return "\n".join(f"{s.id:5} {s.group:10} {s.cost}  {s.title}{ends[s.refusal]}" for s in scenes)
