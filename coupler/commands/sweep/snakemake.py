"""A sweep as a workflow of Snakemake, for sites that run these: a Snakefile beside sweep.json.

A rule makes one run; a run that failed with a reason has ended and does not stop the others, one that was killed or
stopped has no result and is made again. The table is made when all have ended: `surgebreak sweep CASE` does it.
"""

from __future__ import annotations

import sys
from pathlib import Path
from shlex import quote

from coupler.commands.sweep.folder import Spec
from coupler.program.provenance import ROOT

TEXT = """\
# Runs of a sweep of surgebreak, one a job. Written by `surgebreak sweep CASE --export snakemake`.
#   snakemake --cores 4                              here
#   snakemake --executor slurm --jobs 100            on a cluster (plug-in of that name)
# After a kill: `snakemake --unlock`, then the same again; runs go on from their checkpoints.
# Then `surgebreak sweep CASE --output` with this directory makes table, curves and report.
import json

configfile: "snakemake.json"


with open("sweep.json", encoding="utf-8") as file:
    RUNS = list(json.load(file)["runs"])


localrules:
    all,


rule all:
    input:
        expand("runs/{{run}}.json", run=RUNS),


rule run:
    input:
        ancient("sweep.json"),  # written by every call of `surgebreak sweep`: no reason to make a run again
    output:
        "runs/{{run}}.json",
    log:
        "runs/{{run}}.snakemake.log",
    threads: {threads}
    resources:
        mem_mb=config["mem_mb"],
        runtime=config["minutes"],
    shell:
        "{{config[python]}} -m coupler.commands.sweep.one . {{wildcards.run}} > {{log}} 2>&1"
"""


def export(spec: Spec) -> Path:
    """Write Snakefile and snakemake.json into the directory of the sweep; the path of the first."""
    from coupler.run.directory import write_json

    path = spec.folder / "Snakefile"
    path.write_text(TEXT.format(threads=spec.threads), encoding="utf-8")
    python = f"env PYTHONSAFEPATH=1 PYTHONPATH={quote(str(ROOT))} {quote(sys.executable)}"
    write_json(spec.folder / "snakemake.json", {"python": python, "mem_mb": 2000, "minutes": 60})
    return path
