"""The command `surgebreak`. Commands import their modules when they are called, so that help is fast."""

from __future__ import annotations

import os
import sys
from functools import partial
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
    """All commands; Ctrl-C ends each of them with a message and the exit code of a stop."""

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
MANY_SOLIDS = 200
"""Fixed solids from which the substep takes so long that `check` says it is at work."""
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
        help="number of threads; the results do not depend on it; default: SURGEBREAK_THREADS, else all cores of the "
        "process",
        show_default=False,
    ),
]
Laws = Annotated[
    list[Path] | None,
    typer.Option(
        "--law",
        metavar="FILE",
        help="a Python file that defines a cohesive law; its code is executed; may be repeated",
    ),
]


def main() -> None:
    """Entry point. Exit codes: 0 done, 1 failure, 2 bad case, 3 diverged or out of balance, 4 stopped."""
    with Failures():
        try:
            app()
        finally:
            _write_out()


def _write_out() -> None:
    """Write what is still held back: where nobody reads any more, end as quietly as other commands do."""
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise SystemExit(1) from None


@app.callback(invoke_without_command=True)
def _root(
    version: Annotated[bool, typer.Option("--version", help="print the version and exit")] = False,
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
            metavar="DIR", help="a new directory for the results; default: runs/<time>-<hash> beside the case"
        ),
    ] = None,
    end: Annotated[str | None, typer.Option(metavar="TIME", help="short for --set time.end=...")] = None,
    dry: Annotated[bool, typer.Option("--dry", help="only read the case, without running it")] = False,
    threads: Threads = None,
    watch: Annotated[
        bool, typer.Option("--watch", help="also show the run in the browser of this machine")
    ] = False,
) -> None:
    """Run a case. Ctrl-C or a file named `stop` in the run directory ends it cleanly."""
    one_thread()
    take_threads(threads)
    take_laws(law)
    from coupler.checks.read_case import load

    file = load(case, [*(set or []), *([f"time.end={end}"] if end else [])])
    if dry:
        return
    from coupler.run.directory import RunDirectory
    from coupler.run.execute import execute_case

    directory = RunDirectory.create(file, output)
    if not watch:
        raise typer.Exit(int(execute_case(file, directory)))
    from coupler.commands.watch.command import beside

    with beside(directory.path):
        code = execute_case(file, directory)
    raise typer.Exit(int(code))


@app.command(name="watch")
def watch_runs(
    places: Annotated[
        list[Path], typer.Argument(metavar="RUN...", help="runs, sweeps, or folders with runs")
    ],
    port: Annotated[int, typer.Option(min=0, max=65535, help="port of the page; 0 takes any free one")] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="open the browser")] = False,
    pictures: Annotated[
        bool, typer.Option("--pictures/--no-pictures", help="draw a new picture from time to time")
    ] = True,
) -> None:
    """Show runs in the browser while they are in progress.

    The page shows the progress, the time left, histories, the newest picture, the present verdict and the limits, and
    has a button that stops a run. It is accessible only from this machine, at a secret address.
    """
    from coupler.commands.watch.command import watch as serve

    serve(places, port, browser, pictures)


@app.command()
def resume(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="the directory of a run that stopped")],
    end: Annotated[
        str | None, typer.Option(metavar="TIME", help="new end time; short for --set time.end=...")
    ] = None,
    set: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY=VALUE", help="change time.end, time.cfl, time.step_max, limits.* ..."
        ),
    ] = None,
    law: Laws = None,
    any_version: Annotated[
        bool, typer.Option("--any-version", help="continue although the program has changed since")
    ] = False,
    threads: Threads = None,
) -> None:
    """Continue a run that was stopped or killed.

    It is continued from its newest checkpoint.
    """
    one_thread()
    take_threads(threads)
    take_laws(law)
    from coupler.run.execute import execute_case
    from coupler.run.resume import prepare

    found = prepare(run, [*(set or []), *([f"time.end={end}"] if end else [])], any_version)
    raise typer.Exit(int(execute_case(found.file, found.directory, found.checkpoint)))


@app.command()
def check(
    case: CasePlace,
    set: Overrides = None,
    law: Laws = None,
    exact: Annotated[
        bool, typer.Option("--exact", help="also solve for the exact highest frequency of the joints")
    ] = False,
    picture: Annotated[
        Path | None, typer.Option(metavar="PNG", help="draw the blocks, solids and water at the start")
    ] = None,
) -> None:
    """Check a case, and forecast its steps, processor time, memory and disk space.

    Nothing is run, but YADE is loaded to compute the substep of a structure.
    """
    one_thread()
    take_laws(law)
    from coupler.checks.read_case import load
    from coupler.program import terminal
    from coupler.run.execute import describe
    from coupler.run.forecast import forecast

    if picture is not None:
        need("view")
    file = load(case, set or [])
    describe(file, partial(print, flush=True))
    if picture is not None:
        from coupler.commands.blocks import draw_case

        draw_case(file.case, picture)
        print(f"picture: {picture}")
    if file.case.structure is not None and len(file.case.solid) >= MANY_SOLIDS:
        print(f"the substep, with {len(file.case.solid)} fixed solids that blocks can touch, ...", flush=True)
    terminal.table("forecast", forecast(file.case, exact, file.directory).rows)


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
        bool, typer.Option("--pictures/--no-pictures", help="include stills and figures of a run")
    ] = True,
) -> None:
    """Write one HTML page about a run, a study or a sweep.

    The file report.html in the directory contains pictures, figures and tables, for screen and paper.
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
    to: Annotated[
        Path | None, typer.Option(metavar="DIR", help="directory for the files; default: RUN/export")
    ] = None,
    begin: Annotated[float, typer.Option("--from", metavar="S", help="first time [s]")] = 0.0,
    end: Annotated[float, typer.Option("--until", metavar="S", help="last time [s]")] = float("inf"),
) -> None:
    """Write results for other programs.

    The formats are .pvd for ParaView, NetCDF for xarray and .glb for Blender. While a run is in progress, a repeated
    export adds only the new steps.
    """
    from coupler.commands.export.command import export as write

    write(run, [name.strip() for name in format_.split(",") if name.strip()], to, begin, end)


@app.command()
def doctor(
    mend: Annotated[
        bool,
        typer.Option(
            "--mend",
            help="repair what can be repaired: incomplete kernels, locked folders of the cache, missing packages",
        ),
    ] = False,
) -> None:
    """Check that YADE and all other parts work on this machine."""
    one_thread()
    from coupler.commands.doctor import examine

    raise typer.Exit(int(examine(mend)))


@app.command()
def explain(
    key: Annotated[
        str | None,
        typer.Argument(
            metavar="KEY|RUN",
            help="a key of the case file, for instance joints.strength, or a run directory",
        ),
    ] = None,
) -> None:
    """Explain a key of the case file, or what a run did not compute.

    Without an argument it lists all sections. For a run it lists what was skipped, and what that would have cost.
    """
    if key and (os.sep in key or (Path(key) / "run.json").is_file()):
        from coupler.commands.explain_run import explanation_of_run

        print(explanation_of_run(Path(key)))
        return
    from coupler.case.docs import explanation
    from coupler.program.errors import UnknownName

    try:
        print(explanation(key))
    except UnknownName:
        if key not in typer.main.get_command(app).commands:
            raise
        raise UnknownName(
            f"{key}: a command, no name of a case file; `surgebreak {key} --help` explains it"
        ) from None


@app.command()
def blocks(
    drawing: Annotated[
        Path, typer.Argument(metavar="FILE", help="a drawing: STL, OBJ, PLY, ...; STEP and IFC with extras")
    ],
    size: Annotated[
        str, typer.Option(metavar="M", help="intended length of the blocks along walls and slabs")
    ] = "1 m",
    course: Annotated[
        str | None,
        typer.Option(metavar="M", help="intended height of the blocks in walls; default: the size"),
    ] = None,
    bond: Annotated[str, typer.Option(help="bond of the blocks in walls: stack or running")] = "stack",
    scale: Annotated[str, typer.Option(help="length of one unit of the file, for instance '1 mm'")] = "1 m",
    up: Annotated[str, typer.Option(help="axis of the file that points up: z or y")] = "z",
    sliver: Annotated[
        str | None,
        typer.Option(metavar="M", help="parts narrower than this are merged with their neighbours"),
    ] = None,
    most_blocks: Annotated[int | None, typer.Option(help="more blocks are refused; default: 5000")] = None,
    density: Annotated[
        str | None, typer.Option(help="density of the blocks, for instance '1800 kg/m3'")
    ] = None,
    strength: Annotated[str, typer.Option(help="strength of the joints, for the forecast")] = "0.5 MPa",
    opening: Annotated[str, typer.Option(help="opening of the joints at failure, for the forecast")] = "1 mm",
    picture: Annotated[
        Path | None,
        typer.Option(metavar="PNG", help="file of the picture; default: FILE_blocks.png beside the drawing"),
    ] = None,
    to: Annotated[
        Path | None, typer.Option(metavar="OBJ", help="also write the blocks as closed surfaces")
    ] = None,
) -> None:
    """Cut a drawing of a building into blocks.

    It reports the number of blocks, what determines the substep and what a second of simulation costs, draws the
    blocks, and prints the lines for a case.
    """
    one_thread()
    from coupler.commands.blocks import as_number
    from coupler.commands.blocks import blocks as cut

    given = {"size": size, "course": course, "bond": bond, "scale": scale, "up": up, "sliver": sliver}
    given["density"] = density
    options = {k: as_number(v) for k, v in given.items() if v is not None and (k, v) not in DRAWN_AS_USUAL}
    options |= {} if most_blocks is None else {"most_blocks": most_blocks}
    joints = {"strength": strength, "opening_at_failure": opening}
    cut(drawing, options, joints, picture, to)


DRAWN_AS_USUAL = (("bond", "stack"), ("scale", "1 m"), ("up", "z"))
"""Options with the default value of a case."""


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
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="change a value of [terrain], for instance terrain.scale='1 ft'",
        ),
    ] = None,
    map_: Annotated[
        Path | None, typer.Option("--map", metavar="PNG", help="draw a map; needs the extra `view`")
    ] = None,
) -> None:
    """Show a terrain: its extent, heights and slopes, and how cells of a given size represent it.

    For a run it lists the maps of the flood; --map draws them in one picture with the state of the buildings.
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
    """Compute the sea off a coast with ANUGA, and write a record for a side of a case.

    The coupling is one-way: a wide and coarse sea is driven by a source or a record, and the flow at the side of the
    tank is written to a CSV file. Needs the extra `offshore`; docs/terrain.md describes the file.
    """
    one_thread()
    from coupler.commands.offshore.command import offshore as make

    print(f"record: {make(file)}")


@app.command()
def schema(
    to: Annotated[
        Path | None, typer.Option("--to", metavar="FILE", help="file to write; default: standard output")
    ] = None,
) -> None:
    """Print the JSON Schema of case.toml, for editors.

    Editors complete and check the keys of a case with it; docs/editor.md describes how to set up an editor.
    """
    from coupler.case.editor_schema import write

    write(to)


@app.command()
def kernels(
    pack: Annotated[
        Path | None,
        typer.Option("--pack", metavar="FILE", help="write the kernels of this version into one file"),
    ] = None,
    unpack: Annotated[
        Path | None,
        typer.Option(
            "--unpack",
            metavar="FILE",
            help="add the kernels of a file to the cache; only from sources that you trust",
        ),
    ] = None,
) -> None:
    """Show, pack or unpack the compiled kernels, so that other machines need not compile them.

    Without an option it shows where they are, and how many modules of this version have compiled kernels.
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
        typer.Option("--build", metavar="DIR", help="only build the site in this folder, without opening it"),
    ] = None,
) -> None:
    """Build the site of the documentation and open it."""
    from coupler.commands.site.command import docs as make_site

    raise typer.Exit(int(make_site(build)))


@app.command()
def init(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="the new case directory")],
    template: Annotated[
        str,
        typer.Option(metavar="NAME", help="tank, wall, house, quay, harbour, column, terrain, town or dry"),
    ] = "tank",
    ask: Annotated[bool, typer.Option("--ask", help="ask at most six questions about the case")] = False,
) -> None:
    """Write a small commented case that runs."""
    from coupler.case.first_cases import write_first_case

    def answer(question: str, usual: str) -> str:
        return typer.prompt(question, default=usual)

    path, word = write_first_case(directory, template, answer if ask else None), quote(str(directory))
    print(f"wrote {path}; next: surgebreak check {word}, surgebreak run {word}")


@app.command()
def verify(
    ids: Annotated[
        list[str] | None, typer.Argument(metavar="ID", help="cases (P01 ...); default: all")
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="only the cheap cases, which take three minutes of processor time")
    ] = False,
    json: Annotated[
        bool, typer.Option("--json", help="print one JSON object per quantity, one per line")
    ] = False,
    list_: Annotated[
        bool, typer.Option("--list", help="list the cases, and the checks that are not covered")
    ] = False,
    plots: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="folder for figures of computed and measured curves"),
    ] = None,
) -> None:
    """Compare results with exact solutions and measured records.

    The exit code is 3 if a quantity exceeds its tolerance.
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
            metavar="ID",
            help="scenes (S01 ..., R1-12 ...) or groups: structure, water, coupling; default: all",
        ),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="only scenes that take less than a minute")] = False,
    json: Annotated[
        bool, typer.Option("--json", help="print one JSON object per scene, one per line")
    ] = False,
    list_: Annotated[bool, typer.Option("--list", help="list the scenes")] = False,
    random: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="run N random scenes from the whole case format instead"),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="seed of the random scenes")] = 1,
    first: Annotated[
        int, typer.Option("--from", min=0, metavar="K", help="number of the first random scene")
    ] = 0,
    group: Annotated[
        list[str] | None, typer.Option(metavar="GROUP", help="only scenes of this group; may be repeated")
    ] = None,
    keep: Annotated[
        Path,
        typer.Option(
            metavar="DIR", help="directory for random scenes that fail, as cases, complete and reduced"
        ),
    ] = Path("stress-failures"),
    shrink: Annotated[
        float,
        typer.Option(min=0.0, metavar="SECONDS", help="processor time for the reduction of each of them"),
    ] = 60.0,
) -> None:
    """Run stiff and extreme scenes, or random ones.

    A scene passes, is refused with a message, or fails. The exit code is 3 if one fails.
    """
    one_thread()
    from coupler.commands.stress.drawn.command import are_drawn, named, numbered, stress_drawn

    words = [*(scenes or []), *(group or [])]
    if random is not None or are_drawn(words):
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
            help="separated by commas; default: all of this program, cohfrict, jcfpm, mortar and cpm; see `--list`",
        ),
    ] = "",
    set: Overrides = None,
    law: Laws = None,
    output: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="a new directory for the results; default: runs/compare-<time> beside the case",
        ),
    ] = None,
    substeps: Annotated[
        str,
        typer.Option(
            metavar="N,N,...", help="multiples of the substep of the case, for the error against run time"
        ),
    ] = "1,2,4,8",
    records: Annotated[int, typer.Option(min=10, metavar="N", help="number of rows of the tables")] = 1000,
    list_: Annotated[
        bool,
        typer.Option("--list", help="list the laws, and the properties that the laws of YADE cannot match"),
    ] = False,
) -> None:
    """Run a case without water with the cohesive laws of this program and with those of YADE.

    A case with [water] is refused: YADE's own scenes know no water. For such a case run each law by
    `run --set joints.law=NAME`. The parameters of the laws are matched as far as possible. The results are a table, a
    figure, CSV, JSON, and scripts for YADE.
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
        str,
        typer.Option(
            metavar="A,B,...", help="names of ladders, separated by commas; default: all of the case"
        ),
    ] = "",
    repeat: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="number of times that each run is made; default: study.repeat of the case",
        ),
    ] = None,
    law: Laws = None,
    output: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="directory of the study; default: runs/study beside the case"),
    ] = None,
    larger: Annotated[bool, typer.Option("--larger", help="include the larger rungs of the ladders")] = False,
    any_version: Annotated[
        bool, typer.Option("--any-version", help="keep runs that another version of the program made")
    ] = False,
    error: Annotated[
        float,
        typer.Option(min=1.0, metavar="RATIO", help="compare: largest permitted ratio of errors, B over A"),
    ] = 1.1,
    cpu: Annotated[
        float,
        typer.Option(
            min=1.0, metavar="RATIO", help="compare: largest permitted ratio of CPU seconds, B over A"
        ),
    ] = 1.2,
) -> None:
    """Measure errors against run time over the ladders of a case.

    A study that was stopped is continued. `study compare A B` ends with exit code 3 if B is worse than A.
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
    """Make many runs of a case: grids, samples, repeats; fragility curves.

    Completed runs are not repeated, and a killed run is continued. The results are a table, curves and a report.
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


@app.command()
def benchmark(
    quick: Annotated[bool, typer.Option("--quick", help="only small sizes")] = False,
    json: Annotated[bool, typer.Option("--json", help="print one JSON object")] = False,
    only: Annotated[
        str | None,
        typer.Option(
            metavar="PART",
            help="joints, scenes, sleep, dead, cutting, debris, water, solver, threads, roofline or stock",
        ),
    ] = None,
) -> None:
    """Measure the processor time of substeps, cutting and solvers.

    The exit code is 3 if a target is missed.
    """
    one_thread()
    from coupler.commands.benchmark.command import benchmark as measure

    raise typer.Exit(int(measure(quick, json, only)))


@app.command(context_settings=PASS_ON)
def test(context: typer.Context) -> None:
    """Run the tests; further arguments are passed to pytest."""
    need("test")
    one_thread()
    from coupler.program.provenance import ROOT

    raise typer.Exit(run_module("pytest", *context.args, cwd=ROOT).returncode)


def take_laws(files: list[Path] | None) -> None:
    """Register the laws of files that the user named, also for child processes. Raises BadLaw."""
    for file in files or []:
        from coupler.api.laws import register_law

        register_law(file)


if __name__ == "__main__":
    main()
