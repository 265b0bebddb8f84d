"""Compiled kernels need a folder: the home, else one among the temporary files, else a word about it.

In it each module has one folder for each state of its source and of what it imports.
"""

import ast
import os
import re
import tempfile
from pathlib import Path

import pytest

from coupler.program import kernel_cache
from coupler.program.kernel_cache import KEPT, ByContent, NoCache, use_kernel_cache, without_words


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
        forget()
        return lambda file: ByContent.from_function(None, str(root / file)).get_cache_path()

    yield make
    forget()


def forget():
    """What was read of files that have changed since."""
    for kept in (kernel_cache.folder_of, kernel_cache._imports, kernel_cache._code):
        kept.cache_clear()


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
    folder = checkout("here", **{edited: SOURCES[edited] + "edited = 1\n"})
    assert {file for file in kernels if folder(file) != before[file]} == anew


def test_a_kernel_of_a_test_is_compiled_anew_with_what_it_calls(checkout):
    """Kept by the test's own file alone, `squared_distance` could be made wrong, and the tests that call it from a
    kernel of their own passed with the code from before, wherever they had run once."""
    own = {"tests/fluid/test_signs.py": "from fluid.signs import plus\n"}
    before = checkout("here", **own)("tests/fluid/test_signs.py")
    assert checkout("here", **own)("tests/fluid/test_signs.py") == before
    changed = own | {"fluid/signs.py": "edited = 1\n"}
    assert checkout("here", **changed)("tests/fluid/test_signs.py") != before


KERNELS = '''\
"""Sums."""

LABEL = """from fluid import parts"""


@kernel
def total(values):
    """The sum of all values."""
    s = 0.0
    # from the first to the last
    for v in values:
        s += v  # in place
    return s
'''


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"""Sums."""', '"""Sums of\n\nmany "numbers", it\'s said (all of them.\n"""'),
        ('"""Sums."""\n', ""),
        ('    """The sum of all values."""\n', ""),
        ("The sum of all values.", "The sum [m]; see\n    from fluid import parts\n    "),
        ("# from the first to the last", '# from one "end [\n\n    # to the other'),
        ("  # in place", ""),
        ("return s\n", "return s\n\n\n# the end"),
    ],
)
def test_words_compile_nothing(checkout, old, new):
    assert old in KERNELS
    folder = checkout("here", **{"fluid/signs.py": KERNELS})
    before = folder("fluid/edges.py"), folder("fluid/signs.py")
    folder = checkout("here", **{"fluid/signs.py": KERNELS.replace(old, new)})
    assert (folder("fluid/edges.py"), folder("fluid/signs.py")) == before


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("s += v", "s -= v"),
        ('LABEL = """from', 'LABEL = """From'),
        ('LABEL = """from fluid import parts"""', 'LABEL = (\n"""from fluid import parts"""\n)'),
        ('LABEL = """from fluid import parts"""', 'LABEL = \\\n"""from fluid import part"""'),
        ("        s += v", "    s += v"),
        ("    for v in values:", "    s = '#'\n    for v in values:"),
    ],
)
def test_code_that_looks_like_words_counts(checkout, old, new):
    assert old in KERNELS
    before = checkout("here", **{"fluid/signs.py": KERNELS})("fluid/edges.py")
    assert checkout("here", **{"fluid/signs.py": KERNELS.replace(old, new)})("fluid/edges.py") != before


def test_what_is_left_of_the_program_without_words_is_the_same_program():
    """Judged by Python's own parser, for all files of the packages that have kernels."""
    files = [file for room in kernel_cache.ROOMS for file in (kernel_cache.ROOT / room).rglob("*.py")]
    with_kernels = [file for file in files if "kernels.decorators import" in file.read_text()]
    assert len(with_kernels) > 50
    for file in with_kernels:
        text = file.read_text()
        left = without_words(text)
        assert len(left) < len(text)
        assert meaning(EMPTY.sub(r"\1\2\n\1    pass\n", left)) == meaning(text), file


EMPTY = re.compile(r"^( *)(class .*:)\n(?!\1 )", re.MULTILINE)
"""A class of which nothing but a docstring was there."""


def meaning(source):
    """The syntax tree of a program without `pass`, docstrings and other strings that stand alone."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [line for line in body if not (is_words(line) or isinstance(line, ast.Pass))]
    return ast.dump(tree)


def is_words(line):
    return (
        isinstance(line, ast.Expr)
        and isinstance(line.value, ast.Constant)
        and isinstance(line.value.value, str)
    )


def test_checkouts_with_the_same_sources_share_their_kernels(checkout):
    assert checkout("here")("fluid/edges.py") == checkout("there")("fluid/edges.py")


def test_files_elsewhere_are_left_to_numba(checkout, tmp_path):
    checkout("here")
    assert ByContent.from_function(None, str(tmp_path / "law.py")) is None
    assert ByContent.from_function(None, str(tmp_path / "here" / "cases" / "law.py")) is None


def test_old_states_are_dropped(checkout, tmp_path):
    for number in range(KEPT + 3):
        checkout("here", **{"fluid/edges.py": f"number = {number}\n"})
        kept = ByContent.from_function(None, str(tmp_path / "here" / "fluid" / "edges.py"))
        kept.ensure_cache_path()
        os.utime(kept.get_cache_path(), (number, number))
    assert len(list((tmp_path / "kernels" / "fluid.edges").iterdir())) == KEPT
    assert Path(kept.get_cache_path()).is_dir()
