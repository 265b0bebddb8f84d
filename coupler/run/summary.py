"""The required content of run.json for the commands that read it: a file that was edited or is incomplete is
refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from coupler.case.paths import BadPath, read_text
from coupler.case.toml_lines import shown
from coupler.program.errors import NoRun

FILE_NAME = "run.json"
Number = Annotated[float, Field(strict=True)]
Whole = Annotated[int, Field(strict=True)]
Text = Annotated[str, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]
Numbers = dict[str, Number | None]


class _Part(BaseModel):
    model_config = ConfigDict(extra="allow")


class _Machine(_Part):
    system: Text
    processor: Text
    cores: Whole
    threads: Text | Whole
    host: Text = ""


class _About(_Part):
    title: Text
    description: Text = ""


class _Coupling(_Part):
    passes: Whole = 1


class _Case(_Part):
    case: _About
    coupling: _Coupling = _Coupling()


class _Work(_Part):
    """Counts of the work done; those of one side are given together."""

    @model_validator(mode="after")
    def _whole(self):
        given = self.model_dump()
        water = ("mesh_cells", "cells", "wet_cells", "bodies", "bodies_cut", "passes")
        structure = ("blocks", "loose_blocks", "joints", "live_joints", "contacts")
        for names in (water, structure):
            missing = [name for name in names if name not in given]
            if missing and len(missing) < len(names):
                raise ValueError(f"{missing[0]} is missing")
        wrong = [name for name, value in given.items() if type(value) not in (int, float)]
        if wrong:
            raise ValueError(f"{wrong[0]} is no number")
        return self


class _First(_Part):
    time: Number
    place: list[Number]
    blocks: list[Text]


class _Way(_Part):
    block: Text | None
    way: Number


class _Group(_Part):
    """The damage of a structure, a body, a wall or a storey (coupler/verdict/judge.py)."""

    name: Text
    word: Text
    state: Text
    rule: Text
    blocks: Whole
    blocks_moved: Whole
    blocks_out: Whole | None = None
    joints: Whole
    joints_broken: Whole
    joints_torn: Whole = 0
    area_broken: Number
    area_torn: Number = 0.0
    weight_moved: Number
    weight_out: Number | None = None
    farthest: _Way
    first_break: _First | None


class _Peak(_Part):
    value: Number
    time: Number
    of: Text | None = None


class _Gone(_Part):
    block: Text
    way: Number
    left_at: Number
    shift: list[Number] | None = None
    tilt: Number | None = None


class _Displaced(_Part):
    blocks: Whole
    back: Whole | None = None
    rocking: Whole | None = None
    upright: Whole | None = None
    leaning: Whole | None = None
    overturned: Whole | None = None
    first: Number | None
    list: list[_Gone]


class _Hit(_Part):
    time: Number
    block: Text
    other: Text
    place: list[Number]
    speed: Number
    impulse: Number
    force: Number


class _Hits(_Part):
    pairs: Whole
    list: list[_Hit]


class _Verdict(_Group):
    largest: dict[str, _Peak | None]
    bodies: list[_Group]
    members: list[_Group]
    storeys: list[_Group]
    displaced: _Displaced
    hits: _Hits


class _Figures(_Part):
    steps: Whole | None = None
    substeps: Whole | None = None
    time: Number | None = None
    largest_water_force: Number | None = None
    joints: Whole | None = None
    joints_broken: Whole | None = None
    largest_opening_rate: Number | None = None
    numerical_dissipation: Number | None = None
    numerical_impulse: Number | None = None
    cpu_seconds: Numbers = {}
    work: _Work = _Work()
    laws: dict[str, Text] = {}
    size: Numbers = {}
    imports: dict[str, Flag] = {}
    expected: dict[str, Flag] = {}
    verdict: _Verdict | None = None


class _Git(_Part):
    commit: Text
    changed: Flag


class _Again(_Part):
    at: Text
    time: Number
    changed: list[Text] = []


class _Summary(_Part):
    status: Text
    exit_code: Whole | None
    exit_reason: Text | None
    started: Text
    ended: Text | None
    process: Whole
    command: list[Text]
    case_file: Text
    overrides: list[Text]
    modules: dict[str, Flag]
    versions: dict[str, Text]
    machine: _Machine
    git: _Git | None = None
    figures: _Figures
    case: _Case
    wall_seconds: Number = 0.0
    cpu_seconds: Number = 0.0
    resumed: list[_Again] = []
    laws: dict[str, dict[str, Text]] = {}
    files: dict[str, Text] = {}


def read_summary(path: Path) -> dict[str, Any]:
    """The content of run.json in a run directory.  Raises NoRun."""
    if not (path / FILE_NAME).exists():
        raise NoRun(
            f"{path}: not the directory of a run, there is no {FILE_NAME}; runs are in runs/<time>-<hash> beside the "
            "case"
        )
    try:
        found = json.loads(read_text(path / FILE_NAME))
        _Summary.model_validate(found)
    except ValidationError as error:
        first = error.errors()[0]
        raise NoRun(
            f"{path / FILE_NAME}: not what a run writes: {shown(first['loc']) or 'the whole'}: {first['msg']}"
        ) from error
    except BadPath as error:
        raise NoRun(f"{path / FILE_NAME}: {error}") from error
    except (ValueError, RecursionError) as error:
        raise NoRun(f"{path}: not the directory of a run ({FILE_NAME}: {error})") from error
    return found
