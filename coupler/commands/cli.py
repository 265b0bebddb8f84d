"""The command `surgebreak`. Commands import what they need when they are called: help must stay quick."""

from __future__ import annotations

import os
from pathlib import Path
from shlex import quote
from typing import Annotated

import typer
from typer.core import TyperGroup

from coupler.program.extras import need
from coupler.program.failures import Failures
from coupler.program.process import run_module
from coupler.program.start import one_thread
from coupler.program.threads import take_threads


class Commands(TyperGroup):
    """All commands; Ctrl-C ends each with a word and the code of a stop, where typer would say nothing."""

    def invoke(self, ctx):
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            with Failures():
                raise


app = typer.Typer(
    cls=Commands,
    name="surgebreak",
    help="How a structure breaks when water hits it, and how its debris then changes the flow.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
PASS_ON = {"allow_extra_args": True, "ignore_unknown_options": True}

CasePlace = Annotated[Path, typer.Argument(metavar="CASE", help="a case directory or a case.toml")]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="change a value of the case, for instance time.end='2 s'"
    ),
]
Threads = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        help="threads that share the work, with the same results to the last digit; else SURGEBREAK_THREADS, else all "
        "cores of the process",
        show_default=False,
    ),
]
Laws = Annotated[
    list[Path] | None,
    typer.Option(
        "--law",
        metavar="FILE",
        help="a Python file with a cohesive law of your own, which is run; repeatable",
    ),
]


def main() -> None:
    """Entry point; leaves with 0 done, 1 failure, 2 bad case, 3 diverged or out of balance, 4 stopped."""
    with Failures():
        app()


@app.callback(invoke_without_command=True)
def _root(
    version: Annotated[bool, typer.Option("--version", help="print the version and leave")] = False,
) -> None:
    if version:
        from coupler.program.provenance import version as number

        print(f"surgebreak {number()}")
        raise typer.Exit


@app.command()
def run(
    case: CasePlace,
    set: Overrides = None,
    law: Laws = None,
    output: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="a new directory for the results; else runs/<time>-<hash> beside the case"
        ),
    ] = None,
    end: Annotated[str | None, typer.Option(metavar="TIME", help="short for --set time.end=...")] = None,
    dry: Annotated[bool, typer.Option("--dry", help="only read the case; nothing is run")] = False,
    threads: Threads = None,
    watch: Annotated[
        bool, typer.Option("--watch", help="with a page in the browser of this machine")
    ] = False,
) -> None:
    """Run a case. Ctrl-C or a file named `stop` in the run directory ends it cleanly."""
    one_thread()
    take_threads(threads)
    take_laws(law)
    from coupler.api.case import Case

    file = Case.load(case, [*(set or []), *([f"time.end={end}"] if end else [])]).file()
    if dry:
        return
    from coupler.run.directory import RunDirectory
    from coupler.run.execute import carry_out

    directory = RunDirectory.create(file, output)
    if not watch:
        raise typer.Exit(int(carry_out(file, directory)))
    from coupler.commands.watch.command import beside

    with beside(directory.path):
        code = carry_out(file, directory)
    raise typer.Exit(int(code))


@app.command(name="watch")
def watch_runs(
    places: Annotated[
        list[Path], typer.Argument(metavar="RUN...", help="runs, sweeps, or folders with runs")
    ],
    port: Annotated[int, typer.Option(min=0, max=65535, help="of the page; 0: any that is free")] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="open it")] = False,
    pictures: Annotated[bool, typer.Option("--pictures/--no-pictures", help="draw now and then")] = True,
) -> None:
    """Show runs in the browser while they go on.

    Progress, time left, histories, newest picture, verdict so far, limits, and a button that stops a run. Of this
    machine alone, behind a secret address.
    """
    from coupler.commands.watch.command import watch as serve

    serve(places, port, browser, pictures)


@app.command()
def resume(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="the directory of a run that stopped")],
    end: Annotated[
        str | None, typer.Option(metavar="TIME", help="another end; short for --set time.end=...")
    ] = None,
    set: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY=VALUE", help="change time.end, time.cfl, time.step_max, limits.* ..."
        ),
    ] = None,
    law: Laws = None,
    any_version: Annotated[
        bool, typer.Option("--any-version", help="go on although the program has changed since")
    ] = False,
    threads: Threads = None,
) -> None:
    """Go on with a run that was stopped or killed.

    From its newest checkpoint, to the last digit as if it had never stopped.
    """
    one_thread()
    take_threads(threads)
    take_laws(law)
    from coupler.run.execute import carry_out
    from coupler.run.resume import prepare

    found = prepare(run, [*(set or []), *([f"time.end={end}"] if end else [])], any_version)
    raise typer.Exit(int(carry_out(found.file, found.directory, found.checkpoint)))


@app.command()
def check(
    case: CasePlace,
    set: Overrides = None,
    law: Laws = None,
    exact: Annotated[
        bool, typer.Option("--exact", help="solve for the exact frequency of the joints as well")
    ] = False,
    picture: Annotated[
        Path | None, typer.Option(metavar="PNG", help="draw blocks, solids and water as they start")
    ] = None,
) -> None:
    """Check a case, and forecast steps, time, memory and disk.

    Nothing is run; with a structure YADE is asked for the substep.
    """
    one_thread()
    take_laws(law)
    from coupler.api.case import Case
    from coupler.program import terminal
    from coupler.run.execute import describe

    if picture is not None:
        need("view")
    found = Case.load(case, set or [])
    describe(found.file(), print)
    if picture is not None:
        from coupler.commands.blocks import draw_case

        draw_case(found.file().case, picture)
        print(f"picture: {picture}")
    terminal.table("forecast", found.check(exact).rows)


@app.command(context_settings=PASS_ON | {"help_option_names": []})
def render(context: typer.Context) -> None:
    """Make stills, a film and plots of a run."""
    raise typer.Exit(run_module("coupler.commands.view", *context.args).returncode)


@app.command()
def report(
    place: Annotated[
        Path, typer.Argument(metavar="RUN|STUDY|SWEEP", help="the directory of a run, a study or a sweep")
    ],
    pictures: Annotated[
        bool, typer.Option("--pictures/--no-pictures", help="with stills and figures of a run")
    ] = True,
) -> None:
    """Write one HTML page about a run, a study or a sweep.

    report.html in the directory: pictures, figures and tables in one file, for screen and paper.
    """
    if (place / "sweep.json").is_file():
        from coupler.commands.sweep.command import finish
        from coupler.commands.sweep.folder import read_spec

        finish(read_spec(place), stopped=False)
        return
    from coupler.commands.report.command import report as write

    print(f"report: {write(place, pictures)}")


@app.command()
def export(
    run: Annotated[
        Path, typer.Argument(metavar="RUN", help="a run directory, finished or still being written")
    ],
    format_: Annotated[
        str,
        typer.Option("--format", metavar="A,B,...", help="vtk (ParaView), netcdf (xarray), gltf (Blender)"),
    ] = "vtk,netcdf",
    to: Annotated[Path | None, typer.Option(metavar="DIR", help="where to write; else RUN/export")] = None,
    begin: Annotated[float, typer.Option("--from", metavar="S", help="first time [s]")] = 0.0,
    end: Annotated[float, typer.Option("--until", metavar="S", help="last time [s]")] = float("inf"),
) -> None:
    """Write results for other programs.

    .pvd for ParaView by a double click, NetCDF for xarray, .glb for Blender. While a run goes on it adds what is new.
    """
    from coupler.commands.export.command import export as write

    write(run, [name.strip() for name in format_.split(",") if name.strip()], to, begin, end)


@app.command()
def doctor(
    mend: Annotated[
        bool,
        typer.Option(
            "--mend",
            help="put right what can be: torn kernels, locked folders of the cache, missing packages",
        ),
    ] = False,
) -> None:
    """Check that YADE and the rest work here."""
    one_thread()
    from coupler.commands.doctor import examine

    raise typer.Exit(int(examine(mend)))


@app.command()
def explain(
    key: Annotated[
        str | None,
        typer.Argument(
            metavar="KEY|RUN",
            help="a name of the case file, for instance joints.strength, or a run directory",
        ),
    ] = None,
) -> None:
    """Explain a name of the case file, or what a run left out.

    Without a name: all sections. Of a run: what it skipped, and what that would have cost.
    """
    if key and (os.sep in key or (Path(key) / "run.json").is_file()):
        from coupler.commands.explain_run import explanation_of_run

        print(explanation_of_run(Path(key)))
        return
    from coupler.case.docs import explanation

    print(explanation(key))


@app.command()
def blocks(
    drawing: Annotated[
        Path, typer.Argument(metavar="FILE", help="STL, OBJ, PLY, ...; STEP, IFC with extras")
    ],
    size: Annotated[
        str, typer.Option(metavar="M", help="wanted edge of the blocks along walls and slabs")
    ] = "1 m",
    course: Annotated[
        str | None, typer.Option(metavar="M", help="wanted height in walls; else the size")
    ] = None,
    bond: Annotated[str, typer.Option(help="stack or running")] = "stack",
    scale: Annotated[str, typer.Option(help="length of one unit of the file, for instance '1 mm'")] = "1 m",
    up: Annotated[str, typer.Option(help="axis of the file that points up: z or y")] = "z",
    sliver: Annotated[str | None, typer.Option(metavar="M", help="narrower parts are merged")] = None,
    density: Annotated[str | None, typer.Option(help="mass per volume, for instance '1800 kg/m3'")] = None,
    strength: Annotated[str, typer.Option(help="of the joints, for the forecast")] = "0.5 MPa",
    opening: Annotated[str, typer.Option(help="opening at failure, for the forecast")] = "1 mm",
    picture: Annotated[
        Path | None, typer.Option(metavar="PNG", help="else FILE_blocks.png beside it")
    ] = None,
    to: Annotated[
        Path | None, typer.Option(metavar="OBJ", help="write the blocks as closed surfaces")
    ] = None,
) -> None:
    """Cut a drawing of a building into blocks.

    Tells how many, what sets the substep and what a second costs, draws them, and says what to write in a case.
    """
    one_thread()
    from coupler.commands.blocks import as_number
    from coupler.commands.blocks import blocks as cut

    given = {"size": size, "course": course, "bond": bond, "scale": scale, "up": up, "sliver": sliver}
    given["density"] = density
    options = {k: as_number(v) for k, v in given.items() if v is not None and (k, v) not in DRAWN_AS_USUAL}
    joints = {"strength": strength, "opening_at_failure": opening}
    cut(drawing, options, joints, picture, to)


DRAWN_AS_USUAL = (("bond", "stack"), ("scale", "1 m"), ("up", "z"))
"""Options that a case need not say."""


@app.command()
def terrain(
    place: Annotated[
        Path,
        typer.Argument(
            metavar="FILE|CASE|RUN", help="a terrain file, a case with a section [terrain], or a run of one"
        ),
    ],
    set: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="of [terrain], for instance terrain.scale='1 ft'"),
    ] = None,
    map_: Annotated[
        Path | None, typer.Option("--map", metavar="PNG", help="draw a map; needs the extra `view`")
    ] = None,
) -> None:
    """Show a terrain: extent, heights, slopes, and what cells of a size make of it.

    Of a run: the maps of its flood, with --map in one picture with the buildings by their state.
    """
    one_thread()
    if map_ is not None:
        need("view")
    from coupler.commands.terrain import show

    show(place, set or [], map_)


@app.command()
def offshore(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="an offshore.toml, or the directory that holds one")
    ],
) -> None:
    """Run the sea before a coast by ANUGA and write a record for a side of a case.

    One way: a wide and coarse sea from a source or a record, what passes the side of the tank as a CSV file. Needs the
    extra `offshore`; docs/terrain.md says what the file may say.
    """
    one_thread()
    from coupler.commands.offshore.command import offshore as make

    print(f"record: {make(file)}")


@app.command()
def schema(
    to: Annotated[
        Path | None, typer.Option("--to", metavar="FILE", help="write it there; else to standard output")
    ] = None,
) -> None:
    """Print the JSON Schema of case.toml, for editors.

    They complete and check names with it; docs/editor.md says how to tell yours.
    """
    from coupler.case.editor_schema import write

    write(to)


@app.command()
def kernels(
    pack: Annotated[
        Path | None, typer.Option("--pack", metavar="FILE", help="write those of this version into one file")
    ] = None,
    unpack: Annotated[
        Path | None,
        typer.Option(
            "--unpack",
            metavar="FILE",
            help="take those of a file into the cache; only from sources you trust",
        ),
    ] = None,
) -> None:
    """Show, pack or unpack the compiled kernels, so that other machines need not compile them.

    Without an option: where they are, and how many modules of this version have some.
    """
    one_thread()
    from coupler.program import kernel_pack

    with Failures():
        if pack:
            print(f"{kernel_pack.pack(pack)} modules packed into {pack} ({pack.stat().st_size / 1e6:.0f} MB)")
        if unpack:
            print(f"{kernel_pack.unpack(unpack)} files are new in {os.environ['NUMBA_CACHE_DIR']}")
        if not pack and not unpack:
            print(
                f"{len(kernel_pack.compiled())} modules with kernels of this version in {os.environ['NUMBA_CACHE_DIR']}"
            )


@app.command()
def docs(
    build: Annotated[
        Path | None,
        typer.Option("--build", metavar="DIR", help="only build the site into this folder, open nothing"),
    ] = None,
) -> None:
    """Build the site of the documentation and open it."""
    from coupler.commands.site.command import docs as make_site

    raise typer.Exit(int(make_site(build)))


@app.command()
def init(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="the new case directory")],
    template: Annotated[
        str, typer.Option(metavar="NAME", help="tank, wall, house, quay, column, terrain, town or dry")
    ] = "tank",
    ask: Annotated[
        bool, typer.Option("--ask", help="ask for what the case is about, at most six questions")
    ] = False,
) -> None:
    """Write a small commented case that runs."""
    from coupler.case.first_cases import write_first_case

    def answer(question: str, usual: str) -> str:
        return typer.prompt(question, default=usual)

    path, word = write_first_case(directory, template, answer if ask else None), quote(str(directory))
    print(f"wrote {path}; next: surgebreak check {word}, surgebreak run {word}")


@app.command()
def verify(
    ids: Annotated[list[str] | None, typer.Argument(metavar="ID", help="cases (P01 ...); else all")] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="only the cheap cases, three minutes of processor time in all")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="one JSON object a quantity, one a line")] = False,
    list_: Annotated[bool, typer.Option("--list", help="list the cases, and those not covered")] = False,
    plots: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="a folder for figures: computed curves over measured ones"),
    ] = None,
) -> None:
    """Compare with exact solutions and measured records.

    Leaves with 3 if one misses its tolerance.
    """
    one_thread()
    if plots is not None:
        need("view")
    from coupler.commands.verify.report import verify as run_cases

    raise typer.Exit(int(run_cases(ids or [], quick=quick, as_json=json, only_list=list_, plots=plots)))


@app.command()
def stress(
    scenes: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="ID", help="scenes (S01 ..., R1-12 ...) or groups: structure, water, coupling; else all"
        ),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="only scenes that take less than a minute")] = False,
    json: Annotated[bool, typer.Option("--json", help="one JSON object a scene, one a line")] = False,
    list_: Annotated[bool, typer.Option("--list", help="list the scenes")] = False,
    random: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="N scenes drawn over the whole case format instead")
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, help="of the random scenes; the same seed, the same scenes")
    ] = 1,
    first: Annotated[int, typer.Option("--from", min=0, metavar="K", help="number of the first one")] = 0,
    group: Annotated[
        list[str] | None, typer.Option(metavar="GROUP", help="only of this group; may be given again")
    ] = None,
    keep: Annotated[
        Path,
        typer.Option(metavar="DIR", help="where random scenes that fail are kept, as cases and made small"),
    ] = Path("stress-failures"),
    shrink: Annotated[
        float, typer.Option(min=0.0, metavar="SECONDS", help="processor time to make each of them small")
    ] = 60.0,
) -> None:
    """Run stiff and extreme scenes, or random ones.

    Each is passed, refused with a message, or failed; leaves with 3 if one failed.
    """
    one_thread()
    from coupler.commands.stress.drawn.command import is_drawn, named, numbered, stress_drawn

    words = [*(scenes or []), *(group or [])]
    if random is not None or (words and all(map(is_drawn, words))):
        asked = named(words) if random is None else numbered(seed, random, first, words)
        raise typer.Exit(int(stress_drawn(asked, keep, shrink, as_json=json, only_list=list_)))
    from coupler.commands.stress.report import stress as run_scenes

    raise typer.Exit(int(run_scenes(words, quick=quick, as_json=json, only_list=list_)))


@app.command(name="compare")
def compare_laws(
    case: CasePlace,
    laws: Annotated[
        str,
        typer.Option(
            metavar="A,B,...",
            help="comma-separated; else all of ours, cohfrict, jcfpm, mortar and cpm; `--list` names them",
        ),
    ] = "",
    set: Overrides = None,
    law: Laws = None,
    output: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="a new directory for the results; else runs/compare-<time> beside the case"
        ),
    ] = None,
    substeps: Annotated[
        str,
        typer.Option(
            metavar="N,N,...", help="multiples of the case's own substep, for error against run time"
        ),
    ] = "1,2,4,8",
    records: Annotated[int, typer.Option(min=10, metavar="N", help="rows of the tables")] = 1000,
    list_: Annotated[
        bool, typer.Option("--list", help="list the laws and what the stock ones do not match")
    ] = False,
) -> None:
    """Run a dry case under our laws and YADE's own.

    Matched as far as they can be; table, figure, CSV, JSON, and the scripts for yade.
    """
    one_thread()
    take_laws(law)
    from coupler.commands.compare.command import compare, show_laws

    raise typer.Exit(int(show_laws() if list_ else compare(case, laws, set or [], output, substeps, records)))


@app.command()
def study(
    words: Annotated[
        list[Path],
        typer.Argument(metavar="CASE|compare A B", help="a case with a section [study], or two studies"),
    ],
    ladder: Annotated[
        str, typer.Option(metavar="A,B,...", help="comma-separated names of ladders; else all of the case")
    ] = "",
    repeat: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="times that each run is made; else study.repeat of the case"),
    ] = None,
    law: Laws = None,
    output: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="directory of the study; else runs/study beside the case"),
    ] = None,
    larger: Annotated[bool, typer.Option("--larger", help="with the larger rungs of the ladders")] = False,
    any_version: Annotated[
        bool, typer.Option("--any-version", help="keep runs that another version of the program made")
    ] = False,
    error: Annotated[
        float, typer.Option(min=1.0, metavar="RATIO", help="compare: largest ratio of errors, B over A")
    ] = 1.1,
    cpu: Annotated[
        float, typer.Option(min=1.0, metavar="RATIO", help="compare: largest ratio of CPU seconds")
    ] = 1.2,
) -> None:
    """Error against run time over ladders of a case.

    Goes on where it stopped. `study compare A B` leaves with 3 if B is worse than A.
    """
    one_thread()
    take_laws(law)
    if len(words) == 3 and str(words[0]) == "compare":
        from coupler.commands.study.against import compare as compare_studies

        raise typer.Exit(int(compare_studies(words[1], words[2], error, cpu)))
    if len(words) != 1:
        raise typer.BadParameter("give one case, or: compare A B")
    from coupler.commands.study.command import study as make_study

    names = [name.strip() for name in ladder.split(",") if name.strip()]
    raise typer.Exit(int(make_study(words[0], names, repeat, output, larger, any_version)))


@app.command()
def sweep(
    case: CasePlace,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="KEY=...",
            help="A,B,... or FROM:TO:STEPS or 'lognormal(median=..., dispersion=...)'; may be given again; adds to the "
            "case's [sweep]",
        ),
    ] = None,
    set: Overrides = None,
    output: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="directory of the sweep; else runs/sweep beside the case"),
    ] = None,
    plan: Annotated[bool, typer.Option("--plan", help="only show the table and a forecast of cost")] = False,
    jobs: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="runs at a time; else as many as there are cores")
    ] = None,
    threads: Annotated[int, typer.Option(min=1, metavar="N", help="threads of each run")] = 1,
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
            metavar="KEY=VALUE", help="of a cluster: time=30 (minutes), mem=2GB, partition=...; again"
        ),
    ] = None,
    chunk: Annotated[int, typer.Option(min=1, metavar="N", help="slurm: runs that one job makes")] = 1,
    detach: Annotated[
        bool, typer.Option("--detach", help="slurm: submit and leave; the same command waits")
    ] = False,
    cancel: Annotated[
        str | None,
        typer.Option(metavar="all|ROW,ROW", help="slurm: scancel all jobs of this sweep, or those of rows"),
    ] = None,
    export: Annotated[
        str | None,
        typer.Option(metavar="snakemake", help="write a Snakefile that makes the runs; nothing is run"),
    ] = None,
    any_version: Annotated[
        bool, typer.Option("--any-version", help="keep runs that another version of the program made")
    ] = False,
) -> None:
    """Many runs of a case: grids, samples, repeats; fragility curves.

    What is done is not done again, a killed run goes on. Table, curves and a report on one page.
    """
    one_thread()
    from coupler.commands.sweep.command import Wish
    from coupler.commands.sweep.command import sweep as make_sweep

    wish = Wish(
        vary=tuple(vary or ()), set=tuple(set or ()), output=output, plan=plan, jobs=jobs, threads=threads,
        engine=engine, options=tuple(option or ()), chunk=chunk, detach=detach,
        cancel=None if cancel is None else tuple(part.strip() for part in cancel.split(",")), export=export,
        any_version=any_version,
    )  # fmt: skip
    raise typer.Exit(int(make_sweep(case, wish)))


@app.command()
def benchmark(
    quick: Annotated[bool, typer.Option("--quick", help="small sizes only")] = False,
    json: Annotated[bool, typer.Option("--json", help="one JSON object")] = False,
    only: Annotated[
        str | None,
        typer.Option(metavar="PART", help="joints, scenes, dead, cutting, debris, water, solver or stock"),
    ] = None,
) -> None:
    """Measure what substeps, cuts and solvers cost.

    Leaves with 3 if a target is missed.
    """
    one_thread()
    from coupler.commands.benchmark.command import benchmark as measure

    raise typer.Exit(int(measure(quick, json, only)))


@app.command(context_settings=PASS_ON)
def test(context: typer.Context) -> None:
    """Run the tests; further words go to pytest."""
    need("test")
    one_thread()
    from coupler.program.provenance import ROOT

    raise typer.Exit(run_module("pytest", *context.args, cwd=ROOT).returncode)


def take_laws(files: list[Path] | None) -> None:
    """Make the laws of files that the user named known, also to processes that this one starts. Raises BadLaw."""
    for file in files or []:
        from coupler.api.laws import register_law

        register_law(file)


if __name__ == "__main__":
    main()
