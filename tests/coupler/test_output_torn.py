"""A writer stopped after any single write to the disk: the file must open and hold every step it had finished.

Killing a process by chance rarely hits the dangerous microseconds. Here the writes are recorded, and the file is
rebuilt after each one of them, which is every state that a SIGKILL can leave behind.
"""

import io
from contextlib import contextmanager

import h5py
import numpy as np
import pytest

from coupler.results import fields as output
from coupler.results import vtkhdf
from tests.coupler.synthetic_run import tank_mesh


class RecordedFile(io.RawIOBase):
    """A file in memory that remembers what was done to it: (position, bytes) or (length, None) for a cut."""

    def __init__(self):
        self.image, self.place, self.log = bytearray(), 0, []

    def readinto(self, buffer):
        found = self.image[self.place : self.place + len(buffer)]
        buffer[: len(found)] = found
        self.place += len(found)
        return len(found)

    def write(self, text):
        self.log.append((self.place, bytes(text)))
        replay(self.image, *self.log[-1])
        self.place += len(text)
        return len(text)

    def truncate(self, length=None):
        self.log.append((self.place if length is None else length, None))
        replay(self.image, *self.log[-1])

    def seek(self, offset, whence=io.SEEK_SET):
        self.place = offset + {io.SEEK_SET: 0, io.SEEK_CUR: self.place, io.SEEK_END: len(self.image)}[whence]
        return self.place

    def tell(self):
        return self.place

    def readable(self):
        return True

    writable = seekable = readable


def replay(image, position, text):
    """Do one recorded action to `image`."""
    end = position + len(text or b"")
    image.extend(bytes(max(0, end - len(image))))
    if text is None:
        del image[position:]
    else:
        image[position:end] = text


def assert_steps_whole(image, at_least):
    """Step k was written with values in [k, k + 1], so any mix-up of places or data shows."""
    with h5py.File(io.BytesIO(bytes(image)), "r") as file:
        root = file["VTKHDF"]
        steps = root["Steps"]
        assert vtkhdf.count(root) >= at_least
        assert len(steps["Values"]) <= steps.attrs["NSteps"]  # otherwise VTK 9.7 crashes
        for k in range(vtkhdf.count(root)):
            part, first = steps["PartOffsets"][k], steps["CellOffsets"][k, 0]
            m = root["NumberOfCells"][part]
            start = steps["CellDataOffsets/fluid_fraction"][k]
            values = root["CellData/fluid_fraction"][start : start + m]
            assert len(values) == m
            assert np.all((values >= k) & (values <= k + 1))
            ends = root["Offsets"][first + part : first + part + m + 1]
            np.testing.assert_array_equal(ends, np.arange(0, 4 * m + 1, 4))


@pytest.mark.parametrize(("steps", "checked", "changing"), [(9, 8, True), (66, 3, False)])
def test_any_torn_write_leaves_the_finished_steps(monkeypatch, steps, checked, changing):
    """A changing mesh (all arrays grow), and many steps (HDF5 rebuilds its chunk index at the 65th)."""
    file, finished = RecordedFile(), []

    @contextmanager
    def opened(path, mode="r+"):
        layout = vtkhdf.FILE_LAYOUT if mode == "w" else vtkhdf.ARRAY_LAYOUT
        with h5py.File(file, mode, libver=layout) as opened_file:
            yield opened_file

    monkeypatch.setattr(vtkhdf, "opened", opened)
    monkeypatch.setattr(output, "reserve", lambda *_: None)
    monkeypatch.setattr(vtkhdf, "claim", lambda *_: None)
    nodes, cells = tank_mesh((2.0, 2.0, 1.0), 1.0)
    writer, rng = output.WaterWriter("recorded"), np.random.default_rng(0)
    for k in range(steps):
        mine = cells[: 5 + 6 * (k % 4)] if changing else cells
        writer.append(k, nodes, mine, {}, {"fluid_fraction": k + rng.random(len(mine))})
        finished.append(len(file.log))
    image = bytearray()
    for i, action in enumerate(file.log):
        replay(image, *action)
        done = np.searchsorted(finished, i, side="right")
        if done >= steps - checked:
            assert_steps_whole(image, done)
