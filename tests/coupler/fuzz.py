"""Input that is wrong at random: cases, overrides, records, meshes and run directories, each the same for a seed.

Whatever is read must be taken, or refused with a message and exit code 2, within SLOWEST seconds of the processor.
"""

from __future__ import annotations

import contextlib
import copy
import json
import random
import shutil
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from coupler.program.errors import BadCase, ExitCode

SLOWEST = 20.0
"""Processor time [s] after which a refusal comes too late."""
LONGEST = 40_000
"""Characters of a message that somebody may still read."""

VALUES: list[object] = [
    0, -1, 1, 2, 3, 1e-9, 1e9, 1e-30, 1e30, 1e300, -1e300, 5e-324, -0.0, float("nan"), float("inf"), float("-inf"),
    10**400, 2**31, 2**63, 2**64, True, False, "", " ", "x", "x" * 300, "1", "-1", "1 m", "1 mm", "1e400 m", "1 parsec",
    "5 m/s", "2 kg/m3", "30 deg", "1 MPa", "1 km^99", "ä", "../..", "/", "/dev/zero", "~nosuchuser/x", "~", "a\0b", ".",
    "9**9**9**9", "time.end", "x-", "z+", "polyhedra", [], [[]], {}, [0, 0, 0], [1, 1, 1], [1e9, 1e9, 1e9], [1, 2],
    [0, 0, 1e-12], ["a", "b"], ["1 m", "1 s", "1 kg"], [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 0, 0]] * 4,
    {"axis": [0, 0, 1], "angle": 1}, {"kind": "steady"}, [{}], [{"name": "a"}],
]  # fmt: skip
"""What somebody might write anywhere."""


class TooSlow(Exception):
    """An input was neither taken nor refused in time."""


@contextlib.contextmanager
def in_time() -> Iterator[None]:
    """Raises TooSlow after SLOWEST seconds of processor time."""

    def enough(number, frame):
        raise TooSlow

    before = signal.signal(signal.SIGVTALRM, enough)
    signal.setitimer(signal.ITIMER_VIRTUAL, SLOWEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)


def verdict(use: Callable[[], object]) -> str:
    """ "taken" or "refused". Raises what no user should see: anything but a message with exit code 2, or TooSlow."""
    try:
        with in_time():
            use()
    except Exception as error:
        lines = error.lines if isinstance(error, BadCase) else [str(error)]
        if getattr(error, "exit_code", None) != ExitCode.BAD_CASE:
            raise
        assert all(lines), "a refusal without a word"
        assert sum(map(len, lines)) < LONGEST, "a refusal that nobody reads"
        return "refused"
    return "taken"


# ---------------------------------------------------------------- cases


def toml(value: object) -> str:
    """A value of TOML; tables are written inline."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(name)} = {toml(inner)}" for name, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return str(value).lower() if isinstance(value, bool | float) else str(value)


def document(table: dict) -> str:
    """A case file of a table."""
    return "".join(f"{name} = {toml(value)}\n" for name, value in table.items())


def places(value: object, path: tuple = ()) -> list[tuple]:
    """Every place in a table, the deepest ones too."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [found for key, held in inner for found in ((*path, key), *places(held, (*path, key)))]


def mutated_table(table: dict, rng: random.Random) -> dict:
    """One to three places changed: left out, replaced, scaled, copied, renamed or doubled."""
    table = copy.deepcopy(table)
    for _ in range(rng.choice((1, 1, 2, 3))):
        found = places(table)
        if found:
            _change(table, rng.choice(found), rng.choice(found), rng)
    return table


def _change(table: dict, path: tuple, other: tuple, rng: random.Random) -> None:
    *above, key = path
    holder = _held(table, above)
    how = rng.random()
    if how < 0.15:
        del holder[key]
    elif how < 0.55:
        holder[key] = copy.deepcopy(rng.choice(VALUES))
    elif how < 0.75 and isinstance(holder[key], int | float):
        holder[key] *= rng.choice((-1, 0.1, 10, 10.0 ** rng.randint(-14, 14)))
    elif how < 0.85:
        holder[key] = copy.deepcopy(_held(table, other))
    elif isinstance(holder, dict):
        holder[str(key)[::-1] if rng.random() < 0.5 else f"{key}s"] = holder.pop(key)
    else:
        holder.append(copy.deepcopy(holder[key]))


def _held(table: dict, path) -> object:
    for key in path:
        table = table[key]
    return table


def torn(content: bytes, rng: random.Random) -> bytes:
    """Cut, with some bytes changed, a piece doubled, or a number made large."""
    data, how = bytearray(content), rng.random()
    if not data:
        return bytes(rng.randbytes(8))
    at = rng.randrange(len(data))
    if how < 0.3:
        del data[at:]
    elif how < 0.6:
        for _ in range(rng.randint(1, 8)):
            data[rng.randrange(len(data))] = rng.randrange(256)
    elif how < 0.8:
        data[at:at] = rng.choice(
            (b"99999999999", b"-1", b"nan", b"1e400", b"\0", b"\xff\xfe", b"\n", b",", b"[[[[", b'"""')
        )
    else:
        data[at:at] = data[max(0, at - 40) : at]
    return bytes(data)


def override(table: dict, rng: random.Random) -> str:
    """KEY=VALUE of a place in the table, now and then one that is none."""
    key = ""
    for part in rng.choice(places(table)):
        key += f"[{part}]" if isinstance(part, int) else f".{part}" if key else part
    if rng.random() < 0.2:
        key = torn(key.encode(), rng).decode(errors="surrogateescape")
    value = (
        toml(rng.choice(VALUES)) if rng.random() < 0.7 else rng.choice(("absent", "", "=", "[", "1 m", "{"))
    )
    return f"{key}={value}"


# ---------------------------------------------------------------- run directories


def spoil(run: Path, rng: random.Random) -> str:
    """Change one file of a run directory; what was done, for the message of a failure."""
    files = sorted(path for path in run.rglob("*") if path.is_file())
    path, other = rng.choice(files), rng.choice(files)
    how = rng.choice(("torn", "edited", "gone", "folder", "swapped", "empty"))
    content = path.read_bytes()
    if how == "torn" or (how == "edited" and path.suffix not in (".json", ".toml")):
        path.write_bytes(torn(content, rng))
    elif how == "edited":
        edit(path, rng)
    elif how == "swapped":
        path.write_bytes(other.read_bytes())
    elif how == "empty":
        path.write_bytes(b"")
    else:
        path.unlink()
        if how == "folder":
            path.mkdir()
    return f"{how}: {path.relative_to(run)} ({other.name})"


def edit(path: Path, rng: random.Random) -> None:
    """A value of a JSON file replaced; a text torn."""
    if path.suffix != ".json":
        path.write_bytes(torn(path.read_bytes(), rng))
        return
    found = mutated_table(json.loads(path.read_text(encoding="utf-8")), rng)
    path.write_text(json.dumps(found), encoding="utf-8")


def fresh(source: Path, target: Path) -> Path:
    """A copy of a run directory in the place of the one before."""
    shutil.rmtree(target, ignore_errors=True)
    return shutil.copytree(source, target)


def spent() -> float:
    """Processor time of this process [s]."""
    return time.process_time()


def write(folder: Path, content: bytes | str) -> Path:
    """The case file of a folder."""
    path = folder / "case.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass"))
    return folder
