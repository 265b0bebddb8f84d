"""Compiled kernels need a folder: the home, else one among the temporary files, else a word about it.

In it each module has one folder for each state of its source and of what it imports.
"""

import os
import tempfile
from pathlib import Path

import pytest

from coupler.program import kernel_cache
from coupler.program.kernel_cache import KEPT, ByContent, NoCache, use_kernel_cache


@pytest.fixture
def places(tmp_path, monkeypatch):
    """A home and a folder for temporary files, and no cache named."""
    for name in ("home", "temporary"):
        (tmp_path / name).mkdir()
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("NUMBA_CACHE_LOCATOR_CLASSES", "")  # so that what is set is undone
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


SOURCES = {
    "fluid/edges.py": "from fluid.signs import (\n    plus,\n    minus,\n)\nimport numpy\n",
    "fluid/signs.py": "from fluid import edges, parts\n",
    "fluid/parts/__init__.py": "",
    "fluid/parts/halves.py": "",
    "fluid/levels.py": "from fluid.parts import halves\n",
    "coupler/levels.py": "",
}


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """Makes a checkout with SOURCES, in which the cache then looks, and gives a function: file -> folder."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))

    def make(name, **edited):
        root = tmp_path / name
        for file, text in (SOURCES | edited).items():
            (root / file).parent.mkdir(parents=True, exist_ok=True)
            (root / file).write_text(text)
        monkeypatch.setattr(kernel_cache, "ROOT", root)
        kernel_cache.folder_of.cache_clear()
        kernel_cache._imports.cache_clear()
        return lambda file: ByContent.from_function(None, str(root / file)).get_cache_path()

    yield make
    kernel_cache.folder_of.cache_clear()
    kernel_cache._imports.cache_clear()


@pytest.mark.parametrize(
    ("edited", "anew"),
    [
        ("fluid/edges.py", {"fluid/edges.py", "fluid/signs.py"}),  # the two import one another
        ("fluid/signs.py", {"fluid/edges.py", "fluid/signs.py"}),
        (
            "fluid/parts/__init__.py",
            {"fluid/edges.py", "fluid/signs.py", "fluid/levels.py", "fluid/parts/__init__.py"},
        ),
        ("fluid/parts/halves.py", {"fluid/levels.py", "fluid/parts/halves.py"}),
        ("coupler/levels.py", set()),
    ],
)
def test_an_edit_compiles_again_what_imports_it_and_nothing_else(checkout, edited, anew):
    """A kernel has the code of the kernels that it calls in it: with the old one of these it would be wrong."""
    kernels = [file for file in SOURCES if file.startswith("fluid")]
    folder = checkout("here")
    before = {file: folder(file) for file in kernels}
    folder = checkout("here", **{edited: SOURCES[edited] + "# edited\n"})
    assert {file for file in kernels if folder(file) != before[file]} == anew


def test_checkouts_with_the_same_sources_share_their_kernels(checkout):
    assert checkout("here")("fluid/edges.py") == checkout("there")("fluid/edges.py")


def test_files_elsewhere_are_left_to_numba(checkout, tmp_path):
    checkout("here")
    assert ByContent.from_function(None, str(tmp_path / "law.py")) is None
    assert ByContent.from_function(None, str(tmp_path / "here" / "cases" / "law.py")) is None


def test_old_states_are_dropped(checkout, tmp_path):
    for number in range(KEPT + 3):
        checkout("here", **{"fluid/edges.py": f"# {number}\n"})
        kept = ByContent.from_function(None, str(tmp_path / "here" / "fluid" / "edges.py"))
        kept.ensure_cache_path()
        os.utime(kept.get_cache_path(), (number, number))
    assert len(list((tmp_path / "kernels" / "fluid.edges").iterdir())) == KEPT
    assert Path(kept.get_cache_path()).is_dir()
