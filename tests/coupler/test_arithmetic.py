"""The same bits on every processor: one instruction set for all that computes, and kernels that do not need it.

Children get another instruction set for Numba than this process has; what they print is compared bit for bit."""

import json
import subprocess
import sys

import pytest

from coupler.program import arithmetic
from coupler.program.process import environment

OLD = "flags\t\t: fpu sse2 ssse3 sse4_1 sse4_2 popcnt avx\n"
NEW = OLD.strip() + " avx2 bmi1 bmi2 f16c fma abm movbe avx512f\n"

needs_baseline = pytest.mark.skipif(bool(arithmetic.missing()), reason="an older processor takes its own")

IN_FORCE = """
import json
from coupler.program.start import one_thread
one_thread()
import numpy.linalg, scipy.linalg, threadpoolctl
from numba.core.registry import cpu_target
from numpy._core._multiarray_umath import __cpu_features__ as features
print(json.dumps({
    "numpy": sorted(name for name in ("X86_V3", "X86_V4", "AVX512_ICL", "AVX512_SPR") if features[name]),
    "blas": sorted({pool["architecture"] for pool in threadpoolctl.threadpool_info() if "architecture" in pool}),
    "numba": cpu_target.target_context.codegen().magic_tuple()[1:],
}))
"""
KERNELS = """
import sys
from coupler.program.start import one_thread
one_thread()
import numpy as np
from fluid.mesh.background import box_mesh
from fluid.step.remainders import carry_remainder
from tests.yade_scripts.test_joints import JointParameters, Pair
random = np.random.default_rng(3)
mesh = box_mesh((0, 0, 0), (1, 1, 1), 0.3)
found = [mesh.locate(random.uniform(0, 1, (500, 3))), mesh.gradients, mesh.products]
remainder, kick, velocity = random.normal(size=(3, len(mesh.cells), 3))
every, sizes = np.arange(len(mesh.cells)), np.full(len(mesh.cells), 0.3)
found.append(carry_remainder(every, (every, remainder, kick), 0.01, velocity, 0.1, 1e-3, mesh.cells, sizes))
pair = Pair(JointParameters(1e6, 1e-3, law="exponential"))
found += [pair.force(1e-3 * np.array(way), 1e-6, advance=True) for way in random.uniform(-0.1, 0.9, (50, 3))]
print(b"".join(np.ascontiguousarray(a).tobytes() for a in found).hex())
"""
SCENE = """
from coupler.program.start import one_thread
one_thread()
from tests.coupler.test_momentum import run, scene
rows = []
water = {"fill": [{"lower": [0, 0, 0], "upper": [0.5, 0.5, 0.4]}], "walls": "friction", "roughness": 0.002}
coupling, _ = run(scene(water=water), 0.35, lambda c, r: rows.append(c.water.velocity.tobytes() + r.load.tobytes()))
s = coupling.structure
assert not s.joints.alive.all(), "no joint broke"
ends = (coupling.water.level_set, s.centre(), s.rotation(), s.velocity(), s.joints.largest)
print(b"".join([*rows, *(a.tobytes() for a in ends)]).hex())
"""


def printed_by(code: str, without=(), **variables: str) -> str:
    """Output of some Python in a process with the variables of this one, but `without`, and those given."""
    given = {name: value for name, value in environment().items() if name not in without}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, env=given | variables, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@needs_baseline
def test_numpy_blas_and_numba_take_the_baseline():
    found = json.loads(printed_by(IN_FORCE, without=arithmetic.ONE_INSTRUCTION_SET))
    assert found == {"numpy": ["X86_V3"], "blas": ["Haswell"], "numba": [arithmetic.BASELINE, ""]}


@needs_baseline
def test_kernels_give_the_same_bits_with_and_without_fused_and_wide_instructions():
    assert printed_by(KERNELS) == printed_by(KERNELS, NUMBA_CPU_NAME="x86-64-v2", NUMBA_CPU_FEATURES="")


@needs_baseline
@pytest.mark.nightly
@pytest.mark.parametrize("name", ["x86-64-v2", None], ids=["older", "this processor's own"])
def test_a_scene_has_the_same_bits_with_kernels_of_another_baseline(name):
    """Water, free and held blocks, joints that break: the kernels compiled anew for another processor."""
    other = {"NUMBA_CPU_NAME": name, "NUMBA_CPU_FEATURES": ""} if name else {}
    with_host = (
        "from coupler.program import arithmetic\n" + "arithmetic.ONE_INSTRUCTION_SET.pop('NUMBA_CPU_NAME')\n"
    )
    with_host += "arithmetic.ONE_INSTRUCTION_SET.pop('NUMBA_CPU_FEATURES')\n"
    numba = ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES")
    assert printed_by(SCENE) == printed_by(SCENE if name else with_host + SCENE, without=numba, **other)


def test_an_older_processor_takes_what_it_has_and_says_so(tmp_path, monkeypatch):
    cpuinfo = tmp_path / "cpuinfo"
    cpuinfo.write_text(NEW, encoding="utf-8")
    assert arithmetic.missing(cpuinfo) == []
    cpuinfo.write_text(OLD, encoding="utf-8")
    absent = arithmetic.missing(cpuinfo)
    assert {"avx2", "fma"} < set(absent)
    monkeypatch.setattr(arithmetic, "missing", lambda: absent)
    found = {}
    arithmetic.fix_arithmetic(found)
    assert found == arithmetic.ONE_THREAD
    assert "no avx2" in arithmetic.remark()


def test_what_the_user_has_set_stays(monkeypatch):
    monkeypatch.setattr(arithmetic, "missing", list)
    assert arithmetic.remark() == ""
    found = {"OMP_NUM_THREADS": "2", "OPENBLAS_CORETYPE": "Zen"}
    arithmetic.fix_arithmetic(found)
    assert (found["OMP_NUM_THREADS"], found["OPENBLAS_CORETYPE"]) == ("2", "Zen")
    assert found["NUMBA_CPU_NAME"] == arithmetic.BASELINE
