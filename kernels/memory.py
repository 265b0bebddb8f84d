"""Memory that a step frees stays in the process, for the fields of the next one.

A step of a million cells makes and frees some 160 MB of fields. Where they go back to the system and are asked for
again, it fills every page of them with zeros first: a twelfth of a step. This holds for the whole process, so it is for
what makes steps to ask for it, not for whoever imports these packages."""

from __future__ import annotations

import ctypes

TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3
"""Parameters of mallopt(3): bytes of free memory at the end of the heap that stay there, and bytes from which an array
has memory of its own, which goes back when it is freed."""
LEFT, OWN = (1 << 31) - 1, 256 << 20
"""The most that mallopt can be told; and fields of ten million cells, whose memory goes back as before."""


def keep_memory() -> None:
    """Have the C library keep what this process frees from now on; one without mallopt, other than glibc's, goes on as
    it does."""
    library = ctypes.CDLL(None)
    if hasattr(library, "mallopt"):
        library.mallopt(TRIM_THRESHOLD, LEFT)
        library.mallopt(MMAP_THRESHOLD, OWN)
