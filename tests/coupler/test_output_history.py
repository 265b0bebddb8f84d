"""History and crack tables: exact numbers, units beside the names, whole rows whatever happens."""

import errno

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coupler.results.cracks import write_cracks
from coupler.results.history import HistoryTable, read_history
from coupler.results.storage import DiskFull, NotFinite, WrongShape

COLUMNS = [("time", "s", "simulated time"), ("force_x", "N", "on the building, positive along x")]


@given(values=st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=20))
@settings(max_examples=50, deadline=None)
def test_numbers_come_back_bit_for_bit(tmp_path_factory, values):
    """A ledger closes to round-off; a table that rounds would hide where it stops doing so."""
    path = tmp_path_factory.mktemp("h") / "force.csv"
    with HistoryTable(path, COLUMNS) as table:
        for k, value in enumerate(values):
            table.append(time=np.float64(k), force_x=value)
    np.testing.assert_array_equal(read_history(path)["force_x"], values)


def test_header_says_unit_and_sign(tmp_path):
    """A column without its sign convention is half a column."""
    HistoryTable(tmp_path / "force.csv", COLUMNS, title="load").close()
    text = (tmp_path / "force.csv").read_text()
    assert (
        text
        == "# load\n# time [s]: simulated time\n# force_x [N]: on the building, positive along x\ntime,force_x\n"
    )
    history = read_history(tmp_path / "force.csv")
    assert (history.title, history.columns[1].unit, len(history["time"])) == ("load", "N", 0)


def test_rows_are_there_at_once_and_half_a_row_is_left_out(tmp_path):
    """Read while the run goes on, or after a kill in the middle of a row."""
    table = HistoryTable(tmp_path / "force.csv", COLUMNS)
    table.append(time=0.0, force_x=1.0)
    table.append(time=0.1, force_x=None)
    with open(tmp_path / "force.csv", "a") as file:
        file.write("0.2,12")
    history = read_history(tmp_path / "force.csv")
    np.testing.assert_array_equal(history["time"], [0.0, 0.1])
    np.testing.assert_array_equal(history["force_x"], [1.0, np.nan])


def test_text_columns_keep_commas(tmp_path):
    """The pair that limits the substep is a text."""
    with HistoryTable(
        tmp_path / "dt.csv", [*COLUMNS, ("limit", "", "pair that limits the substep")]
    ) as table:
        table.append(time=0.0, force_x=1, limit='wall_3, "roof"')
    assert read_history(tmp_path / "dt.csv")["limit"][0] == 'wall_3, "roof"'


def test_bad_numbers_and_names_are_refused(tmp_path):
    """NaN has a name and a row; a misspelt column does not vanish."""
    table = HistoryTable(tmp_path / "force.csv", COLUMNS)
    with pytest.raises(NotFinite, match="force_x is nan in row 0"):
        table.append(time=0.0, force_x=float("nan"))
    with pytest.raises(WrongShape, match=r"missing columns \['force_x'\], unknown columns \['force'\]"):
        table.append(time=0.0, force=1.0)


class FullFile:
    """A file on a disk that takes half a line and then no more."""

    def __init__(self, file):
        self.file = file

    def __getattr__(self, name):
        return getattr(self.file, name)

    def write(self, text):
        self.file.write(text[: len(text) // 2])
        self.file.flush()
        raise OSError(errno.ENOSPC, "No space left on device")


def test_full_disk_takes_back_the_half_written_row(tmp_path):
    """Rows before stay whole, and the error names the file and how many it holds."""
    table = HistoryTable(tmp_path / "force.csv", COLUMNS)
    table.append(time=0.0, force_x=1.0)
    whole = (tmp_path / "force.csv").read_bytes()
    table._file = FullFile(table._file)
    with pytest.raises(DiskFull, match=r"force.csv: no room .* readable and holds 1 rows"):
        table.append(time=0.1, force_x=123456.789)
    assert (tmp_path / "force.csv").read_bytes() == whole


def test_cracks_come_back_with_vectors_by_component(tmp_path):
    """A joint that holds has no time of failure: the cell is empty, not a made-up number."""
    joints = {"a": [0, 1], "b": [1, -1], "normal": np.eye(3)[:2], "time": [0.25, np.inf], "area": [4.0, 2.0]}
    write_cracks(tmp_path / "cracks.csv", joints)
    write_cracks(tmp_path / "cracks.csv", joints)
    back = read_history(tmp_path / "cracks.csv")
    assert [c.name for c in back.columns] == ["a", "b", "time", "area", "normal_x", "normal_y", "normal_z"]
    np.testing.assert_array_equal(back["time"], [0.25, np.nan])
    np.testing.assert_array_equal(back["b"], [1, -1])
    assert list(tmp_path.iterdir()) == [tmp_path / "cracks.csv"]


def test_unknown_or_unequal_crack_columns_are_refused(tmp_path):
    """The table has one vocabulary."""
    with pytest.raises(WrongShape, match=r"unknown columns \['dammage'\]"):
        write_cracks(tmp_path / "cracks.csv", {"dammage": [1.0]})
    with pytest.raises(WrongShape, match="rows"):
        write_cracks(tmp_path / "cracks.csv", {"a": [1], "b": [1, 2]})
    with pytest.raises(NotFinite, match="area is nan in row 1"):
        write_cracks(tmp_path / "cracks.csv", {"area": [1.0, np.nan]})
