"""What a run says at its end about joints that opened faster than the substeps follow."""

from types import SimpleNamespace

import pytest

from coupler.run.run import FAST_OPENING, FAST_OPENING_NEEDLEMAN, _report_fast_openings


def told(rate, mode, pairs=()):
    messages = []
    joints = SimpleNamespace(mixed_mode=mode, pair=[SimpleNamespace(mixed_mode=m) for m in pairs])
    case, reporter = SimpleNamespace(joints=joints), SimpleNamespace(message=messages.append)
    _report_fast_openings(case, {"largest_opening_rate": rate}, reporter)
    return messages


@pytest.mark.parametrize(
    ("mode", "pairs", "limit", "what"),
    [
        ("effective", (), FAST_OPENING, "work of separation is kept"),
        ("needleman", (), FAST_OPENING_NEEDLEMAN, "is off by more than a per cent"),
        ("effective", (None, "needleman"), FAST_OPENING_NEEDLEMAN, "is off by more than a per cent"),
    ],
)
def test_fast_openings_are_told_from_the_limit_of_their_rule_on(mode, pairs, limit, what):
    assert told(limit, mode, pairs) == []
    (message,) = told(1.01 * limit, mode, pairs)
    assert what in message
    assert f"{1.01 * limit:.2g}" in message


def test_a_run_without_joints_says_nothing():
    messages = []
    _report_fast_openings(SimpleNamespace(joints=None), {}, SimpleNamespace(message=messages.append))
    assert messages == []
