"""The Markdown that a study writes (coupler/commands/study/page.py) as HTML: headings, paragraphs, tables, lists,
figures."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path

from coupler.commands.report.html import figure, table

IMAGE = re.compile(r"!\[(.*)\]\((.*)\)")
UNITS = {"set-up": "s", "start": "s", "compile": "s"}
"""Of the columns of a study that are CPU seconds beside a column that says so."""
MARKS = (
    (re.compile(r"`([^`]+)`"), r"<code>\1</code>"),
    (re.compile(r"\*\*(.+?)\*\*"), r"<strong>\1</strong>"),
)


def to_html(text: str, folder: Path) -> str:
    """The page as HTML; figures are read from `folder`, and missing ones are replaced by their names."""
    return "\n".join(_block(block.strip(), folder) for block in re.split(r"\n\s*\n", text) if block.strip())


def _block(block: str, folder: Path) -> str:
    if block.startswith("#"):
        marks, _, title = block.partition(" ")
        return f"<h{len(marks)}>{_inline(title)}</h{len(marks)}>"
    if block.startswith("|"):
        return _table(block.splitlines())
    if block.startswith("- "):
        return f"<ul>{''.join(f'<li>{_inline(line[2:])}</li>' for line in block.splitlines())}</ul>"
    found = IMAGE.fullmatch(block)
    if found:
        return _figure(folder / found[2], found[1])
    return f"<p>{_inline(block)}</p>"


def _table(lines: list[str]) -> str:
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return table([f"{name} {UNITS[name]}" if name in UNITS else name for name in rows[0]], rows[2:])


def _figure(path: Path, caption: str) -> str:
    if not path.exists():
        return f'<p class="note">The figure {escape(path.name)} was not drawn.</p>'
    return figure(path, caption, wide=False)


def _inline(text: str) -> str:
    marked = escape(text, quote=False).replace("  \n", "<br>\n")
    for mark, tag in MARKS:
        marked = mark.sub(tag, marked)
    return marked
