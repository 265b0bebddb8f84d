"""The arguments of `surgebreak sweep`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coupler.commands.shared_options import CasePlace, Laws, Overrides, take_laws
from coupler.program.start import one_thread


def sweep(
    case: CasePlace,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="KEY=...",
            help="A,B,... or FROM:TO:STEPS or 'lognormal(median=..., dispersion=...)'; may be repeated; added to the "
            "section [sweep] of the case",
        ),
    ] = None,
    set: Overrides = None,
    law: Laws = None,
    output: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="directory of the sweep; default: runs/sweep beside the case"),
    ] = None,
    plan: Annotated[bool, typer.Option("--plan", help="only show the table and a forecast of cost")] = False,
    jobs: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="number of simultaneous runs; default: the number of cores"),
    ] = None,
    threads: Annotated[int, typer.Option(min=1, metavar="N", help="number of threads of each run")] = 1,
    engine: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="local; slurm; dask-pbs, dask-slurm, dask-sge, dask-lsf, dask-oar, dask-htcondor, dask-local",
        ),
    ] = "local",
    option: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE",
            help="option of a cluster: time=30 (minutes), mem=2GB, partition=...; may be repeated",
        ),
    ] = None,
    chunk: Annotated[int, typer.Option(min=1, metavar="N", help="slurm: number of runs in each job")] = 1,
    detach: Annotated[
        bool,
        typer.Option(
            "--detach", help="slurm: submit the jobs and end; the same command waits for them later"
        ),
    ] = False,
    cancel: Annotated[
        str | None,
        typer.Option(
            metavar="all|ROW,ROW", help="slurm: cancel all jobs of this sweep, or those of some rows"
        ),
    ] = None,
    export: Annotated[
        str | None,
        typer.Option(metavar="snakemake", help="only write a Snakefile that makes the runs"),
    ] = None,
    any_version: Annotated[
        bool, typer.Option("--any-version", help="keep runs that another version of the program made")
    ] = False,
) -> None:
    """Make many runs of a case: grids, samples, fragility curves.

    The runs differ by values on a grid, samples of a distribution, or repeats. Completed runs are not repeated, and a
    killed run is continued. The results are a table, curves and a report.
    """
    one_thread()
    take_laws(law)
    from coupler.commands.sweep.command import SweepRequest
    from coupler.commands.sweep.command import sweep as make_sweep

    request = SweepRequest(
        vary=tuple(vary or ()), set=tuple(set or ()), output=output, plan=plan, jobs=jobs, threads=threads,
        engine=engine, options=tuple(option or ()), chunk=chunk, detach=detach,
        cancel=None if cancel is None else tuple(part.strip() for part in cancel.split(",")), export=export,
        any_version=any_version,
    )  # fmt: skip
    raise typer.Exit(int(make_sweep(case, request)))
