"""Texts made from the schema: `surgebreak explain`, the page docs/case_file.md, and words that people use.

`python -m coupler.case.docs` writes the page anew; a test compares it with the schema.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import get_args

from pydantic import BaseModel

from coupler.case.first_cases import FIRST_CASES
from coupler.case.keys import Key, find, keys
from coupler.case.materials import PRESETS, described
from coupler.program.errors import UnknownName, did_you_mean
from coupler.program.provenance import ROOT

PAGE = ROOT / "docs" / "case_file.md"


def explanation(name: str | None) -> str:
    """What a name of the case file means; without a name, the sections.

    Raises UnknownName when the schema has no such name, with the nearest one.
    """
    if not name:
        return "\n".join(_entry(key) for key in keys() if "." not in key.path)
    presets = [preset for preset in PRESETS if name.lower() in (preset, *preset.split("-"))]
    if presets:
        return "\n".join(map(described, presets))
    plain = name.strip("[]").replace("[]", "")
    key = find(tuple(plain.split(".")))
    if key is None:
        found = meant(plain)
        if not found:
            raise UnknownName(f"{name}: no such name in a case file{_near(plain)}")
        return "\n".join(
            [
                f"'{name}' is no name of a case file; perhaps one of these is meant:",
                *(entry for key in found for entry in entries_of(key)),
                *_first_cases(plain),
            ]
        )
    entries = entries_of(key)
    for section in key.sections:
        entries += ["", inspect.getdoc(section) or ""]
        entries += [
            f"  {_entry(inner)}" for inner in keys(section, f"{key.path}.") if _depth(inner, key) == 1
        ]
    return "\n".join(entries)


def entries_of(key: Key) -> list[str]:
    """What a name means; in a section of several kinds, such as gauges and inflows, each meaning with the kinds that
    have it."""
    above = key.path.rpartition(".")[0]
    section = find(tuple(above.split("."))) if above else None
    kinds: dict[str, list[str]] = {}
    for kind in section.sections if section is not None else ():
        for inner in keys(kind, f"{above}."):
            if inner.path == key.path:
                kinds.setdefault(_entry(inner), []).append(_kind_of(kind))
    if section is None or len(section.sections) < 2 or key.path.endswith(".kind"):
        return list(kinds) or [_entry(key)]
    return [f"{entry} [kind: {', '.join(names)}]" for entry, names in kinds.items()]


def _kind_of(section: type[BaseModel]) -> str:
    """The value of `kind` by which a section is told from others."""
    field = section.model_fields.get("kind")
    return ", ".join(get_args(field.annotation)) if field is not None else section.__name__


WORDS = {
    "wave": ("water.inflow", "water.inflow.kind", "water.sea", "water.fill", "water.fill.surface"),
    "tsunami": ("water.inflow", "water.inflow.kind", "water.sea"),
    "bore": ("water.inflow", "water.inflow.level", "water.inflow.ahead"),
    "quay": ("solid", "structure.wall"),
    "wharf": ("solid", "structure.wall"),
    "sea wall": ("solid", "structure.wall", "contact.uplift"),
    "seawall": ("solid", "structure.wall", "contact.uplift"),
    "retaining wall": ("solid", "structure.wall", "contact.uplift"),
    "caisson": ("structure.wall", "structure.block", "contact.pair.friction", "contact.uplift"),
    "backfill": ("structure.rubble", "structure.wall", "structure.file"),
    "earth pressure": ("structure.rubble", "structure.wall"),
    "parapet": ("structure.wall", "water.covers", "joints.pair"),
    "safety factor": ("gauge", "contact.friction", "sweep.vary", "verdict.moved"),
    "factor of safety": ("gauge", "contact.friction", "sweep.vary", "verdict.moved"),
    "run-up": ("terrain", "tank.cell"),
    "breakwater": ("structure.wall", "structure.block", "structure.rubble", "contact.uplift"),
    "sliding": ("contact.friction", "contact.pair", "contact.uplift", "verdict.moved"),
    "overturning": ("verdict.moved", "verdict.collapsed_weight", "contact.uplift", "gauge.about"),
    "harbour": ("solid", "water.inflow"),
    "pier": ("solid", "structure.column"),
    "masonry": ("structure.wall", "structure.wall.material", "joints"),
    "preset": ("structure.wall.material", "structure.building.material", "joints.pair"),
    "unit": ("structure.drawing.scale", "structure.file.scale", "terrain.scale"),
    "millimetres": ("structure.drawing.scale", "structure.file.scale"),
    "flood": ("water.inflow", "water.sea", "water.fill"),
    "surge": ("water.inflow", "water.fill"),
    "river": ("water.inflow", "terrain"),
    "dam": ("water.fill", "structure.wall"),
    "ground": ("structure.ground", "terrain", "joints.ground"),
    "brick": ("structure.wall", "joints.strength", "structure.density"),
    "mortar": ("joints", "joints.strength", "joints.pair"),
    "glue": ("joints",),
    "house": ("structure.building", "structure.drawing", "structure.town"),
    "warehouse": ("structure.building", "structure.building.opening", "structure.drawing"),
    "footprint": ("structure.town", "structure.building.outline"),
    "second wave": ("water.inflow.path", "water.inflow.velocity"),
    "tide gauge": ("water.inflow.path", "water.inflow.velocity", "water.inflow.zero"),
    "gauge record": ("water.inflow.path", "water.inflow.velocity", "water.inflow.zero"),
    "drawing": ("structure.drawing", "structure.file"),
    "container": ("structure.block",),
    "box": ("structure.block", "solid", "water.fill"),
    "cube": ("structure.block",),
    "sphere": ("structure.block.diameter", "structure.block.faces", "structure.rubble"),
    "ball": ("structure.block.diameter", "structure.block.faces"),
    "boulder": ("structure.block.diameter", "structure.rubble"),
    "slosh": ("water.fill.surface", "water.fill.slope"),
    "tilt": ("water.fill.slope",),
    "debris": ("structure.rubble", "verdict.hit_speed"),
    "roof": ("structure.building.roof",),
    "window": ("structure.building.opening",),
    "door": ("structure.building.opening",),
    "mesh": ("tank.cell", "tank.mesh"),
    "resolution": ("tank.cell",),
    "timestep": ("time.step_max", "time.cfl", "structure.substep"),
    "output": ("time.output_every", "gauge"),
    "failure": ("verdict", "joints"),
    "damage": ("verdict", "joints"),
    "collapse": ("verdict",),
    "crack": ("joints", "verdict.damaged_joints"),
    "sensor": ("gauge",),
    "probe": ("gauge",),
    "gravity": ("case.gravity",),
    "bathymetry": ("terrain",),
    "dem": ("terrain", "structure"),
    "sand": ("water.walls", "structure.rubble"),
    "impact": ("contact", "gauge.mean_over"),
    "stop": ("limits", "limits.cpu_seconds"),
}
"""Words that people use, and the names that say what they mean."""
MOST_MEANT = 8


def meant(word: str) -> list[Key]:
    """Names that a common word stands for, that end in it, or whose description holds it; at most MOST_MEANT."""
    known = {key.path: key for key in keys()}
    plain = word.lower().rstrip("s") if word.lower() not in WORDS else word.lower()
    asked = [known[path] for path in WORDS.get(plain, ()) if path in known]
    ends = [key for path, key in known.items() if path.rsplit(".", 1)[-1] in (plain, f"{plain}s")]
    entries = [key for key in known.values() if len(plain) > 3 and plain in key.description.lower()]
    return list({key.path: key for key in [*asked, *ends, *entries]}.values())[:MOST_MEANT]


def _first_cases(word: str) -> Iterator[str]:
    """The templates of `init` whose name or line has a word that begins like this one, each with its command."""
    plain = word.lower().rstrip("s")
    for name, case in FIRST_CASES.items():
        if name == plain or any(part.startswith(plain) for part in case.summary.split()):
            yield f"surgebreak init DIR --template {name}: writes a case to begin with: {case.summary}"


def _near(name: str) -> str:
    known = [key.path for key in keys()]
    ends = [path for path in known if path.rsplit(".", 1)[-1] == name]
    return f"; did you mean '{ends[0]}'?" if ends else did_you_mean(name, known)


def _depth(key: Key, above: Key) -> int:
    return key.path.count(".") - above.path.count(".")


def _entry(key: Key) -> str:
    """joints.strength [Pa] (> 0; required; for instance "0.5 MPa"): what it is."""
    unit = f" [{key.unit}]" if key.unit else ""
    facts = [key.limits, _default(key), f"for instance {key.example}" if key.example else ""]
    entries = "; ".join(fact for fact in facts if fact)
    return f"{_header(key)}{unit}" + (f" ({entries})" if entries else "") + f": {key.description}"


def _header(key: Key) -> str:
    if key.sections:
        return f"[[{key.path}]]" if key.several else f"[{key.path}]"
    return key.path


def _default(key: Key) -> str:
    if key.required:
        return "required"
    return f"default {key.default}" if key.default not in ("", '""') else ""


# ---------------------------------------------------------------- the page


def page() -> str:
    """docs/case_file.md."""
    return "\n".join([*_opening(), *_tables()]).rstrip() + "\n"


def _opening() -> Iterator[str]:
    yield "# The case file"
    yield ""
    yield "<!-- Made from coupler/case by `python -m coupler.case.docs`; changes here are lost. -->"
    yield ""
    yield "A case is a directory with a `case.toml` ([TOML](https://toml.io)). Plain numbers are SI; text may carry"
    yield 'any unit of the right kind (`"5 MN/mm"`, `"2.4 t/m3"`, `"30 deg"`). z points up. A section that is absent'
    yield "switches its part of the program off. Unknown names are refused, and all mistakes are reported at once."
    yield ""
    yield "`surgebreak check CASE` checks a case, `surgebreak explain NAME` shows what is below for one name, and"
    yield "`--set NAME=VALUE` changes a value for one run (`--set structure.block[0].density=600`); `--set NAME=absent`"
    yield "leaves the name out (`--set joints=absent`)."
    yield ""
    yield "| name | unit | values | default | meaning |"
    yield "|---|---|---|---|---|"
    for key in keys():
        if "." not in key.path:
            yield f"| [`{_header(key)}`](#{key.path}) | | | {_shown_default(key)} | {key.description} |"
    yield ""


def _tables() -> Iterator[str]:
    for key in keys():
        if not key.sections:
            continue
        yield f"## {key.path}"
        yield ""
        for section in key.sections:
            yield from _table(section, key)


def _table(section: type[BaseModel], key: Key) -> Iterator[str]:
    title = inspect.getdoc(section) or ""
    kind = section.model_fields.get("kind")
    if kind is not None:
        yield f'`kind = "{get_args(kind.annotation)[0]}"`: {title}'
    else:
        yield f"`{_header(key)}`: {title}"
    yield ""
    yield "| name | unit | values | default | meaning |"
    yield "|---|---|---|---|---|"
    for inner in keys(section, f"{key.path}."):
        if _depth(inner, key) == 1:
            yield _row(inner)
    yield ""


def _row(key: Key) -> str:
    name = key.path.rsplit(".", 1)[-1]
    shown = f"[`{name}`](#{key.path.replace('.', '')})" if key.sections else f"`{name}`"
    meaning = key.description + (f"; for instance `{key.example}`" if key.example else "")
    limits = key.limits.replace(" | ", ", ")
    return f"| {shown} | {key.unit} | {limits} | {_shown_default(key)} | {meaning} |"


def _shown_default(key: Key) -> str:
    if key.required:
        return "required"
    return f"`{key.default}`" if key.default else ""


# ---------------------------------------------------------------- the first case

if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"wrote {PAGE}")
