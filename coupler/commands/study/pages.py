"""docs/studies.md with its figures out of several studies: `python -m coupler.commands.study.pages STUDY...`."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from coupler.commands.study.page import AGAINST, cheapest_cells, curve_of, page, table
from coupler.program.provenance import ROOT

OPENING = """\
# Error against run time

<!-- Made from studies by `python -m coupler.commands.study.pages STUDY...`; changes here are lost. -->

`surgebreak study CASE` runs the ladders of the case's [`[study]`](case_file.md#study): mesh, step, law, scheme. A
study that was stopped goes on when the command is given again; `--larger` adds the larger rungs; `surgebreak study
compare A B` leaves with 3 if errors or CPU times got worse. Results: `study.json`, `study.csv`, `study.md`, and a
figure a quantity. The tables below are those of the default ladders, each run once; the larger rungs are left out.

Every quantity has errors of one kind: against an exact answer, a measurement, or the finest run. CPU s are user and
system time of the steps and of writing results, one thread; set-up of the scene (and loading YADE), start of the
program and compilation stand apart. A run that had to compile is made again. In the figures dotted lines are 1, 5 and
10 %, crosses on the upper edge are failed runs; errors below 0.0001 % are drawn there. A run that belongs to several
ladders carries its settings in all of them ("50 mm / 10 ms / 2").

The cheapest setting counts only if every finer run of its ladder is as near, since a coarse run may hit the answer by
chance. The order of convergence is the slope of the errors where there is an exact answer; else it comes from the
differences of the three finest runs, and there is none where these do not shrink.

What a part of the program costs is the difference of two runs, the case with and without it; what is within the
scatter of CPU times, some 10 % on a busy machine and 0.3 s of short runs, is noise. Less than nothing beyond that
means that the scene does more without the part: blocks that no joints hold have contacts instead. Wall seconds are
those of a machine that did other work too.
"""

COLOURS = 96
"""Of a picture in the repository: lines, texts and their smooth edges."""


def summary(studies: list[dict]) -> str:
    """The settings for 5 % of all studies."""
    rows: list[list[str]] = []
    for content in studies:
        what = {q["name"]: f"{q['what']}, {AGAINST[q['against']]}" for q in content["quantities"]}
        rows += [
            [content["title"] + curve_of(entry), what[entry["quantity"]], *cheapest_cells(content, entry)]
            for entry in content["cheapest"]
            if entry["level"] == 0.05
        ]
    head = ["case", "quantity", "setting", "its error", "CPU s"]
    cases = [row[0] for row in rows]
    for row, before in zip(rows[1:], cases):
        row[0] = "" if row[0] == before else row[0]
    return "## Settings for an error of 5 %\n\n" + table(head, rows, words=True)


def _copy(figure: Path, place: Path) -> None:
    """A figure with as many colours as it needs: a third of the file."""
    from PIL import Image

    with Image.open(figure) as image:
        image.convert("RGB").quantize(COLOURS).save(place, optimize=True)


def main() -> None:
    """docs/studies.md, and the figures into docs/pictures/studies."""
    folders = [Path(word) for word in sys.argv[1:]]
    pictures = ROOT / "docs" / "pictures" / "studies"
    pictures.mkdir(parents=True, exist_ok=True)
    studies, pages = [], []
    for folder in folders:
        content = json.loads((folder / "study.json").read_text(encoding="utf-8"))
        case = Path(content["case"]).parent.name
        content["command"] = [
            "surgebreak",
            "study",
            f"cases/{case}",
        ]  # as from the checkout, wherever it was made
        for figure in sorted(folder.glob("*.png")):
            _copy(figure, pictures / f"{case}_{figure.name}")
        studies.append(content)
        pages.append(page(content, level=2, pictures=f"pictures/studies/{case}_"))
    (ROOT / "docs" / "studies.md").write_text(
        "\n".join([OPENING, summary(studies), "", *pages]), encoding="utf-8"
    )


if __name__ == "__main__":
    main()
