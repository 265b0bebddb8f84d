"""The command `surgebreak diff`: reads the runs, prints the table, writes page and figures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from string import ascii_uppercase

from coupler.commands import pictures
from coupler.commands.diff.case import changes
from coupler.commands.diff.curves import chosen
from coupler.commands.diff.figures import Run, rows
from coupler.commands.diff.page import CURVES, content, page
from coupler.commands.diff.table import text
from coupler.program.errors import BadCall
from coupler.run.directory import as_json, write_json
from coupler.run.summary import read_summary


def diff(paths: Sequence[Path], to: Path | None, names: Sequence[str], only_json: bool) -> None:
    """Print how runs differ; with `to`, also write diff.html, diff.json and the figures there. Raises NoRun, BadCall,
    UnknownName."""
    runs = _read(paths)
    changed = changes([run.summary["case"] for run in runs], [run.files for run in runs])
    found, curves = rows(runs), chosen(runs, names)
    data = content(runs, changed, found, curves)
    print(as_json(data) if only_json else text(runs, changed, found))
    if to is None:
        return
    to.mkdir(parents=True, exist_ok=True)
    for old in to.glob(f"{CURVES}*.*"):
        old.unlink()
    write_json(to / "diff.json", data)
    remark = pictures.missing() or pictures.run_figures(to)
    remark = f"no figures: {remark}" if remark else ""
    (to / "diff.html").write_text(page(runs, changed, found, to, remark), encoding="utf-8")
    if not only_json:
        print("\n".join([*([remark] if remark else []), f"page: {to / 'diff.html'}"]))


def _read(paths: Sequence[Path]) -> list[Run]:
    if not 2 <= len(paths) <= len(ascii_uppercase):
        raise BadCall([f"surgebreak diff: name two runs or more, {len(ascii_uppercase)} at most"])
    return [Run(path, label, read_summary(path)) for path, label in zip(paths, ascii_uppercase)]
