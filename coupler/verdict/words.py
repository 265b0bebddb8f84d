"""The verdict in the words of an engineer."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from coupler.program.quantities import length, moment_of, quantity
from coupler.verdict.divisions import in_words

MOST_IN_ORDER = 12
"""Walls and floors whose first break is reported in a line; the table has all."""

MOST_NAMED = 8
"""Bodies of one state that are named in a line; the table of buildings has all."""

SOON = 0.5
"""Share of the length of a run within which a block that moves at its end would leave its place."""


def headline(reported: dict) -> str:
    """The answer in one line: COLLAPSED: 63% of its weight left its place (...)."""
    return f"{reported['word'].upper()}: {reported['rule']}"


def sentences(reported: dict) -> Iterator[str]:
    """The verdict line by line; its argument is what `judge.verdict` returns."""
    yield headline(reported)
    yield from _of_bodies(reported["bodies"])
    yield from _not_judged(reported["bodies"])
    yield from _first_break(reported)
    yield from _order(reported)
    yield from _loads(reported["largest"])
    yield from _displaced(reported)
    yield from _hits(reported["hits"])


def unreached(reported: dict, time: float) -> str | None:
    """A sentence where no water touched the structure until time [s], so that the verdict reflects its weight and
    contacts alone; None otherwise. For runs whose water can meet the structure."""
    if reported["largest"]["force"]:
        return None
    return (
        f"no water touched the structure until the run ended at t = {moment_of(time)}: this verdict says nothing about "
        "the water; raise time.end, or look in the pictures where the water goes"
    )


def unfinished(time: float, end: float) -> str:
    """A sentence for a run that ended at time [s], before its end [s]: what broke until then is a lower bound."""
    return (
        f"the run ended early, at t = {moment_of(time)} of {moment_of(end)}: "
        "this verdict says nothing about what comes later"
    )


def unsettled(reported: dict, time: float) -> str | None:
    """A sentence where a run of this length [s] ends while a block of a structure that has not collapsed moves out of
    its place, and would have left it soon; None otherwise."""
    found = reported["leaving"]
    if found is None or reported["state"] == "collapsed" or found["within"] > SOON * time:
        return None
    return (
        f"'{found['block']}' still moves as the run ends at t = {moment_of(time)}: it is {length(found['way'])} from "
        f"its place, and at {quantity(found['speed'], 'm/s')} it leaves it within {moment_of(found['within'])}; this "
        "verdict is not the last one: raise time.end"
    )


def still_rising(reported: dict, time: float) -> str | None:
    """A sentence where the load of the water on a structure that has not collapsed is at its largest and still grows
    as the run ends at time [s]; None otherwise."""
    found = reported["rising"]
    if found is None or reported["state"] == "collapsed":
        return None
    load = "horizontal force" if found["load"] == "horizontal" else "force"
    return (
        f"the {load} of the water still grows as the run ends at t = {moment_of(time)}: its mean over about the last "
        f"twentieth of the run, {quantity(found['recent'], 'N')}, is as large as ever and "
        f"{found['recent'] / found['long'] - 1.0:.0%} above that over the last fifth; this verdict may come before "
        "the largest load: raise time.end"
    )


def name_of(reported: dict, name: str) -> str:
    """A wall, floor or storey in words."""
    return in_words(name, {body["name"] for body in reported["bodies"]})


def point(place: Sequence[float]) -> str:
    """(30.00, 9.00, 2.20) m"""
    return "({}) m".format(", ".join(f"{x + 0.0:.2f}" for x in place))


def _of_bodies(bodies: Sequence[dict]) -> Iterator[str]:
    """Where several buildings, walls or groups have joints: how many of them collapsed, and which. The headline judges
    all of them together, so that a town of which two houses collapsed is damaged."""
    joined = [body for body in bodies if body["joints"]]
    if len(joined) < 2:
        return
    parts = []
    for state, of_one, of_several in (
        ("collapsed", "collapsed", "collapsed"),
        ("damaged", "is damaged", "are damaged"),
        ("stands", "stands", "stand"),
    ):
        names = [body["name"] for body in joined if body["state"] == state]
        more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
        which = f" ({', '.join(names[:MOST_NAMED])}{more})" if state != "stands" else ""
        if names:
            parts.append(f"{len(names)} {of_one if len(names) == 1 else of_several}{which}")
    yield f"of {len(joined)} bodies with joints " + ", ".join(parts)


def _not_judged(bodies: Sequence[dict]) -> Iterator[str]:
    """The bodies that the verdict is not about, with their states: loose blocks beside a structure with joints."""
    left = [body for body in bodies if not body.get("judged", True)]
    if not left:
        return
    parts = []
    for word in dict.fromkeys(body["word"] for body in left):
        names = [body["name"] for body in left if body["word"] == word]
        more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
        parts.append(f"{', '.join(names[:MOST_NAMED])}{more} ({word})")
    yield f"not judged: {', '.join(parts)}; verdict.on names what is judged, by default what has joints"


def _first_break(reported: dict) -> Iterator[str]:
    if not reported["joints"]:
        return
    first, torn = reported["first_break"], reported.get("joints_torn", 0)
    its = "its" if torn == 1 else "their"
    if first is None:
        part = f", {torn} are torn: they hold by a part of their face" if torn > 1 else ""
        part = ", one is torn: it holds by a part of its face" if torn == 1 else part
        yield f"no joint of {reported['joints']} broke{part}"
        return
    yield (
        f"first break at t = {moment_of(first['time'])} at {point(first['place'])}, between {first['blocks'][0]} "
        f"and {first['blocks'][1]}; {reported['joints_broken']} of {reported['joints']} joints broke, "
        f"{reported['area_broken']:.0%} of the joined area"
        + (
            f"; {torn} more {'holds' if torn == 1 else 'hold'} by a part of {its} face, the rest is torn"
            if torn
            else ""
        )
    )


def _order(reported: dict) -> Iterator[str]:
    """The order in which walls, floors and storeys broke."""
    for what, key in (("walls and floors", "members"), ("storeys", "storeys")):
        found = [group for group in reported[key] if group["first_break"]]
        found.sort(key=lambda group: group["first_break"]["time"])
        if len(reported[key]) < 2 or not found:
            continue
        listed = [
            f"{name_of(reported, group['name'])} at {moment_of(group['first_break']['time'])}"
            for group in found[:MOST_IN_ORDER]
        ]
        more = len(found) - len(listed)
        yield f"{what} broke in this order: {', '.join(listed)}" + (f", and {more} more" if more else "")


def _loads(largest: dict) -> Iterator[str]:
    force, push, moment, depth = (largest.get(name) for name in ("force", "horizontal", "moment", "depth"))
    parts = []
    if force:
        parts.append(f"force of the water {at(force, 'N')} with its uplift")
    if push:
        parts.append(f"horizontally {at(push, 'N')}")
    if moment:
        whose = f"the base of {moment['of']}" if moment.get("of") else "its base"
        parts.append(f"overturning moment about the middle of {whose} {at(moment, 'N m')}")
    if depth:
        parts.append(f"depth of water beside it {length(depth['value'])} at {moment_of(depth['time'])}")
    if parts:
        yield "largest " + ", ".join(parts)


def at(peak: dict, unit: str) -> str:
    """3.2 MN at 1.6 s"""
    return f"{quantity(peak['value'], unit)} at {moment_of(peak['time'])}"


def _displaced(reported: dict) -> Iterator[str]:
    found = reported["displaced"]
    if not found["blocks"]:
        yield f"no block left its place; the largest displacement is {length(reported['farthest']['way'])}"
        return
    farthest = found["list"][0]
    whose = "its" if found["blocks"] == 1 else "their"
    yield (
        f"{found['blocks']} of {reported['blocks']} blocks left {whose} place, the first at t = "
        f"{moment_of(found['first'])}; the farthest is {farthest['block']}, by {length(farthest['way'])}"
        + (f" (at the end {attitude(farthest)})" if farthest.get("shift") else "")
    )
    yield from _attitudes(found)
    if found.get("back"):
        yield f"{found['back']} of these {'is' if found['back'] == 1 else 'are'} back in place"
    if found.get("rocking"):
        yield (
            f"{found['rocking']} of these {'rocks' if found['rocking'] == 1 else 'rock'} at the end: what they belong "
            "to tilts about an edge in its place, and its centre of mass is not beyond that; raise time.end to see "
            "whether it comes back"
        )


def attitude(block: dict) -> str:
    """6.93 m sideways, 5 mm down, tilted by 3 degrees"""
    x, y, z = block["shift"]
    level = f"{length(math.hypot(x, y))} sideways"
    upright = f", {length(abs(z))} {'up' if z > 0.0 else 'down'}" if abs(z) >= 0.01 * math.hypot(x, y) else ""
    return f"{level}{upright}, tilted by {degrees(block['tilt'])}"


def degrees(angle: float) -> str:
    """An angle [rad] in words: 23 degrees, 3.2 degrees"""
    size = math.degrees(angle)
    return f"{size:.0f} degrees" if size >= 10.0 else f"{size:.1f} degrees"


def _attitudes(found: dict) -> Iterator[str]:
    """Whether what left its place slid, leans or has overturned; of a single block its tilt is reported already."""
    if found.get("upright") is None or found["blocks"] == 1:
        return
    if found["upright"] == found["blocks"]:
        yield "at the end none of them leans or has overturned (all are tilted by 10 degrees at most)"
        return
    parts = (
        (found["upright"], "upright (tilted by 10 degrees at most)"),
        (found["leaning"], "leaning (by up to 45)"),
        (found["overturned"], "overturned (by more than 45)"),
    )
    yield "at the end, of these: " + ", ".join(f"{number} {what}" for number, what in parts if number)


def _hits(hits: dict) -> Iterator[str]:
    if not hits["pairs"]:
        return
    hard, count = hits["list"][0], "once" if hits["pairs"] == 1 else f"{hits['pairs']} times"
    yield (
        f"loose blocks hit something {count}; the hardest hit: {hard['block']} against {hard['other']} at t = "
        f"{moment_of(hard['time'])}, at {point(hard['place'])}, with an impulse of {quantity(hard['impulse'], 'N s')} "
        f"(it lost {quantity(hard['speed'], 'm/s')})"
    )
