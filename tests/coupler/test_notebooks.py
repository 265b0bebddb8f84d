"""The notebooks run from top to bottom as a reader runs them, and say what their text promises."""

import json
import subprocess
import sys

import pytest

from coupler.program.provenance import ROOT

NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))

RUN = """
import json, sys
from IPython.core.interactiveshell import InteractiveShell
shell = InteractiveShell.instance()
for cell in json.load(open(sys.argv[1], encoding="utf-8"))["cells"]:
    if cell["cell_type"] == "code":
        shell.run_cell("".join(cell["source"])).raise_error()
"""
PROMISED = {
    "first_case": [
        "'25 kg' is a mass, needs a length [m]",
        "the box went",
        "largest force along x",
        "corners of the box",
    ],
    "own_law": ["work is no integral of s r", "joints broken: 1", "dissipated 700."],
}


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_shows_what_it_says(notebook, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", RUN, notebook],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert [words for words in PROMISED[notebook.stem] if words not in done.stdout] == []


def test_notebooks_hold_no_output_and_are_linked():
    """Outputs of somebody's machine would be read as those of the present program."""
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    assert {path.stem for path in NOTEBOOKS} == set(PROMISED)
    for path in NOTEBOOKS:
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        assert not any(cell.get("outputs") or cell.get("execution_count") for cell in cells)
        assert f"notebooks/{path.name}" in page
