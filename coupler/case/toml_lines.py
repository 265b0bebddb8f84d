"""Line numbers of the keys of a TOML text: key path -> line number.

A path is a tuple of names and list indices, ("structure", "block", 1, "size"). The text must be valid TOML, because
tomllib has read it before; the scan may therefore be simpler than a parser.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from typing import cast

Path = tuple[str | int, ...]

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_STRING = re.compile(r'"""(?:\\.|[^\\])*?"""|\'\'\'.*?\'\'\'|"(?:\\.|[^"\\])*"|\'[^\']*\'', re.DOTALL)
_SKIP = re.compile(r"(?:[ \t\r\n]+|#[^\n]*)+")
_BLANK = re.compile(r"[ \t]+")


def key_lines(text: str) -> dict[Path, int]:
    """Line (from 1) of every table header and every key, inline tables included."""
    return _Scan(text).run()


def line_of(path: Path, lines: dict[Path, int]) -> int | None:
    """Line of the longest known beginning of a path; None when not even its first name is there."""
    for length in range(len(path), 0, -1):
        if path[:length] in lines:
            return lines[path[:length]]
    return None


def shown(path: Path) -> str:
    """("structure", "block", 1, "size") -> "structure.block[1].size"."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).lstrip(".")


class _Scan:
    """One pass over the characters of a TOML text."""

    def __init__(self, text: str):
        self.text, self.at = text, 0
        self.ends = [found.start() for found in re.finditer("\n", text)]
        self.lines: dict[Path, int] = {}
        self.count: dict[Path, int] = {}

    def run(self) -> dict[Path, int]:
        """The line, counted from 1, of every key of the text."""
        table: Path = ()
        while self._skip():
            if self.text[self.at] == "[":
                table = self._header()
            else:
                self._pair(table)
        return self.lines

    def _skip(self, pattern: re.Pattern = _SKIP) -> bool:
        """Go over blanks and comments; False at the end of the text."""
        match = pattern.match(self.text, self.at)
        if match:
            self.at = match.end()
        return self.at < len(self.text)

    def _note(self, path: Path) -> None:
        self.lines.setdefault(path, bisect_left(self.ends, self.at) + 1)

    def _key(self) -> tuple[str, ...]:
        """A dotted key, bare or quoted."""
        names = []
        while True:
            self._skip(_BLANK)
            quoted = _STRING.match(self.text, self.at)
            match = cast("re.Match[str]", quoted or _BARE.match(self.text, self.at))  # tomllib has read it
            names.append(match[0][1:-1] if quoted else match[0])
            self.at = match.end()
            self._skip(_BLANK)
            if self.at >= len(self.text) or self.text[self.at] != ".":
                return tuple(names)
            self.at += 1

    def _placed(self, names: tuple[str, ...]) -> Path:
        """A path of names with the place of the last table in every list of tables it passes through."""
        path: Path = ()
        for name in names:
            path += (name,)
            if path in self.count:
                path += (self.count[path] - 1,)
        return path

    def _header(self) -> Path:
        several = self.text.startswith("[[", self.at)
        self.at += 1 + several
        names = self._key()
        parent = self._placed(names[:-1])
        path = (*parent, names[-1])
        if several:
            self._note(path)
            self.count[path] = self.count.get(path, 0) + 1
            path += (self.count[path] - 1,)
        self._note(path)
        self.at = self.text.index("]", self.at) + 1 + several
        return path

    def _pair(self, table: Path) -> None:
        """`key = value`; the value of an inline table holds pairs of its own."""
        start = self.at
        names = self._key()
        end, self.at = self.at, start
        for length in range(1, len(names) + 1):
            self._note(table + names[:length])
        self.at = end + 1
        self._skip()
        self._value(table + names)

    def _value(self, path: Path) -> None:
        first = self.text[self.at]
        if first in "[{":
            self._several(path, "]" if first == "[" else "}")
            return
        match = _STRING.match(self.text, self.at) or re.compile(r"[^,\]}\n#]*").match(self.text, self.at)
        assert match is not None  # the second pattern takes an empty text too
        self.at = match.end()

    def _several(self, path: Path, closing: str) -> None:
        """The items of an array or the pairs of an inline table."""
        self.at += 1
        place = 0
        while self._skip() and self.text[self.at] != closing:
            if self.text[self.at] == ",":
                self.at += 1
            elif closing == "}":
                self._pair(path)
            else:
                self._note((*path, place))
                self._value((*path, place))
                place += 1
        self.at += 1
