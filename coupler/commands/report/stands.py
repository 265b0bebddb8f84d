"""The first screen of the report of a structure: the verdict, the order and times of failures, and its figures."""

from __future__ import annotations

from html import escape
from pathlib import Path

from coupler.commands.report.html import drawn, figure, note, table
from coupler.program.quantities import length, moment_of, percent, quantity
from coupler.verdict.words import attitude, name_of, point, sentences

FIGURES = {
    "damage": "Share of the joined area that is broken, by wall and floor, in order of their first break",
    "cracks": "Cracks by the time at which they opened, in elevation and plan",
    "wall_pressure": "Envelope: the largest net pressure of the water that each block bore in its place",
}
"""Figures of a verdict (coupler/commands/view/damage.py) and their captions."""
MOST = 30
"""Rows of a table of walls and floors."""


def stands(summary: dict, pictures: Path) -> list[str]:
    """Pieces of the section; none for a run without a structure."""
    judged = summary["figures"].get("verdict")
    if not judged:
        return []
    first, *rest = sentences(judged)
    found = drawn(pictures)
    shown = [figure(found[name], words) for name, words in FIGURES.items() if name in found]
    return [
        f'<p class="verdict state-{escape(judged["state"])}">{escape(first)}</p>',
        f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in rest)}</ul>",
        *_bores(summary["figures"].get("bores", []), judged),
        *_groups("body", judged["bodies"] if len(judged["bodies"]) > 1 else [], judged, loads=True),
        *_groups("storey", judged["storeys"] if len(judged["storeys"]) > 1 else [], judged),
        *_groups("wall, floor or part", judged["members"] if len(judged["members"]) > 1 else [], judged),
        *shown,
        _displaced(judged),
        _hits(judged),
        note(_rules(judged)),
    ]


def _bores(found: list[dict], judged: dict) -> list[str]:
    """Theoretical depth and velocity of each bore at the structure, and the depth computed beside it."""
    measured = judged["largest"]["depth"]
    beside = f"{length(measured['value'])} at {moment_of(measured['time'])}" if measured else "–"
    rows = [
        [
            f"{bore['side']}: {length(bore['depth'])}, {quantity(bore['velocity'], 'm/s')}",
            f"{length(bore['depth_there'])}, {quantity(bore['velocity_there'], 'm/s')}",
            length(bore["against_wall"]),
            beside,
        ]
        for bore in found
    ]
    head = [
        "bore where it comes in: depth, velocity",
        f"by theory at {found[0]['at'] if found else ''}",
        "depth against a wall across the tank",
    ]
    return [table([*head, "measured: largest depth beside it"], rows, (0, 1))] if rows else []


def _groups(what: str, groups: list[dict], judged: dict, loads: bool = False) -> list[str]:
    """A table of groups, those that broke first come first."""
    if not groups:
        return []
    ranked = sorted(groups, key=lambda g: g["first_break"]["time"] if g["first_break"] else float("inf"))
    head = [
        what,
        "state",
        "first break",
        "joints broken",
        "share of the joined area",
        "blocks out of place",
        "largest displacement",
    ]
    head += ["largest force", "at", "largest depth"] if loads else []
    rows = [_group(group, judged, loads) for group in ranked[:MOST]]
    left = len(ranked) - len(rows)
    return [table(head, rows, (0, 1)), note(f"and {left} more in run.json" if left else "")]


def _group(group: dict, judged: dict, loads: bool) -> list[str]:
    first = group["first_break"]
    row = [
        name_of(judged, group["name"]),
        group["word"],
        moment_of(first["time"]) if first else "–",
        _joints(group) if group["joints"] else "–",
        percent(group["area_broken"]) if group["joints"] else "–",
        f"{group['blocks_moved']} of {group['blocks']}",
        length(group["farthest"]["way"]),
    ]
    if loads:
        force, depth = (group.get("largest", {}).get(name) for name in ("force", "depth"))
        row += [
            quantity(force["value"], "N") if force else "–",
            moment_of(force["time"]) if force else "–",
            length(depth["value"]) if depth else "–",
        ]
    return row


def _joints(group: dict) -> str:
    torn = group.get("joints_torn", 0)
    return f"{group['joints_broken']} of {group['joints']}" + (f", {torn} torn" if torn else "")


def _displaced(judged: dict) -> str:
    found = judged["displaced"]
    rows = [
        [b["block"], length(b["way"]), moment_of(b["left_at"]), attitude(b) if b.get("shift") else "–"]
        for b in found["list"]
    ]
    left = found["blocks"] - len(rows)
    return table(["block that left its place", "moved by", "left at", "at the end"], rows, (0, 3)) + note(
        f"and {left} more in blocks.csv" if left else ""
    )


def _hits(judged: dict) -> str:
    rows = [
        [
            hit["block"], hit["other"], moment_of(hit["time"]), point(hit["place"]), quantity(hit["speed"], "m/s"),
            quantity(hit["impulse"], "N s"), quantity(hit["force"], "N"),
        ]
        for hit in judged["hits"]["list"]
    ]  # fmt: skip
    head = ["debris", "hit", "at", "place", "speed lost", "impulse", "mean force of the step"]
    return table(head, rows, (0, 1)) + note(
        "Of the hits of a pair the hardest; forces of impacts depend on the length of the step."
        if rows
        else ""
    )


def _rules(judged: dict) -> str:
    r = judged["rules"]
    by_joints = r["collapsed_joints"]
    return (
        f"Rules: a block has left its place when its centre has moved by more than {percent(r['moved'])} of its "
        f"thickness (verdict.moved); damaged: more than {percent(r['damaged_joints'])} of the joined area broken or "
        "torn (verdict.damaged_joints), or a block out of its place; collapsed: "
        f"{percent(r['collapsed_weight'])} of the weight out of its place for good (verdict.collapsed_weight), without "
        "what came back or rocks"
        + (
            f", or {percent(by_joints)} of the joined area broken (verdict.collapsed_joints)."
            if by_joints
            else "."
        )
    )
