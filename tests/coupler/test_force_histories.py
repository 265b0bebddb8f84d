"""Force histories of several runs beside each other: arrival, impulse, and an end where the first one breaks."""

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from coupler.commands.view import force_histories
from coupler.results.history import HistoryTable


def run_of(folder, force, breaks=np.inf):
    """A run directory with a force of the given value from 1 s on, and a joint that breaks at a time [s]."""
    (folder / "history").mkdir(parents=True)
    gauges = HistoryTable(
        folder / "history" / "gauges.csv", [("time", "s", "time"), ("house_force_x", "N", "force")]
    )
    structure = HistoryTable(
        folder / "history" / "structure.csv", [("time", "s", "time"), ("joints_broken", "1", "broken")]
    )
    for time in np.linspace(0.01, 2.0, 200):
        gauges.append(time=time, house_force_x=force if time >= 1.0 else 0.0)
        structure.append(time=time, joints_broken=float(time >= breaks))
    gauges.close()
    structure.close()
    return folder


def test_runs_are_compared_up_to_the_first_break_of_the_first(tmp_path):
    """Twice the force from 1 s to 1.5 s: twice the peak and twice the impulse."""
    runs = {
        "weak": force_histories.Curve(run_of(tmp_path / "weak", 1e6, 1.5), "house"),
        "strong": force_histories.Curve(run_of(tmp_path / "strong", 2e6), "house"),
    }
    assert runs["weak"].broken == pytest.approx(1.5)
    assert runs["weak"].arrival == pytest.approx(1.0, abs=0.011)
    assert runs["weak"].until(1.5)[1] == pytest.approx(0.51e6, rel=0.03)
    shown = force_histories.table(runs)
    assert "| weak | 1.000 | 1.500 |" in shown
    assert "none" in shown
    assert shown.rstrip().endswith("2.000 | 2.000 |")


def test_the_figure_is_written(tmp_path):
    curve = force_histories.Curve(run_of(tmp_path / "run", 1e6), "house")
    force_histories.draw({"run": curve}, tmp_path / "forces.png")
    assert (tmp_path / "forces.png").stat().st_size > 10_000
