"""Curves of a run over the data that its case names: entries [[curve]] of expected.toml, beside the promises.

figure = "levels"                       name of the file; its curves with the same `panel` share one pair of axes
panel = "depth of water at H1 [m]"      name of the y-axis, with its unit
table = "history/gauges.csv"            and column = "H1_level"
columns, places, above                  instead of column: the times at which the columns exceed `above`, over
                                        their places: the path of a front
x_label, x_scale, y_scale               "time [s]", 1, 1: what time and value are multiplied with
x_range, y_range                        what is shown; absent: all
references = [{file = "record.csv", x = "t", y = "H1", label = "measured"}]
                                        low and high instead of y: a band; the file from the directory of the case,
                                        or one of coupler/reference by its name
"""

import json
import tomllib
from pathlib import Path

import numpy as np

from coupler.case.records import column, find_record, read_record
from coupler.commands.view.curves import draw
from coupler.commands.view.figure_files import FORMATS
from coupler.results.expected import first_above
from coupler.results.history import read_history


def over_data(run, folder, endings=FORMATS):
    """Draw the figures that the case of `run` asks for into `folder`; their paths with the last of the endings."""
    place = directory_of_case(run)
    if place is None or not (place / "expected.toml").exists():
        return []
    entries = tomllib.loads((place / "expected.toml").read_text(encoding="utf-8")).get("curve", [])
    return [draw(figure, folder, endings) for figure in figures(entries, run, place)]


def directory_of_case(run):
    """Directory of the case of a run; None if it is unknown or no longer exists."""
    summary = run / "run.json"
    if not summary.exists():
        return None
    recorded = json.loads(summary.read_text(encoding="utf-8")).get("case_file")
    place = Path(recorded).parent if recorded else None
    return place if place is not None and place.is_dir() else None


def figures(entries, run, place):
    """The figures as coupler/commands/view/curves.py takes them: curves by figure and panel, in their order."""
    found = {}
    for entry in entries:
        panels = found.setdefault(entry["figure"], {})
        panel = panels.setdefault(entry["panel"], _axes(entry))
        panel["curves"] += [reference(r, place) for r in entry.get("references", [])]
        panel["curves"].append(computed(entry, run))
    return [
        {"name": name, "panels": list(panels.values()), "columns": 2 if len(panels) > 3 else 1}
        for name, panels in found.items()
    ]


def _axes(entry):
    label = entry.get("x_label", "time [s]")
    ranges = {key: entry[key] for key in ("x_range", "y_range") if key in entry}
    return {"x_label": label, "y_label": entry["panel"], "curves": [], **ranges}


def computed(entry, run):
    """The curve of the run."""
    history = read_history(run / entry["table"]).values
    time = history["time"] * entry.get("x_scale", 1.0)
    if "columns" in entry:
        values = np.array([column(history, name, entry["table"]) for name in entry["columns"]])
        x, y = arrivals(time, values, entry["above"]), np.array(entry["places"], float)
    else:
        x, y = time, column(history, entry["column"], entry["table"])
    y = y * entry.get("y_scale", 1.0)
    return {"label": entry.get("label", "computed"), "kind": "computed", "x": x.tolist(), "y": y.tolist()}


def arrivals(time, values, above):
    """Times (n,) at which the rows of values (n, steps) first exceed `above`; NaN where they never do."""
    return np.array([first_above(time, row, above) for row in values])


def reference(entry, place):
    """A measured curve or band from a CSV file whose comments begin with #."""
    table = read_record(find_record(entry["file"], place))
    x = column(table, entry["x"], entry["file"])
    curve = {"label": entry["label"], "x": (x * entry.get("x_scale", 1.0)).tolist()}
    scale = entry.get("y_scale", 1.0)
    if "low" in entry:
        low, high = (scale * column(table, entry[k], entry["file"]) for k in ("low", "high"))
        return curve | {"kind": "band", "y": low.tolist(), "upper": high.tolist()}
    y = scale * column(table, entry["y"], entry["file"])
    return curve | {"kind": "measured", "y": y.tolist()}
