"""What the files of a run say about a picture: its caption, where north is, and where the damage began."""

import json
import textwrap

import numpy as np

from coupler.commands.view.scales import corners
from coupler.program.quantities import counted

SIDES = {"x-": (-1.0, 0.0), "x+": (1.0, 0.0), "y-": (0.0, -1.0), "y+": (0.0, 1.0)}
"""Direction in plan of each side of a tank by which water may come in."""


def caption_of(run, width):
    """Title of the case, then number of cells and blocks, in lines of at most width letters, broken between words so
    that the lines of the title are about as long as one another."""
    counts = []
    if run.water:
        counts.append(counted(len(run.water.at(run.water.times[0]).cells), "cell"))
    if run.blocks:
        counts.append(counted(int(run.blocks.at(run.blocks.times[0])["block"].max()) + 1, "block"))
    title = _entry(run, "case", "case", "title") or run.directory.name
    return "\n".join([*_evenly(title, max(width, 1)), *([", ".join(counts)] if counts else [])])


def _evenly(text, width):
    """Lines of a text, as few as `width` letters allow, the longest as short as it can be then."""
    lines = textwrap.wrap(text, width)
    while width > 1 and len(narrower := textwrap.wrap(text, width - 1)) == len(lines):
        lines, width = narrower, width - 1
    return lines


def north_of(run):
    """Direction (2,) of north in plan: y of the terrain file, which may be rotated; None without a terrain."""
    terrain = _entry(run, "case", "terrain")
    if not isinstance(terrain, dict):
        return None
    turn = float(terrain.get("turn") or 0.0)
    return np.array([-np.sin(turn), np.cos(turn)])


def where_it_happens(run):
    """Direction (2,) in plan from the middle of the blocks to the first joint that broke, else to where the water comes
    from; zero without blocks."""
    first = _to_first_break(run)
    return first if first.any() else _to_the_water(run)


def struck_side(run):
    """Direction (2,) in plan of the side that is shown: that from which the water comes and, of what lies across that,
    where the first joint broke. A joint in the lee often breaks first, and there is little else to see."""
    return _unit(_to_the_water(run)) + 0.5 * _unit(_to_first_break(run))


def _unit(vector):
    size = np.linalg.norm(vector)
    return vector / size if size > 0.0 else vector


def _middle(run):
    """Middle (2,) [m] of the blocks at the start in plan."""
    low, high = corners(run.blocks.at(run.blocks.times[0]))
    return 0.5 * (low + high)[:2]


def _to_first_break(run):
    """Direction (2,) [m] from the middle of the blocks to the first joint that broke; zero without one."""
    place = _entry(run, "figures", "verdict", "first_break", "place")
    return np.array(place[:2], float) - _middle(run) if place and run.blocks else np.zeros(2)


def _to_the_water(run):
    """Direction (2,) from the middle of the blocks to where the water comes from: the sides with inflows, else the
    water at the start; zero where there is none, or no blocks."""
    if not run.blocks or not run.water:
        return np.zeros(2)
    inflows = _entry(run, "case", "water", "inflow") or []
    sides = [str(inflow.get("side")) for inflow in inflows if isinstance(inflow, dict)]
    towards = [SIDES[side] for side in sides if side in SIDES]
    if towards:
        return np.sum(towards, axis=0)
    water = run.water.at(run.water.times[0])
    wet = water.nodes[water.level_set < 0.0]
    return wet[:, :2].mean(axis=0) - _middle(run) if len(wet) else np.zeros(2)


def _entry(run, *names):
    """The value in run.json under these nested names; None where it is missing, as in an incomplete file."""
    path = run.directory / "run.json"
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    for name in names:
        found = found.get(name) if isinstance(found, dict) else None
    return found
