"""The doctor tries every part for real; here its answers on this machine and its judgement of what is broken."""

import pytest

from coupler.commands import doctor

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
