"""Remarks on gaps beside and below thin walls, through which more water flows than does."""

from coupler.case.case import Case
from coupler.checks.gaps import gap_remarks


def remarked(gate, tank=None, **water):
    """Remarks on a solid before 1 m of water, in a channel 0.4 m wide on cells of 0.2 m."""
    solids = gate if isinstance(gate, list) else [gate]
    table = {
        "case": {"title": "a gate"},
        "time": {"end": 1.0},
        "tank": {"lower": [0, 0, 0], "upper": [12, 0.4, 1.6], "cell": 0.2, **(tank or {})},
        "water": {"fill": [{"lower": [0, 0, 0], "upper": [6, 0.4, 1]}], "covers": "multiple", **water},
        "solid": solids,
    }
    return list(gap_remarks(Case.model_validate(table)))


def gate(below=0.0, beside=0.0, thick=0.1):
    return {
        "name": "gate",
        "centre": [6 + thick / 2, (0.4 + beside) / 2, below + 0.75],
        "size": [thick, 0.4 - beside, 1.5],
    }


def test_a_sluice_gate_that_is_hardly_open_is_remarked_on():
    """0.05 m let through 0.258 m2/s on these cells; 0.61 b sqrt(2 g h) = 0.135, and 0.135 under a gate of two cells."""
    (said,) = remarked(gate(below=0.05))
    assert "the gap of 0.05 m between 'gate' and the floor of the tank is 0.25 cells wide" in said
    assert "about 1.9 times the water that it should" in said
    (said,) = remarked(gate(below=0.02))
    assert "about 4 times" in said
    assert remarked(gate(below=0.2)) == remarked(gate()) == remarked(gate(below=0.05, thick=0.4)) == []
    assert remarked(gate(below=0.05), tank={"cell": 0.05}) == []


def test_a_wall_that_misses_a_side_is_remarked_on():
    (said,) = remarked(gate(beside=0.02))
    assert "the gap of 0.02 m between 'gate' and the side y- of the tank is 0.1 cells wide" in said
    assert remarked(gate(beside=0.15)) == []  # a way around it, cut as it is
    assert remarked(gate(beside=0.02), openings="wide") == []
    assert remarked(gate(beside=0.02), covers="single") == []


def test_a_gap_that_something_fills_is_none():
    sill = {"name": "sill", "centre": [6.05, 0.2, 0.025], "size": [0.3, 0.4, 0.05]}
    assert remarked([gate(below=0.05), sill]) == []
