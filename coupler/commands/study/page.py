"""A study as Markdown: runs and machine, errors, cheapest settings, orders of convergence, cost of parts."""

from __future__ import annotations

import math
import shlex

AGAINST = {
    "exact": "the exact solution",
    "measured": "the measurement",
    "finest": "the finest run",
}

ROUND_OFF = 1e-6
"""Errors below this value are round-off; figures draw them at this value."""
TIMES = ("cpu_seconds", "set_up_seconds", "start_seconds", "compile_seconds", "wall_seconds")


def page(study: dict, level: int = 1, pictures: str = "") -> str:
    """One study; pictures: where its figures are, from the page."""
    mark = "#" * level
    parts = [
        f"{mark} {study['title']}",
        *([study["note"]] if study["note"] else []),
        _where(study),
        *(_quantity(study, q, pictures) for q in study["quantities"]),
        f"{mark}# Runs\n\n{_ladders(study)}\n\n{_runs(study)}",
        f"{mark}# Cheapest setting for an error\n\n{_cheapest(study)}",
    ]
    if study["orders"]:
        parts.append(f"{mark}# Observed order of convergence\n\n{_orders(study)}")
    if study["laws"]:
        parts.append(f"{mark}# Laws of YADE and of this program\n\n{_laws(study, pictures)}")
    if study["parts"]:
        parts.append(f"{mark}# Cost of parts of the program\n\n{_parts(study)}")
    failed = _failed(study)
    if failed:
        parts.append(f"{mark}# Runs that failed\n\n{failed}")
    missing = _missing(study)
    if missing:
        parts.append(f"{mark}# Figures that runs do not have\n\n{missing}")
    return "\n\n".join(parts) + "\n"


def _where(study: dict) -> str:
    machine, versions = study["machine"], study["versions"]
    packages = ", ".join(f"{name} {number}" for name, number in versions.items())
    commit = f", commit {study['git']['commit'][:12]}" if study["git"] else ""
    return (
        f"`{shlex.join(study['command'])}`  \n{machine['processor']}, {machine['cores']} cores, one thread; "
        f"{packages}{commit}.{_first_step(study)}"
    )


def _first_step(study: dict) -> str:
    first = study["first_step"]
    if first is None:
        return ""
    return (
        f" A separate process with one step took {first['cpu_seconds']:.3g} CPU s, "
        f"of which {first['compile_seconds']:.3g} s were compilation."
    )


def _quantity(study: dict, q: dict, pictures: str) -> str:
    against = AGAINST[q["against"]]
    if q["finest"]:
        against += f" ({q['finest']['ladder']} {q['finest']['label']})"
    source = f": {q['source']}" if q["source"] else ""
    figure = f"\n\n![{q['what']}]({pictures}{q['name']}.png)" if _drawn(study, q) else ""
    return f"**{q['what']}**, error relative to {against}{source}.{figure}"


def _drawn(study: dict, q: dict) -> bool:
    readings = [point["readings"].get(q["name"], {}) for point in study["points"]]
    return any(reading.get("error") for reading in readings)


def table(head: list[str], rows: list[list[str]], words: bool = False) -> str:
    """A Markdown table; the first column is text, the others are numbers unless all are `words`."""
    rule = "|---|" + ("---|" if words else "--:|") * (len(head) - 1)
    lines = ["| " + " | ".join(row) + " |" for row in [head, *rows]]
    return "\n".join([lines[0], rule, *lines[1:]])


def point_name(point: dict) -> str:
    """Ladder and setting of a point or rung."""
    return f"{point['ladder']} {point['label']}{curve_of(point)}"


def percent(value) -> str:
    """A share as text; a dash where there is none, and no digits of round-off."""
    if not _number(value):
        return "–"
    return f"< {100 * ROUND_OFF:g} %" if 0.0 < abs(value) < ROUND_OFF else f"{100 * value:.3g} %"


def _number(value) -> bool:
    return isinstance(value, int | float) and math.isfinite(value)


def _ladders(study: dict) -> str:
    """The meaning of the short names of ladders in the tables."""
    run = {point["ladder"] for point in study["points"]}
    return "; ".join(f"`{la['name']}`: {la['what']}" for la in study["ladders"] if la["name"] in run) + "."


def _runs(study: dict) -> str:
    quantities = study["quantities"]
    head = ["run", *(f"error: {q['name']}" for q in quantities)]
    head += [
        "CPU s",
        "set-up",
        "start",
        "compile",
        "wall s",
        "MB",
        "cells",
        "wet",
        "blocks",
        "steps",
        "passes",
    ]
    rows = [_run_row(study, point, quantities) for point in study["points"]]
    said = [k for k in range(len(head)) if any(row[k] != "–" for row in rows)]
    return table([head[k] for k in said], [[row[k] for k in said] for row in rows])


def _run_row(study: dict, point: dict, quantities: list[dict]) -> list[str]:
    run = study["runs"][point["setting"]]
    size = run["size"]
    errors = [percent(point["readings"].get(q["name"], {}).get("error")) for q in quantities]
    if point["reason"]:
        errors = ["failed"] * len(quantities)
    return [
        point_name(point),
        *errors,
        *(f"{run[name]:.3g}" for name in TIMES),
        f"{run['peak_memory'] / 1e6:.0f}",
        *(str(size.get(name, "–")) for name in ("cells", "wet_cells", "blocks")),
        str(run["steps"]),
        f"{run['passes']:.2f}" if run["passes"] else "–",
    ]


def _cheapest(study: dict) -> str:
    """One row per quantity (and value across its ladders), one column per level: setting, error, CPU seconds."""
    what = {q["name"]: q["what"] for q in study["quantities"]}
    rows: dict[str, dict[float, str]] = {}
    for e in study["cheapest"]:
        setting, error, cpu = cheapest_cells(study, e)
        cell = f"{setting} ({error}, {cpu} s)" if e["rung"] else setting
        rows.setdefault(f"{what[e['quantity']]}{curve_of(e)}", {})[e["level"]] = cell
    levels = sorted({e["level"] for e in study["cheapest"]})
    cells = [[name, *(found[level] for level in levels)] for name, found in rows.items()]
    return table(["quantity", *(f"error of {100 * level:g} %" for level in levels)], cells, words=True)


def curve_of(entry: dict) -> str:
    """The value of the second ladder at which an entry was found, in brackets."""
    return f" ({entry['curve']})" if entry["curve"] else ""


def cheapest_cells(study: dict, entry: dict) -> list[str]:
    """Setting with what its ladder holds fixed, its error and its cost."""
    rung = entry["rung"]
    if rung is None:
        return ["none of these", "–", "–"]
    what = next(ladder["what"] for ladder in study["ladders"] if ladder["name"] == rung["ladder"])
    return [f"{what}: {rung['label']}", percent(entry["error"]), f"{entry['cpu_seconds']:.3g}"]


def _orders(study: dict) -> str:
    def shown(value) -> str:
        return f"{value + 0.0:.2f}".replace("-0.00", "0.00") if _number(value) else "–"

    rows = [
        [f"{o['quantity']}, {o['ladder']}{curve_of(o)}", shown(o["overall"]),
         shown(o["finest"]), o["how"]]
        for o in study["orders"]
    ]  # fmt: skip
    return table(["quantity, ladder", "all runs", "finest runs", "from"], rows)


def _laws(study: dict, pictures: str) -> str:
    names = list(study["laws"][0]["readings"])
    rows = [
        [f"{row['law']}{' (YADE)' if row['stock'] else ''}, {row['multiple']} x substep",
         *(percent(row["readings"][name]["error"]) for name in names), f"{row['cpu_seconds']:.3g}"]
        for row in study["laws"]
    ]  # fmt: skip
    head = ["law", *(f"error: {name}" for name in names), "CPU s of stepping"]
    figures = "".join(f"\n\n![{name}, laws]({pictures}{name}_laws.png)" for name in names)
    return table(head, rows) + figures


def _parts(study: dict) -> str:
    rows = [
        [part["name"], part["reason"] or f"{part['cpu_seconds']:.3g}", percent(part["share"]),
         f"{round(part['memory'] / 1e6)}"]
        for part in study["parts"]
    ]  # fmt: skip
    whole = study["runs"][study["base"]]["cpu_seconds"]
    rows.append(
        [
            "the whole case",
            f"{whole:.3g}",
            "100 %",
            f"{study['runs'][study['base']]['peak_memory'] / 1e6:.0f}",
        ]
    )
    return table(["part", "CPU s", "share", "MB"], rows)


def _failed(study: dict) -> str:
    lines = [f"- {point_name(point)}: {point['reason']}" for point in study["points"] if point["reason"]]
    return "\n".join(dict.fromkeys(lines))


def _missing(study: dict) -> str:
    """The figures that runs which reached their end do not have, with the reason."""
    lines = [
        f"- {point_name(point)}: {name}: {reading['why']}"
        for point in study["points"]
        for name, reading in point["readings"].items()
        if reading.get("why")
    ]
    return "\n".join(dict.fromkeys(lines))
