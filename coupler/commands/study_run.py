"""One run of a study: `python -m coupler.commands.study_run FIGURES.json run CASE --set ... --output DIR`.

What follows the file is handed to `surgebreak`, so the run is the one that a user makes. The processor time that
numba takes to compile is written to the file: it is paid once for each state of the sources, not by every run.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

from coupler.commands.cli import main
from coupler.program.start import one_thread


class Compilation:
    """Processor seconds inside numba's compiler, and how many kernels it compiled; compilations may be nested."""

    def __init__(self):
        self.seconds, self.kernels = 0.0, 0
        self._depth, self._began = 0, 0.0

    def start(self) -> None:
        """Called when the compilation of a kernel begins."""
        if self._depth == 0:
            self._began = time.process_time()
        self._depth += 1
        self.kernels += 1

    def end(self) -> None:
        """Called when the compilation of a kernel ends."""
        self._depth -= 1
        if self._depth == 0:
            self.seconds += time.process_time() - self._began

    def write(self, path: Path) -> None:
        """As JSON."""
        figures = {"compile_seconds": self.seconds, "kernels_compiled": self.kernels}
        path.write_text(json.dumps(figures), encoding="utf-8")


def watch(compilation: Compilation) -> None:
    """Make numba report its compilations to `compilation`; the kernel cache must be set before numba is imported."""
    one_thread()
    from numba.core import event

    class CompileEvents(event.Listener):
        def on_start(self, event):
            compilation.start()

        def on_end(self, event):
            compilation.end()

    event.register("numba:compile", CompileEvents())


if __name__ == "__main__":
    place, sys.argv = Path(sys.argv[1]), ["surgebreak", *sys.argv[2:]]
    compilation = Compilation()
    watch(compilation)
    try:
        main()
    finally:
        compilation.write(place)
