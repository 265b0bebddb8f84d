"""Compiled kernels need a folder: the home, else one among the temporary files, else a word about it."""

import os
import tempfile
from pathlib import Path

import pytest

from coupler.kernel_cache import NoCache, use_kernel_cache


@pytest.fixture
def places(tmp_path, monkeypatch):
    """A home and a folder for temporary files, and no cache named."""
    for name in ("home", "temporary"):
        (tmp_path / name).mkdir()
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    return tmp_path


def chosen(monkeypatch):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    use_kernel_cache()
    return Path(os.environ["NUMBA_CACHE_DIR"])


def test_the_cache_is_below_the_home(places, monkeypatch, capsys):
    place = chosen(monkeypatch)
    assert place.is_relative_to(places / "home" / ".cache" / "surgebreak")
    assert place.is_dir()
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("home", ["a file", "/proc/nothing"])
def test_where_the_home_cannot_be_written_it_is_among_the_temporary_files(places, monkeypatch, capsys, home):
    """Services and containers have such homes; numba would only say that it has no locator."""
    (places / "a file").touch()
    monkeypatch.setenv("HOME", str(places / home))
    place = chosen(monkeypatch)
    assert place.is_relative_to(places / "temporary" / f"surgebreak-{os.getuid()}")
    assert (places / "temporary" / f"surgebreak-{os.getuid()}").stat().st_mode & 0o077 == 0
    assert "compiled kernels are kept in" in capsys.readouterr().err


def test_a_folder_that_somebody_else_prepared_is_not_used(places, monkeypatch):
    """Whoever owns it could put code there that would be run."""
    monkeypatch.setenv("HOME", "/proc/nothing")
    (places / "temporary" / f"surgebreak-{os.getuid()}").mkdir()
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    (places / "temporary" / "surgebreak-12345").mkdir()
    with pytest.raises(NoCache, match=r"compiled kernels can be kept nowhere .*XDG_CACHE_HOME=DIR"):
        chosen(monkeypatch)
