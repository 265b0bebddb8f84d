"""python -m coupler.commands.watch PLACE: serves the page beside a run until it is ended; prints its address first."""

import signal
import sys
from pathlib import Path

from coupler.commands.watch.command import watch

signal.signal(signal.SIGTERM, signal.default_int_handler)
watch([Path(sys.argv[1])], port=0, browser=False, pictures=True)
