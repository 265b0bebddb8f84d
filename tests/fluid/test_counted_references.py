"""Threads that share a kernel change no count of references in its loops.

Where a loop takes an array out of a tuple, numba counts one reference more and one less in every turn, by instructions
that lock the count. The array is the same for all threads, so they wait for one another: the slope of the volumes took
13.7 ms on two threads and 24 on sixteen instead of 8.9 on one."""

import re

import numpy as np
import pytest
import scipy.sparse as sp
from numba import njit
from scipy.sparse.csgraph import connected_components

from coupler.commands.benchmark.water import dam_break, step
from fluid.domain.layers import _beyond
from fluid.domain.moments import _nodal_water, _wet_fraction
from fluid.pressure.waterline import _differences
from fluid.surface.extrapolation import _mean_gradients
from fluid.surface.pools import _trees
from fluid.surface.volume import _edge_rates, _probed
from fluid.transport.advection import _brought, _limited

COUNT = re.compile(r"call[^\n]*@NRT_(?:incref|decref)")
KERNELS = [
    _beyond,
    _brought,
    _differences,
    _edge_rates,
    _limited,
    _mean_gradients,
    _nodal_water,
    _probed,
    _trees,
    _wet_fraction,
]

ARRIVED = 0.5
"""Seconds after which water is at the box, so that every one of KERNELS has been called."""


@pytest.fixture(scope="module")
def stepped():
    water = dam_break(1000)
    while water.time < ARRIVED:
        step(water)


@pytest.mark.parametrize("kernel", KERNELS, ids=lambda kernel: kernel.py_func.__name__)
def test_loops_that_threads_share_count_no_references(stepped, kernel):
    assert counts_in_loops(kernel.py_func, kernel.signatures[0]) == 0


def counts_in_loops(function, signature) -> int:
    """Changes of counts in those basic blocks of a compiled function that lead back to themselves."""
    compiled = njit(nogil=True)(function)
    compiled.compile(signature)
    found = 0
    for body in re.findall(r"^define [^\n]*\{\n(.*?)^\}", compiled.inspect_llvm(signature), re.M | re.S):
        blocks = re.split(r"^(?=[\w.\"$-]+:)", body, flags=re.M)
        label = {block.split(":", 1)[0].strip('"'): k for k, block in enumerate(blocks)}
        jumps = [
            (k, label[to])
            for k, block in enumerate(blocks)
            for to in re.findall(r"label %\"?([\w.$-]+)", block)
            if to in label
        ]
        ways = sp.coo_array(
            (np.ones(len(jumps)), np.array(jumps, int).reshape(-1, 2).T), shape=(len(blocks),) * 2
        )
        _, loop = connected_components(ways, connection="strong")
        again = (np.bincount(loop)[loop] > 1) | (ways.todense().diagonal() > 0)
        found += sum(len(COUNT.findall(block)) for block, inside in zip(blocks, again) if inside)
    return found
