"""Pages of the documentation that are made from code: commands, the Python side, columns of histories, the case file.

`python -m coupler.commands.pages` writes them anew; a test compares them with the code.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from coupler.program.provenance import ROOT

MADE = "<!-- Made from code by `python -m coupler.commands.pages`; changes here are lost. -->"


def commands_page() -> str:
    """docs/commands.md."""
    return "\n".join(_commands()).rstrip() + "\n"


def _commands() -> Iterator[str]:
    from typer.main import get_command

    from coupler.commands.cli import app
    from coupler.commands.view.__main__ import command_line

    yield from ("# Commands", "", MADE, "")
    yield "`./surgebreak` in the checkout and `.venv/bin/surgebreak` are the same command; `COMMAND --help` says what"
    yield "is below. Exit codes: 0 done, 1 failure, 2 bad case or wrong use, 3 diverged, out of balance or a check"
    yield "missed, 4 stopped by a limit or by the user."
    for name, command in get_command(app).commands.items():
        arguments = [p for p in command.params if p.param_type_name == "argument"]
        words = " ".join(_argument(p) for p in arguments)
        yield from ("", f"## {name}", "", f"`surgebreak {name}{' ' + words if words else ''}`", "")
        yield from (_text(command.help), "")
        if name == "render":
            rows = [_of_argparse(action) for action in command_line()._actions if action.dest != "help"]
        else:
            rows = [(_argument(p), p.help or "") for p in arguments]
            rows += [_option(p) for p in command.params if p.param_type_name == "option" and p.name != "help"]
        if rows:
            yield from ("| | |", "|---|---|")
            yield from (f"| `{shown}` | {_cell(meaning)} |" for shown, meaning in rows)


def _argument(parameter: Any) -> str:
    shown = parameter.metavar or parameter.name.upper()
    return (shown if parameter.required else f"[{shown}]") + ("..." if parameter.nargs == -1 else "")


def _option(parameter: Any) -> tuple[str, str]:
    names = "/".join([parameter.opts[0], *parameter.secondary_opts])
    value = "" if parameter.is_flag else f" {parameter.metavar or parameter.name.upper()}"
    default = parameter.default
    standard = (
        "" if parameter.is_flag or default in (None, "", ()) or callable(default) else f"; default {default}"
    )
    return names + value, f"{parameter.help or ''}{standard}"


def _of_argparse(action: Any) -> tuple[str, str]:
    names = "/".join(action.option_strings) or action.metavar
    value = (
        "" if action.nargs == 0 or not action.option_strings else f" {action.metavar or action.dest.upper()}"
    )
    return names + value, action.help


def python_page() -> str:
    """docs/python_reference.md."""
    return "\n".join(_python()).rstrip() + "\n"


def _python() -> Iterator[str]:
    import surgebreak

    yield from ("# Python reference", "", MADE, "")
    yield "What `import surgebreak` offers; [how it goes together](python.md)."
    for name in sorted(surgebreak.__all__, key=_place):
        thing = getattr(surgebreak, name)
        if name in ("load", "open"):
            made = thing if name == "load" else thing.__init__
            yield from ("", f"## {name}", "", f"`surgebreak.{name}{_signature(made)}`", "")
            what = {"load": "the same as `Case.load`. ", "open": "the same as `Run`. "}[name]
            yield what + _text(made.__doc__)
        elif inspect.isclass(thing):
            yield from _class(name, thing)
        elif inspect.ismodule(thing):
            yield from _module(name, thing)
        else:
            yield from (
                "",
                f"## {name}",
                "",
                f"`surgebreak.{name}{_signature(thing)}`",
                "",
                _text(thing.__doc__),
            )


FIRST = ("load", "open", "Case", "Run", "Step", "Blocks", "WaterState", "BlockState", "History", "Forecast")


def _place(name: str) -> tuple[int, str]:
    """Sort key of the entries: those that a reader needs first come first, errors last."""
    import surgebreak

    thing = getattr(surgebreak, name)
    if name in FIRST:
        return FIRST.index(name), name
    return len(FIRST) + (inspect.isclass(thing) and issubclass(thing, BaseException)), name


def _module(name: str, thing: Any) -> Iterator[str]:
    yield from ("", f"## {name}", "", _text(thing.__doc__), "", "| | |", "|---|---|")
    for own in thing.__all__:
        function = getattr(thing, own)
        yield f"| `{name}.{own}{_signature(function)}` | {_cell(_text(function.__doc__))} |"


def _class(name: str, thing: type) -> Iterator[str]:
    error = issubclass(thing, BaseException)
    yield from ("", f"## {name}", "")
    if not error:
        yield from (f"`surgebreak.{name}{_signature(thing)}`", "")
    yield _text(thing.__doc__)
    if error:
        return
    if (
        inspect.getdoc(thing.__init__)
        and "__init__" in vars(thing)
        and not hasattr(thing, "__dataclass_fields__")
    ):
        yield from ("", _text(thing.__init__.__doc__))
    members = [(n, m) for n, m in vars(thing).items() if not n.startswith("_") and _is_member(m)]
    if members:
        yield from ("", "| | |", "|---|---|")
    for own, member in members:
        if isinstance(member, property):
            yield f"| `{own}` | {_cell(_text(member.__doc__))} |"
        else:
            function = member.__func__ if isinstance(member, classmethod) else member
            yield f"| `{own}{_signature(function)}` | {_cell(_text(function.__doc__))} |"


def _is_member(member: object) -> bool:
    return isinstance(member, property | classmethod) or inspect.isfunction(member)


def _signature(function: Callable) -> str:
    """Names and defaults; types would fill the page."""
    try:
        found = inspect.signature(function)
    except ValueError:
        return ""
    plain = [
        p.replace(annotation=inspect.Parameter.empty)
        for p in found.parameters.values()
        if p.name not in ("self", "cls")
    ]
    return str(found.replace(parameters=plain, return_annotation=inspect.Signature.empty))


def _text(docstring: str | None) -> str:
    """Paragraphs of a docstring; indented lines are kept as code."""
    paragraphs = inspect.cleandoc(docstring or "").split("\n\n")
    return "\n\n".join(p if p.startswith("    ") else re.sub(r"\s*\n\s*", " ", p) for p in paragraphs)


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;").replace("\n\n", "<br>").replace("\n", " ")


def histories_page() -> str:
    """docs/histories.md."""
    return "\n".join(_histories()).rstrip() + "\n"


def _histories() -> Iterator[str]:
    from coupler.results import columns
    from coupler.results.cracks import CRACK_COLUMNS

    yield from ("# Columns of the histories", "", MADE, "")
    yield "One table a subject under `history/` of a run, a row a step; the head of each file says the same. Gauges"
    yield "have the columns that [results](results.md) describes. `run.history(NAME)` in [Python](python.md) reads one."
    tables = {
        "history/energy.csv": columns.ENERGY,
        "history/coupling.csv": columns.COUPLING,
        "history/water.csv": columns.WATER,
        "history/structure.csv": columns.STRUCTURE,
        "history/momentum.csv": columns.momentum_columns("N s", "momentum"),
        "cracks.csv": [(c.name, c.unit, c.meaning) for c in CRACK_COLUMNS],
    }
    for name, rows in tables.items():
        yield from ("", f"## {name}", "", "| column | unit | meaning |", "|---|---|---|")
        yield from (f"| `{column}` | {unit} | {_cell(meaning)} |" for column, unit, meaning in rows)


def pages() -> dict[Path, Callable[[], str]]:
    """Every made page, with what makes it."""
    from coupler.case.docs import PAGE, page

    docs = ROOT / "docs"
    return {
        PAGE: page,
        docs / "commands.md": commands_page,
        docs / "python_reference.md": python_page,
        docs / "histories.md": histories_page,
    }


if __name__ == "__main__":
    for place, make in pages().items():
        place.write_text(make(), encoding="utf-8")
        print(f"wrote {place}")
