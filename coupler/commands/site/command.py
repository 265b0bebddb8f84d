"""`surgebreak docs`: builds the site and opens it."""

from __future__ import annotations

import shutil
import tempfile
import webbrowser
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from coupler.program.errors import ExitCode, SurgebreakError
from coupler.program.extras import need
from coupler.program.process import environment, run_module
from coupler.program.provenance import ROOT


class NoPages(SurgebreakError):
    """There are no pages to build a site from, or building it failed."""


def docs(folder: Path | None) -> ExitCode:
    """Build the site into a folder, which is replaced; None: into a temporary one, which is served
    to this machine and opened in a browser until Ctrl-C.

    Raises NoPages for an installation without a checkout, and where mkdocs fails or warns.
    """
    need("docs")
    settings = ROOT / "mkdocs.yml"
    if not settings.exists():
        raise NoPages(
            f"{ROOT}: no checkout, so there are no pages to build; they are in the source, under docs/"
        )
    if folder is not None and folder.exists() and not _is_site(folder):
        raise NoPages(f"{folder}: exists and is no site of before; name a new folder")
    place = Path(tempfile.mkdtemp(prefix="surgebreak-docs-")) if folder is None else folder.resolve()
    quiet = environment() | {"NO_MKDOCS_2_WARNING": "1"}
    words = ("build", "--strict", "-f", settings, "-d", place)
    done = run_module("mkdocs", *words, cwd=ROOT, env=quiet, capture_output=True, text=True)
    if done.returncode:
        wrong = [line for line in done.stderr.splitlines() if not line.startswith("INFO")]
        raise NoPages("\n".join(["the site has mistakes:", *wrong]))
    if folder is None:
        _show(place)
    else:
        print(f"site: {place / 'index.html'}")
    return ExitCode.DONE


def _show(place: Path) -> None:
    """Serve a folder to this machine alone until Ctrl-C, and open it in a browser."""
    handler = partial(_Quiet, directory=str(place))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        address = f"http://127.0.0.1:{server.server_address[1]}/"
        print(f"the site is at {address} until Ctrl-C", flush=True)
        if not webbrowser.open(address):
            print("no browser was found; open that address in one", flush=True)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            print()
        finally:
            shutil.rmtree(place, ignore_errors=True)


class _Quiet(SimpleHTTPRequestHandler):
    """A request handler that does not print requests."""

    def log_message(self, *_: object) -> None:
        return None


def _is_site(folder: Path) -> bool:
    """Whether the target may be replaced: it does not exist, or it is a site."""
    return folder.is_dir() and (not any(folder.iterdir()) or (folder / "sitemap.xml").exists())
