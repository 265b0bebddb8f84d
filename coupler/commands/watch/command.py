"""`surgebreak watch`: serve the page until Ctrl-C, or beside a run."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import threading
import time as clock
import webbrowser
from collections.abc import Iterator
from pathlib import Path

from coupler.commands.watch.pictures import Pictures
from coupler.commands.watch.server import Site, address_of, server_of
from coupler.commands.watch.state import runs_in
from coupler.program.errors import CannotWrite, NoRun
from coupler.program.extras import missing
from coupler.program.process import environment

LAST_LOOK = 3.0
"""[s] after the end of a run in which its page hears of it."""


def watch(places: list[Path], port: int, browser: bool, pictures: bool) -> None:
    """Serve the page of runs and sweeps until Ctrl-C.  Raises NoRun, CannotWrite."""
    absent = [place for place in places if not place.is_dir()]
    if absent:
        raise NoRun(f"{absent[0]}: no such directory; give a run, a sweep, or a folder with runs")
    if not runs_in(places):
        print("no run there yet; the page shows those that begin")
    with serving(places, port, pictures) as address:
        print(f"watch: {address} (Ctrl-C ends the page, not the runs)", flush=True)
        if browser:
            webbrowser.open(address)
        with contextlib.suppress(KeyboardInterrupt):
            threading.Event().wait()


@contextlib.contextmanager
def beside(run: Path) -> Iterator[None]:
    """Serve the page of a run from a process of its own, so that watching does not slow the run down. The address is
    printed, and the page is kept until it has received how the run ended."""
    process = subprocess.Popen(
        [sys.executable, "-m", "coupler.commands.watch", str(run)],
        env=environment(), stdout=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    try:
        for line in process.stdout:
            if line.startswith("watch: "):
                print(line.split(" (")[0], flush=True)
                break
        yield
    finally:
        clock.sleep(LAST_LOOK)
        process.terminate()
        process.wait()


@contextlib.contextmanager
def serving(places: list[Path], port: int = 0, pictures: bool = True) -> Iterator[str]:
    """The page, served by a thread while the context lasts; its address."""
    drawn = Pictures() if pictures and not missing("view") else None
    site = Site(places, drawn)
    try:
        server = server_of(site, port)
    except OSError as error:
        raise CannotWrite(
            f"--port {port}: {error.strerror}; leave it out for any port that is free"
        ) from error
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield address_of(server, site)
    finally:
        server.shutdown()
        server.server_close()
        if drawn is not None:
            drawn.close()
