"""One process per run directory: the process that runs or resumes there holds a lock, which the system releases when
it dies.

The lock is an flock on log.txt, which every run has; no separate lock file is left behind, and the lock of a killed
process blocks no other one.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import weakref
from pathlib import Path

from coupler.program.errors import ExitCode, SurgebreakError

HELD = (errno.EAGAIN, errno.EACCES)
LOG = "log.txt"
NO_LOCKS = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS)
"""Error numbers (errno) of file systems without locks."""


class Busy(SurgebreakError):
    """Another process runs in the directory."""

    exit_code = ExitCode.BAD_CASE


class FileLock:
    """Holds a file until `release`, or until this process and those forked from it end in any way."""

    def __init__(self, file: Path, busy: str):
        """busy: the message of `Busy`, raised where another process holds the file. `known` is False where the file
        system has no locks."""
        handle = os.open(file, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
        self._close = weakref.finalize(self, os.close, handle)
        self.known = True
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno in HELD:
                self._close()
                raise Busy(busy) from error
            if error.errno not in NO_LOCKS:
                raise
            self.known = False

    def release(self) -> None:
        """Release the file for other processes; may be called twice."""
        with contextlib.suppress(OSError):
            self._close()


class RunLock(FileLock):
    """Holds a run directory."""

    def __init__(self, path: Path):
        super().__init__(
            path / LOG,
            f"{path}: another process runs or resumes it at this moment; wait for its end, or end it with Ctrl-C or "
            f"`touch {path / 'stop'}`",
        )
