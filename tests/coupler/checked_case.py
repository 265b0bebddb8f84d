"""A small case for tests of checks and remarks."""

from coupler.case.case import Case
from coupler.checks.case import problems


def case(**sections):
    """A tank of 10 m with water in its left half, and whatever sections come on top."""
    base = {
        "case": {"title": "x"},
        "time": {"end": 1},
        "tank": {"lower": [0, 0, 0], "upper": [10, 10, 10], "cell": 1},
        "water": {"fill": [{"lower": [0, 0, 0], "upper": [5, 10, 5]}]},
    }
    return Case.model_validate({k: v for k, v in (base | sections).items() if v is not None})


def structure(*blocks, **more):
    """Sections of a case with these blocks of 1 m, b0, b1, ..., and their contact."""
    return {
        "structure": {
            "block": [{"name": f"b{i}", "size": [1, 1, 1], **b} for i, b in enumerate(blocks)],
            **more,
        },
        "contact": {"stiffness": 1e6},
    }


def reported(case):
    """The problems of a case, each as "key: message"."""
    return [".".join(map(str, path)) + ": " + text for path, text in problems(case)]
