"""The joints at the end of a run, as a table and as surfaces: one polygon per joint, at the position of its block a."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.results.history import Column, WrongShape, write_table
from coupler.results.storage import NotFinite

CRACK_COLUMNS = tuple(
    Column(*c)
    for c in (
        ("joint", "1", "number of the joint"),
        ("a", "1", "row of the first block"),
        ("b", "1", "row of the second block, -1 for the ground"),
        ("time", "s", "when the joint lost its last traction; empty if it still holds"),
        ("area", "m2", "joined area"),
        ("centre", "m", "centre of the joined face now; it moves with block a"),
        ("normal", "1", "unit normal of that face now, out of block a"),
        ("damage", "1", "largest effective opening of its points over the opening at failure, 0 to 1"),
        ("opening", "m", "mean normal opening, positive when open"),
        ("sliding", "m", "mean tangential opening, a length"),
        ("mode_mix", "1", "share of sliding in the effective opening: 0 pulled apart, 1 sheared"),
        ("dissipated", "J", "energy the joint has used up"),
        ("intact", "1", "1 while the joint carries traction, else 0"),
    )
)

OTHER_NAMES = {"time": "failure_time", "intact": "alive"}
"""Column → field of `JointTable` where they differ."""


def crack_columns(structure) -> dict[str, Array]:
    """Columns of the crack table, (J,) or (J, 3) each; empty without joints."""
    joints = structure.joint_table()
    if joints is None:
        return {}
    found = {"joint": np.arange(len(joints))}
    for name in (column.name for column in CRACK_COLUMNS if column.name not in found):
        values = getattr(joints, OTHER_NAMES.get(name, name))
        found[name] = values.astype(int) if values.dtype == bool else values
    return found


def write_cracks(path, table):
    """Write the crack table from a dict of arrays with names out of CRACK_COLUMNS (n,) or, for vectors, (n, 3).

    A time that is not finite (the joint holds) becomes an empty cell. Raises WrongShape (unknown name, unequal
    lengths), NotFinite, DiskFull.
    """
    columns, arrays = _crack_arrays(path, table)
    for c, array in zip(columns, arrays):
        if c.name != "time" and not np.isfinite(array).all():
            row = int(np.flatnonzero(~np.isfinite(array))[0])
            raise NotFinite(f"{path}: {c.name} is {array[row]} in row {row}")
    write_table(path, "joints: which broke, when and how", columns, arrays)


def _crack_arrays(path, table):
    known = {c.name: c for c in CRACK_COLUMNS}
    unknown = sorted(set(table) - set(known))
    lengths = {name: np.shape(values)[:1] for name, values in table.items()}
    if unknown or len(set(lengths.values())) > 1:
        raise WrongShape(f"{path}: unknown columns {unknown} (known: {', '.join(known)}); rows {lengths}")
    columns, arrays = [], []
    for name in (c.name for c in CRACK_COLUMNS if c.name in table):
        values = np.asarray(table[name])
        parts = [("", values)] if values.ndim == 1 else [("_" + "xyz"[i], values[:, i]) for i in range(3)]
        columns += [Column(name + tail, known[name].unit, known[name].meaning) for tail, _ in parts]
        arrays += [part for _, part in parts]
    return columns, arrays


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
