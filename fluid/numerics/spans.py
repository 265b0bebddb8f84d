"""Rows of large arrays, some at a time.

An expression of NumPy on a whole field makes temporary arrays as long as the field, which set the peak of the memory;
on spans of rows they stay in the cache of the processor.
"""

from __future__ import annotations

from collections.abc import Iterator

LENGTH = 32_768
"""Rows of a span: a temporary array of three numbers a row takes 0.8 MB."""


def spans(count: int) -> Iterator[slice]:
    """Slices of at most LENGTH rows that together cover 0 ... count, in order."""
    for first in range(0, count, LENGTH):
        yield slice(first, min(first + LENGTH, count))
