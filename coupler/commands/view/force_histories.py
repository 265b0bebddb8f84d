"""python -m coupler.commands.view.force_histories GAUGE FIGURE NAME=RUN [NAME=RUN ...]: the force on a gauge in several
runs of one scene, and its impulse, as a figure and as a table that compares each run with the first.

The comparison ends when a joint of the first run breaks, since the structures differ from then on.
"""

import sys
from itertools import cycle
from pathlib import Path

import numpy as np

from coupler.commands.view.figure_files import undated
from coupler.commands.view.palette import LINES
from coupler.commands.view.plots import STYLE, plt
from coupler.commands.view.study import DASHES
from coupler.results.history import read_history

SIZE = (6.9, 3.6)
"""[inch] two columns of a journal."""
BEFORE = 0.1
"""[s] shown before the wave arrives."""
ARRIVES = 0.02
"""Share of the largest force from which the wave has arrived."""


class Curve:
    """time (n,) [s], force (n,) [N] along x, impulse (n,) [N s], broken [s]: when the first joint broke (inf: none)."""

    def __init__(self, run, gauge):
        history = read_history(Path(run) / "history" / "gauges.csv")
        self.time, self.force = history["time"], history[f"{gauge}_force_x"]
        self.impulse = np.cumsum(self.force * np.diff(self.time, prepend=0.0))
        structure = read_history(Path(run) / "history" / "structure.csv")
        broken = structure["joints_broken"] > 0
        self.broken = float(structure["time"][np.argmax(broken)]) if broken.any() else np.inf

    @property
    def arrival(self):
        """[s]"""
        return float(self.time[np.argmax(self.force > ARRIVES * self.force.max())])

    def until(self, time):
        """(largest force [N], impulse [N s]) up to a time [s]."""
        early = self.time <= time
        return float(self.force[early].max()), float(np.interp(time, self.time, self.impulse))


def draw(curves, path):
    """Force and impulse over time, the first break of each run marked."""
    with plt.rc_context(STYLE):
        drawing, (upper, lower) = plt.subplots(2, 1, figsize=SIZE, sharex=True)
        for colour, dashes, (name, curve) in zip(LINES, cycle(DASHES), curves.items()):
            upper.plot(curve.time, 1e-6 * curve.force, color=colour, linestyle=dashes)
            lower.plot(curve.time, 1e-6 * curve.impulse, color=colour, linestyle=dashes, label=name)
            if np.isfinite(curve.broken):
                for axes in (upper, lower):
                    axes.axvline(curve.broken, color=colour, linewidth=0.8, linestyle=":")
                upper.annotate("first joint breaks", (curve.broken, 0.03), xycoords=("data", "axes fraction"),
                               xytext=(4, 0), textcoords="offset points", fontsize=7, color=colour)  # fmt: skip
        upper.set_ylabel("force [MN]")
        lower.set_ylabel("impulse [MN·s]")
        lower.set_xlabel("time [s]")
        arrival = min(curve.arrival for curve in curves.values())
        upper.set_xlim(max(0.0, arrival - BEFORE), max(curve.time[-1] for curve in curves.values()))
        lower.legend(loc="lower right")
        drawing.savefig(path, metadata=undated(Path(path).suffix[1:]))
        plt.close(drawing)


def table(curves):
    """Markdown: arrival, first break, and up to the first break of the first run the largest force and the impulse."""
    first = next(iter(curves.values()))
    end = min(first.broken, *(c.time[-1] for c in curves.values()))
    lines = [
        f"| run | arrival [s] | first joint breaks [s] | largest force to {end:.2f} s [MN] | impulse to {end:.2f} s "
        "[MN·s] | largest force / first | impulse / first |",
        "|---|--:|--:|--:|--:|--:|--:|",
    ]
    reference = first.until(end)
    for name, curve in curves.items():
        force, impulse = curve.until(end)
        broken = f"{curve.broken:.3f}" if np.isfinite(curve.broken) else "none"
        shares = f"{force / reference[0]:.3f} | {impulse / reference[1]:.3f}"
        lines.append(
            f"| {name} | {curve.arrival:.3f} | {broken} | {1e-6 * force:.3f} | {1e-6 * impulse:.3f} | {shares} |"
        )
    return "\n".join(lines)


def main():
    """Write the figure and print the table."""
    gauge, figure, *runs = sys.argv[1:]
    curves = {name: Curve(run, gauge) for name, run in (word.split("=", 1) for word in runs)}
    draw(curves, figure)
    print(table(curves))


if __name__ == "__main__":
    main()
