"""The cube root: exact under scaling, within one unit in the last place, the same on every processor."""

import os
import subprocess
import sys
from decimal import Decimal, localcontext

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fluid.numerics.cube_root import cube_root, root_of
from kernels.decorators import kernel

PRINT_ROOTS = """
import numpy as np
from fluid.numerics.cube_root import cube_root
print(cube_root(np.random.default_rng(1).uniform(1e-6, 1e6, 4001)).tobytes().hex())
"""


def spread(count: int):
    """Numbers of all sizes, (count,)."""
    return np.exp(np.random.default_rng(0).uniform(-600.0, 600.0, count))


@given(st.floats(1e-200, 1e200), st.integers(-100, 100))
def test_powers_of_eight_leave_the_root_as_powers_of_two(x, k):
    assert cube_root(np.ldexp(x, 3 * k)) == np.ldexp(cube_root(x), k)


def test_error_is_below_one_unit_in_the_last_place():
    x = spread(3000)
    with localcontext() as context:
        context.prec = 40
        third = Decimal(1) / Decimal(3)
        for value, root in zip(x, cube_root(x)):
            error = abs(Decimal(root) - Decimal(value) ** third)
            assert error < Decimal("0.7") * Decimal(np.spacing(root))


@kernel
def roots_of(x):
    """`root_of` each of x (n,)."""
    out = np.empty_like(x)
    for k in range(len(x)):
        out[k] = root_of(x[k])
    return out


def test_kernels_have_the_same_root():
    np.testing.assert_array_equal(roots_of(spread(3000)), cube_root(spread(3000)))


def test_cubes_of_whole_numbers_have_their_exact_root():
    whole = np.arange(-500.0, 500.0)
    np.testing.assert_array_equal(cube_root(whole**3), whole)


def test_values_without_a_root_come_back_as_they_are():
    x = np.array([0.0, -0.0, np.inf, -np.inf, np.nan])
    assert cube_root(x).tobytes() == x.tobytes()


def test_the_bits_do_not_depend_on_the_instruction_set():
    def roots(**environment):
        command = [sys.executable, "-c", PRINT_ROOTS]
        done = subprocess.run(
            command, env=os.environ | environment, capture_output=True, text=True, check=True
        )
        return done.stdout

    assert roots() == roots(NPY_DISABLE_CPU_FEATURES="X86_V3 X86_V4 AVX512_ICL AVX512_SPR")
