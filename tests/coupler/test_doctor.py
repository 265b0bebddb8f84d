"""The doctor tries every part for real; here its answers on this machine and its judgement of what is broken."""

import pytest

from coupler.commands.doctor import command as doctor

pytestmark = pytest.mark.before_yade


def test_all_parts_work_here(capsys):
    assert doctor.examine() == 0
    assert capsys.readouterr().out.count("ok   ") == len(doctor.CHECKS)


def test_a_failure_comes_with_its_remedy(monkeypatch, capsys):
    broken = doctor.Finding("YADE", "not usable", False, "apt install yade")
    monkeypatch.setattr(doctor, "CHECKS", (lambda: broken,))
    assert doctor.examine() == 1
    reported = capsys.readouterr().out
    assert "BAD  YADE" in reported
    assert "-> apt install yade" in reported


@pytest.mark.parametrize(
    ("code", "says"), [("import os; os.abort()", "crashed with signal 6"), ("1 / 0", "ZeroDivisionError")]
)
def test_a_crash_in_another_process_is_a_finding(code, says):
    """VTK and YADE can end a process with a signal; the doctor must survive that."""
    status, reported = doctor._in_process(code)
    assert status != 0
    assert says in doctor._last(reported)


def test_yade_not_found_is_reported_with_the_way_out(monkeypatch, tmp_path):
    from yade_scripts.yade_side import engine

    monkeypatch.setattr(engine, "PACKAGED", (str(tmp_path / "nowhere"),))
    finding = doctor._yade()
    assert not finding.good
    assert "apt install yade" in finding.remedy


def test_the_wrong_yade_package_is_reported(monkeypatch, tmp_path):
    """Another project on the package index is called yade; it must be named, not imported."""
    from yade_scripts.yade_side import engine

    (tmp_path / "yade").mkdir()
    (tmp_path / "yade" / "__init__.py").write_text("", encoding="utf-8")
    monkeypatch.setattr(engine, "PACKAGED", (str(tmp_path / "nowhere"),))
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(__import__("sys").modules, "yade", raising=False)
    finding = doctor._yade()
    assert not finding.good
    assert "is not the discrete element code" in finding.remedy


# ---------------------------------------------------------------- what it mends


def kernels_in(place, *names, content=b"\x80\x04K\x01."):
    """Files as numba writes them: pickles, which end with a full stop."""
    for name in names:
        path = place / "fluid.cut" / "0123" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return path


@pytest.fixture
def place(tmp_path, monkeypatch):
    kernels_in(tmp_path, "a.nbi", "a.1.nbc")
    kernels_in(tmp_path / "other", "b.nbi")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(doctor, "CHECKS", (doctor._kernels,))
    return tmp_path


@pytest.mark.parametrize("torn", [b"", b"\x80\x04K"])
def test_torn_kernels_are_found_and_removed(place, torn, capsys):
    """Cut off at a full disk. The folder of their module goes, others stay, and all is well after that."""
    assert doctor.examine() == 0
    path = kernels_in(place, "a.2.nbc", content=torn)
    assert doctor.examine() == 1
    assert f"cut off: {path}" in capsys.readouterr().out
    assert path.exists(), "nothing is removed unless it is asked for"
    assert doctor.examine(mending=True) == 0
    reported = capsys.readouterr().out
    assert "removed 1 folders" in reported
    assert not path.parent.exists()
    assert (place / "other" / "fluid.cut" / "0123" / "b.nbi").exists()


def test_folders_that_were_locked_are_opened_again(place, capsys):
    """A cache that was copied read-only. Root may write anywhere, so the mode itself is looked at."""
    folder = place / "fluid.cut"
    folder.chmod(0o500)
    (folder / "0123" / "a.nbi").chmod(0o400)
    assert doctor.examine() == 1
    assert "chmod -R u+rwX" in capsys.readouterr().out
    assert doctor.examine(mending=True) == 0
    assert folder.stat().st_mode & 0o700 == 0o700
    assert (folder / "0123" / "a.nbi").stat().st_mode & 0o600 == 0o600


def test_missing_packages_are_installed_with_the_pins_and_only_in_a_virtual_environment(monkeypatch, capsys):
    from coupler.commands.doctor import mend

    called = []

    def run(command, **_):
        called.append(command)
        return doctor.subprocess.CompletedProcess(command, 0, "", "")

    found = iter([False, True])
    monkeypatch.setattr(mend.subprocess, "run", run)
    monkeypatch.setattr(
        doctor, "CHECKS",
        (lambda: doctor.Finding("packages", "missing: pint", next(found), "pip", doctor._installer(["pint"])),),
    )  # fmt: skip
    monkeypatch.setattr(mend, "can_install", lambda: True)
    assert doctor.examine(mending=True) == 0
    assert called[0][1:6] == ["-m", "pip", "install", "--quiet", "pint"]
    assert called[0][-2] == "-c"
    monkeypatch.setattr(mend, "can_install", lambda: False)
    assert doctor._installer(["pint"]) is None


@pytest.mark.parametrize("harm", ["cut", "gone"])
def test_a_damaged_package_is_found_and_fetched_again(harm, tmp_path, monkeypatch, capsys):
    """A file of a package that was cut off or lost: pip itself takes the package to be there."""
    from coupler.commands.doctor import mend

    place, called = tmp_path / "lib", []
    (place / "some-1.0.dist-info").mkdir(parents=True)
    (place / "some-1.0.dist-info" / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: some\nVersion: 1.0\n"
    )
    (place / "some-1.0.dist-info" / "RECORD").write_text("some.py,sha256=x,5\nsome-1.0.dist-info/RECORD,,\n")
    (place / "some.py").write_text("a = 1")
    monkeypatch.setattr(mend.sys, "prefix", str(tmp_path))
    monkeypatch.setattr(mend.sys, "path", [*mend.sys.path, str(place)])
    assert mend.damaged() == {}
    if harm == "cut":
        (place / "some.py").write_text("a")
    else:
        (place / "some.py").unlink()

    def run(command, **_):
        called.append(command)
        (place / "some.py").write_text("a = 1")
        return doctor.subprocess.CompletedProcess(command, 0, "", "")

    monkeypatch.setattr(mend.subprocess, "run", run)
    monkeypatch.setattr(mend, "can_install", lambda: True)
    monkeypatch.setattr(doctor, "CHECKS", (doctor._packages,))
    assert doctor.examine() == 1
    assert "damaged: some (some.py is not as it was installed)" in capsys.readouterr().out
    assert doctor.examine(mending=True) == 0
    assert called[0][4:8] == ["--quiet", "some", "--force-reinstall", "--no-deps"]


def test_a_remedy_that_fails_leaves_the_finding_bad(monkeypatch, capsys):
    def fail():
        raise OSError("pip: no network")

    monkeypatch.setattr(
        doctor, "CHECKS", (lambda: doctor.Finding("packages", "missing", False, "pip", fail),)
    )
    assert doctor.examine(mending=True) == 1
    assert "not mended: pip: no network" in capsys.readouterr().out
