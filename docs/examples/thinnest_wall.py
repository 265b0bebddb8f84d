"""The thinnest wall that stands under 0.9 m of still water with a probability of 95 %: scipy drives surgebreak.

    .venv/bin/python docs/examples/thinnest_wall.py

The strength of the joints of a wall is log-normal, median 0.1 MPa, dispersion 0.3. What a wall carries, a stronger one
of the same thickness carries too, so walls stand with 95 % where that of the 5 % quantile just stands: bisection over
the thickness, a run each. Closed form: t = (rho g h^3 / (6 T m_max))^(1/2), m_max the largest moment of a joint under
the weight above (coupler/commands/verify/wall_fragility.py).
"""

import tempfile
from pathlib import Path

import surgebreak  # before numpy and scipy: see its help

from scipy.optimize import bisect  # isort: skip
from scipy.stats import lognorm  # isort: skip

DEPTH, HEIGHT = 0.9, 2.0
STRENGTH = lognorm(0.3, scale=1e5).ppf(0.05)
WALL = surgebreak.load(Path(__file__).parents[2] / "cases" / "fragility_of_a_wall")


def stands(thickness: float, folder: Path) -> bool:
    """Whether the wall of this thickness [m] finds an equilibrium and keeps it for two steps."""
    case = WALL.copy().set("water.fill[0].upper[2]", DEPTH).set("joints.strength", float(STRENGTH))
    case.set("structure.wall[0].size", [thickness, 0.5, HEIGHT])
    case.set("structure.wall[0].block", [thickness, 0.5, 0.25])
    try:
        run = case.run(folder / f"{thickness:.4f}", quiet=True)
    except Exception as error:
        if type(error).__name__ != "CannotStand":
            raise
        return False
    return run.history("structure")["joints_broken"][-1] == 0


def thinnest() -> float:
    """Thickness [m] of the wall that just stands, to 2 mm."""
    with tempfile.TemporaryDirectory() as folder:
        return bisect(lambda t: 1.0 if stands(t, Path(folder)) else -1.0, 0.15, 0.31, xtol=2e-3)


if __name__ == "__main__":
    found = thinnest()
    print(
        f"joints of {STRENGTH / 1e3:.1f} kPa (one wall in twenty is weaker): a wall of {1e3 * found:.0f} mm just stands"
    )
