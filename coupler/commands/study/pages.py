"""Writes docs/studies.md and its figures from several studies: `python -m coupler.commands.study.pages STUDY...`."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from coupler.commands.study.page import AGAINST, cheapest_cells, curve_of, page, table
from coupler.program.provenance import ROOT

OPENING = """\
# Error against run time

<!-- Made from studies by `python -m coupler.commands.study.pages STUDY...`; changes here are lost. -->

`surgebreak study CASE` runs the ladders of the case's section [`[study]`](case_file.md#study), in which the mesh,
the step, the law or the scheme is varied. A study that was stopped is continued when the command is given again.
`--larger` adds the larger rungs, and `surgebreak study compare A B` ends with exit code 3 if errors or CPU times
have become worse. The results are `study.json`, `study.csv`, `study.md` and one figure for each quantity. The
tables below were made with the default ladders, each run once, without the larger rungs.

All errors of a quantity are of one kind: relative to an exact solution, to a measurement, or to the finest run. The
column "CPU s" contains the user and system time of the steps and of writing results, on one thread; the set-up of
the scene (with loading YADE), the start of the program and the compilation have columns of their own. A run that
had to compile kernels is repeated. In the figures the dotted lines mark 1, 5 and 10 %, and crosses at the upper
edge are failed runs; errors below 0.0001 % are drawn at 0.0001 %. A run that belongs to several ladders is labelled
with its settings in all of them ("50 mm / 10 ms / 2").

A setting counts as the cheapest only if all finer runs of its ladder are at least as accurate as required, because
a coarse run may be accurate by chance. The order of convergence is the slope of the errors where there is an exact
solution. Otherwise it follows from the differences of the three finest runs, and none is given where these
differences do not decrease, or where it would be above 4, twice that of the schemes.

The cost of a part of the program is the difference between two runs, the case with this part and without it.
Differences within the scatter of CPU times (about 10 % on a busy machine, and 0.3 s for short runs) are not
significant. A negative cost beyond this scatter means that the scene does more work without the part: blocks
without joints have contacts instead. The wall time was measured while other programs were running.
"""

COLOURS = 96
"""Number of colours of a picture in the repository: lines, texts and their smooth edges."""


def summary(studies: list[dict]) -> str:
    """Table of the cheapest settings for an error of 5 %, over all studies."""
    rows: list[list[str]] = []
    for content in studies:
        what = {q["name"]: f"{q['what']}, {AGAINST[q['against']]}" for q in content["quantities"]}
        rows += [
            [content["title"] + curve_of(entry), what[entry["quantity"]], *cheapest_cells(content, entry)]
            for entry in content["cheapest"]
            if entry["level"] == 0.05
        ]
    head = ["case", "quantity", "setting", "error", "CPU s"]
    cases = [row[0] for row in rows]
    for row, before in zip(rows[1:], cases):
        row[0] = "" if row[0] == before else row[0]
    return "## Settings for an error of 5 %\n\n" + table(head, rows, words=True)


def _copy(figure: Path, place: Path) -> None:
    """Copies a figure with a reduced palette, which makes the file three times smaller."""
    from PIL import Image

    with Image.open(figure) as image:
        image.convert("RGB").quantize(COLOURS).save(place, optimize=True)


def main() -> None:
    """Writes docs/studies.md, and the figures into docs/pictures/studies."""
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
