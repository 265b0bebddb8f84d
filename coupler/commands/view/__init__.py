"""Pictures and films, from the files of a run alone (own process: VTK and YADE cannot share one)."""

import os

os.environ.setdefault("MPLBACKEND", "agg")  # figures are drawn into files; read when matplotlib is imported
