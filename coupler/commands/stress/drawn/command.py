"""`surgebreak stress --random`: scenes of a seed one after the other, their table, and the failures kept as cases."""

from __future__ import annotations

import json
import re
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from coupler.commands.stress.drawn.case import write
from coupler.commands.stress.drawn.dice import Dice
from coupler.commands.stress.drawn.scene import Drawn, draw, group_of
from coupler.commands.stress.drawn.shrink import shrunk
from coupler.commands.stress.drawn.trial import Trial, trial
from coupler.commands.stress.registry import GROUPS, Outcome
from coupler.commands.stress.report import FORM, HEAD, shown, totals
from coupler.program.errors import BadCall, ExitCode

ID = re.compile(r"R(\d+)-(\d+)", re.IGNORECASE)


def are_drawn(words: list[str]) -> bool:
    """Whether the words on the command line name drawn scenes. Raises BadCall where only some of them do."""
    drawn = [word for word in words if ID.fullmatch(word)]
    if drawn and len(drawn) < len(words):
        other = next(word for word in words if word not in drawn)
        raise BadCall(
            [f"{drawn[0]}: a random scene, and {other} is none; give random scenes in a call of their own"]
        )
    return bool(drawn)


def numbered(seed: int, count: int, first: int, groups: list[str]) -> Iterator[tuple[int, int]]:
    """(seed, number) of `count` scenes from number `first` on, of these groups; of all without any. Raises BadCall."""
    wrong = [
        f"{group}: unknown group; there are {', '.join(GROUPS)}" for group in groups if group not in GROUPS
    ]
    if wrong:
        raise BadCall(wrong)
    number = first
    while count > 0:
        if not groups or group_of(Dice(seed, number)) in groups:
            yield seed, number
            count -= 1
        number += 1


def named(words: list[str]) -> Iterator[tuple[int, int]]:
    """(seed, number) of scenes R<seed>-<number>. Raises BadCall."""
    for word in words:
        found = ID.fullmatch(word)
        if found is None:
            raise BadCall([f"{word}: random scenes are called R<seed>-<number>, for instance R1-12"])
        yield int(found[1]), int(found[2])


def stress_drawn(
    scenes: Iterator[tuple[int, int]], keep: Path, seconds: float, as_json: bool, only_list: bool
) -> ExitCode:
    """Run scenes and print each outcome as it comes. DIVERGED if one failed.

    Failures go to `keep`; each is reduced, which takes at most `seconds` of processor time."""
    outcomes = []
    if not as_json and not only_list:
        print(FORM.format(*HEAD).rstrip())
    for seed, number in scenes:
        drawn = draw(seed, number)
        if only_list:
            print(f"{drawn.id:9} {drawn.group:10} {drawn.title}")
            continue
        found = outcome(drawn, keep, seconds)
        outcomes.append(found)
        print(json.dumps(found.as_row()) if as_json else _shown(found), flush=True)
    if outcomes and not as_json:
        print(totals(outcomes))
    return ExitCode.DIVERGED if any(o.verdict == "failed" for o in outcomes) else ExitCode.DONE


def _shown(found: Outcome) -> str:
    """The whole outcome of a failure; otherwise its row and the output."""
    if found.verdict == "failed":
        return shown(found)
    return shown(
        Outcome(
            found.id, found.group, found.title, found.verdict, found.message, [], found.cpu_s, found.wall_s
        )
    )


def outcome(drawn: Drawn, keep: Path, seconds: float) -> Outcome:
    """Run a scene; a failure is reduced, within `seconds` of processor time, and kept."""
    with tempfile.TemporaryDirectory() as folder:
        found = _run(drawn, drawn.table, Path(folder))
    message = found.message
    if found.verdict == "failed":
        place = _kept(drawn, found, keep, seconds)
        message = f"{message}; kept in {place}" if message else f"kept in {place}"
    return Outcome(
        drawn.id, drawn.group, drawn.title, found.verdict, message, found.measures, found.cpu_s, found.wall_s
    )


def _run(drawn: Drawn, table: dict, folder: Path) -> Trial:
    return trial(write(table, drawn.files, folder / "case"), folder / "out", drawn.still)


def _kept(drawn: Drawn, found: Trial, keep: Path, seconds: float) -> Path:
    """Write the scene as a case to keep/ID, the reduced one to keep/ID/small, and the output of both to found.txt."""
    place = keep / drawn.id
    shutil.rmtree(place, ignore_errors=True)
    write(drawn.table, drawn.files, place)
    spent = 0.0
    last = found

    def fails_at(table: dict) -> float | None:
        nonlocal spent, last
        if spent >= seconds:
            return None
        with tempfile.TemporaryDirectory() as folder:
            again = _run(drawn, table, Path(folder))
        spent += again.cpu_s
        if again.verdict != "failed" or again.kind != found.kind:
            return None
        last = again
        return again.reached or 0.0

    small = shrunk(drawn.table, fails_at, found.reached)
    write(small, drawn.files, place / "small")
    (place / "found.txt").write_text(
        f"{drawn.id}: {drawn.title}\n{_story(found)}\n\nsmall: {_story(last)}\n", encoding="utf-8"
    )
    return place


def _story(found: Trial) -> str:
    missed = [f"{m.quantity} {m.value:.3g}, at most {m.limit:.3g}" for m in found.measures if not m.kept]
    return "; ".join([text for text in (found.message, *missed) if text])
