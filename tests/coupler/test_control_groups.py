"""Cores and memory that a container or a batch job gives a process, by control groups of both versions."""

import os
import resource
from functools import partial

import pytest

from coupler.checks.read_case import load
from coupler.program import control_groups, memory, threads
from coupler.program.errors import BadCase

MACHINE = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


@pytest.fixture
def groups(tmp_path, monkeypatch):
    """A function that makes control groups: the content of /proc/self/cgroup, and of their files by path."""

    def make(own, files):
        (tmp_path / "own").write_text(own, encoding="ascii")
        for path, content in files.items():
            place = tmp_path / "root" / path
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(content, encoding="ascii")
        found = partial(control_groups.groups, root=tmp_path / "root", own=tmp_path / "own")
        monkeypatch.setattr(threads, "groups", found)
        monkeypatch.setattr(memory, "groups", found)

    return make


def test_less_time_than_the_machine_has_cores(groups):
    """Half of a core counts as one, one and a half as one, and the outer group limits the inner one."""
    groups("0::/outer/inner\n", {})
    assert threads._quota() is None
    groups("0::/outer/inner\n", {"outer/inner/cpu.max": "max 100000\n", "outer/cpu.max": "150000 100000\n"})
    assert threads._quota() == 1.5
    groups("0::/outer/inner\n", {"outer/inner/cpu.max": "50000 100000\n"})
    assert threads._quota() == 0.5
    assert threads.cores() == 1


@pytest.mark.parametrize(
    ("own", "file"),
    [
        ("0::/outer/inner\n", "outer/inner/memory.max"),
        ("0::/outer/inner\n", "outer/memory.max"),
        ("4:memory:/docker/1f\n1:cpu,cpuacct:/\n0::/\n", "memory/docker/1f/memory.limit_in_bytes"),
        ("4:memory:/docker/1f\n", "memory/memory.limit_in_bytes"),  # as a container sees its own group
    ],
)
def test_less_memory_than_the_machine_has(groups, own, file):
    groups(own, {})
    assert memory.memory() == MACHINE
    groups(own, {file: "max\n"})
    assert memory.memory() == MACHINE
    groups(own, {file: f"{2**63 - 4096}\n"})
    assert memory.memory() == MACHINE
    groups(own, {file: "100000000\n"})
    assert memory.memory() == 100_000_000


def test_ulimit_counts(monkeypatch, groups):
    groups("", {})
    monkeypatch.setattr(resource, "getrlimit", lambda what: (50_000_000, resource.RLIM_INFINITY))
    assert memory.memory() == 50_000_000


def test_a_mesh_too_large_for_a_container_is_refused(groups, tmp_path):
    """It would be killed without a word in the set-up; on the machine it would fit."""
    (tmp_path / "case.toml").write_text(
        """
[case]
title = "t"
[time]
end = 1
[tank]
lower = [0, 0, 0]
upper = [4, 1, 2]
cell = "25 mm"
[[water.fill]]
lower = [0, 0, 0]
upper = [1, 1, 1]
""",
        encoding="utf-8",
    )
    groups("0::/job\n", {})
    load(tmp_path)
    groups("0::/job\n", {"job/memory.max": "500000000"})
    with pytest.raises(
        BadCase, match=r"3.07e\+06 cells of 0.025 m need about .* GB, there are 0.5 GB for it; use cells of"
    ):
        load(tmp_path)
