"""How probable it is that a wall of glued courses falls under still water, where the strength of its joints is
log-normal: `python -m coupler.commands.verify.wall_fragility` writes cases/fragility_of_a_wall/exact.csv.

The joint at the foot (thickness t, compression n T from the weight above) turns by the angle whose openings δ(x) carry
the moment of the water,

    ρ g h³/6 = T t² m,    m = ∫ τ x dx,   -n = ∫ τ dx,   d = e + φ x,   x in (-1/2, 1/2),
    τ = 27/4 d (1 - d)² for 0 < d < 1,   27/4 d for d < 0,   0 for d > 1      (closing as stiff as opening at first)

so it holds up to m_max(n), the largest m over φ, n = ρ_s g H/T. The stronger the joints, the deeper the water h*(T)
that they just carry, so P(h*(T)) = Φ(ln(T/median)/dispersion).
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq, minimize_scalar
from scipy.special import ndtr

from coupler.commands.verify.wall import DENSITY, HEIGHT, RHO, STRENGTH, THICKNESS, G
from coupler.program.provenance import ROOT

DISPERSION = 0.3
QUANTILES = np.linspace(-3.0, 3.0, 25)
"""Standard normal deviates of the strengths whose depths the file has."""
FILE = ROOT / "cases" / "fragility_of_a_wall" / "exact.csv"
TURNS = np.geomspace(0.05, 8.0, 30)
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(3)  # exact for the polynomials of degree 4 on each part


def resultants(e: np.ndarray, turn: float) -> np.ndarray:
    """∫ τ dx and ∫ τ x dx (2, k) of openings e + φ x, e (k,), part by part between closed, open and broken."""
    e = np.atleast_1d(e)
    half = np.full(len(e), 0.5)
    ends = np.clip(np.stack([-half, -e / turn, (1.0 - e) / turn, half]), -0.5, 0.5)
    low, high = ends[:-1, :, None], ends[1:, :, None]
    x = 0.5 * (low + high) + 0.5 * (high - low) * _POINTS
    d = e[:, None] + turn * x
    tau = 27.0 / 4.0 * np.where(d < 0.0, d, np.where(d < 1.0, d * (1.0 - d) ** 2, 0.0))
    weight = 0.5 * (high - low) * _WEIGHTS
    return np.stack([(weight * tau).sum(axis=(0, 2)), (weight * tau * x).sum(axis=(0, 2))])


def moment(n: float, turn: float) -> float:
    """m at the angle φ under the compression n, for the most closed of all e that carry n."""
    trial = np.linspace(-0.5 * turn - n, 0.5 * turn + 1.0, 200)
    carried = resultants(trial, turn)[0] >= -n
    first = int(np.argmax(carried))
    if not carried[first]:
        return 0.0
    e = brentq(lambda e: resultants(e, turn)[0, 0] + n, trial[max(first - 1, 0)], trial[first], xtol=1e-13)
    return float(resultants(e, turn)[1, 0])


def largest_moment(n: float) -> float:
    """m_max(n)"""
    best = int(np.argmax([moment(n, turn) for turn in TURNS]))
    bounds = TURNS[max(best - 1, 0)], TURNS[min(best + 1, len(TURNS) - 1)]
    found = minimize_scalar(
        lambda turn: -moment(n, turn), bounds=bounds, method="bounded", options={"xatol": 1e-8}
    )
    return float(-found.fun)


def depth_that_breaks(strength: float) -> float:
    """h*(T) [m]: the depth that a wall with joints of this strength [Pa] just carries."""
    carried = strength * THICKNESS**2 * largest_moment(DENSITY * G * HEIGHT / strength)
    return (6.0 * carried / (RHO * G)) ** (1.0 / 3.0)


def table() -> str:
    """Text of the case's file: the probability of collapse at the depth h*(T) is that of a strength below T."""
    lines = [
        "# Probability that a wall falls over the depth of still water: own solution, the joint at the foot integrated",
        "# exactly (coupler/commands/verify/wall_fragility.py). GPL-2.0-or-later.",
        "depth,falls",
    ]
    strengths = STRENGTH * np.exp(DISPERSION * QUANTILES)
    rows = [f"{depth_that_breaks(T):.5f},{ndtr(q):.6f}" for T, q in zip(strengths, QUANTILES)]
    return "\n".join([*lines, *rows]) + "\n"


if __name__ == "__main__":
    FILE.write_text(table(), encoding="utf-8")
    print(f"wrote {FILE}")
