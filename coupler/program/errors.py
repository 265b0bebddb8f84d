"""What can go wrong, each with its exit code; the message says what, where, which value and what to do."""

from __future__ import annotations

import difflib
import errno
import reprlib
from collections.abc import Iterable
from enum import IntEnum

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Error numbers (errno) that mean that there is no room, for this user or in this file."""


class ExitCode(IntEnum):
    """Exit codes of the commands."""

    DONE = 0
    CRASHED = 1
    BAD_CASE = 2
    DIVERGED = 3
    STOPPED = 4


class SurgebreakError(Exception):
    """Base of the errors whose message is all that the user needs; no traceback is shown."""

    exit_code = ExitCode.CRASHED


class BadCase(SurgebreakError):
    """The case cannot be run as written; the message has one line for each fault found."""

    exit_code = ExitCode.BAD_CASE

    def __init__(self, lines: Iterable[str]) -> None:
        self.lines = list(lines)
        super().__init__("\n".join(self.lines))


class BadCall(BadCase):
    """The words after the command cannot be used, whatever the case is; the message has one line for each fault."""


class UnknownName(SurgebreakError):
    """A name that no case file knows was asked for."""

    exit_code = ExitCode.BAD_CASE


class UnitError(ValueError):
    """A value whose unit is missing, unknown or of another dimension."""


class RunDirectoryExists(SurgebreakError):
    """The directory for the results exists already; results are never overwritten."""

    exit_code = ExitCode.BAD_CASE


class NoRun(SurgebreakError):
    """A directory was named that holds no run."""

    exit_code = ExitCode.BAD_CASE


class CannotWrite(SurgebreakError):
    """The directory for the results cannot be made."""

    exit_code = ExitCode.BAD_CASE


class _Briefly(reprlib.Repr):
    """Values as they were written, shortened where they are long, so that messages stay readable."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = 80
        self.maxlist = self.maxtuple = self.maxdict = 8
        self.maxlevel = 4

    def repr_int(self, value: int, level: int) -> str:
        """A whole number, or how many digits it has where these are many."""
        digits = int(value.bit_length() * 0.30103) + 1
        return repr(value) if digits <= 60 else f"a whole number of about {digits} digits"


briefly = _Briefly().repr
"""A value as it was written, shortened where it is long, so that messages stay readable."""


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """'; did you mean ...?' with the nearest known name, or nothing when none is near."""
    near = difflib.get_close_matches(name, list(known), n=1, cutoff=0.6)
    return f"; did you mean '{near[0]}'?" if near else ""
