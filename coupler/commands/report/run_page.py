"""The report of a run: the case, the results, checks of their reliability, and what was not computed."""

from __future__ import annotations

import shlex
from html import escape
from pathlib import Path

from coupler.case.paths import BadPath, read_text
from coupler.commands.explain_run import Skipped, not_loaded, seconds_of, shares, skipped
from coupler.commands.report import tables
from coupler.commands.report.html import (
    document,
    drawn,
    facts,
    figure,
    film,
    note,
    paragraph,
    preformatted,
    section,
    table,
)
from coupler.commands.report.stands import FIGURES as OF_VERDICT
from coupler.commands.report.stands import stands
from coupler.commands.view.palette import LINES
from coupler.program.process import was_killed
from coupler.program.quantities import percent, quantity
from coupler.results.history import by_block, read_history

CAPTIONS = {
    "gauges": "Gauges",
    "energy": "Energy: change since the first step",
    "structure": "Structure: joints, momentum of the blocks, impulse of the water on them, largest speed of a block",
    "water": "Water: volume, numerical corrections of it, momentum",
    "momentum": "Momentum: contribution of each term since the start",
    "angular_momentum": "Angular momentum: contribution of each term since the start",
    "coupling": "Steps: length, passes, iterations, defect",
}
"""Captions of the figures of the histories, in the order of display; other tables follow the gauges."""
FLOOD = "flood_map"
"""The picture with the maps of a flood over terrain."""
OF_SCHEME = ("momentum", "angular_momentum", "coupling")
"""Histories of the numerical scheme rather than of the scene, which are shown towards the end of the page."""
FIGURES = {
    "time": ("simulated time", "s"),
    "steps": ("steps", "1"),
    "substeps": ("substeps of the blocks", "1"),
    "largest_water_force": (
        "largest force of the water on blocks that can move (all bodies if none can)",
        "N",
    ),
    "joints": ("joints at the start", "1"),
    "joints_broken": ("joints broken", "1"),
    "largest_opening_rate": ("largest opening in a substep, share of the opening at failure", "%"),
    "numerical_dissipation": ("numerical dissipation, share of the energy put in", "%"),
    "numerical_impulse": ("impulse of numerical corrections, share of all impulses", "%"),
}
"""Values of run.json that the page shows."""
NEEDS = {
    "substeps": ("structure",),
    "largest_water_force": ("structure", "fixed solids"),
    "joints": ("joints",),
    "joints_broken": ("joints",),
    "largest_opening_rate": ("joints",),
}
"""Values that have a meaning only where one of these modules is on."""


def run_page(run: Path, summary: dict, pictures: Path, remarks: list[str]) -> str:
    """The whole page. pictures: folder of stills and figures; remarks: why some are missing."""
    title = summary["case"]["case"]["title"]
    return document(
        title,
        [
            f"<h1>{escape(title)}</h1>",
            paragraph(summary["case"]["case"].get("description", "")),
            _verdict(run, summary),
            _doubts(summary),
            section("Does it stand?", *stands(summary, pictures)),
            section("What was run", _what(run, summary)),
            section("Results", _figures(summary), _promises(summary)),
            section("Notes before the run", _notes(summary)),
            section("Pictures", _stills(run, pictures), *map(note, remarks)),
            section("The flood", _flood(pictures)),
            section("Computed over data", *(figure(p, _words(p.stem)) for p in over_data(run, pictures))),
            section("Histories", *_histories(run, pictures, of_scheme=False)),
            section("Ledger", tables.energy(run), tables.volume(run), tables.momentum(run, "momentum")),
            section("Cracks", tables.cracks(run)),
            section("Limits", tables.limits(summary)),
            section("Processor time, and what was not computed", _time(summary), _left_out(summary)),
            section("Histories of the scheme", *_histories(run, pictures, of_scheme=True)),
            section("The case file", _case(run)),
        ],
    )


def _verdict(run: Path, summary: dict) -> str:
    killed = was_killed(summary)
    bad = killed or summary["exit_code"] not in (0, None)
    shown = summary["status"]
    if summary["exit_reason"]:
        shown += f" (exit code {summary['exit_code']}): {summary['exit_reason']}"
    elif killed:
        shown = f"killed: its process is gone and could not say why; this is what it has written{_until(run)}"
    elif summary["status"] == "running":
        shown += f": this is what the run has written so far{_until(run)}"
    return f'<p class="verdict{" bad" if bad else ""}">{escape(shown)}</p>'


def _doubts(summary: dict) -> str:
    """Reasons to doubt the loads of this run, for the first screen; empty if there are none."""
    return "".join(
        f'<p class="verdict bad">{escape(line)}</p>' for line in summary["figures"].get("doubts", [])
    )


def _notes(summary: dict) -> str:
    """The notes on the case that the run printed before it began."""
    found = summary["figures"].get("notes", [])
    return f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in found)}</ul>" if found else ""


def _until(run: Path) -> str:
    """Time reached by the histories of a run that did not record its end."""
    found = tables.history(run, "energy")
    return "" if found is None else f", to t = {quantity(float(found['time'][-1]), 's')}"


def _what(run: Path, summary: dict) -> str:
    on = [name for name, on in summary["modules"].items() if on]
    off = [name for name, on in summary["modules"].items() if not on]
    machine, git = summary["machine"], summary.get("git")
    rows = [
        ("case", summary["case_file"]),
        ("changed keys", ", ".join(summary["overrides"]) or "none"),
        ("command", shlex.join(summary["command"])),
        ("results in", str(run.resolve())),
        ("began", _moment(summary["started"])),
        *(("resumed", _again(again)) for again in summary.get("resumed", [])),
        ("ended", _moment(summary["ended"]) if summary["ended"] else ""),
        *_times(summary),
        ("on", ", ".join(on)),
        ("off", ", ".join(off)),
        *((what, law) for what, law in summary["figures"].get("laws", {}).items()),
        ("size at the start", _size(summary["figures"].get("size", {}))),
        (
            "machine",
            f"{machine['processor']}, {machine['cores']} cores, threads {machine['threads']}; "
            f"{machine['system']}",
        ),
        ("versions", ", ".join(f"{name} {number}" for name, number in summary["versions"].items())),
        ("commit", f"{git['commit']}{' with changes' if git['changed'] else ''}" if git else "not from git"),
    ]
    return facts(rows)


def _moment(text: str) -> str:
    """2026-01-31 12:00:00 UTC of 2026-01-31T12:00:00+00:00."""
    return text.replace("T", " ").replace("+00:00", " UTC")


def _again(again: dict) -> str:
    """When and from where the run was resumed, and what was changed."""
    changed = f"; {', '.join(again['changed'])}" if again.get("changed") else ""
    return f"{_moment(again['at'])}, from the checkpoint at t = {quantity(again['time'], 's')}{changed}"


def _times(summary: dict) -> list[tuple[str, str]]:
    """Total time of all parts of a run; empty for one that has not ended, since its summary has no times yet."""
    if summary["ended"] is None:
        return []
    times = (("wall time", "wall_seconds"), ("processor time", "cpu_seconds"))
    return [(what, quantity(summary.get(name), "s")) for what, name in times]


def _size(size: dict) -> str:
    return ", ".join(f"{_words(name)} {count}" for name, count in size.items() if count)


def _stills(run: Path, pictures: Path) -> str:
    found = sorted(pictures.glob("still_*s.png"), key=_time_of)
    shown = [figure(p, f"t = {_time_of(p):.4g} s") for p in found]
    shown = [f'<div class="stills">{"".join(shown)}</div>'] if shown else []
    made = run / "pictures" / "film.mp4"
    if made.exists():
        shown.append(film(made, "pictures/film.mp4"))
    return "\n".join(shown)


def _flood(pictures: Path) -> str:
    """The maps of a run over terrain."""
    path = pictures / f"{FLOOD}.png"
    words = "Largest depth, speed and h v², time of arrival, and the buildings by their state (maps/, buildings.csv)"
    return figure(path, words) if path.exists() else ""


def _time_of(still: Path) -> float:
    return float(still.stem.removeprefix("still_").removesuffix("s"))


def _figures(summary: dict) -> str:
    figures = summary["figures"]
    rows = [
        [what, percent(figures[name]) if unit == "%" else quantity(figures[name], unit)]
        for name, (what, unit) in FIGURES.items()
        if name in figures and _says_something(name, summary["modules"])
    ]
    return table(["figure", "value"], rows)


def _says_something(figure_name: str, modules: dict) -> bool:
    return figure_name not in NEEDS or any(modules.get(module, True) for module in NEEDS[figure_name])


def _promises(summary: dict) -> str:
    kept = summary["figures"].get("expected", {})
    rows = [[what, "kept" if is_kept else "NOT KEPT"] for what, is_kept in kept.items()]
    return table(["what expected.toml promises", "in this run"], rows, (0, 1))


def plots(run: Path, pictures: Path) -> list[Path]:
    """Figures of the histories in the order of CAPTIONS, other tables behind the gauges."""
    order = list(CAPTIONS)
    stems = sorted(p.stem for p in (run / "history").glob("*.csv"))
    ranked = sorted(stems, key=lambda stem: order.index(stem) if stem in order else 0.5)
    return [path for stem in ranked for path in _leaves(pictures, stem)]


def _leaves(pictures: Path, stem: str) -> list[Path]:
    """The figures of a table over several pages: gauges.svg, gauges_2.svg, ..."""
    found = drawn(pictures)
    more = [name.removeprefix(f"{stem}_") for name in found if name.startswith(f"{stem}_")]
    leaves = [f"{stem}_{number}" for number in sorted((n for n in more if n.isdigit()), key=int)]
    return [found[name] for name in (stem, *leaves) if name in found]


def over_data(run: Path, pictures: Path) -> list[Path]:
    """Figures that the case asks for: neither stills nor histories."""
    histories = plots(run, pictures)
    return [
        p
        for p in drawn(pictures).values()
        if p not in histories and p.stem not in (*OF_VERDICT, FLOOD) and not p.name.startswith("still_")
    ]


def _histories(run: Path, pictures: Path, of_scheme: bool) -> list[str]:
    found = [(p, p.stem.rstrip("0123456789").rstrip("_")) for p in plots(run, pictures)]
    shown = [figure(p, _caption(stem, p.stem)) for p, stem in found if (stem in OF_SCHEME) == of_scheme]
    without = [] if of_scheme else _of_many_blocks(run)
    if shown and without:
        shown.append(
            note(f"Without a figure, since they have more than {len(LINES)} blocks: {', '.join(without)}.")
        )
    return shown


def _of_many_blocks(run: Path) -> list[str]:
    """The tables with a row for each block that have more blocks than a panel has lines."""
    found = []
    for path in sorted((run / "history").glob("loads_*_blocks.csv")):
        blocks = by_block(read_history(path))
        if blocks is not None and len(blocks.names) > len(LINES):
            found.append(f"history/{path.name}")
    return found


def _caption(stem: str, leaf: str) -> str:
    again = "" if leaf == stem else ", continued"
    return f"{CAPTIONS.get(stem, _words(stem))}{again} (history/{stem}.csv)"


def _time(summary: dict) -> str:
    rows = [[name, quantity(seconds, "s"), percent(share)] for name, seconds, share in shares(summary)]
    return table(["part", "processor time", "share"], rows)


def _left_out(summary: dict) -> str:
    rows = [
        [row.what, _count(row.done), _count(row.skipped), _cost(row),
         quantity(seconds_of(summary, row.parts), "s"),         ", ".join(row.parts)]
        for row in skipped(summary)
        if row.done + row.skipped > 0.0
    ]  # fmt: skip
    head = ["skipped in the steps", "done", "skipped", "would have cost", "processor time spent", "by"]
    shown = [f"{part} ({', '.join(names)})" for part, names in not_loaded(summary).items()]
    return "\n".join(
        [
            table(head, rows, (0, 5)),
            note(
                "Mean numbers per step. The cost is an estimate: what one took in this run, times those that were "
                "skipped; a dash where the run measured none."
                if rows
                else "This run did not count what it skipped."
            ),
            paragraph(f"Parts of the program that were not loaded: {', '.join(shown)}." if shown else ""),
        ]
    )


def _count(value: float) -> str:
    return f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"


def _cost(row: Skipped) -> str:
    if row.seconds is None:
        return "–"
    return f"{row.how_sure} {quantity(float(f'{row.seconds:.2g}'), 's')}"


def _case(run: Path) -> str:
    path = run / "case.toml"
    if not path.exists():
        return ""
    try:
        return preformatted(read_text(path))
    except BadPath as error:
        return note(f"case.toml {error}")


def _words(name: str) -> str:
    return name.replace("_", " ")
