"""Pockets of air that join, part or open: which of them goes on under its name, and how much of it opens."""

from types import SimpleNamespace

import numpy as np

from fluid.air.cushions import _names, _opened
from fluid.air.gas import Gas


def test_a_pocket_keeps_the_name_of_that_with_most_of_its_air():
    """A bubble of a litre joins a cubic metre: the cubic metre goes on, whichever was found first. Where a pocket
    parts, one of the parts is new."""
    air = SimpleNamespace(reference=np.array([0.001, 1.0]), name=np.array([4, 7]), names=7)

    def names(share):
        return _names(air, SimpleNamespace(share=np.array(share)))

    assert [names([[1.0], [1.0]])[0].tolist(), names([[0.5, 0.5], [0.0, 1.0]])[0].tolist()] == [[7], [4, 7]]
    parted, count = names([[1.0, 0.0, 0.0], [0.0, 0.4, 0.6]])
    assert (parted.tolist(), count) == ([4, 7, 8], 8)


def test_of_a_pocket_that_parts_only_the_part_that_the_open_air_reaches_is_open():
    """A fifth of 3 m³ at 1.5 atmospheres."""
    gas = Gas(gamma=1.0)
    air = SimpleNamespace(reference=np.array([4.5]), gas=gas, label=np.array([1, 1, 1]))
    descent = SimpleNamespace(opened=np.array([0.2]))
    nodes = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0, 0.0, 4.0]])
    (found,) = _opened(air, np.array([3.0]), descent, np.array([1, 0, 0]), nodes)
    np.testing.assert_allclose([found.volume, found.pressure], [0.6, 0.5 * gas.atmospheric])
    np.testing.assert_allclose(found.place, [0.0, 0.0, 3.0])
