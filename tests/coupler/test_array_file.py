"""A checkpoint file is there as a whole or not at all, and a damaged one is never taken for a good one."""

import resource

import numpy as np
import pytest

from coupler.results.storage import DiskFull, NotFinite
from coupler.run.array_file import Damaged, read_arrays, write_arrays

ARRAYS = {
    "water/velocity": np.random.default_rng(1).normal(size=(500, 3)),
    "joints/alive": np.array([True, False, True]),
    "joints/failure_time": np.array([np.nan, 0.25, np.nan]),
    "contacts/a": np.zeros(0, np.int64),
    "time": np.array(0.1 + 0.2),
    "steps": np.array(7),
}
UNSET = ("joints/failure_time",)


@pytest.fixture
def path(tmp_path):
    write_arrays(tmp_path / "1.h5", ARRAYS, '{"case": "Grüße"}', UNSET)
    return tmp_path / "1.h5"


def test_what_is_read_is_what_was_written(path):
    """To the last bit, with type and shape; also nothing, single numbers, and NaN where it means "not yet"."""
    arrays, text = read_arrays(path)
    assert text == '{"case": "Grüße"}'
    assert set(arrays) == set(ARRAYS)
    for name, array in ARRAYS.items():
        assert arrays[name].dtype == array.dtype
        np.testing.assert_array_equal(arrays[name], array, strict=True)


def test_a_torn_file_is_reported(path):
    """Whatever length it was cut to."""
    whole = path.read_bytes()
    for size in np.linspace(0, len(whole) - 1, 25).astype(int):
        path.write_bytes(whole[:size])
        with pytest.raises(Damaged, match=r"1\.h5"):
            read_arrays(path)


def test_a_single_changed_byte_never_passes_unnoticed(path):
    """Either the file cannot be read, or its digest does not fit, or the byte was in a gap that holds nothing."""
    whole = path.read_bytes()
    noticed = 0
    for at in np.random.default_rng(2).integers(0, len(whole), 150):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x55]) + whole[at + 1 :])
        try:
            arrays, _ = read_arrays(path)
        except Damaged:
            noticed += 1
            continue
        for name, array in ARRAYS.items():
            np.testing.assert_array_equal(arrays[name], array)
    assert noticed > 75


def test_nothing_that_is_not_finite_is_written_and_what_was_there_stays(path):
    before = path.read_bytes()
    with pytest.raises(NotFinite, match="water/velocity"):
        write_arrays(path, ARRAYS | {"water/velocity": np.array([np.inf])}, "", UNSET)
    with pytest.raises(NotFinite, match="failure_time"):
        write_arrays(path, ARRAYS, "")
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


def test_a_full_disk_is_reported_and_what_was_there_stays(path):
    """A limit on the size of files stands for the disk."""
    before = path.read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, limits[1]))
    try:
        with pytest.raises(DiskFull, match="as it was before"):
            write_arrays(path, ARRAYS | {"more": np.zeros(10_000)}, "", UNSET)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


def test_what_a_killed_writer_left_is_in_nobodys_way(path):
    (path.parent / ".2.h5.part").write_bytes(b"half of a file")
    write_arrays(path.with_name("2.h5"), ARRAYS, "", UNSET)
    assert sorted(p.name for p in path.parent.iterdir()) == ["1.h5", "2.h5"]
    assert read_arrays(path.with_name("2.h5"))[1] == ""
