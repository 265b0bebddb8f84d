"""The memory that this process may take: that of the machine, less where a container, a batch job or `ulimit -v` gives
it less. Whoever takes more is killed without a word."""

from __future__ import annotations

import os
import resource

from coupler.program.control_groups import groups

LIMITS = ("memory.max", "memory.limit_in_bytes")
"""Files of a control group with its limit [B], of version 2 and 1; "max" and huge numbers mean none."""


def memory() -> int:
    """Bytes of memory that there are for this process."""
    machine = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    own, _ = resource.getrlimit(resource.RLIMIT_AS)
    return min([machine, *_of_groups(), *([] if own == resource.RLIM_INFINITY else [own])])


def _of_groups() -> list[int]:
    found = []
    for group in groups("memory"):
        for name in LIMITS:
            try:
                found.append(int((group / name).read_text(encoding="ascii")))
            except (OSError, ValueError):
                continue
    return found
