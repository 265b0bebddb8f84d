"""What the pages say can be typed in is known to the program: names of the case file, commands, their options."""

import json
import re
import tomllib

import pytest
from typer.main import get_command

from coupler.case.keys import keys, names_in
from coupler.commands.cli import app
from coupler.commands.offshore.file import Offshore
from coupler.commands.stress.registry import Measure, Outcome
from coupler.commands.verify.registry import Result
from coupler.commands.verify.report import json_line
from coupler.program.extras import EXTRAS
from coupler.program.provenance import ROOT

TOP = [
    ROOT / name for name in ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md")
]  # the changelog has old names
PAGES = sorted([*TOP, *(ROOT / "docs").glob("*.md"), *(ROOT / "cases").glob("*/README.md")])
FIGURES = {
    "verdict.weight_moved", "verdict.weight_out", "verdict.largest.force.value", "verdict.displaced.overturned",
}  # fmt: skip
"""Names of run.json that begin as sections of a case do; tests/coupler/test_verdict.py finds them in a verdict."""
KNOWN = {key.path for key in keys()}
SECTIONS = {path.split(".")[0] for path in KNOWN}
FILES = ("py", "toml", "md", "json", "csv", "vtu", "pvd")
COMMANDS = get_command(app).commands
each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


def blocks(text, language):
    return re.findall(rf"^```{language}\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)


def typed(text):
    """What stands between backticks and in blocks of the shell: `text` that a reader may copy."""
    plain = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    return re.findall(r"`([^`\n]+)`", plain) + "".join(blocks(text, "sh") + blocks(text, "")).splitlines()


def paths(table, above=()):
    """Dotted names of all entries of a TOML table; those of a list of tables without their number."""
    for name, value in table.items():
        path = (*above, name)
        yield ".".join(path)
        for entry in value if isinstance(value, list) else [value]:
            if isinstance(entry, dict) and path[-1] not in ("set",):
                yield from paths(entry, path)


def test_the_page_on_installing_has_every_extra():
    table = (ROOT / "docs" / "install.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`[a-z`, ]+`) \|", table, flags=re.MULTILINE)
    assert sorted(re.findall(r"[a-z]+", " ".join(rows))) == sorted(EXTRAS)


@each_page
def test_names_of_the_case_file_exist(page):
    text = page.read_text(encoding="utf-8")
    dotted = re.compile(r"(?<![\w./-])([a-z_]+(?:\.[a-z_]+)+)(?![\w/(*])")
    found = [name for words in typed(text) for name in dotted.findall(words)]
    lost = {
        name
        for name in found
        if name.split(".")[0] in SECTIONS and name not in KNOWN | FIGURES and name.split(".")[-1] not in FILES
    }
    assert lost == set()


@each_page
def test_toml_that_is_shown_is_valid(page):
    for block in blocks(page.read_text(encoding="utf-8"), "toml"):
        reported = tomllib.loads(block)
        if "near" in reported:  # no case, but an offshore file
            Offshore.model_validate(reported)
            continue
        assert {path for path in paths(reported) if path not in KNOWN} == set()


@each_page
def test_commands_and_their_options_exist(page):
    """`surgebreak run CASE --end '2 s'`: the command is there, and so is every option."""
    lost = []
    for words in typed(page.read_text(encoding="utf-8")):
        for command, rest in re.findall(r"surgebreak ([a-z]+)\b([^|;]*)", words):
            if command not in COMMANDS:
                lost.append(f"surgebreak {command}")
            elif command not in ("render", "test"):  # these hand their words on
                there = {o for p in COMMANDS[command].params for o in (*p.opts, *p.secondary_opts)}
                lost += [o for o in re.findall(r"(?<!\S)--[a-z-]+", rest) if o not in there]
    assert lost == []


def test_the_readme_states_the_benchmarks_of_the_page():
    """Counts, and each measured and computed value as the README rounds it."""
    page = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    section = (
        (ROOT / "README.md")
        .read_text(encoding="utf-8")
        .split("## How far it has been checked\n")[1]
        .split("\n## ")[0]
    )
    passed, of, seconds = re.search(r"(\d+) of (\d+) cases pass.*took (\d+) CPU s", page).groups()
    words = " ".join(section.split())
    assert f"compares {of} cases" in words
    assert f"({seconds} CPU s;" in words
    assert f"{passed} of them pass" in words
    case, rows = (
        "",
        re.findall(r"^\|(.*?)\| (.*?) \| ([\d.]+) \| ([\d.]+) \|$", section, flags=re.MULTILINE),
    )
    assert len(rows) == 9
    for experiment, quantity, *shown in rows:
        case = (re.findall(r"\[(P\d\d)\]", experiment) or [case])[0]
        text = page.split(f"\n## {case}:")[1].split("\n## ")[0]
        computed, measured = re.search(
            rf"^\| {re.escape(quantity)} \| (\S+) \| (\S+) \|", text, re.MULTILINE
        ).groups()
        for value, stated in zip((measured, computed), shown):
            decimals = len(stated.partition(".")[2])
            assert f"{float(value):.{decimals}f}" == stated, quantity


def documented(title):
    """Names in the first column of the table with this head in docs/results.md."""
    text = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
    table = text.split(f"| `{title}` | |\n|---|---|\n")[1].split("\n\n")[0]
    return {name for row in table.splitlines() for name in re.findall(r"`(\w+)`", row.split("|")[1])}


def test_what_programs_read_is_documented():
    """Scripts of users hang on these names: who changes one changes the page, and tells it."""
    checked = json.loads(json_line(Result.failed("P01", "why", 1.0)))
    assert documented("verify --json") == set(checked)
    outcome = Outcome("S01", "structure", "what", "passed", measures=[Measure("gain", 1.0, 2.0, "J")])
    assert documented("stress --json") == set(outcome.as_row())
    assert set(outcome.as_row()["measures"][0]) == {"quantity", "value", "limit", "unit", "kept"}


def test_sections_have_names():
    """The test above would pass over everything if the schema gave nothing."""
    assert {"tank", "water", "joints", "study"} <= SECTIONS
    assert names_in(("joints",))
