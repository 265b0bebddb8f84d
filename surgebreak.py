"""How a structure breaks when water hits it: the Python side of surgebreak.

    import surgebreak

    case = surgebreak.load("cases/dam_break_building")
    case.set("joints.strength", "0.3 MPa").set("time.end", "1 s")
    run = case.run("weaker", callback=lambda step: print(step.time, step.joints_broken))

    run = surgebreak.open("weaker")
    force = run.history("gauges")            # numpy; run.frame("gauges") is a pandas table
    water, blocks = run.water(0.5), run.blocks(0.5)

The names in `__all__`, and the public names of what they return, are what scripts may rely on; the packages below
(`coupler`, `fluid`, `yade_scripts`) may change with any version. Import this before numpy: the last digits are the same
on every processor only if numpy is loaded as it is set here.
"""

from typing import TYPE_CHECKING

from coupler.program.start import one_thread as _one_thread

_one_thread()

from coupler.api.case import Case  # noqa: E402
from coupler.api.execution import RunInRun  # noqa: E402
from coupler.api.laws import register_law  # noqa: E402
from coupler.api.run import BlockState, Run, WaterState  # noqa: E402
from coupler.api.step import Blocks, Step  # noqa: E402
from coupler.program.errors import BadCase, SurgebreakError  # noqa: E402
from coupler.program.provenance import version as _version  # noqa: E402
from coupler.results.history import History  # noqa: E402
from coupler.run.forecast import Forecast  # noqa: E402
from coupler.step.limits import Diverged, LimitReached  # noqa: E402

if TYPE_CHECKING:
    from coupler.commands.sweep import tables as sweep
    from yade_scripts.joints.law import CohesiveLaw

__all__ = [
    "BadCase",
    "BlockState",
    "Blocks",
    "Case",
    "CohesiveLaw",
    "Diverged",
    "Forecast",
    "History",
    "LimitReached",
    "Run",
    "RunInRun",
    "Step",
    "SurgebreakError",
    "WaterState",
    "load",
    "open",
    "register_law",
    "sweep",
]
__version__ = _version()

load = Case.load
open = Run


def __getattr__(name: str) -> object:
    """`CohesiveLaw` is of the room of the structure, which a script with water alone does not load; `sweep` reads the
    tables of sweeps."""
    if name == "CohesiveLaw":
        from yade_scripts.joints.law import CohesiveLaw

        return CohesiveLaw
    if name == "sweep":
        from coupler.commands.sweep import tables

        return tables
    raise AttributeError(f"module 'surgebreak' has no attribute {name!r}")
