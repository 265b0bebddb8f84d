"""The same last digits on every processor: one thread in the libraries, and the instructions of x86-64-v3.

NumPy, OpenBLAS and Numba choose their code by the processor: with AVX-512, products of matrices, hyperbolic functions
and the sorting of equal numbers differ from those with AVX2, at first in the last digit and later in the paths of drops
and debris. Here all three are set to use the instructions of processors since 2013 (Intel) and 2015 (AMD). The C
library chooses between code with and without fused multiply-add, which gives the same on all of these. On an older
processor each library uses what is available, and `missing` names what is not. Environment variables that the user has
not set are set, so this must happen before numpy or numba is imported; processes started later inherit them."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import MutableMapping
from pathlib import Path

BASELINE = "x86-64-v3"
NEEDED = ("avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe")
"""The baseline beyond x86-64-v2, in the words of /proc/cpuinfo (abm: lzcnt)."""

ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
"""Variables that set one thread: sums keep their order, and several busy-waiting thread pools would be far slower."""
ONE_INSTRUCTION_SET = {
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    "OPENBLAS_CORETYPE": "Haswell",
    "NUMBA_CPU_NAME": BASELINE,
    "NUMBA_CPU_FEATURES": "",
}


_too_late: list[str] = []


def fix_arithmetic(environment: MutableMapping[str, str] = os.environ) -> None:
    """Set the variables above that are not set; the instruction set where the processor has it."""
    settings = ONE_THREAD if missing() else ONE_THREAD | ONE_INSTRUCTION_SET
    if environment is os.environ and any(name not in environment for name in settings):
        _too_late[:] = [name for name in ("numpy", "numba") if name in sys.modules]
    for name, value in settings.items():
        environment.setdefault(name, value)


def _remark_on_order() -> str:
    """A warning for scripts that loaded a library before this program could configure it, if that matters; else
    empty."""
    if not _too_late or not _has_more():
        return ""
    return (
        f"{' and '.join(_too_late)} was loaded before surgebreak, and takes the instructions of this processor: the "
        "last digits, and what grows from them, may differ from those elsewhere; import surgebreak first"
    )


def _has_more(cpuinfo: Path = Path("/proc/cpuinfo")) -> bool:
    """Whether the processor has instructions beyond the baseline that these libraries would take."""
    return "avx512f" in cpuinfo.read_text(encoding="utf-8")


def missing(cpuinfo: Path = Path("/proc/cpuinfo")) -> list[str]:
    """Parts of the baseline that this processor lacks, in the words of NEEDED; all of them on other architectures."""
    if platform.machine() != "x86_64":
        return list(NEEDED)
    for line in cpuinfo.read_text(encoding="utf-8").splitlines():
        if line.startswith("flags"):
            found = line.partition(":")[2].split()
            return [name for name in NEEDED if name not in found]
    return list(NEEDED)


def remark() -> str:
    """A remark for users of older processors; empty on others."""
    absent = missing()
    if not absent:
        return _remark_on_order()
    return (
        f"this processor has no {', '.join(absent)} ({BASELINE}): the last digits, and what grows from them, differ "
        "from those on processors since 2013"
    )
