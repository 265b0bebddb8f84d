"""Hooks of mkdocs (mkdocs.yml): pages from outside of docs/, Markdown as GitHub reads it, equations as MathML.

https://www.mkdocs.org/dev-guide/plugins/#events says when each function is called.
"""

from __future__ import annotations

import json
import re
from html import unescape
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[3]
PROJECT = {
    "README.md": "about.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "ARCHITECTURE.md": "architecture.md",
}
"""Pages at the top of the checkout, and their names in the site."""


def on_config(config: Any) -> Any:
    """Add the pages of docs/ that mkdocs.yml does not name to the how-to section."""
    placed = str(config["nav"])
    rest = [page.name for page in sorted((ROOT / "docs").glob("*.md")) if page.name not in placed]
    for section in config["nav"]:
        section.get("How to", []).extend(rest)
    return config


def on_files(files: Files, config: Any) -> Files:
    """Pages from outside of docs/: the cases with their files, the notebooks, those of the project."""
    docs = ROOT / "docs"
    pages = {
        f"cases/{place.parent.name}.md": _case(place.parent)
        for place in sorted(ROOT.glob("cases/*/README.md"))
    }
    pages["cases/index.md"] = _list_of_cases()
    pages |= {
        f"notebooks/{place.stem}.md": _notebook(place) for place in sorted(docs.glob("notebooks/*.ipynb"))
    }
    for name, place in PROJECT.items():
        pages[place] = (ROOT / name).read_text(encoding="utf-8").replace("](docs/", "](")
    for path, text in pages.items():
        files.append(File.generated(config, path, content=text))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Links of the checkout as those of the site, and blank lines where GitHub needs none."""
    up = "../" * page.file.src_uri.count("/")
    markdown = re.sub(
        r"\]\((?:\.\./)*cases/(\w+)(?:/README\.md)?/?(#[\w-]+)?\)", rf"]({up}cases/\1.md\2)", markdown
    )
    markdown = re.sub(r"\]\((?:\.\./)*cases/(\w+)/[\w.]+\)", rf"]({up}cases/\1.md)", markdown)
    markdown = re.sub(r"\]\((?:\.\./)*cases/?\)", rf"]({up}cases/index.md)", markdown)
    markdown = re.sub(r"(\]\((?:\.\./)?(?:notebooks/)?\w+)\.ipynb", r"\1.md", markdown)
    for name, place in PROJECT.items():
        markdown = re.sub(rf"\]\((?:\.\./)*{name}", f"]({up}{place}", markdown)
    return _spaced(markdown)


def on_page_content(html: str, **_: Any) -> str:
    r"""Equations, which arithmatex left as \(...\) and \[...\], as MathML: every browser shows it, without scripts."""
    html = re.sub(
        r'<span class="arithmatex">\\\((.+?)\\\)</span>', lambda m: _math(m[1], "inline"), html, flags=re.S
    )
    return re.sub(
        r'<div class="arithmatex">\s*\\\[(.+?)\\\]\s*</div>', lambda m: _math(m[1], "block"), html, flags=re.S
    )


TAG = re.compile(r"\\tag\{(.+?)\}")


def _math(text: str, display: str) -> str:
    text = unescape(text).strip()
    tag = TAG.search(text)
    made = convert(TAG.sub("", text), display=display)
    if display == "inline":
        return made
    number = f'<span class="number">({tag[1]})</span>' if tag else ""
    return f'<div class="equation">{made}{number}</div>'


def _spaced(markdown: str) -> str:
    """Markdown with blank lines before lists and tables and around equations, and with continued list items indented by
    four spaces: Python's Markdown takes them for plain text otherwise."""
    found: list[str] = []
    fenced = equation = item = loose = False
    for line in markdown.split("\n"):
        before = found[-1] if found else ""
        fence = line.lstrip().startswith("```")
        begins = line.startswith("$$") and not (fenced or equation)
        kind = _kind(line)
        item = not fenced and (kind == "list" or (item and (kind == "inside" or begins or equation)))
        if not (fenced or equation) and before.strip():
            block = kind in ("list", "table") and (_kind(before) == "text" or (kind == "list" and loose))
            if block or begins or before.endswith("$$"):
                found.append("")
        loose = item and kind != "list" and (loose or begins)  # an item of several paragraphs
        if begins or equation:
            equation = not line.rstrip().endswith("$$") or (begins and line.strip() == "$$")
        if item and kind != "list":
            line = "    " + line.lstrip()
        fenced ^= fence
        found.append(line)
    return "\n".join(found)


def _kind(line: str) -> str:
    """Kind of block that a line begins or belongs to; indented lines continue an item."""
    if re.match(r"([-*]|\d+\.) ", line):
        return "list"
    if line.startswith("|"):
        return "table"
    return "inside" if line.startswith((" ", "\t", ">", "#")) else "text"


def _case(folder: Path) -> str:
    """The page of a case: its README, followed by the case file."""
    text = (folder / "README.md").read_text(encoding="utf-8").replace("](../../docs/", "](../")
    case = (folder / "case.toml").read_text(encoding="utf-8")
    return f"{text}\n## case.toml\n\n`cases/{folder.name}/case.toml`\n\n```toml\n{case}```\n"


def _list_of_cases() -> str:
    lines = [
        "# Cases",
        "",
        "Data only: each is a folder in `cases/`, run by `surgebreak run cases/NAME`.",
        "",
    ]
    for page in sorted(ROOT.glob("cases/*/README.md")):
        title = page.read_text(encoding="utf-8").splitlines()[0].lstrip("# ")
        lines.append(f"- [{page.parent.name}]({page.parent.name}.md): {title}")
    return "\n".join(lines) + "\n"


def _notebook(place: Path) -> str:
    """Text and code of a notebook; the tests run it, and its output is left to whoever runs it."""
    parts = []
    for cell in json.loads(place.read_text(encoding="utf-8"))["cells"]:
        text = "".join(cell["source"])
        parts.append(text if cell["cell_type"] == "markdown" else f"```python\n{text}\n```")
    return "\n\n".join(parts) + "\n"
