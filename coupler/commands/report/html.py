"""Pieces of a page: text, tables, figures as data in the page itself."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from string import Template

HERE = Path(__file__).parent
KIND = {".png": "image/png", ".svg": "image/svg+xml", ".mp4": "video/mp4"}
LARGEST_FILM = 8_000_000
"""[bytes] of a film that is put into the page; a larger one is linked."""
SHORT = 16
"""Rows of a table that paper does not break."""
MOST_COLUMNS = 9
"""Of a table in letters of the usual size; one of more has smaller ones."""
PREFIXES = {-3: "n", -2: "µ", -1: "m", 0: "", 1: "k", 2: "M", 3: "G", 4: "T"}
PREFIXED = ("J", "N", "N s", "N m s", "Pa", "W", "s", "m", "m/s", "B")
UNIT_TEXT = {"1": "", "m2": "m²", "m3": "m³", "m/s2": "m/s²", "kg/m3": "kg/m³"}


def document(title: str, parts: Iterable[str]) -> str:
    """The whole page with its style sheet."""
    style = (HERE / "style.css").read_text(encoding="utf-8")
    page = Template((HERE / "page.html").read_text(encoding="utf-8"))
    return page.substitute(title=escape(title), style=style, body="\n".join(part for part in parts if part))


def section(title: str, *parts: str) -> str:
    """A heading and what stands under it; nothing at all without content."""
    content = "\n".join(part for part in parts if part)
    return f"<section>\n<h2>{escape(title)}</h2>\n{content}\n</section>" if content else ""


def paragraph(text: str) -> str:
    """Plain text."""
    return f"<p>{escape(text)}</p>" if text else ""


def note(text: str) -> str:
    """A remark in small letters."""
    return f'<p class="note">{escape(text)}</p>' if text else ""


def table(head: Sequence[str], rows: Sequence[Sequence[str]], texts: Iterable[int] = (0,)) -> str:
    """Rows of text under a head; columns `texts` are words, the others numbers that stand to the right."""
    if not rows:
        return ""
    words = set(texts)

    def cells(tag: str, row: Sequence[str]) -> str:
        found = (
            f"<{tag}{'' if i in words else ' class=n'}>{escape(str(cell))}</{tag}>"
            for i, cell in enumerate(row)
        )
        return f"<tr>{''.join(found)}</tr>"

    body = "\n".join(cells("td", row) for row in rows)
    kinds = [*(["wide"] if len(head) > MOST_COLUMNS else []), *(["short"] if len(rows) <= SHORT else [])]
    size = f' class="{" ".join(kinds)}"' if kinds else ""
    return f"<table{size}>\n<thead>{cells('th', head)}</thead>\n<tbody>\n{body}\n</tbody>\n</table>"


def facts(rows: Iterable[tuple[str, str]]) -> str:
    """Names and what they are, without empty ones."""
    found = "\n".join(f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>" for name, value in rows if value)
    return f'<dl class="facts">\n{found}\n</dl>'


def preformatted(text: str) -> str:
    """Text as it stands."""
    return f"<pre>{escape(text)}</pre>"


def figure(path: Path, caption: str, wide: bool = True) -> str:
    """A picture inside the page; of a figure that is there as SVG and PNG, the smaller of the two."""
    svg = path.with_name(f"{path.stem}.svg")
    if path.suffix == ".png" and svg.exists() and svg.stat().st_size < path.stat().st_size:
        path = svg
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
    """A file as the address of itself."""
    return f"data:{KIND[path.suffix]};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"


def quantity(value: float | None, unit: str) -> str:
    """A number with its unit and a prefix that keeps it short: 1.23 kN; a dash for none."""
    if value is None or value != value:
        return "–"
    power = power_of(value, unit)
    told = f"{_digits(value / 1000.0**power)}"
    return f"{told} {unit_text(unit, power)}".strip()


def in_one_unit(value: float, power: int) -> str:
    """A number of a book whose lines all have the unit with this power of 1000, so that they can be compared."""
    return _digits(value / 1000.0**power)


def unit_text(unit: str, power: int) -> str:
    """The unit with the prefix of a power of 1000."""
    return f"{PREFIXES[power]}{UNIT_TEXT.get(unit, unit)}"


def power_of(value: float, unit: str) -> int:
    """Power of 1000 that keeps a number of this unit short."""
    power = _power(abs(value)) if unit in PREFIXED else 0
    return min(power, 0) if unit == "s" else power


def _digits(value: float) -> str:
    """Four digits, whole ones without a power of ten."""
    return f"{value:.0f}" if 1e4 <= abs(value) < 1e9 else f"{value:.4g}"


def _power(size: float) -> int:
    """Of 1000, so that 1 ≤ size / 1000^power < 1000 where a prefix allows it."""
    power = 0
    while power < max(PREFIXES) and size >= 1000.0 ** (power + 1):
        power += 1
    while power > min(PREFIXES) and 0.0 < size < 1000.0**power:
        power -= 1
    return power


def percent(value: float | None) -> str:
    """A share; a dash for none."""
    return "–" if value is None else f"{100.0 * value:.3g} %"
