"""The list of scenes: the purpose of each scene, its limits, and the results that its function yields.

A scene is a generator of `Measure`s: a physical quantity of a run and its limit. A scene may end
by refusing: an error of this program with a message that says what to change, where `refusal` allows or asks for it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from importlib import import_module
from typing import Literal

GROUPS: dict[str, tuple[str, ...]] = {
    "structure": ("strength", "contacts", "masses", "places", "steps", "piles"),
    "water": ("still", "violent"),
    "coupling": ("bodies", "crowds"),
}
"""Packages in this folder and their files with scenes."""

Cost = Literal["S", "M"]
Refusal = Literal["never", "may", "must"]
Verdict = Literal["passed", "refused", "failed"]


@dataclass(frozen=True)
class Measure:
    """A value and its upper limit; `unit` "1" for shares. limit None: only reported, not judged."""

    quantity: str
    value: float
    limit: float | None
    unit: str = "1"

    @property
    def kept(self) -> bool:
        """Whether the value keeps its limit; NaN does not."""
        return self.limit is None or abs(self.value) <= self.limit


@dataclass(frozen=True)
class Scene:
    """cost on two cores: S below a minute, M below 15. refusal: whether it may or must end with a message."""

    id: str
    group: str
    title: str
    cost: Cost
    refusal: Refusal
    run: Callable[[], Iterator[Measure]]


@dataclass(frozen=True)
class Outcome:
    """Result of a scene: verdict, the message of a refusal or failure, measures, CPU and wall seconds."""

    id: str
    group: str
    title: str
    verdict: Verdict
    message: str = ""
    measures: list[Measure] = field(default_factory=list)
    cpu_s: float = 0.0
    wall_s: float = 0.0

    def as_row(self) -> dict:
        """For JSON."""
        row = asdict(self)
        row["measures"] = [asdict(m) | {"kept": bool(m.kept)} for m in self.measures]
        return row


def judged(scene: Scene, measures: list[Measure], refused: str, cpu_s: float, wall_s: float) -> Outcome:
    """The verdict on a scene that ended by itself; refused: the message, "" for a run to the end."""
    kept = all(m.kept for m in measures) and (bool(measures) or bool(refused))
    allowed = scene.refusal != "never" if refused else scene.refusal != "must"
    verdict: Verdict = "failed"
    if kept and allowed:
        verdict = "refused" if refused else "passed"
    message = refused or ("should have been refused" if not allowed else "")
    return Outcome(scene.id, scene.group, scene.title, verdict, message, measures, cpu_s, wall_s)


_registered: dict[str, Scene] = {}


def scene(id: str, title: str, cost: Cost = "S", refusal: Refusal = "never"):
    """Register the decorated generator as a scene; its group is its package."""

    def keep(run):
        _registered[id] = Scene(id, run.__module__.split(".")[-2], title, cost, refusal, run)
        return run

    return keep


def scenes() -> dict[str, Scene]:
    """All scenes by id, in order."""
    for group, files in GROUPS.items():
        for name in files:
            import_module(f"coupler.commands.stress.{group}.{name}")
    return dict(sorted(_registered.items()))
