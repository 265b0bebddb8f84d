"""The median of some entries of a field, by all threads: a sample says where it lies, and the rest is counted.

After R. W. Floyd, R. L. Rivest, Commun. ACM 18 (1975) 165: only entries between two values of the sample are sorted.
"""

from __future__ import annotations

import numpy as np

from kernels.decorators import released
from kernels.threads import over

SAMPLE = 1_000
"""Number of entries in the sample; of fewer than eight times as many the median is found at once."""
AROUND = 0.05
"""Share of the sample on either side of its middle within which the median is sought."""


def median_of(field, rows) -> float:
    """Median of field (N,) at the listed rows (n,), n > 0: np.median(field[rows]), to the bit."""
    n = len(rows)
    if n < 8 * SAMPLE:
        return float(np.median(field[rows]))
    sample = np.sort(field[rows[:: n // SAMPLE]])
    low, high = (sample[int((0.5 + side * AROUND) * len(sample))] for side in (-1, 1))
    below, at_low, at_high, between = zip(*over(_counted, n, rows, field, low, high))
    held = np.sort(np.concatenate(between))
    ends = np.cumsum([sum(below), sum(at_low), len(held), sum(at_high)])
    found = []
    for rank in ((n - 1) // 2, n // 2):
        if not ends[0] <= rank < ends[3]:
            return float(np.median(field[rows]))
        found.append(low if rank < ends[1] else high if rank >= ends[2] else held[rank - ends[1]])
    return float((found[0] + found[1]) / 2.0)


@released
def _counted(first, last, rows, field, low, high):
    """How many of the listed entries lie below `low`, at it and at `high`, and those between them."""
    below, at_low, at_high, n = 0, 0, 0, 0
    between = np.empty(last - first + 1)
    for s in range(first, last):
        value = field[rows[s]]
        below += value < low
        at_low += value == low
        at_high += value == high and low < high
        between[n] = value
        n += low < value < high
    return below, at_low, at_high, between[:n].copy()
