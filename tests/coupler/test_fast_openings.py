"""What `check` and a run at its end say about joints that open faster than the substeps follow."""

import numpy as np
import pytest

from coupler.run.fast_openings import FAST_OPENING, FAST_OPENING_NEEDLEMAN, note
from coupler.run.forecast import forecast
from tests.physics.scenes import case

JOINTS = {"strength": 1e5, "opening_at_failure": 1e-3}


def of_modes(mode, pairs=()):
    """A case whose joints have this mixed mode, and those of its pairs these."""
    pair = [{"between": ["a", "b"]} | ({"mixed_mode": m} if m else {}) for m in pairs]
    return case(time={"end": 1.0}, joints=JOINTS | {"mixed_mode": mode, "pair": pair})


@pytest.mark.parametrize(
    ("mode", "pairs", "limit", "what"),
    [
        ("effective", (), FAST_OPENING, "work of separation is kept"),
        ("needleman", (), FAST_OPENING_NEEDLEMAN, "is off by more than a per cent"),
        ("effective", (None, "needleman"), FAST_OPENING_NEEDLEMAN, "is off by more than a per cent"),
    ],
)
def test_fast_openings_are_told_from_the_limit_of_their_rule_on(mode, pairs, limit, what):
    found = of_modes(mode, pairs)
    assert note(found, limit) == ""
    message = note(found, 1.01 * limit)
    assert what in message
    assert f"{1.01 * limit:.2g}" in message


def test_a_run_without_joints_says_nothing():
    assert note(case(time={"end": 1.0}), 0.0) == ""


def two_blocks(speed, spin=0.0, **joints):
    """Two cubes joined, of which one flies off at a speed [m/s] and turns at a spin [rad/s]; substep 0.1 ms."""
    return case(
        time={"end": 0.01},
        structure={
            "substep": 1e-4,
            "start": "sudden",
            "block": [
                {"name": "a", "centre": [0, 0, 0.5], "size": [1, 1, 1], "density": 2000.0, "fixed": True},
                {"name": "b", "centre": [0, 0, 1.5], "size": [1, 1, 1], "density": 2000.0}
                | {"velocity": [0, 0, speed], "spin": [spin, 0, 0]},
            ],
        },
        joints=JOINTS | joints,
    )


def test_check_says_how_fast_a_joint_with_a_potential_may_open():
    """A tenth of a millimetre in a tenth of a millisecond."""
    slow, fast = (forecast(two_blocks(v, mixed_mode="needleman")) for v in (0.9, 1.1))
    assert slow["fastest opening"] == pytest.approx(1.0)
    rows = [next(row for row in found.rows if row.name == "fastest opening") for found in (slow, fast)]
    assert "structure.substep" not in rows[0].remark
    assert "a block at the start has 1.1 m/s" in rows[1].remark
    assert "structure.substep = 9.1e-05" in rows[1].remark
    effective = forecast(two_blocks(1.1))
    assert "fastest opening" not in [row.name for row in effective.rows]


def test_the_corner_of_a_block_that_turns_opens_a_joint_too():
    """0.9 m/s and 2 rad/s at half the diagonal of the cube."""
    found = forecast(two_blocks(0.9, 2.0, mixed_mode="needleman"))
    (row,) = [row for row in found.rows if row.name == "fastest opening"]
    assert f"a block at the start has {0.9 + np.sqrt(3.0):.3g} m/s" in row.remark


def test_of_laws_of_several_pairs_the_most_brittle_one_counts():
    for first, second in ((1e-3, 5e-4), (5e-4, 1e-3)):
        pair = [{"between": ["block", "block"], "mixed_mode": "needleman", "opening_at_failure": second}]
        found = forecast(two_blocks(0.1, mixed_mode="needleman", opening_at_failure=first, pair=pair))
        assert found["fastest opening"] == pytest.approx(0.5)
