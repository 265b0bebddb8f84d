"""`surgebreak report RUN|STUDY`: writes a self-contained report.html into the directory."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from shlex import quote

from coupler.case.paths import BadPath, read_text
from coupler.commands import pictures
from coupler.commands.report.html import document
from coupler.commands.report.markdown import to_html
from coupler.commands.report.run_page import run_page
from coupler.program.errors import NoRun
from coupler.results import vtkhdf
from coupler.run.summary import read_summary

NAME = "report.html"
STILLS = 4
"""Pictures of a run, two beside each other: its first stored step, its last, and those between."""


def report(place: Path, with_pictures: bool = True) -> Path:
    """Write the page of a run or a study and return its path.  Raises NoRun."""
    if (place / "study.json").is_file():
        page = study_report(place)
    elif (place / "run.json").is_file():
        page = run_report(place, with_pictures)
    else:
        raise NoRun(f"{place}: {_what_it_is(place)}")
    path = place / NAME
    part = place / f".{NAME}.part"
    part.write_text(page, encoding="utf-8")
    part.replace(path)
    return path


def _what_it_is(place: Path) -> str:
    """A message for a path that is neither a run nor a study: what to name instead."""
    if place.name in ("run.json", "study.json", NAME) and place.is_file():
        return f"a file of a run or a study; name its directory, {place.parent}"
    if (place / "run.json").exists():
        return "neither a run nor a study: run.json is not a file"
    if place.suffix == ".toml" or (place / "case.toml").is_file():
        return f"a case; `surgebreak run {quote(str(place))}` makes a run of it, whose directory a report is made of"
    return "neither a run (run.json) nor a study (study.json)"


def run_report(run: Path, with_pictures: bool) -> str:
    """The page of a run; the page names what could not be drawn."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        remarks = _draw(run, folder) if with_pictures else ["Made without pictures (--no-pictures)."]
        return run_page(run, read_summary(run), folder, remarks)


def _draw(run: Path, folder: Path) -> list[str]:
    reason = pictures.missing()
    if reason:
        return [f"No pictures and figures: {reason}."]
    times = stored_times(run)
    failed = {
        "No stills": pictures.stills(run, folder, times) if times else "the run has stored no fields",
        "Figures are missing": pictures.plots(run, folder) if times else "",
    }
    if (run / "maps" / "bed.asc").exists():
        title = read_summary(run)["case"]["case"]["title"]
        failed["No maps of the flood"] = pictures.flood_map(run, folder, title)
    return [f"{what}: {why}" for what, why in failed.items() if why]


def stored_times(run: Path) -> list[float]:
    """Times [s] of the stills: STILLS of the stored steps, spread evenly; fewer where fewer are stored."""
    for name in ("fields.vtkhdf", "blocks.vtkhdf"):
        if (run / name).exists():
            try:
                times = vtkhdf.read_times(run / name)
            except vtkhdf.UNREADABLE as error:
                raise NoRun(f"{run / name}: not what a run writes: {error}") from error
            if len(times):
                last = len(times) - 1
                return [
                    float(times[k]) for k in sorted({round(i * last / (STILLS - 1)) for i in range(STILLS)})
                ]
    return []


def study_report(study: Path) -> str:
    """The page of a study: the content of its study.md with the figures embedded."""
    from coupler.commands.study.page import page

    try:
        content = json.loads(read_text(study / "study.json"))
        title, text = content["title"], page(content)
    except BadPath as error:
        raise NoRun(f"{study / 'study.json'}: {error}") from error
    except (LookupError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise NoRun(f"{study / 'study.json'}: not what a study writes: {error!r}") from error
    if not any(study.glob("*.png")) and not pictures.missing():
        pictures.study_figures(study)
    return document(title, [to_html(text, study)])
