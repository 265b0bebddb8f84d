"""States out of YADE and forces into it: where its objects keep them, and through its Python interface."""

import numpy as np
import pytest

from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure
from yade_scripts.yade_side import exchange, memory, scene
from yade_scripts.yade_side.engine import load_yade


def _blocks():
    sizes = [(1.0, 0.7, 0.4), (0.5, 0.6, 0.9), (0.8, 0.8, 0.3)]
    return [
        Block(
            f"b{k}",
            (0.2 * k, 0.1 * k, 0.5 + 1.0 * k),
            size=size,
            density=2000.0,
            velocity=(0.1 * k, 0, -1),
            spin=(0.4, -1.3, 0.2),
        )
        for k, size in enumerate(sizes)
    ]


def _fall():
    """Blocks that fall on one another under a load, after 60 substeps: the class of the exchange, and the state."""
    with Structure(_blocks(), ContactLaw(stiffness=1e6, friction=0.3, restitution=0.5), ground=0.0) as s:
        for k in range(3):
            s.set_load(np.arange(18.0).reshape(3, 6) * (40.0 - 30.0 * k))
            s.advance(0.02, 0.001)
        return type(s._scene._exchange), s.save()


def test_the_memory_of_yade_is_found():
    """In the YADE of Debian 12, for which the program is made."""
    kind, _ = _fall()
    assert kind is memory.BodyMemory


def test_both_ways_give_the_same_bits(monkeypatch):
    _, by_memory = _fall()

    def absent(engine, bodies):
        raise memory.NotFound("made up")

    monkeypatch.setattr(exchange, "BodyMemory", absent)
    kind, by_lists = _fall()
    assert kind is exchange.Interface
    np.testing.assert_array_equal(by_memory.motion, by_lists.motion)
    assert (by_memory.motion[:, 13:] != 0.0).any()


@pytest.mark.parametrize("shift", [(8, 0, 0), (0, 8, 0), (0, 0, 8)])
def test_another_layout_is_noticed(monkeypatch, shift):
    """Numbers that lie elsewhere than in a first object are refused, before anything is written."""
    found = memory.layout

    def shifted(engine):
        at = found(engine)
        return memory.Layout(at.state + shift[0], at.force + shift[1], at.moment + shift[2])

    monkeypatch.setattr(memory, "layout", shifted)
    kind, _ = _fall()
    assert kind is exchange.Interface


def test_a_wrong_address_is_no_crash():
    with memory._memory() as open_memory:
        for address in (0, 8, 2**62, 2**64 - 8, 2**70):
            with pytest.raises(memory.NotFound):
                memory._word(open_memory, address)


def test_forces_of_blocks_that_are_no_longer_pushed_end():
    """What a block was given acts in one step only, also if others are pushed in the next."""
    world = scene.Scene(load_yade(), _blocks(), False, np.zeros(3))
    try:
        all_rows, F = np.arange(3), np.zeros((3, 6))
        F[:, 0] = 100.0
        world.pushing(all_rows)(F)
        world.step(1e-3)
        before = world.save()
        world.pushing(np.array([1]))(F)
        world.step(1e-3)
        gained = (world.save() - before)[:, 7]
        assert gained[1] > 0.0
        np.testing.assert_array_equal(gained[[0, 2]], 0.0)
    finally:
        world.close()
