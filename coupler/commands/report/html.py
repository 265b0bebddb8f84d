"""Pieces of a page: text, tables, figures as data in the page itself."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from string import Template

from coupler.program.quantities import quantity

HERE = Path(__file__).parent
FIGURE = (".svg", ".png")
"""Endings of a figure that a page can show."""
KIND = {".png": "image/png", ".svg": "image/svg+xml", ".mp4": "video/mp4"}
LARGEST_FILM = 8_000_000
"""Size [bytes] up to which a film is embedded in the page; a larger one is linked."""
SHORT = 16
"""Number of rows up to which a table is not split between printed pages."""
MOST_COLUMNS = 9
"""Number of columns up to which a table has letters of the usual size; a wider one has smaller letters."""


def document(title: str, parts: Iterable[str]) -> str:
    """The whole page with its style sheet."""
    style = (HERE / "style.css").read_text(encoding="utf-8")
    page = Template((HERE / "page.html").read_text(encoding="utf-8"))
    return page.substitute(title=escape(title), style=style, body="\n".join(part for part in parts if part))


def section(title: str, *parts: str) -> str:
    """A heading with its content; empty if there is no content."""
    content = "\n".join(part for part in parts if part)
    return f"<section>\n<h2>{escape(title)}</h2>\n{content}\n</section>" if content else ""


def paragraph(text: str) -> str:
    """Plain text."""
    return f"<p>{escape(text)}</p>" if text else ""


def note(text: str) -> str:
    """A remark in small letters."""
    return f'<p class="note">{escape(text)}</p>' if text else ""


class Markup(str):
    """A cell that is HTML already."""


def link(text: str, address: str) -> Markup:
    """A cell with a link to another page."""
    return Markup(f'<a href="{escape(address)}">{escape(text)}</a>')


def table(head: Sequence[str], rows: Sequence[Sequence[str]], texts: Iterable[int] = (0,)) -> str:
    """Rows of text under a head; columns `texts` are words, the others numbers that stand to the right."""
    if not rows:
        return ""
    words = set(texts)

    def cells(tag: str, row: Sequence[str]) -> str:
        found = (
            f"<{tag}{'' if i in words else ' class=n'}>{_cell(cell)}</{tag}>" for i, cell in enumerate(row)
        )
        return f"<tr>{''.join(found)}</tr>"

    body = "\n".join(cells("td", row) for row in rows)
    kinds = [*(["wide"] if len(head) > MOST_COLUMNS else []), *(["short"] if len(rows) <= SHORT else [])]
    size = f' class="{" ".join(kinds)}"' if kinds else ""
    return f"<table{size}>\n<thead>{cells('th', head)}</thead>\n<tbody>\n{body}\n</tbody>\n</table>"


def _cell(content: object) -> str:
    return content if isinstance(content, Markup) else escape(str(content))


def facts(rows: Iterable[tuple[str, str]]) -> str:
    """A list of names and values, without empty values."""
    found = "\n".join(f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>" for name, value in rows if value)
    return f'<dl class="facts">\n{found}\n</dl>'


def preformatted(text: str) -> str:
    """Preformatted text, unchanged."""
    return f"<pre>{escape(text)}</pre>"


def drawn(folder: Path) -> dict[str, Path]:
    """The figures in a folder by their names without endings."""
    names = sorted({path.stem for path in folder.iterdir() if path.suffix in FIGURE})
    return {name: _smaller(folder / f"{name}.png") for name in names}


def _smaller(path: Path) -> Path:
    """Of a figure that exists as SVG and PNG, the smaller file."""
    files = (path.with_name(f"{path.stem}{ending}") for ending in FIGURE)
    return min((file for file in files if file.exists()), key=lambda file: file.stat().st_size, default=path)


def figure(path: Path, caption: str, wide: bool = True) -> str:
    """A picture embedded in the page; of a figure that exists as SVG and PNG, the smaller file is used."""
    path = _smaller(path)
    kind = "" if wide else " class=narrow"
    below = "" if path.name.startswith("still_") else f"<figcaption>{escape(caption)}</figcaption>"
    return f'<figure{kind}><img src="{as_data(path)}" alt="{escape(caption)}">{below}</figure>'


def film(path: Path, link: str) -> str:
    """A small film inside the page, a link to a larger one (paper shows neither)."""
    size = path.stat().st_size
    if size > LARGEST_FILM:
        return (
            f'<p class="screen">Film: <a href="{escape(link)}">{escape(link)}</a> ({quantity(size, "B")})</p>'
        )
    return f'<p class="screen"><video controls src="{as_data(path)}"></video></p>'


def as_data(path: Path) -> str:
    """The data URI of a file."""
    return f"data:{KIND[path.suffix]};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"
