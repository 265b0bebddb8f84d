"""python -m coupler.commands.view RUN: stills, films and figures of a run, from its files alone."""

import argparse
import ctypes
import json
import os
import sys
import time
from pathlib import Path

from coupler.case.paths import BadPath, read_text
from coupler.commands.view.camera import VIEWS
from coupler.program.errors import FULL, ExitCode, NoRun, SurgebreakError
from coupler.program.extras import need
from coupler.program.process import was_killed

INSIDE = "inside"


class CannotDraw(SurgebreakError):
    """The system has nothing to draw with."""


def command_line():
    """The parser of its options."""
    parser = argparse.ArgumentParser(prog="surgebreak render", description=__doc__.partition(":")[2].strip())
    parser.add_argument(
        "run", type=Path, metavar="RUN", help="a run directory, finished or still being written"
    )
    parser.add_argument("--still", action="store_true", help="make one picture for print, at --time")
    parser.add_argument(
        "--film", action="store_true", help="make an H.264 film with one frame per stored step"
    )
    parser.add_argument(
        "--plots",
        action="store_true",
        help="draw histories, and curves over the data of the case, as PDF, SVG and PNG",
    )
    parser.add_argument(
        "--time",
        type=float,
        action="append",
        metavar="S",
        help="time of the still [s]; may be given again, a still each; default: the last stored step",
    )
    parser.add_argument(
        "--size",
        type=pixels,
        default=(1280, 720),
        metavar="WxH",
        help="size of the film in pixels; a still is twice as large",
    )
    parser.add_argument("--fps", type=rate, default=20.0, help="frames per second of the film (default 20)")
    parser.add_argument(
        "--azimuth",
        type=float,
        help="direction of the camera in degrees from +x towards +y; default: the side that the water strikes, and of "
        "its two ends that where the first joint broke",
    )
    parser.add_argument(
        "--elevation", type=angle, default=22.0, help="elevation of the camera above the ground in degrees"
    )
    parser.add_argument(
        "--view",
        choices=[*VIEWS, INSIDE],
        help="a plan; an elevation, seen from the south (y-), east (x+), north (y+) or west (x-); or inside, a "
        "view from among the blocks towards --azimuth (default: where joints break)",
    )
    parser.add_argument(
        "--cut",
        type=section,
        metavar="x=M",
        help="draw a section: everything in front of x, y or z = M [m] is removed",
    )
    parser.add_argument("--foam", action="store_true", help="draw white water where fast water disperses")
    parser.add_argument(
        "--letters",
        type=letters,
        default=1.0,
        metavar="TIMES",
        help="factor on the size of letters, for a small picture",
    )
    parser.add_argument(
        "--for-page",
        action="store_true",
        help="write each figure of --plots only in the format that a page shows: SVG, and PNG beside a large SVG",
    )
    parser.add_argument(
        "--to", type=Path, metavar="FOLDER", help="directory for the pictures; default RUN/pictures"
    )
    return parser


def arguments(given):
    """The parsed command line; where it does not choose what to make, everything is made."""
    options = command_line().parse_args(given)
    if not (options.still or options.film or options.plots):
        options.still = options.film = options.plots = True
    return options


def pixels(text):
    """(width, height) of "1280x720"."""
    try:
        width, height = (int(part) for part in text.lower().split("x"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a size; write it like 1280x720") from None
    if not (64 <= width <= 8192 and 64 <= height <= 8192):
        raise argparse.ArgumentTypeError(f"'{text}': width and height must be between 64 and 8192")
    return width, height


def rate(text):
    """Frames a second."""
    return within(text, 1.0, 120.0, "frames a second")


def angle(text):
    """Elevation of the camera [degree]; from straight above, up would have no meaning."""
    return within(text, -5.0, 85.0, "degrees")


def section(text):
    """(axis, place [m]) of "x=2.5"."""
    name, _, place = text.partition("=")
    if name.strip() not in ("x", "y", "z"):
        raise argparse.ArgumentTypeError(f"'{text}' is no section; write it like x=2.5")
    return "xyz".index(name.strip()), within(place, -1e9, 1e9, "m")


def letters(text):
    """Size of the letters as multiples of the usual one."""
    return within(text, 0.5, 3.0, "times the usual size")


def within(text, low, high, unit):
    """A number in [low, high]."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number") from None
    if not low <= value <= high:
        raise argparse.ArgumentTypeError(f"{text} is not between {low:g} and {high:g} {unit}")
    return value


def check_drawing():
    """Raise CannotDraw if the system cannot draw: without a display that takes EGL and a software renderer."""
    try:
        ctypes.CDLL("libEGL.so.1")
    except OSError:
        raise CannotDraw(
            "no EGL found: run `apt install libegl1 libgl1-mesa-dri` (YADE brings it along)"
        ) from None


def make(options):
    """Make what the options ask for and say what was made."""
    need("view")
    check_drawing()
    from coupler.commands.view.run_files import open_run

    run = open_run(options.run)
    if was_killed(summary(options.run)):
        print(f"note: the run was killed; shown is what it wrote, until t = {run.times[-1]:g} s", flush=True)
    folder = options.to or options.run / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    azimuth, elevation = VIEWS.get(options.view, (options.azimuth, options.elevation))
    camera = {
        "azimuth": azimuth,
        "elevation": elevation,
        "letters": options.letters,
        "cut": options.cut,
        "from_inside": options.view == INSIDE,
        "foam": options.foam,
    }
    if options.still:
        from coupler.commands.view.pictures import stills

        for time in options.time or []:
            run.check(time)
        report(stills, run, folder, options.size, options.time or [None], **camera)
    if options.plots:
        from coupler.commands.view.damage import damage_figures
        from coupler.commands.view.figure_files import FOR_A_PAGE, FORMATS
        from coupler.commands.view.over_data import over_data
        from coupler.commands.view.plots import plots

        for figures in (plots, damage_figures, over_data):
            report(figures, options.run, folder, FOR_A_PAGE if options.for_page else FORMATS)
    if options.film:
        from coupler.commands.view.pictures import film

        report(film, run, folder, options.size, options.fps, tell=tell, **camera)


def summary(run):
    """What run.json says, which may be incomplete; nothing where there is none.  Raises NoRun where it is torn."""
    path = run / "run.json"
    if not path.exists():
        return {}
    try:
        found = json.loads(read_text(path))
    except (ValueError, RecursionError, BadPath) as error:
        raise NoRun(f"{path}: {error}") from error
    if not isinstance(found, dict):
        raise NoRun(f"{path}: not what a run writes")
    return found


def report(action, *given, **options):
    """Call `action`, and print the files it wrote and its CPU time."""
    start = time.process_time()
    written = action(*given, **options)
    for path in written if isinstance(written, list) else [written]:
        print(f"{path}", flush=True)
    print(f"  {action.__name__}: {time.process_time() - start:.1f} CPU-s", flush=True)


def tell(done, frames):
    """Print a line for every tenth of the film."""
    if done == frames or done % max(1, frames // 10) == 0:
        print(f"  frame {done} of {frames}", flush=True)


def main(given=None):
    """Exit code 0, or the code of the error after its message."""
    options = arguments(given)
    try:
        make(options)
    except SurgebreakError as error:
        print(f"surgebreak render: {error}", file=sys.stderr)
        return int(error.exit_code)
    except BrokenPipeError:  # the reader, such as `| head`, has closed the pipe: end quietly
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return int(ExitCode.STOPPED)
    except OSError as error:
        remedy = "; free some space, or write elsewhere with --to" if error.errno in FULL else ""
        print(f"surgebreak render: {options.run}: {error}{remedy}", file=sys.stderr)
        return int(ExitCode.STOPPED)
    return int(ExitCode.DONE)


if __name__ == "__main__":
    sys.exit(main())
