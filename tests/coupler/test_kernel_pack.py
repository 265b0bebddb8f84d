"""Compiled kernels in one file: what was packed here is found by an empty cache elsewhere; anything else is refused."""

import io
import json
import os
import tarfile

import pytest

from coupler.program import kernel_cache, kernel_pack
from coupler.program.kernel_pack import ABOUT, BadPack, compiled, pack, unpack

SOURCE = "fluid/cut/pieces.py"


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache, and a function that makes another one the cache."""

    def use(name):
        (tmp_path / name).mkdir(exist_ok=True)
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / name))
        kernel_cache.folder_of.cache_clear()
        return tmp_path / name

    yield use
    kernel_cache.folder_of.cache_clear()


def compile_one(place):
    folder = kernel_cache.folder_of(kernel_pack.ROOT / SOURCE, place)
    folder.mkdir(parents=True)
    (folder / "pieces.split-220.py311.nbi").write_bytes(b"index")
    (folder / "pieces.split-220.py311.1.nbc").write_bytes(b"code")


def test_another_cache_gets_what_was_packed(cache, tmp_path):
    compile_one(cache("here"))
    old = tmp_path / "here" / "fluid.cut.pieces" / ("0" * 16)  # of a source that is no more
    old.mkdir()
    (old / "pieces.split-1.py311.nbi").touch()
    assert pack(tmp_path / "kernels.tgz") == 1

    cache("there")
    assert compiled() == {}
    assert unpack(tmp_path / "kernels.tgz") == 2
    assert unpack(tmp_path / "kernels.tgz") == 0
    (folder,) = compiled().values()
    assert {path.read_bytes() for path in folder.iterdir()} == {b"index", b"code"}
    assert not (folder.parent / old.name).exists()


def test_an_empty_cache_has_nothing_to_pack(cache, tmp_path):
    cache("here")
    with pytest.raises(BadPack, match=r"no kernels of this version are in .*run a case first"):
        pack(tmp_path / "kernels.tgz")
    assert not (tmp_path / "kernels.tgz").exists()


def written(path, **members):
    with tarfile.open(path, "w:gz") as file:
        for name, content in members.items():
            entry = tarfile.TarInfo(name)
            entry.size = len(content)
            file.addfile(entry, io.BytesIO(content))
    return path


def test_kernels_of_another_numba_are_refused(cache, tmp_path):
    """They would be compiled anew in silence, after a long copy."""
    place = cache("here")
    about = json.dumps(kernel_pack._conditions() | {"numba": "0.1"}).encode()
    with pytest.raises(BadPack, match=r"kernels of numba 0\.1 \(here .*nothing was unpacked"):
        unpack(written(tmp_path / "k.tgz", **{ABOUT: about}))
    assert os.listdir(place) == []


@pytest.mark.parametrize(
    "name",
    ["../../evil.nbi", "../0123456789abcdef/x.nbi", "/tmp/evil.nbi", "fluid.cut/0123456789abcdef/x.py"],
)
def test_nothing_but_kernels_is_unpacked(cache, tmp_path, name):
    """A name that leads out of the cache would write wherever its author wants."""
    place = cache("here")
    about = json.dumps(kernel_pack._conditions()).encode()
    with pytest.raises(BadPack, match="is no kernel; nothing was unpacked"):
        unpack(written(tmp_path / "k.tgz", **{ABOUT: about, name: b"x"}))
    assert os.listdir(place) == []


def test_other_files_are_refused(cache, tmp_path):
    cache("here")
    (tmp_path / "a.tgz").write_bytes(b"no archive")
    for file in (tmp_path / "a.tgz", tmp_path / "none.tgz", written(tmp_path / "b.tgz", x=b"y")):
        with pytest.raises(BadPack, match="not a file of kernels"):
            unpack(file)
