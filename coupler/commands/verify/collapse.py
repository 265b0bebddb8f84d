"""The collapse of a column of water on a dry bed: the front and the height at the wall (Martin and Moyce)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupler.commands.verify.curves import Curve, Figure, Panel
from coupler.commands.verify.figures import columns
from coupler.commands.verify.losses import Losses
from coupler.commands.verify.registry import Finding, check
from coupler.commands.verify.scenes import G, column, slice_sides, tank
from fluid.readings import gauges

A = 0.05715
"""Width of Martin and Moyce's column [m]; its height is 2 a."""
SMOOTH = 4e-5
"""k_s [m] of a hydraulically smooth wall, 3.3 ν/u*, at the friction velocity u* = 0.08 m/s of this front."""
FRONT_AT = A / 64
"""Height above the bed [m] at which the front is read, on all cells: a quarter of a cell of a/16. At a quarter of each
cell the front of a/64 is farther down its wedge, where it is 0.6 % earlier."""
SLIPPING = 2.263
"""T at Z = 3 of the front without friction, released at once: cells of a/64 and CFL 1."""
TABLE = "Martin and Moyce 1952"


@dataclass(frozen=True)
class Collapse:
    """T = t sqrt(2 g/a), front Z = x/a at FRONT_AT above the bed, height H = h/(2 a) at the wall, all (n,); losses of
    the run."""

    T: np.ndarray
    Z: np.ndarray
    H: np.ndarray
    losses: Losses

    @property
    def slope(self) -> float:
        """dZ/dT by least squares over 2 < Z < 4."""
        within = (self.Z > 2.0) & (self.Z < 4.0)
        return float(np.polyfit(self.T[within], self.Z[within], 1)[0])

    def at(self, Z: float) -> float:
        """Time T at which the front reaches Z."""
        return float(np.interp(Z, self.Z, self.T))


@check("P36", "front of a collapsing column", "Martin and Moyce, Phil. Trans. A 244 (1952) 312, table 2", "M")
def dam_break_front():
    table = columns("martin_moyce_front_n2_2_a2p25in_table")
    rubbed = {
        n: collapse(3.6, n, walls="friction", roughness=SMOOTH, is_smooth=slice_sides) for n in (16, 32)
    }
    slipping = {n: collapse(3.6, n) for n in (16, 32)}
    measured = table["T"][table["Z"] == 3.0][0]
    for n, run in rubbed.items():
        # a band over the two columns of the experiment, 1.34 to 1.37
        yield Finding(f"smooth walls, cells of a/{n}: slope dZ/dT for 2 < Z < 4", run.slope, 1.355, 0.10)
        yield Finding(f"smooth walls, cells of a/{n}: T at Z = 3", run.at(3.0), measured, 0.25, False)
        yield from run.losses.findings(f"smooth walls, cells of a/{n}: ")
    for n, run in slipping.items():
        yield Finding(
            f"free-slip walls, cells of a/{n}: T at Z = 3, against a/64", run.at(3.0), SLIPPING, 0.01
        )
    long, other = columns("martin_moyce_front_n2_2_a2p25in_fig3"), columns("koshizuka_oka_front")
    curves = (
        Curve(f"{TABLE}, table 2", "measured", table["T"], table["Z"]),
        Curve("the same, figure 3", "measured", long["T"], long["Z"]),
        Curve("Koshizuka and Oka 1996, measured", "measured", other["T"], other["Z"]),
        *(Curve(f"free-slip walls, cells a/{n}", "computed", run.T, run.Z) for n, run in slipping.items()),
        *(Curve(f"smooth walls, cells a/{n}", "computed", run.T, run.Z) for n, run in rubbed.items()),
    )
    axes = ("time $t\\sqrt{2g/a}$ [–]", "front $x/a$ [–]")
    yield Figure("P36_front", (Panel(*axes, curves, (0.0, 3.6), (1.0, 4.6)),))


@check("P37", "height of a collapsing column at the wall", "Martin and Moyce 1952, table 6", "M")
def dam_break_height():
    table = columns("martin_moyce_height_n2_2_a2p25in_table")
    run = collapse(4.0 * np.sqrt(2.0))
    tau = run.T / np.sqrt(2.0)
    for at in (1.08, 2.0, 3.06):
        measured = table["H"][np.isclose(table["tau"], at)][0]
        yield Finding(f"H at tau = {at}", float(np.interp(at, tau, run.H)), measured, 0.04, False)
    yield from run.losses.findings()
    curves = (
        Curve(f"{TABLE}, table 6", "measured", table["tau"], table["H"]),
        Curve("computed, cells a/16", "computed", tau, run.H),
    )
    axes = ("time $t\\sqrt{g/a}$ [–]", "height at the wall $h/2a$ [–]")
    yield Figure("P37_height", (Panel(*axes, curves, (0.0, 4.0), (0.0, 1.05)),))


def collapse(until: float, n: int = 16, **settings) -> Collapse:
    """A slice two cells wide on cells of a/n, to T = until; settings as of `tank`."""
    c = tank((7 * A, 2 * A / n, 2.5 * A), (7 * n, 2, round(2.5 * n)), column(A, 2 * A), rtol=1e-7, **settings)
    scale, losses = np.sqrt(2 * G / A), Losses(c.water)
    x = np.linspace(0, 7 * A, 7 * n * 4 + 1)
    bed = np.column_stack([x, np.full_like(x, A / n), np.full_like(x, FRONT_AT)])
    rows = [(0.0, 1.0, 1.0)]
    while rows[-1][0] < until:
        c.step(c.water.stable_step())
        losses.add()
        height = gauges.level(c.water, (0.5 * A / n, A / n)) / (2 * A)
        rows.append((c.time * scale, _front(c.water, bed) / A, height))
    return Collapse(*np.array(rows).T, losses)


def _front(water, bed) -> float:
    """x [m] of the surface along the line `bed` (m, 3) between the last wet point before the first dry one and this."""
    level = gauges.level_set_at(water, bed)
    dry = int(np.argmax(level >= 0.0)) if (level >= 0.0).any() else len(bed)
    if dry in (0, len(bed)):
        return bed[max(dry - 1, 0), 0]
    return float(np.interp(0.0, level[dry - 1 : dry + 1], bed[dry - 1 : dry + 1, 0]))
