"""Restitution at the substep that a structure takes by itself: any masses, any time at which the blocks meet."""

import numpy as np
import pytest

from tests.yade_scripts.ledger import balance
from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure

K = 1e8
STILL = (0.0, 0.0, 0.0)
PHASES = np.linspace(0.02, 0.98, 7)
"""Parts of a substep that are left when the blocks touch."""


def returned(blocks, law, phase, ground=None):
    """Speed at which two blocks (or one and the ground) part, over that at which they meet, and energy over the
    first."""
    with Structure(blocks(0.0), law, ground=ground, gravity=STILL) as s:
        dt = s.substep()
    with Structure(blocks((3.0 + phase) * dt), law, ground=ground, gravity=STILL) as s:
        start = s.energies()
        s.advance(300 * dt, dt)
        v, e = s.velocity()[:, 2], s.energies()
    return float(v[0] - v[1] if len(v) > 1 else v[0]), balance(e) / balance(start)


@pytest.mark.parametrize("ratio", [1e-3, 0.1, 1.0, 10.0, 1e3])
@pytest.mark.parametrize("e", [0.05, 0.3, 0.7, 1.0])
def test_two_blocks_return_e_at_the_default_substep(e, ratio):
    """To 0.003 of the speed, whatever the ratio of the masses and the time of impact; the account of energy closes."""

    def pair(gap):
        return [
            Block("a", (0, 0, 1.0 + gap), size=1.0, density=2000.0, velocity=(0, 0, -1.0)),
            Block("b", (0, 0, 0), size=1.0, density=2000.0 * ratio),
        ]

    found = np.array([returned(pair, ContactLaw(K, e), phase) for phase in PHASES])
    assert np.abs(found[:, 0] - e).max() < 3e-3
    assert np.abs(found[:, 1] - 1.0).max() < 1e-9


@pytest.mark.parametrize("e", [0.1, 0.5, 0.9, 1.0])
def test_a_block_on_the_ground_returns_e_at_the_default_substep(e):
    def block(gap):
        return [Block("a", (0, 0, 0.5 + gap), size=1.0, density=2000.0, velocity=(0, 0, -1.0))]

    found = np.array([returned(block, ContactLaw(K, e), phase, 0.0) for phase in PHASES])
    assert np.abs(found[:, 0] - e).max() < 3e-3
