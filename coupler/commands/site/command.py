"""`surgebreak docs`: builds the site and opens it."""

from __future__ import annotations

import sys
import tempfile
import webbrowser
from pathlib import Path

from coupler.program.errors import ExitCode, SurgebreakError
from coupler.program.extras import need
from coupler.program.process import environment, run_module
from coupler.program.provenance import ROOT


class NoPages(SurgebreakError):
    """There is nothing to build a site from, or building it failed."""


def docs(folder: Path | None) -> ExitCode:
    """Build the site into a folder, which is replaced; None: into a temporary one, which is opened in a browser.

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
    first = place / "index.html"
    print(f"site: {first}")
    if folder is None and not webbrowser.open(first.as_uri()):
        print("no browser was found; open that file in one", file=sys.stderr)
    return ExitCode.DONE


def _is_site(folder: Path) -> bool:
    """Whether what is there may be replaced: nothing, or a site."""
    return folder.is_dir() and (not any(folder.iterdir()) or (folder / "sitemap.xml").exists())
