"""The joints as surfaces for viewing: a polygon each, where its block a is, with the columns of the crack table."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

Array = np.ndarray


def write_crack_surfaces(path: Path, corners: Array, start: Array, columns: dict[str, Array]) -> None:
    """Write an unstructured VTK file (.vtu) as a whole, beside the old one and then in its place.

    corners (c, 3) [m] · start (J + 1,): first corner of each joint · columns: (J,) or (J, 3) a name.
    Thresholds on `intact` or `time` (of failure, NaN before) show the cracks.
    """
    import meshio

    size = np.diff(start)
    cells, order = [], []
    for corner_count in np.unique(size):
        joints = np.flatnonzero(size == corner_count)
        kind = {3: "triangle", 4: "quad"}.get(int(corner_count), "polygon")
        cells.append((kind, start[joints][:, None] + np.arange(corner_count)))
        order.append(joints)
    data = {name: [np.asarray(values)[joints] for joints in order] for name, values in columns.items()}
    beside = path.with_suffix(".new.vtu")
    meshio.Mesh(corners, cells, cell_data=data).write(beside)
    os.replace(beside, path)
