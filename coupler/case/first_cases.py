"""First cases: `surgebreak init` writes a small case that runs, chosen by name or by a few questions."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from string import Template

from coupler.case.materials import PRESETS
from coupler.case.units import to_si
from coupler.program.errors import SurgebreakError, UnitError, did_you_mean

FOLDER = Path(__file__).parent / "templates"


class CannotBegin(SurgebreakError):
    """A first case that cannot be written; the message says why."""


@dataclass(frozen=True)
class Question:
    """A question for a $name: its text · default answer · unit, "" of a plain number, None of
    the name of a material."""

    text: str
    usual: str
    unit: str | None = "m"


END = Question("How long is the run?", "4 s", "s")
CELL = Question(
    "Edge of the cells of the water (three to five over its depth; half of it costs ten times as much)",
    "0.5 m",
)
STRENGTH = Question(
    "Tensile strength of the joints (mortar 0.1 to 0.5 MPa, concrete 1 to 3 MPa)", "0.2 MPa", "Pa"
)
DEPTH = Question("Height of the water that the surge comes from", "3 m")


@dataclass(frozen=True)
class FirstCase:
    """summary: one line · questions by $name · derived: $names that follow · files: what is written beside the case"""

    summary: str
    questions: dict[str, Question]
    derived: Callable[[dict[str, str]], dict[str, str]] = lambda answers: {}
    files: dict[str, Callable[[], str]] = field(default_factory=dict)


def _half(of: str, to: str) -> Callable[[dict[str, str]], dict[str, str]]:
    return lambda answers: {to: f"{0.5 * to_si(answers[of], 'm'):g}"}


def _harbour(answers: dict[str, str]) -> dict[str, str]:
    """Heights over the bed of the harbour; the tank ends well above what the quay throws up."""
    height, depth, freeboard = (to_si(answers[name], "m") for name in ("height", "depth", "freeboard"))
    quay = depth + freeboard
    found = {
        "still": depth,
        "level": depth + height,
        "quay_top": quay,
        "half_quay": 0.5 * quay,
        "speed_at": quay + 0.6,
        "top": math.ceil(max(quay + 6.0, depth + 3.0 * height)),
    }
    return {name: f"{value:g}" for name, value in found.items()}


def _site() -> str:
    """A beach that rises from -2.5 m to 2.5 m over 30 m, with a bank of sand across; ESRI grid of 2 m."""
    columns, rows, cell = 33, 23, 2.0
    lines = [f"ncols {columns}", f"nrows {rows}", "xllcenter -2", "yllcenter -2", f"cellsize {cell:g}"]
    for j in reversed(range(rows)):
        heights = []
        for i in range(columns):
            x, y = -2.0 + cell * i, -2.0 + cell * j
            beach = -2.5 + 5.0 * min(max((x - 10.0) / 30.0, 0.0), 1.0)
            bank = 0.4 * max(0.0, 1.0 - abs(x - 30.0) / 4.0) * (1.0 if 8.0 < y < 30.0 else 0.5)
            heights.append(f"{beach + bank:.3f}")
        lines.append(" ".join(heights))
    return "\n".join(lines) + "\n"


def _houses() -> str:
    """Four footprints with their storeys, GeoJSON in the coordinates of the terrain."""
    corners = {
        "inn": (36, 4, 9, 8, 2),
        "school": (36, 16, 9, 9, 1),
        "shop": (48, 5, 8, 7, 1),
        "farm": (48, 26, 9, 8, 1),
    }
    features = [
        {
            "type": "Feature",
            "properties": {"name": name, "storeys": storeys},
            "geometry": {
                "type": "Polygon",
                "coordinates": [[[x, y], [x + a, y], [x + a, y + b], [x, y + b], [x, y]]],
            },
        }
        for name, (x, y, a, b, storeys) in corners.items()
    ]
    return json.dumps({"type": "FeatureCollection", "features": features}, indent=1) + "\n"


FIRST_CASES = {
    "tank": FirstCase(
        "a column of water falls against a light box",
        {
            "depth": Question("Height of the column of water", "1 m"),
            "size": Question("Edge of the box", "0.4 m"),
            "density": Question("Density of the box", "600 kg/m3", "kg/m3"),
            "cell": Question("Edge of the cells of the water", "0.2 m"),
            "end": Question("How long is the run?", "1.5 s", "s"),
        },
        _half("size", "half_size"),
    ),
    "wall": FirstCase(
        "a free-standing wall of blocks in the way of a surge",
        {
            "depth": DEPTH,
            "height": Question("Height of the wall", "2 m"),
            "thickness": Question("Thickness of the wall", "0.4 m"),
            "strength": STRENGTH,
            "cell": CELL,
            "end": END,
        },
    ),
    "house": FirstCase(
        "a house with doors and windows in a surge",
        {
            "depth": Question("Height of the water that the surge comes from", "5 m"),
            "height": Question("Height of the house", "4 m"),
            "strength": STRENGTH,
            "cell": Question(CELL.text, "1 m"),
            "end": END,
        },
    ),
    "quay": FirstCase(
        "containers on a dry quay that a surge overtops",
        {
            "overtopping": Question("How far does the water stand above the quay?", "3 m"),
            "density": Question("Density of a loaded container, over its whole volume", "350 kg/m3", "kg/m3"),
            "friction": Question("Friction between container and quay", "0.4", ""),
            "cell": Question(CELL.text, "1 m"),
            "end": Question("How long is the run?", "8 s", "s"),
        },
        lambda answers: {"level": f"{3.0 + to_si(answers['overtopping'], 'm'):g}"},
    ),
    "harbour": FirstCase(
        "a house on a quay in the bore of a tsunami that comes in through the harbour",
        {
            "height": Question("How high does the bore stand over the still water of the harbour?", "3.5 m"),
            "depth": Question("Depth of the harbour", "4 m"),
            "freeboard": Question("Height of the quay over the still water", "1.5 m"),
            "material": Question(
                "Material of the house (brick-masonry, concrete or timber)", "brick-masonry", None
            ),
            "cell": Question(CELL.text, "1 m"),
            "end": Question("How long is the run?", "5 s", "s"),
        },
        _harbour,
    ),
    "column": FirstCase(
        "drums on one another without mortar, hit by a surge",
        {
            "depth": DEPTH,
            "drums": Question("Number of drums", "5", ""),
            "height": Question("Height of the column", "3 m"),
            "radius": Question("Radius of the drums", "0.5 m"),
            "cell": CELL,
            "end": END,
        },
    ),
    "terrain": FirstCase(
        "a surge runs up a beach with a house on it (a terrain file comes with it)",
        {
            "depth": Question("Height of the water above the still sea", "5 m"),
            "strength": STRENGTH,
            "cell": Question(CELL.text, "1.5 m"),
            "end": Question("How long is the run?", "6 s", "s"),
        },
        files={"site.asc": _site},
    ),
    "town": FirstCase(
        "a surge runs through four houses on a beach (terrain and footprints come with it)",
        {
            "depth": Question("Height of the water above the still sea", "5 m"),
            "strength": STRENGTH,
            "cell": Question(CELL.text, "2 m"),
            "end": Question("How long is the run?", "8 s", "s"),
        },
        files={"site.asc": _site, "houses.geojson": _houses},
    ),
    "dry": FirstCase(
        "no water: a wall that is pulled over at its top",
        {
            "thickness": Question("Thickness of the wall", "0.4 m"),
            "strength": STRENGTH,
            "speed": Question("Speed of the pull", "20 mm/s", "m/s"),
            "end": Question("How long is the run?", "0.5 s", "s"),
        },
        _half("thickness", "half_thickness"),
    ),
}


def write_first_case(
    directory: Path, name: str = "tank", ask: Callable[[str, str], str] | None = None
) -> Path:
    """Write a case of that name into a new or empty directory; its case.toml.

    ask(question, usual) gives the answers, None: the usual ones. Raises CannotBegin."""
    if name not in FIRST_CASES:
        hint = did_you_mean(name, list(FIRST_CASES)) or "."
        raise CannotBegin(f"--template {name}: there is none{hint} The templates are {all_summaries()}")
    path = directory / "case.toml"
    if path.exists():
        raise CannotBegin(f"{path}: exists and is left as it is; name another directory")
    text = text_of(name, ask)
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for file, make in FIRST_CASES[name].files.items():
            (directory / file).write_text(make(), encoding="utf-8")
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise CannotBegin(f"{path}: cannot be written ({error.strerror})") from error
    return path


def text_of(name: str, ask: Callable[[str, str], str] | None = None) -> str:
    """The case file with its answers."""
    first = FIRST_CASES[name]
    answers = {key: _answer(question, ask) for key, question in first.questions.items()}
    return Template((FOLDER / f"{name}.toml").read_text(encoding="utf-8")).substitute(
        answers | first.derived(answers)
    )


def _answer(question: Question, ask: Callable[[str, str], str] | None) -> str:
    """An answer that has the unit it must have; asked again until it has."""
    text = question.text
    while ask is not None:
        given = ask(text, question.usual).strip() or question.usual
        try:
            return _checked(given, question.unit)
        except UnitError as error:
            text = f"{error}. {question.text}"
    return question.usual


def _checked(given: str, unit: str | None) -> str:
    """An answer with its unit; a plain number has the unit of the question."""
    if unit is None:
        if given not in PRESETS:
            raise UnitError(f"{given!r} is no material{did_you_mean(given, list(PRESETS))}")
        return given
    try:
        number = float(given)
    except ValueError:
        to_si(given, unit)
        return given
    return f"{number:g} {unit}".strip()


def all_summaries() -> str:
    """Names and what they are, for messages and help."""
    return "; ".join(f"{name}: {first.summary}" for name, first in FIRST_CASES.items())
