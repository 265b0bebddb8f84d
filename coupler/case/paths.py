"""Paths and texts named in a case. A file that is missing, is no regular file or is too large is refused before it is
opened.

A pipe would wait for a writer, a device never ends, and a file of gigabytes would exhaust the memory of the machine.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path

from coupler.program.errors import ExitCode, SurgebreakError, briefly, did_you_mean

MOST_BYTES = 64_000_000
"""Size of a text that is read whole: a million rows of a record, or of vertices of a case."""


class BadPath(SurgebreakError):
    """A path that leads nowhere, or to nothing that can be read; the message says why."""

    exit_code = ExitCode.BAD_CASE


def place_of(text: str | Path, directory: Path) -> Path:
    """Where a path of the case leads, from `directory`; ~ is a home. Whether it exists is not checked.

    Raises BadPath for a text that cannot be a file name."""
    try:
        path = (directory / Path(text).expanduser()).resolve()
        os.stat(path)
    except FileNotFoundError:
        return path
    except RuntimeError as error:  # of pathlib: a user that does not exist, links in a circle
        raise BadPath(f"{briefly(str(text))} leads nowhere: {error}") from error
    except (
        OSError,
        ValueError,
    ) as error:  # too long, links in a circle, a folder that is closed, a zero byte
        raise BadPath(f"{briefly(str(text))} is no path here: {getattr(error, 'strerror', error)}") from error
    return path


def check_file(path: Path, most: int | None = None) -> None:
    """Refuse what is not a regular file, or larger than `most` [B]. Raises BadPath with the nearest name there is."""
    try:
        there = os.stat(path)
    except FileNotFoundError as error:
        raise BadPath(f"no such file{_nearest(path)}") from error
    except (OSError, ValueError) as error:
        raise BadPath(f"cannot be read: {getattr(error, 'strerror', error)}") from error
    if not stat.S_ISREG(there.st_mode):
        what = "a directory" if stat.S_ISDIR(there.st_mode) else "a pipe, a device or a socket"
        raise BadPath(f"is {what}, not a regular file")
    if most is not None and there.st_size > most:
        raise BadPath(f"has {there.st_size / 1e6:.0f} MB; at most {most / 1e6:.0f} MB are read")


def read_text(path: Path, most: int = MOST_BYTES) -> str:
    """The text of an ordinary file, without the byte order mark that editors and tables of Windows begin UTF-8 with.
    Raises BadPath, whose message goes on after the path."""
    check_file(path, most)
    try:
        with open(path, "rb") as stream:
            content = stream.read(most + 1)
        if len(content) > most:
            raise BadPath(f"has more than {most / 1e6:.0f} MB, the largest that is read")
        return content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        raise BadPath(f"not a text in UTF-8 (byte {error.start}); save it as UTF-8") from error
    except OSError as error:
        raise BadPath(f"cannot be read: {error.strerror}") from error


def _nearest(path: Path) -> str:
    there = next((above for above in path.parents if above.is_dir()), path.parent)
    try:
        beside = [place.name for place in there.iterdir()]
    except OSError:
        return ""
    if there != path.parent:  # a folder on the way is missing
        return f"; did you mean '{path.name}'? Paths are from the directory of the case" * (
            path.name in beside
        )
    return did_you_mean(path.name, beside)


def stamp(path: str) -> tuple[int, int]:
    """Time of the last change [ns] and size [B] of a file: a change of these means that it is read again."""
    there = os.stat(path)
    return there.st_mtime_ns, there.st_size
