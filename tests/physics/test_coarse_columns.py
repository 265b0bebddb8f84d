"""A column of a few cells gains no energy while it collapses."""

from coupler.case.case import Case
from coupler.scene.build import build
from tests.fakes import no_clock


def gained(cell):
    """Largest error of the energy before the front reaches the wall, over the energy put in."""
    case = Case.model_validate(
        {
            "case": {"title": "a column of 5 x 2 x 4 cells of 2 cm"},
            "time": {"end": 0.16},
            "tank": {"lower": [0, 0, 0], "upper": [0.274, 0.0415, 0.156], "cell": cell},
            "water": {"fill": [{"lower": [0, 0, 0], "upper": [0.105, 0.0415, 0.075]}]},
        }
    )
    coupling = build(case, no_clock).coupling
    worst = 0.0
    while coupling.time < case.time.end - 1e-12:
        record = coupling.step(coupling.step_size(case.time.end - coupling.time))
        worst = max(worst, record.balance.energy_error)
    return worst


def test_a_coarse_column_gains_nothing():
    """It gained 4.9 % on four cells in its height, 1.5 % on six, 0.2 % on seven and a half."""
    for cell in (0.02, 0.0133, 0.01):
        assert gained(cell) < 0.005
