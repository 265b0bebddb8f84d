"""The books of momentum over water, blocks, tank, ground and held bodies: they close to round-off in every step."""

import numpy as np
import pytest

from coupler.balance.momentum import LINES, BlocksStep, MomentumLedger
from coupler.case.case import Case
from coupler.scene.build import build
from coupler.step.limits import Diverged, check_momentum
from tests.fakes import no_clock

G = 9.81


def scene(**changes):
    """A dam breaks onto debris of three kinds: light, glued to the ground and to one another, and held; and a pier."""
    blocks = [
        {"name": "light", "centre": [0.62, 0.2, 0.06], "size": [0.1, 0.14, 0.1], "density": 500},
        {"name": "foot", "centre": [0.8, 0.2, 0.05], "size": [0.06, 0.2, 0.1]},
        {"name": "top", "centre": [0.8, 0.2, 0.15], "size": [0.06, 0.2, 0.1]},
        {"name": "held", "centre": [0.72, 0.4, 0.1], "size": [0.1, 0.1, 0.1], "fixed": True},
    ]
    return Case.model_validate(
        {
            "case": {"title": "t"},
            "time": {"end": 0.4},
            "tank": {"lower": [0, 0, 0], "upper": [1.2, 0.5, 0.5], "cell": 0.1},
            "water": {"fill": [{"lower": [0, 0, 0], "upper": [0.5, 0.5, 0.4]}]},
            "structure": {"block": blocks, "ground": {}},
            "solid": [{"name": "pier", "centre": [1.0, 0.3, 0.2], "size": [0.1, 0.1, 0.4]}],
            "contact": {"stiffness": 1e6, "restitution": 0.3, "friction": 0.4},
            "joints": {"strength": 2e3, "opening_at_failure": 1e-3},
        }
        | changes
    )


def run(case, end, each):
    """Step a case to `end` [s]; each(coupling, record) after every step."""
    made = build(case, no_clock)
    try:
        while made.coupling.time < end * (1 - 1e-9):
            record = made.coupling.step(made.coupling.step_size(end - made.coupling.time))
            each(made.coupling, record)
    finally:
        if made.coupling.structure is not None:
            made.coupling.structure.close()
    return made.coupling, record


@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_debris_in_a_dam_break_closes_every_step(covers):
    """Water, free blocks, a pier, a held block, ground contact, rough walls and joints that break: linear and angular.

    Fields are handed on between cuts only where nodes have several covers."""
    errors, reported = [], {name: 0.0 for name, _ in LINES}

    def each(coupling, record):
        m = record.momentum
        errors.append(m.error)
        total = sum(m.lines.values()) + m.residual
        np.testing.assert_allclose(m.water + m.blocks, total, atol=1e-11 * m.exchanged)  # from rest
        for name, line in m.lines.items():
            reported[name] = max(reported[name], np.abs(line).max())

    fill = [{"lower": [0, 0, 0], "upper": [0.5, 0.5, 0.4]}]
    water = {"fill": fill, "covers": covers, "walls": "friction", "roughness": 0.002}
    coupling, _ = run(scene(water=water), 0.4, each)
    assert max(errors) < 1e-13
    assert not coupling.structure.joints.alive.all(), "no joint broke"
    acting = ["tank", "tank_shear", "held_blocks", "ground", "ground_joints", "lag", "transport"]
    for name in acting + ["recut"] * (covers == "multiple"):
        assert reported[name] > 1e-6, f"nothing happened in {name}: the scene does not show that it closes"


def test_a_pier_that_water_alone_strikes_has_a_line_of_its_own():
    """Without a structure fixed solids are none of its held blocks."""
    errors, solids = [], []

    def each(coupling, record):
        errors.append(record.momentum.error)
        solids.append(np.abs(record.momentum.lines["solids"]).max())

    run(scene(structure=None, contact=None, joints=None), 0.3, each)
    assert max(errors) < 1e-13
    assert max(solids) > 0.1


def test_water_gives_what_blocks_receive():
    """Impulse handed to the structure = impulse on the water, to round-off."""

    def each(coupling, record):
        n, s = coupling.structure.n, coupling.structure
        received = record.impulses.of_held(record.load[:n], np.zeros(3))[~s.fixed, :3].sum(axis=0)
        given = record.dt * record.load[:n][~s.fixed, :3].sum(axis=0)
        np.testing.assert_allclose(received, given, rtol=1e-12, atol=1e-13)

    run(scene(), 0.15, each)


def test_lines_tell_the_balance_of_things_at_rest():
    """A pool on its floor and a block on the ground: each weight against what carries it."""
    changes = {
        "water": {"fill": [{"lower": [0, 0, 0], "upper": [1.2, 0.5, 0.23]}]},
        "structure": {
            "block": [{"name": "b", "centre": [0.6, 0.25, 0.4], "size": [0.1, 0.1, 0.1], "fixed": True}],
            "ground": {},
        },
    }
    case = scene(**changes)
    _, record = run(case, 0.1, lambda *_: None)
    lines = record.momentum.lines
    # the pier stands in it; a cell with solid and surface takes the wet share of the whole cell
    volume = 1.2 * 0.5 * 0.23 - 0.1 * 0.1 * 0.23
    np.testing.assert_allclose(lines["water_weight"][2], -0.1 * 1000 * G * volume, rtol=2e-4)
    np.testing.assert_allclose(lines["tank"][2], -lines["water_weight"][2], rtol=1e-5)
    assert record.momentum.scheme < 1e-6


def test_a_load_that_does_not_arrive_is_an_error():
    """Seen to fail: half of a load lost between the two sides shows in full, and stops the run."""
    ledger = MomentumLedger(np.zeros(3), 1.0)
    ledger.start(None, np.zeros(6))
    got = np.array([2.0, 0, 0, 0, 0, 0])
    lines = {name: np.zeros(6) for name in ("blocks_weight", "ground", "ground_joints")}
    balance = ledger.add_step(
        None,
        BlocksStep(
            after=got,
            lines=lines | {"ground": 0.5 * got},
            held=np.zeros(6),
            received=np.zeros(6),
            exchanged=1.0,
        ),
    )
    assert balance.error == pytest.approx(1.0 / 1.002)
    with pytest.raises(Diverged, match="momentum_error"):
        check_momentum(0.1, balance.error, 1e-8)


def test_a_moment_from_nowhere_is_an_error_by_its_arm():
    """A moment of 6 N m s that no line has, with an arm of 4 m, counts as an impulse of 1.5 N s, whatever its sign;
    impulses of 3 N s were exchanged, and nothing has momentum that would count as well."""
    for turned in ([0, 0, 0, 0, -6.0, 0], [0, 0, 0, 0, 0, 6.0]):
        ledger = MomentumLedger(np.zeros(3), 4.0)
        ledger.start(None, np.zeros(6))
        lines = {name: np.zeros(6) for name in ("blocks_weight", "ground", "ground_joints")}
        got = np.array(turned)
        step = BlocksStep(after=got, lines=lines, held=np.zeros(6), received=np.zeros(6), exchanged=3.0)
        balance = ledger.add_step(None, step)
        assert balance.error == pytest.approx(0.5)
        assert balance.residual == pytest.approx(got)


def test_books_go_on_from_what_was_saved():
    ledger = MomentumLedger([1.0, 2.0, 3.0], 4.0)
    ledger.start(None, np.arange(6.0))
    lines = {"blocks_weight": np.ones(6), "ground": np.zeros(6), "ground_joints": np.zeros(6)}
    step = BlocksStep(
        after=np.arange(6.0) + 1.0, lines=lines, held=np.zeros(6), received=np.zeros(6), exchanged=2.0
    )
    ledger.add_step(None, step)
    again = MomentumLedger(np.zeros(3), 1.0)
    again.restore(ledger.save())
    for name, value in ledger.save().items():
        np.testing.assert_array_equal(again.save()[name], value)


def test_a_block_that_strikes_a_held_one_is_stopped_by_it():
    """Dry: the held block gives what gravity and the fall had brought, and the books close in every step."""
    blocks = [
        {"name": "held", "centre": [0.6, 0.25, 0.15], "size": [0.1, 0.1, 0.1], "fixed": True},
        {"name": "falls", "centre": [0.6, 0.25, 0.26], "size": [0.1, 0.1, 0.1], "density": 1000},
    ]
    alone = {"block": blocks, "ground": {}}
    errors = []
    case = scene(
        structure=alone, water=None, tank=None, solid=[], joints=None, time={"end": 0.3, "step_max": 0.01}
    )
    _, record = run(case, 0.3, lambda _, record: errors.append(record.momentum.error))
    lines = record.momentum.lines
    assert max(errors) < 1e-12
    np.testing.assert_allclose(lines["held_blocks"][2], 0.3 * G * 1000 * 0.1**3, rtol=1e-2)
    assert np.abs(lines["ground"]).max() < 1e-12


def test_a_block_that_hangs_on_a_held_one_is_carried_by_it():
    """Dry, by a joint and without any contact: what carries the weight is the held block, which is no ground."""
    blocks = [
        {"name": "held", "centre": [0.6, 0.25, 0.45], "size": [0.1, 0.1, 0.1], "fixed": True},
        {"name": "hangs", "centre": [0.6, 0.25, 0.35], "size": [0.1, 0.1, 0.1], "density": 1000},
    ]
    errors = []
    case = scene(
        structure={"block": blocks},
        water=None,
        tank=None,
        solid=[],
        joints={"strength": 1e5, "opening_at_failure": 1e-3},
        time={"end": 0.3, "step_max": 0.01},
    )
    _, record = run(case, 0.3, lambda _, record: errors.append(record.momentum.error))
    lines = record.momentum.lines
    assert max(errors) < 1e-12
    np.testing.assert_allclose(lines["held_blocks"][2], 0.3 * G * 1000 * 0.1**3, rtol=1e-2)
    for name in ("ground", "ground_joints"):
        assert np.abs(lines[name]).max() < 1e-12


def test_what_closes_narrow_openings_has_a_line():
    """A block in falling water of coarse cells: what closes the openings beside it holds the water."""
    errors, held = [], []

    def each(coupling, record):
        errors.append(record.momentum.error)
        held.append(np.abs(record.momentum.lines["openings"]).max())

    sections = {
        "tank": {"lower": [0, 0, 0], "upper": [1, 1, 1], "cell": 0.2},
        "water": {
            "covers": "multiple",
            "openings": "wide",
            "fill": [{"lower": [0, 0, 0], "upper": [0.6, 1, 0.8]}],
        },
        "solid": [{"name": "b", "centre": [0.5, 0.5, 0.5], "size": [0.3, 0.3, 0.3]}],
    }
    run(scene(**sections, structure=None, contact=None, joints=None), 0.06, each)
    assert max(errors) < 1e-13
    assert max(held) > 1e-2


def test_an_edge_that_an_inflow_shares_with_a_sea_closes_beside_blocks():
    """There the velocity is given and the pressure sought, not held: a block in the cells beside it feels the same."""
    errors = []
    sections = {
        "tank": {"lower": [0, 0, 0], "upper": [0.6, 0.4, 0.4], "cell": 0.1},
        "water": {
            "fill": [{"lower": [0, 0, 0], "upper": [0.6, 0.4, 0.15]}],
            "inflow": [{"kind": "steady", "side": "y+", "level": 0.15, "velocity": 0.2}],
            "sea": [{"side": "x+", "level": 0.25}],
        },
        "structure": {
            "block": [{"name": "b", "centre": [0.54, 0.34, 0.08], "size": [0.1, 0.1, 0.1], "fixed": True}]
        },
        "contact": None,
        "joints": None,
        "solid": [],
    }
    run(scene(**sections), 0.04, lambda coupling, record: errors.append(record.momentum.error))
    assert max(errors) < 1e-13
