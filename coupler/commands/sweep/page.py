"""The report of a sweep on one page: what was run, curves, sensitivity, failed runs, the table of all runs."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from pathlib import Path

from coupler.case.sweep import Varied
from coupler.commands.report.html import (
    document,
    facts,
    figure,
    link,
    note,
    paragraph,
    section,
    table,
)
from coupler.commands.report.run_page import run_page
from coupler.commands.sweep.folder import Spec
from coupler.commands.sweep.fragility import curves
from coupler.commands.sweep.quantities import asked
from coupler.commands.sweep.results import NOT_YET, Results
from coupler.commands.sweep.sensitivity import CONFIDENCE, sensitivities
from coupler.program.errors import NoRun
from coupler.program.quantities import as_said
from coupler.program.terminal import duration
from coupler.run.directory import write_json
from coupler.run.summary import read_summary

MOST_ROWS = 400
"""Largest number of rows of the table on the page; table.csv holds all."""
FAILED = ("refused", "diverged", "gave up", "stopped", "killed", "crashed", "lost")


def analyse(spec: Spec, results: Results) -> list[str]:
    """Write fragility.json and sensitivity.json, which page and figures are made from; a sentence for each fragility
    without a curve, with the reason."""
    found = [curves(spec, results, f) for f in spec.sweep.fragility]
    write_json(spec.folder / "fragility.json", found)
    write_json(spec.folder / "sensitivity.json", sensitivities(spec, results))
    return [f"no curve of fragility '{f['name']}': {f['refused']}" for f in found if f["refused"]]


def write(spec: Spec, results: Results) -> Path:
    """Write report.html of the sweep, and that of every run that has none; its path."""
    path = spec.folder / "report.html"
    part = path.with_name(".report.html.part")
    part.write_text(_page(spec, results), encoding="utf-8")
    part.replace(path)
    return path


def _page(spec: Spec, results: Results) -> str:
    return document(
        f"Sweep: {spec.title}",
        [
            f"<h1>Sweep: {escape(spec.title)}</h1>",
            paragraph(spec.sweep.note),
            _verdict(results),
            *(f'<p class="verdict bad">{escape(sentence)}</p>' for sentence in results.doubted),
            section("What was run", _what(spec, results), *(note(r) for r in spec.remarks)),
            *_fragilities(spec),
            section("On what the results depend", *_sensitivities(spec)),
            section(
                "Results over what was varied",
                *_figure(
                    spec,
                    "results",
                    "Every run a point. Crosses: runs that failed; triangles on the edge: those that could not stand.",
                    wide=False,
                ),
            ),
            section("Runs that did not reach their end", _failed(spec, results)),
            section("All runs", *_rows(spec, results), *(note(sentence) for sentence in results.lacking)),
        ],
    )


def _verdict(results: Results) -> str:
    counts: dict[str, int] = {}
    for outcome in results.column("outcome"):
        counts[outcome] = counts.get(outcome, 0) + 1
    bad = any(outcome in counts for outcome in (*FAILED, NOT_YET))
    ended_runs = ", ".join(f"{count} {outcome}" for outcome, count in counts.items())
    return f'<p class="verdict{" bad" if bad else ""}">{len(results.records)} runs: {escape(ended_runs)}</p>'


def _what(spec: Spec, results: Results) -> str:
    sweep, ended_runs = spec.sweep, results.figures.values()
    cpu, wall = (sum(t[name] for t in ended_runs) for name in ("cpu_seconds", "wall_seconds"))
    versions = sorted(
        {t["program"].get("surgebreak", "") + " " + t["program"].get("commit", "") for t in ended_runs}
    )
    drawn = any(v.distribution for v in sweep.vary)
    rows = [
        ("case", str(spec.case_file)),
        ("changed in all runs", ", ".join(sweep.set)),
        ("table", sweep.table or ""),
        *((v.column, described(v)) for v in sweep.vary),
        *((f"follows: {item.key}", item.formula) for item in sweep.link),
        (
            "drawn",
            f"{sweep.samples} samples a point of the grid ({sweep.sample}), seed {sweep.seed}"
            if drawn
            else "",
        ),
        ("repeats", f"{sweep.repeats}" if sweep.repeats > 1 else ""),
        ("seeds", ", ".join(sweep.seeds)),
        (
            "runs",
            f"{len(spec.runs)} for {len(spec.rows)} rows; hosts {', '.join(sorted({t['host'] for t in ended_runs}))}",
        ),
        (
            "processor time",
            f"{duration(cpu)}, {cpu / max(len(ended_runs), 1):.3g} s a run; {duration(wall)} of wall time in all",
        ),
        ("largest memory", as_said(max((t["memory"] for t in ended_runs), default=None), "B")),
        ("surgebreak", ", ".join(versions)),
    ]
    return facts(rows)


def described(v: Varied) -> str:
    """What is done with a key, in words: joints.strength, lognormal (median 0.1 MPa, dispersion 0.3)."""
    of = ", ".join(v.keys) or "for formulas"
    if v.values:
        return f"{of}: {', '.join(map(str, v.values))}"
    if v.steps:
        return f"{of}: {v.steps} values from {v.low} to {v.high}" + (
            ", equal ratios" if v.spacing == "log" else ""
        )
    given = {
        n: getattr(v, n)
        for n in type(v).model_fields
        if n not in ("name", "key", "what", "unit", "values", "spacing", "distribution", "whole")
    }
    return f"{of}: {v.distribution} ({', '.join(f'{n} {value}' for n, value in given.items() if value is not None)})"


def _figure(spec: Spec, stem: str, caption: str, wide: bool = True) -> Iterator[str]:
    path = spec.folder / f"{stem}.png"
    if path.exists():
        yield figure(path, caption, wide)


def _json(spec: Spec, name: str) -> list[dict]:
    import json

    path = spec.folder / name
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else []


def _fragilities(spec: Spec) -> Iterator[str]:
    for f in _json(spec, "fragility.json"):
        ended_runs = [paragraph(f"No curve: {f['refused']}.")] if f["refused"] else [_medians(f)]
        share = f"{f['confidence']:.0%}"
        caption = (
            f"Probability to reach each state; shaded: {share} band of the curve (bootstrap over the runs); points: "
            f"share of the runs with exact binomial {share} intervals"
            + ("; dashed: known probability." if f["exact"] else ".")
        )
        slower = "Width of the band of the median against the number of runs (mean and range of five random orders)."
        yield section(
            f["what"] or f"Fragility: {f['name']}",
            *_figure(spec, f"fragility_{f['name']}", caption, wide=False),
            *ended_runs,
            note(_counted(f)),
            note(f.get("note", "")),
            *(
                _figure(spec, f"convergence_{f['name']}", slower, wide=False)
                if len(f["convergence"]) > 1
                else ()
            ),
        )


def _medians(f: dict) -> str:
    unit = f["measure"]["unit"]
    rules = {s["name"]: s["rule"] for s in f["states"]}
    rows = [
        [
            c["state"],
            rules[c["state"]],
            _with_band(c["median"], c["median_band"], unit),
            _with_band(f["dispersion"], f["dispersion_band"], "1"),
        ]
        for c in f["curves"]
    ]
    return table(
        ["state", "reached when", f"median {f['measure']['what']}", "dispersion of its logarithm"],
        rows,
        (0, 1),
    )


def _with_band(value: float, band: list[float | None] | None, unit: str) -> str:
    """A number with its band, an end of which is None where it is infinite."""
    ended_runs = as_said(value, unit)
    low, high = (as_said(end, unit) if end is not None else "∞" for end in band or (None, None))
    return f"{ended_runs} ({low} to {high})" if band else ended_runs


def _counted(f: dict) -> str:
    parts = [f"{f['runs']} runs count"]
    parts += [f"{f['unknown']} failed before their state was known"] if f["unknown"] else []
    parts += [f"{f['without']} have no intensity above 0"] if f["without"] else []
    parts += (
        [f"{f['crossed']} reached a state but not a lighter one, and count as both"] if f["crossed"] else []
    )
    parts += [f"no curve of {out}" for out in f["left_out"]]
    return "; ".join(parts) + "."


def _sensitivities(spec: Spec) -> Iterator[str]:
    found = _json(spec, "sensitivity.json")
    if any(s["rows"] for s in found):
        yield from _figure(
            spec, "sensitivity", f"Bars with {CONFIDENCE:.0%} intervals (bootstrap).", wide=False
        )
    for s in found:
        if s["refused"]:
            yield paragraph(f"{s['quantity']}: {s['refused']}.")
            continue
        sobol = "total" in s["rows"][0]
        head = [
            f"{s['quantity']}: {s['how']}",
            "first order" if sobol else "correlation",
            *(["total"] if sobol else []),
        ]
        rows = [[r["name"], _interval(r, ""), *([_interval(r, "total")] if sobol else [])] for r in s["rows"]]
        yield table(head, rows)


def _interval(row: dict, name: str) -> str:
    value, low, high = (
        row[f"{name}_{n}" if name and n != "value" else name or n] for n in ("value", "low", "high")
    )
    return f"{value:.2f} ({low:.2f} to {high:.2f})"


def _failed(spec: Spec, results: Results) -> str:
    failed = [r for r in results.records if r["outcome"] in FAILED]
    rows = [[_link(spec, r), *_values(spec, r), r["outcome"], r["reason"]] for r in failed[:MOST_ROWS]]
    head = ["row", *_heads(spec), "how it ended", "why"]
    more = f"and {len(failed) - MOST_ROWS} more in table.csv" if len(failed) > MOST_ROWS else ""
    return table(head, rows, (0, len(head) - 2, len(head) - 1)) + note(more)


def _rows(spec: Spec, results: Results) -> Iterator[str]:
    names = {c.name: c for c in results.columns}
    quantities = [names[q.name] for q in asked(spec.sweep)]
    rows = [
        [
            _link(spec, r),
            *_values(spec, r),
            *(as_said(r[c.name], c.unit) for c in quantities),
            r["outcome"],
            as_said(r["cpu_seconds"], "s"),
        ]
        for r in results.records[:MOST_ROWS]
    ]
    head = ["row", *_heads(spec), *(c.name.replace("_", " ") for c in quantities), "how it ended", "CPU"]
    yield table(head, rows, (0, len(head) - 2))
    left = len(results.records) - len(rows)
    yield note(
        ("" if left <= 0 else f"and {left} more. ")
        + "All columns with units and meanings: table.csv; in Python surgebreak.sweep.open(DIRECTORY)."
    )


def _heads(spec: Spec) -> list[str]:
    return [c.name.replace("_", " ") for c in spec.columns]


def _values(spec: Spec, record: dict) -> list[str]:
    return [
        as_said(record[c.name], c.unit) if isinstance(record[c.name], int | float) else str(record[c.name])
        for c in spec.columns
    ]


def _link(spec: Spec, record: dict):
    """The number of a row, leading to the report of its run, which is written if it has none."""
    place, text = spec.place(record["id"]), str(record["run"])
    if (place / "run.json").exists():
        page = place / "report.html"
        if not page.exists() or page.stat().st_mtime < (place / "run.json").stat().st_mtime:
            try:
                ended_runs = run_page(
                    place, read_summary(place), place, ["`surgebreak report RUN` adds pictures."]
                )
            except NoRun:
                return text
            page.write_text(ended_runs, encoding="utf-8")
        return link(text, f"runs/{record['id']}/report.html")
    log = place.with_suffix(".log")
    return link(text, f"runs/{log.name}") if log.exists() else text
