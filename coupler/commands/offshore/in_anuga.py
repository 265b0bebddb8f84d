"""ANUGA on a rectangle of triangles, a process of its own (it prints, and brings matplotlib):

python -m coupler.commands.offshore.in_anuga IN.npz OUT.npz
"""

from __future__ import annotations

import contextlib
import io
import os
import sys

import numpy as np

SIDES = {"x-": "left", "x+": "right", "y-": "bottom", "y+": "top"}
STEPS = 20
"""Lines of progress."""


def main(source: str, out: str) -> None:
    """Arrays of the sea → level and momenta (t, k) at places (k, 2)."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        import anuga
    from scipy.interpolate import RegularGridInterpolator

    with np.load(source, allow_pickle=False) as file:
        given = {name: file[name] for name in file.files}
    size, count = given["size"], given["count"]
    level, end, every = (float(given[name]) for name in ("level", "end", "every"))
    domain = anuga.rectangular_cross_domain(
        int(count[0]), int(count[1]), len1=float(size[0]), len2=float(size[1])
    )
    domain.set_flow_algorithm("DE1")
    domain.set_name(os.path.splitext(os.path.basename(out))[0])
    domain.set_store(False)
    bed = RegularGridInterpolator((given["x"], given["y"]), given["bed"])
    moved = RegularGridInterpolator((given["x"], given["y"]), given["moved"])
    domain.set_quantity("elevation", lambda x, y: bed((x, y)))
    domain.set_quantity("stage", lambda x, y: _stage(bed((x, y)), level, moved((x, y))))
    domain.set_quantity("friction", float(given["manning"]))
    walls, beyond = anuga.Reflective_boundary(domain), anuga.Dirichlet_boundary([level, 0.0, 0.0])
    kinds = {}
    for side, tag in SIDES.items():
        kinds[tag] = beyond if side in given["open"].tolist() else walls
        if f"record {side}" in given:
            kinds[tag] = anuga.Time_boundary(domain, function=_boundary(given[f"record {side}"]))
    domain.set_boundary(kinds)
    places = given["places"]
    names = ("stage", "elevation", "xmomentum", "ymomentum")
    time, rows, shown = [], [], 0
    for t in domain.evolve(yieldstep=every, finaltime=end):
        rows.append([domain.get_quantity(name).get_values(interpolation_points=places) for name in names])
        time.append(t)
        if t >= end * (shown + 1) / STEPS:
            shown = int(STEPS * t / end)
            print(f"offshore: {100 * shown // STEPS} %", flush=True)
    values = np.array(rows)
    np.savez(out, time=time, triangles=len(domain), **{name: values[:, k] for k, name in enumerate(names)})


def _stage(bed, level: float, moved):
    """Surface z (n,) [m] at the start; the uplift moves water only and no dry land."""
    return np.where(bed < level, np.maximum(level + moved, bed), bed)


def _boundary(table):
    """(t, 4) of time, level and both momenta → function of the time."""
    return lambda t: [float(np.interp(t, table[:, 0], table[:, k])) for k in (1, 2, 3)]


if __name__ == "__main__":
    main(*sys.argv[1:])
