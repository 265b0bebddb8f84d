"""Kernels compiled ahead: the small scenes touch every part, and a case gets the parts that it needs and lacks."""

import subprocess
import sys
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from coupler.case.case import modules
from coupler.checks.read_case import from_text, load
from coupler.commands.cli import app
from coupler.commands.warm_up import CASE, PARTS
from coupler.program.process import environment
from coupler.run import compile_ahead as ahead
from coupler.run import forecast


def test_the_warm_up_case_switches_on_both_sides_and_what_joins_them(tmp_path):
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    on = modules(load(tmp_path).case)
    usual = {"water", "structure", "coupling", "fixed solids", "contact", "joints", "gauges"}
    assert {
        name for name, switched in on.items() if switched
    } == usual  # others compile when they are asked for


@pytest.fixture
def reported(monkeypatch):
    """Runs compile_ahead of a warm-up case: what is printed, and the parts that would have been compiled."""

    def run(part, there=(), cores=2, failed=()):
        lines, asked = [], []
        monkeypatch.setattr(ahead, "is_compiled", lambda name: name in there)
        monkeypatch.setattr(ahead.os, "sched_getaffinity", lambda _: set(range(cores)))
        monkeypatch.setattr(
            ahead,
            "_compile",
            lambda chains: asked.extend(chains) or [p for c in chains for p in c if p in failed],
        )
        ahead.compile_ahead(from_text(PARTS[part], "case", ahead.ROOT).case, lines.append)
        return asked, " ".join(lines)

    return run


def test_a_case_gets_the_parts_that_it_needs_and_lacks(reported):
    assert reported("both")[0] == [["solids", "water"], ["structure", "both"]]
    assert reported("both", there=("structure",))[0] == [["solids", "water"], ["both"]]
    assert reported("both", there=("solids", "water", "structure", "both")) == ([], "")


def test_where_nothing_is_gained_the_run_compiles_as_it_goes(reported):
    """One core, or one chain: a process more would only load everything twice. The run says why nothing is heard of it
    for a while."""
    for asked, lines in (
        reported("both", cores=1),
        reported("structure"),
        reported("solids"),
        reported("both", there=("structure", "both")),
    ):
        assert asked == []
        assert lines.startswith("compiling the numerical kernels (")
        assert lines.endswith("as they are first called: half a minute or more")


@pytest.mark.parametrize("there", [True, False])
def test_a_check_says_why_nothing_is_heard_of_it_for_a_while(tmp_path, monkeypatch, there):
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    monkeypatch.setattr(ahead, "is_compiled", lambda part: there)
    monkeypatch.setattr(forecast, "forecast", lambda *given: SimpleNamespace(rows=[]))
    told = CliRunner().invoke(app, ["check", str(tmp_path)]).output
    assert ("compiling the kernels of joints" in told) != there


def test_a_failure_is_reported_and_left_to_the_run(reported):
    asked, lines = reported("both", failed=("solids", "water"))
    assert ["solids", "water"] in asked
    assert "note: solids, water: not compiled ahead; the run compiles what it needs itself" in lines


def test_every_part_has_modules_with_kernels_and_an_empty_cache_has_none(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("NUMBA_CACHE_LOCATOR_CLASSES", "ByContent")
    ahead.folder_of.cache_clear()
    for part in ahead.MODULES:
        assert len(ahead._modules(part)) > (1 if part == "both" else 5)
        assert not ahead.is_compiled(part)
        for module in ahead._modules(part):
            folder = ahead.folder_of(module, tmp_path)
            folder.mkdir(parents=True, exist_ok=True)
            (folder / "kernel.nbi").touch()
        assert ahead.is_compiled(part)
    monkeypatch.delenv("NUMBA_CACHE_LOCATOR_CLASSES")
    ahead.folder_of.cache_clear()
    assert ahead.is_compiled("water"), "a cache of the user's own is left alone"


COMPILED_BY_SOLIDS = """
from numba.core import event

from coupler.commands.warm_up import warm_up

warm_up("water")
warm_up("both")
compiled = []


class Compilations(event.Listener):
    def on_start(self, event):
        compiled.append(event.data["dispatcher"].py_func.__module__)

    def on_end(self, event):
        return None


event.register("numba:compile", Compilations())
warm_up("solids")
print(sorted({module for module in compiled if module.startswith(("fluid", "coupler", "yade_scripts"))}))
"""


def test_kernels_called_directly_have_the_arguments_that_a_run_gives_them():
    """Another type of an argument would compile a kernel that no run uses, and leave the one that it does."""
    done = subprocess.run(
        [sys.executable, "-c", COMPILED_BY_SOLIDS],
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.splitlines()[-1:] == ["[]"], done.stderr
