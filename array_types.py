"""Types of arrays, by what they hold; their shapes and units stand in the docstrings of what takes or gives them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
"""Of any numbers."""
Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Integers = npt.NDArray[np.integer[Any]]
"""Of any width: numbers of nodes and of shapes are kept in the smallest type that holds them."""
Bools = npt.NDArray[np.bool_]
