"""Reference figures as columns; each file names its source in its header."""

from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parents[1] / "reference"


def columns(name: str) -> dict[str, np.ndarray]:
    """Columns of tests/reference/<name>.csv by their heading."""
    lines = [line for line in (FOLDER / f"{name}.csv").read_text().splitlines() if not line.startswith("#")]
    table = np.array([[float(c) for c in line.split(",")] for line in lines[1:]])
    return dict(zip(lines[0].split(","), table.T))
