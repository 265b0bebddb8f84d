"""The command `surgebreak doctor`: each part of the installation is executed; parts that may crash run in their own
process."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from coupler.commands.doctor import mend
from coupler.program import terminal
from coupler.program.arithmetic import BASELINE, missing, remark
from coupler.program.errors import ExitCode
from coupler.program.extras import EXTRAS, absent
from coupler.program.provenance import version, versions
from coupler.program.threads import VARIABLE, cores


class Finding(NamedTuple):
    """What was examined, its state, whether that is good, the remedy if not, and the function that carries out the
    remedy where the program can do so itself."""

    what: str
    found: str
    good: bool
    remedy: str = ""
    mend: Callable[[], str] | None = None


def examine(mending: bool = False) -> ExitCode:
    """Test every part, print a table, and return 0 when all is well; mending: repair what can be, and test again."""
    findings = []
    for check in CHECKS:
        found = check()
        _show(found)
        if not found.good and found.mend is not None:
            if mending:
                found = _mended(found, check)
            else:
                print(f"     {'':22} -> `surgebreak doctor --mend` does that", flush=True)
        findings.append(found)
    bad = sum(not finding.good for finding in findings)
    terminal.console().print(f"{bad} of {len(findings)} checks failed" if bad else "everything works")
    return ExitCode.CRASHED if bad else ExitCode.DONE


def _show(found: Finding) -> None:
    print(f"{'ok ' if found.good else 'BAD'}  {found.what:22} {found.found}", flush=True)
    if not found.good:
        print(f"     {'':22} -> {found.remedy}", flush=True)


def _mended(found: Finding, check: Callable[[], Finding]) -> Finding:
    """The finding after the remedy was carried out; the earlier one if the remedy failed."""
    assert found.mend is not None
    try:
        print(f"     {'':22} -> {found.mend()}", flush=True)
    except OSError as error:
        print(f"     {'':22} -> not mended: {error}", flush=True)
        return found
    importlib.invalidate_caches()
    again = check()
    _show(again)
    return again


def _python() -> Finding:
    system = os.path.realpath("/usr/bin/python3")
    mine = os.path.realpath(sys.executable)
    output = f"{sys.version.split()[0]}, surgebreak {version()}"
    return Finding(
        "Python", output, mine == system,
        f"this is {mine}, YADE is built for {system}; remove .venv and call ./surgebreak again",
    )  # fmt: skip


def _packages() -> Finding:
    import_names = {"scikit-fem": "skfem"}
    names = ("numpy", "scipy", "scikit-fem", "meshio", "h5py", "numba", "pydantic", "pint", "rich")
    lacking = [name for name in names if find_spec(import_names.get(name, name)) is None]
    hurt = {} if lacking else mend.damaged()
    if hurt:
        name, file = next(iter(hurt.items()))
        more = f" and {len(hurt) - 1} more packages" if len(hurt) > 1 else ""
        return Finding(
            "packages", f"damaged: {name} ({file} is not as it was installed){more}", False,
            f"pip install --force-reinstall --no-deps -c constraints.txt {' '.join(hurt)}",
            _installer(list(hurt), again=True),
        )  # fmt: skip
    held = ", ".join(f"{name} {number}" for name, number in versions().items() if name in names)
    return Finding(
        "packages", f"missing: {' '.join(lacking)}" if lacking else held, not lacking,
        f"pip install -c constraints.txt {' '.join(lacking)}", _installer(lacking),
    )  # fmt: skip


def _installer(names: list[str], again: bool = False) -> Callable[[], str] | None:
    """The command that installs packages (`mend.install`); none outside of a virtual environment."""
    return partial(mend.install, names, again) if mend.can_install() else None


def _extras() -> Finding:
    """Optional packages, which enable more of the commands; their absence is no fault."""
    lacking = [name for name in EXTRAS if absent(name)]
    found = f"without {', '.join(lacking)}: pip install -c constraints.txt -e '.[NAME]'" if lacking else "all"
    return Finding("extras", found, True)


def _kernels() -> Finding:
    """The compiled kernels must be complete, in a writable folder."""
    place = mend.kernel_place()
    if place is None or not place.is_dir():
        return Finding("compiled kernels", "none yet; the first run compiles them", True)
    shut = mend.locked(place)
    if shut:
        return Finding(
            "compiled kernels", f"may not be read or written: {shut[0]}{_and_more(shut)}", False,
            f"chmod -R u+rwX {place}", partial(mend.unlock, place),
        )  # fmt: skip
    broken = mend.torn(place)
    if broken:
        return Finding(
            "compiled kernels", f"cut off: {broken[0]}{_and_more(broken)}", False,
            "remove their folders; the next run compiles them", partial(mend.drop_torn, place),
        )  # fmt: skip
    return Finding("compiled kernels", f"{sum(1 for _ in mend.kernels(place))} whole files in {place}", True)


def _and_more(paths: list[Path]) -> str:
    return f" and {len(paths) - 1} more" if len(paths) > 1 else ""


def _yade_packages() -> Finding:
    """Packages that YADE imports without declaring them; without mpmath its error is unreadable."""
    lacking = [name.lower() for name in ("future", "IPython", "mpmath") if find_spec(name) is None]
    return Finding(
        "packages YADE needs", f"missing: {' '.join(lacking)}" if lacking else "future, ipython, mpmath",
        not lacking, f"pip install {' '.join(lacking)}", _installer(lacking),
    )  # fmt: skip


def _yade() -> Finding:
    from yade_scripts.yade_side.engine import YadeError, find_yade

    try:
        place = find_yade()
    except YadeError as error:
        return Finding("YADE", "not usable", False, str(error))
    return Finding("YADE", f"{versions().get('yade', 'version unknown')} in {place}", True)


_FALLING_SPHERE = """
import json, sys
from yade_scripts.yade_side.engine import load_yade
engine = load_yade()
O, utils, wrapper = engine.O, engine.utils, engine.wrapper
O.reset()
O.bodies.append(utils.sphere((0, 0, 0), 1.0))
O.engines = [wrapper.ForceResetter(), wrapper.NewtonIntegrator(damping=0, gravity=(0, 0, -9.81))]
O.dt = 1e-3
for _ in range(10):
    O.step()
print(json.dumps({"version": str(engine.version), "z": O.bodies[0].state.vel[2]}))
"""


def _yade_run() -> Finding:
    """YADE must compute ten steps of a falling sphere: v = g t."""
    status, output = _in_process(_FALLING_SPHERE)
    if status != 0:
        explained = any(name in output for name in ("YadeNeedsPackage", "YadeMissing", "WrongYade"))
        remedy = "as its message says" if explained else "apt install --reinstall yade"
        return Finding("ten steps of YADE", _last(output), False, remedy)
    result = json.loads(output.splitlines()[-1])
    good = abs(result["z"] + 9.81 * 0.01) < 1e-12
    return Finding(
        "ten steps of YADE", f"version {result['version']}, v = {result['z']:.6f} m/s after 10 ms", good,
        "expected -0.098100 m/s; apt install --reinstall yade",
    )  # fmt: skip


def _threads() -> Finding:
    asked, most = os.environ.get(VARIABLE, str(cores())), cores()
    good = asked.isdigit() and 1 <= int(asked) <= most
    return Finding(
        "threads",
        f"{asked} of {most} cores",
        good,
        f"unset {VARIABLE} (all cores of the process) or set at most that many",
    )


def _processor() -> Finding:
    """The processor's instruction set; older processors work, but their results differ in the last digits."""
    absent = missing()
    return Finding(
        "processor", f"works; {remark()}" if absent else f"{BASELINE}: last digits as on every such one", True
    )


_WRITE = """
import h5py, sys
with h5py.File(sys.argv[1], "w", libver=("earliest", "v110")) as file:
    root = file.create_group("VTKHDF")
    root.attrs["Version"] = (2, 0)
    root.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", len("UnstructuredGrid")))
    for name, values in (("NumberOfPoints", [4]), ("NumberOfCells", [1]), ("NumberOfConnectivityIds", [4])):
        root[name] = values
    root["Points"] = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    root["Connectivity"], root["Offsets"] = [0, 1, 2, 3], [0, 4]
    root.create_dataset("Types", data=[10], dtype="uint8")
"""
_READ = """
import sys
from vtkmodules.vtkIOHDF import vtkHDFReader
reader = vtkHDFReader()
reader.SetFileName(sys.argv[1])
reader.Update()
grid = reader.GetOutput()
assert (grid.GetNumberOfPoints(), grid.GetNumberOfCells()) == (4, 1)
"""


def _files() -> Finding:
    """h5py must write a tetrahedron that VTK, if installed, can read; never in one process with YADE."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "one.vtkhdf")
        status, output = _in_process(_WRITE, path)
        if status == 0 and find_spec("vtkmodules") is None:
            return Finding("result files", "written; VTK is not installed (`render` brings it)", True)
        if status == 0:
            status, output = _in_process(_READ, path)
    return Finding(
        "result files", "written by h5py, read by VTK" if status == 0 else _last(output), status == 0,
        "h5py and VTK do not fit together; install with -c constraints.txt",
    )  # fmt: skip


_DRAW = """
import sys
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 48))
plotter.add_mesh(pyvista.Sphere(), color="red")
picture = plotter.screenshot(return_img=True)
assert len({tuple(p) for p in picture.reshape(-1, 3)}) > 2, "the picture is empty"
"""


def _pictures() -> Finding:
    if find_spec("pyvista") is None:
        return Finding("pictures", "not installed (`render` brings what it needs)", True)
    status, output = _in_process(_DRAW, VTK_DEFAULT_OPENGL_WINDOW="vtkEGLRenderWindow")
    return Finding(
        "pictures", "drawn without a screen" if status == 0 else _last(output), status == 0,
        "apt install libegl1 libgl1-mesa-dri",
    )  # fmt: skip


def _in_process(code: str, *arguments: str, **environment: str) -> tuple[int, str]:
    """Exit status and output of Python code in another process, so that a crash there becomes a finding."""
    command = [sys.executable, "-c", code, *arguments]
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
            env={**os.environ, **environment},
        )
    except subprocess.TimeoutExpired:
        return 1, "no answer within two minutes"
    if done.returncode < 0:
        return done.returncode, f"crashed with signal {-done.returncode}"
    return done.returncode, (done.stdout or done.stderr) if done.returncode == 0 else done.stderr


def _last(output: str) -> str:
    lines = output.strip().splitlines()
    return lines[-1][:200] if lines else "no output"


CHECKS: tuple[Callable[[], Finding], ...] = (
    _python, _packages, _extras, _kernels, _yade_packages, _yade, _yade_run, _threads, _processor, _files, _pictures,
)  # fmt: skip
