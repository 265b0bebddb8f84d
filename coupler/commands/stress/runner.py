"""Runs scenes one after the other, each in a process of its own, because an extreme scene may crash its process."""

from __future__ import annotations

import time

from coupler.commands.stress.registry import Measure, Outcome, Scene, scenes
from coupler.program.errors import BadCall, did_you_mean
from coupler.program.process import rows_of_module

TIME_LIMIT = {"S": 600, "M": 3600}
"""Wall seconds after which a scene counts as failed: far more than its cost."""


def chosen(ids: list[str], quick: bool) -> list[Scene]:
    """The scenes asked for, by id or group; all without; with quick only those of cost S. Raises BadCall, also where
    none is left."""
    known = scenes()
    groups = sorted({s.group for s in known.values()})
    names = [*known, *groups]
    wrong = [
        f"{word}: unknown scene{did_you_mean(word, names) or '.'} `surgebreak stress --list` names all"
        for word in ids
        if word.upper() not in known and word not in groups
    ]
    if wrong:
        raise BadCall(wrong)
    words = {word.upper() for word in ids} | set(ids)
    found = [s for s in known.values() if not ids or s.id in words or s.group in words]
    left = [s for s in found if s.cost == "S" or not quick]
    if not left:
        raise BadCall([f"--quick leaves out {', '.join(s.id for s in found)}: each takes minutes"])
    return left


def run(scene: Scene) -> Outcome:
    """The outcome of a scene from its own process; a process that crashes is a failure, with its output."""
    began = time.perf_counter()
    rows, wrong = rows_of_module("coupler.commands.stress.one", scene.id, TIME_LIMIT[scene.cost])
    measures = [Measure(**row["measure"]) for row in rows if "measure" in row]
    ended = next((row["outcome"] for row in rows if "outcome" in row), None)
    if wrong or ended is None:
        ended = ("failed", wrong or "its process gave no outcome", 0.0, time.perf_counter() - began)
    verdict, message, cpu, wall = ended
    return Outcome(scene.id, scene.group, scene.title, verdict, message, measures, cpu, wall)
