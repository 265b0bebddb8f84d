"""The state of the water goes out as arrays and comes back into a water made afresh, which goes on bit for bit."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.step import state
from fluid.step.state import NotAfterAStep, OtherWater
from fluid.step.water import Water
from tests.fluid.scenes import advance, column, tank

SIZES = np.array([[0.3, 0.25, 0.2], [0.08, 0.9, 0.7]])
VELOCITY = np.array([[0.2, 0.05, -0.4], [0.1, 0.0, 0.0]])
DT = 0.01


def placed(time):
    """A box that dives and a thin wall that is pushed through the water."""
    centre = np.array([[0.3, 0.5, 0.6], [0.72, 0.5, 0.36]])
    return ConvexBodies.boxes(centre, SIZES).moved(centre + time * VELOCITY)


def start(covers, mesh=None, domain=None):
    """A water of the scene; the place of its bodies at the start."""
    if mesh is None:
        return tank([1, 1, 1], 0.125, column(0.6, 0.55), placed(0.0), covers=covers)
    return Water(mesh, domain, column(0.6, 0.55))


def steps(water, first, last):
    """Bodies move, water follows in steps of two lengths; the pressure solution of each step."""
    found = []
    for k in range(first, last):
        if k > 0:
            domain = cut_domain(water.mesh, placed(k * DT), water.domain.covers, previous=water.domain)
            water.move_solids(domain)
        found.append(
            advance(water, DT if k % 2 else 0.6 * DT, np.hstack([VELOCITY, np.zeros((2, 3))]).ravel())[1]
        )
    return found


def differences(one, two, at="water", found=None):
    """Places where two objects of the water's room differ in the last bit, whatever they are made of."""
    found = [] if found is None else found
    if isinstance(one, np.ndarray):
        if (
            one.dtype != two.dtype
            or (one.size > 0 and one.strides != two.strides)
            or not np.array_equal(one, two, equal_nan=True)
        ):
            found.append(at)
    elif isinstance(one, tuple | list):
        if len(one) != len(two):
            found.append(at)
        for k, (a, b) in enumerate(zip(one, two)):
            differences(a, b, f"{at}[{k}]", found)
    elif isinstance(one, dict):
        differences([*one, *one.values()], [*two, *two.values()], at, found)
    elif hasattr(one, "toarray"):
        differences([one.data, one.indices, one.indptr], [two.data, two.indices, two.indptr], at, found)
    elif hasattr(one, "__dict__") and type(one).__module__.startswith("fluid"):
        for name in vars(one):
            differences(getattr(one, name), getattr(two, name), f"{at}.{name}", found)
    elif not callable(one) and one != two:
        found.append(at)
    return found


@pytest.mark.parametrize("covers", ["single", "multiple"])
@pytest.mark.parametrize("before", [0, 1, 12])
def test_saved_and_restored_water_goes_on_bit_for_bit(covers, before):
    """Also where the domain is cut afresh instead of step by step. Everything that the object holds is compared, so
    that nothing that a step leaves for the next one is forgotten."""
    water = start(covers)
    steps(water, 0, before)
    arrays = state.save(water)
    mesh = box_mesh(np.zeros(3), [1, 1, 1], 0.125)
    again = start(covers, mesh, cut_domain(mesh, placed(0.0), covers))
    state.restore(again, cut_domain(mesh, placed(max(before - 1, 0) * DT), covers), arrays)
    for one in (water, again):
        one.wall_area()  # found where it is asked for
    kept = {name: value for name, value in held(water).items() if name != "report"}
    found = held(again)
    assert [d for name, value in kept.items() for d in differences(value, found[name], name)] == []
    for x, y in zip(steps(water, before, before + 4), steps(again, before, before + 4)):
        np.testing.assert_array_equal(x, y)
    assert differences(held(water), held(again)) == []


def held(water):
    """What a water holds."""
    return vars(water)


def test_a_saved_state_is_a_copy():
    """What the water does after `save` must not reach what was saved."""
    water = start("single")
    steps(water, 0, 2)
    arrays = state.save(water)
    before = {name: np.array(value) for name, value in arrays.items()}
    steps(water, 2, 4)
    for name, value in before.items():
        np.testing.assert_array_equal(arrays[name], value, err_msg=name)


def test_a_state_is_saved_after_a_step_only():
    water = start("single")
    steps(water, 0, 1)
    water.move_solids(cut_domain(water.mesh, placed(0.2), "single", previous=water.domain))
    with pytest.raises(NotAfterAStep, match="before the solids move on"):
        state.save(water)


def test_a_state_of_another_water_is_refused():
    arrays = state.save(tank([1, 1, 1], 0.25, lambda x: x[:, 2] - 0.5))
    water = start("single")
    with pytest.raises(OtherWater, match=r"125 nodes and 384 cells, the domain 729 and \d+"):
        state.restore(water, water.domain, arrays)
    del arrays["pressure"]
    with pytest.raises(OtherWater, match="pressure missing"):
        state.restore(water, water.domain, arrays)
