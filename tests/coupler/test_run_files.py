"""The files of a run as pictures read them."""

from pathlib import Path

import numpy as np
import pytest


@pytest.mark.before_yade
def test_a_time_that_the_run_has_not_is_refused():
    """It was drawn as the last state, in silence. A time between two states, or just behind the last one, is shown."""
    from coupler.commands.view.run_files import NothingToShow, RunFiles

    run = RunFiles(Path("runs/dam"), None, None, None, None, np.array([0.0, 0.5, 1.0]))
    for time in (None, 0.0, 0.3, 1.2):
        run.check(time)
    with pytest.raises(NothingToShow, match=r"--time 99: runs/dam has states from 0 s to 1 s"):
        run.check(99.0)
