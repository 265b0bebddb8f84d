"""Figures of a study: every run is in them, failed ones with their reason, and texts can be read."""

import itertools

from coupler.commands.view.labels import _extent, place_labels
from coupler.commands.view.plots import plt
from coupler.commands.view.study import (
    crosses,
    figure,
    footnotes,
    labels,
    ladder_curves,
    limits,
    line,
    ylabel,
)


def point(ladder, label, cpu, error, reason=""):
    readings = {} if reason else {"force": {"value": 1.0, "reference": 1.0, "error": error, "band": 0.0}}
    return {
        "ladder": ladder,
        "curve": "",
        "label": label,
        "cpu_seconds": cpu,
        "reason": reason,
        "readings": readings,
    }


TOLD = {
    "ladders": [{"name": "h", "what": "cells"}, {"name": "dt", "what": "step"}],
    "points": [
        point("h", "10 cm", 1.0, 0.2),
        point("h", "5 cm", 8.0, 0.05),
        point("h", "2 cm", 90.0, 0.0, "the water volume is off by 3 %"),
        point("dt", "20 ms", 1.0, 0.2),
        point("dt", "10 ms", 1.1, 0.19),
        point("dt", "5 ms", 1.2, 0.21),
        point("dt", "2 ms", 1.25, 1e-12),
    ],
}


def test_a_curve_is_a_ladder_without_its_failed_runs():
    curves = dict(ladder_curves(TOLD, "force"))
    assert [p[2] for p in curves["cells"]] == ["10 cm", "5 cm"]
    assert len(curves["step"]) == 4


def test_a_run_that_took_no_time_that_counts_is_drawn_all_the_same(tmp_path):
    """All of it was spent in the compiler: zero seconds have no place on a logarithmic axis."""
    q = {"name": "force", "what": "force", "against": "exact"}
    reported = TOLD | {"points": [point("h", "10 cm", 0.0, 0.2), point("h", "5 cm", 0.5, 0.1)]}
    assert figure(tmp_path / "force", q, ladder_curves(reported, "force"), [], "CPU time [s]").exists()


def test_failed_runs_are_reported_below_with_their_reason():
    failed = [p for p in TOLD["points"] if p["reason"]]
    assert footnotes(failed) == ["× 1  failed: h 2 cm: the water volume is off by 3 %"]


def test_the_axis_says_what_the_error_is_against():
    assert ylabel({"what": "force", "against": "measured"}).endswith("against the measurement")


def test_a_place_shared_by_two_ladders_has_one_text_with_both_settings_and_round_off_is_reported():
    texts = [text for *_, text, _ in labels(ladder_curves(TOLD, "force"))]
    assert "10 cm / 20 ms" in texts
    assert "2 ms (< 0.0001 %)" in texts
    assert len(texts) == 5


def test_texts_of_crowded_points_cover_neither_each_other_nor_points():
    drawing, axis = plt.subplots()
    axis.set_xscale("log")
    axis.set_yscale("log")
    curves = ladder_curves(TOLD, "force")
    for number, (legend, points) in enumerate(curves):
        line(axis, number, legend, points)
    failed = [p for p in TOLD["points"] if p["reason"]]
    limits(axis, curves, failed)
    crosses(axis, failed)
    place_labels(drawing, axis, labels(curves), 6.5)
    renderer = drawing.canvas.get_renderer()
    boxes = [_extent(text, renderer) for text in axis.texts[len(failed) :]]
    assert len(boxes) == 5
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))
    places = [axis.transData.transform((cpu, max(error, 1e-6))) for _, p in curves for cpu, error, *_ in p]
    assert not any(box.contains(*place) for box in boxes for place in places)
    plt.close(drawing)
