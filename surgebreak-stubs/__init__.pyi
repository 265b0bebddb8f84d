"""Types of `import surgebreak` for type checkers and editors, which find none in a single module that is installed
(PEP 561). A test holds the names of this file and those of `surgebreak.py` together."""

from coupler.api.case import Case
from coupler.api.execution import RunInRun
from coupler.api.laws import register_law
from coupler.api.run import BlockState, Run, WaterState
from coupler.api.step import Blocks, Step
from coupler.commands.sweep import tables as sweep
from coupler.program.errors import BadCase, SurgebreakError
from coupler.results.history import History
from coupler.run.forecast import Forecast
from coupler.step.limits import Diverged, LimitReached
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
__version__: str

load = Case.load
open = Run
