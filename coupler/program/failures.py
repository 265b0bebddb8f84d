"""The exit of a command after an error: its exit code, and the messages to the user and the log.

Errors of this program carry a complete message. A full disk is reported as such. Any other exception is a fault of the
program, whose traceback goes to the log (or to standard error without a run).
"""

from __future__ import annotations

import errno
import resource
import sys
import traceback
from dataclasses import dataclass
from types import TracebackType

from coupler.program import terminal
from coupler.program.errors import FULL, BadCall, BadCase, ExitCode

OURS = ("coupler", "fluid", "yade_scripts")
CLOSED = (errno.EACCES, errno.EPERM, errno.EROFS)
"""Error numbers (errno) that mean that this user has no permission."""
NO_MEMORY = ("cannot allocate memory", "failed to map segment", "not enough memory")
"""Messages of the dynamic loader when memory is short, in lower case."""


@dataclass(frozen=True)
class Failure:
    """The exit code, the message, and the traceback if the program itself is at fault."""

    exit_code: ExitCode
    message: str
    traceback: str = ""

    @classmethod
    def of(cls, error: BaseException) -> Failure:
        """The Failure that an exception means for the user."""
        if isinstance(error, KeyboardInterrupt):
            return cls(
                ExitCode.STOPPED, "stopped at once by Ctrl-C; the last written state and checkpoint are sound"
            )
        if isinstance(error, BrokenPipeError):
            return cls(
                ExitCode.STOPPED, "nobody reads the output any more (a pipe to `head`, for instance); stopped"
            )
        if isinstance(error, OSError) and error.errno in FULL:
            return cls(ExitCode.STOPPED, _full(error))
        if isinstance(error, OSError) and error.errno in CLOSED:
            return cls(ExitCode.BAD_CASE, _closed(error))
        if out_of_memory(error):
            return cls(ExitCode.STOPPED, _memory(error))
        code = getattr(error, "exit_code", None)
        if code is None and type(error).__module__.split(".")[0] in OURS:
            code = ExitCode.DIVERGED if isinstance(error, ArithmeticError) else ExitCode.CRASHED
        if code is not None:
            return cls(ExitCode(code), str(error))
        trace = "".join(traceback.format_exception(error))
        return cls(ExitCode.CRASHED, f"unexpected {type(error).__name__}: {error}", trace)


def _full(error: OSError) -> str:
    if type(error).__module__.split(".")[0] in OURS:
        return str(error)
    place = f"{error.filename}: " if error.filename else ""
    return (
        f"{place}no room for the results ({error.strerror or error}); what was written before is readable; "
        "free some space, give --output a larger disk, or raise time.output_every"
    )


def _closed(error: OSError) -> str:
    place = f"{error.filename}: " if error.filename else ""
    return f"{place}{error.strerror}; name a place that you may read and write"


def out_of_memory(error: BaseException | None) -> bool:
    """Whether an error or its cause is a lack of memory, which libraries report in different ways."""
    if error is None:
        return False
    if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM:
        return True
    if isinstance(error, ImportError | OSError):
        library = any(words in str(error).lower() for words in NO_MEMORY)
        return library or out_of_memory(error.__cause__ or error.__context__)
    return out_of_memory(error.__cause__)


def _memory(error: BaseException) -> str:
    most, _ = resource.getrlimit(resource.RLIMIT_AS)
    limit = (
        "" if most == resource.RLIM_INFINITY else f"; this process may take {most / 1e6:.0f} MB (ulimit -v)"
    )
    while (inner := error.__cause__ or error.__context__) and not isinstance(error, MemoryError):
        error = inner
    return (
        f"there is not enough memory ({str(error) or type(error).__name__}){limit}. What was written before is "
        "readable; `surgebreak check CASE` tells what a case needs: use a larger tank.cell, fewer blocks, or another "
        "machine"
    )


class Failures:
    """A context around a command: reports an error and exits with its code."""

    def __enter__(self) -> Failures:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, _: TracebackType | None) -> None:
        if not isinstance(error, Exception | KeyboardInterrupt) or _is_click(error):
            return
        failure = Failure.of(error)
        if isinstance(error, BadCase):
            _tell_mistakes(error)
        else:
            terminal.error(failure.message)
        log = getattr(error, "log_path", None)
        if failure.traceback and log is None:
            terminal.error(failure.traceback)
        elif failure.traceback:
            terminal.error(f"the traceback is in {log}")
        if log is not None:
            terminal.error(f"results so far in {log.parent}")
        raise SystemExit(int(failure.exit_code)) from None


def _tell_mistakes(error: BadCase) -> None:
    """Print one line for each mistake, beginning with the place as compilers do, which editors recognise."""
    lines = error.lines
    for line in lines:
        print(line, file=sys.stderr)
    count = "1 mistake" if len(lines) == 1 else f"{len(lines)} mistakes"
    where = "call" if isinstance(error, BadCall) else "case"
    terminal.error(f"{count} in the {where}; nothing was run")


def _is_click(error: BaseException) -> bool:
    """Whether the command line library reports the error itself (wrong options, early exits)."""
    return type(error).__module__.split(".")[0] in ("click", "typer")
