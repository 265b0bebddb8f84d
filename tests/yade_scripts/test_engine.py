"""Loading YADE leaves the process as it was, and every way it can fail says what to do.

Each case needs a fresh interpreter: YADE is loaded once in a process.
"""

import subprocess
import sys

import pytest


def run(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_loading_is_quiet_and_clean():
    """No output, same sys.path, same dlopen flags, same builtins, no folder left behind."""
    out = run("""
import builtins, sys, glob, os, tempfile
names, path, flags = set(dir(builtins)), list(sys.path), sys.getdlopenflags()
from yade_scripts.yade_side.engine import load_yade
engine = load_yade()
assert set(dir(builtins)) == names, set(dir(builtins)) - names
assert sys.path == path and sys.getdlopenflags() == flags
assert os.environ["OMP_NUM_THREADS"] == "1"
print(os.path.dirname(engine.O.tmpFilename()))
""")
    assert "\n" not in out
    assert not __import__("os").path.exists(out)


def test_loads_without_a_home():
    """Services and containers start programs without HOME, which YADE reads while it loads."""
    out = run("""
import os
os.environ.pop("HOME", None)
from yade_scripts.yade_side.engine import load_yade
print(load_yade().O.iter)
""")
    assert out == "0"


@pytest.mark.parametrize("package", ["vtk", "pyvista", "rasterio"])
def test_packages_that_would_crash_are_refused(package):
    out = run(f"""
from yade_scripts.yade_side.engine import load_yade, CrashesAfterYade
load_yade()
try:
    import {package}
except CrashesAfterYade as error:
    print(error)
""")
    assert "process of their own" in out


def test_missing_yade_says_how_to_install_it():
    out = run("""
import yade_scripts.yade_side.engine as e
e.PACKAGED = ("/nowhere/yade",)
try:
    e.load_yade()
except e.YadeMissing as error:
    print(error)
""")
    assert "apt install yade" in out


def test_a_folder_named_by_the_user_is_taken_whatever_is_in_its_path(tmp_path):
    package = tmp_path / "Käthe [1] Übel" / "py" / "yade"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("")
    out = run(f"""
import os
os.environ["SURGEBREAK_YADE"] = {str(package)!r}
import yade_scripts.yade_side.engine as e
print(e.find_yade() == e.Path({str(package.parent)!r}))
os.environ["SURGEBREAK_YADE"] = {str(tmp_path)!r}
try:
    e.find_yade()
except e.YadeMissing as error:
    print(error)
""")
    assert "True" in out
    assert f"SURGEBREAK_YADE = {tmp_path} holds no YADE" in out


@pytest.mark.parametrize("is_package", [True, False], ids=["package", "folder"])
def test_the_wrong_package_called_yade_is_named(tmp_path, is_package):
    """A mere folder of this name, too, which Python imports as a package without a file."""
    (tmp_path / "yade").mkdir()
    if is_package:
        (tmp_path / "yade" / "__init__.py").write_text("")
    out = run(f"""
import sys
sys.path.insert(0, {str(tmp_path)!r})
import yade_scripts.yade_side.engine as e
e.PACKAGED = ("/nowhere/yade",)
try:
    e.load_yade()
except e.WrongYade as error:
    print(error)
""")
    assert "pip uninstall yade" in out
    assert str(tmp_path) in out


def test_a_package_that_yade_needs_is_named():
    out = run("""
import yade_scripts.yade_side.engine as e
e.UNDECLARED = ("mpmath", "surely_not_installed")
try:
    e.load_yade()
except e.YadeNeedsPackage as error:
    print(error)
""")
    assert "surely_not_installed" in out
    assert "pip install" in out
