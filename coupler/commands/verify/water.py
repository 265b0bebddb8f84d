"""The water alone: sloshing, and the pressure at the release of a dam."""

from __future__ import annotations

import numpy as np
from scipy.optimize import curve_fit

from coupler.commands.verify.curves import Curve, Figure, Panel
from coupler.commands.verify.figures import columns
from coupler.commands.verify.registry import Finding, check
from coupler.commands.verify.scenes import DENSITY, G, column, tank
from fluid.mesh.refinement import InBox
from fluid.readings import gauges

WEIGHT = DENSITY * G


@check("P33", "linear sloshing in a tank of 1 m, 0.5 m deep", "omega² = g k tanh(k h)")
def sloshing():
    table = columns("sloshing_linear")
    omega, curves = table["omega"][0], []
    for name, share, coarse in (
        ("default step", 1.0, 1),
        ("half the default step", 0.5, 1),
        ("cells twice as large, halved at the surface", 1.0, 2),
    ):
        t, mode = _slosh(omega, share, coarse)
        found, damping = _fit(t, mode, omega)
        loss = 1.0 - np.exp(-damping * found * t[-1])
        curves.append(Curve(name, "computed", t, 1e3 * mode))
        yield Finding(f"period of the first mode [s], {name}", 2 * np.pi / found, table["T_s"][0], 0.01)
        yield Finding(f"share of the amplitude lost in 5 periods, {name}", loss, 0.0, 0.10, False)
    t = np.linspace(0.0, 10 * np.pi / omega, 400)
    curves.append(Curve("linear theory", "exact", t, 1e3 * AMPLITUDE * np.cos(omega * t)))
    yield Figure("P33_sloshing", (Panel("time [s]", "amplitude of the first mode [mm]", tuple(curves)),))


AMPLITUDE = 0.005
"""[m]"""


def _slosh(omega: float, share: float, coarse: int = 1):
    """Times (n,) [s] and the amplitude of the first mode (n,) [m] over five periods. The step is `share` times the
    default one; coarse: factor by which the cells deeper than 0.125 m below the surface are larger."""
    n, amplitude = 32 // coarse, AMPLITUDE
    high = 21 if coarse == 1 else 11
    c = tank(
        (1, 2 / n, high / n),
        (n, 2, high),
        lambda x: x[:, 2] - 0.5 - amplitude * np.cos(np.pi * x[:, 0]),
        rtol=1e-7,
        refined=[] if coarse == 1 else [InBox((0, 0, 0.375), (1, 2 / n, high / n), 1)],
    )
    end = 5 * 2 * np.pi / omega
    dt = end / np.ceil(end / (share * c.water.stable_step()))
    shape = np.cos(np.pi * c.water.topology.nodes[:, 0])
    t, mode = [], []
    while c.time < end - 0.5 * dt:
        c.step(dt)
        t.append(c.time)
        mode.append(2 * (c.water.nodal_water @ shape) * n / 2)
    return np.array(t), np.array(mode)


def _fit(t, signal, omega: float) -> tuple[float, float]:
    """(ω, ζ) of A e^(-ζωt) cos(ωt + φ) + c by least squares."""

    def model(t, A, w, zeta, phase, c):
        return A * np.exp(-zeta * w * t) * np.cos(w * t + phase) + c

    found = curve_fit(model, t, signal, [signal.max(), omega, 0.003, 0.0, 0.0])[0]
    return float(found[1]), float(found[2])


@check("P34", "pressure at the release of a dam", "series solution of Laplace's equation")
def dam_release():
    table, panels = columns("dam_release_initial_pressure"), []
    for width, exact in ((1.0, 0.589371), (2.0, 0.910975)):
        n = 20
        c = tank((width + 0.5, 2 / n, 1.2), (round((width + 0.5) * n), 2, round(1.2 * n)), column(width, 1.0))
        c.step(1e-4)
        z = np.linspace(0.0, 1.0, 201)
        y = 1.0 / n
        p = gauges.pressure(c.water, np.column_stack([np.zeros_like(z), np.full_like(z, y), z]))
        force = np.trapezoid(p, z) / (0.5 * WEIGHT)
        yield Finding(f"force on the back wall / hydrostatic, W/H {width:g}, h = H/{n}", force, exact, 0.02)
        at = (table["W"] == width) & (table["x"] == 0.0)
        curves = (
            Curve("series", "measured", table["p"][at], table["y"][at]),
            Curve(f"first step, cells H/{n}", "computed", p / WEIGHT, z),
        )
        axes = ("pressure on the back wall $p/\\rho g H$ [–]", f"height $z/H$ [–], $W/H$ = {width:g}")
        panels.append(Panel(*axes, curves, (0.0, 1.0), (0.0, 1.0)))
    yield Figure("P34_release", tuple(panels), columns=2)
