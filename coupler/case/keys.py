"""Access to the schema itself: every key of a case with its unit, limits, default and description."""

from __future__ import annotations

import types
import typing
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import annotated_types
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from coupler.case.case import Case
from coupler.case.units import InSI

REQUIRED = "required"


@dataclass(frozen=True)
class Key:
    """One name of the case file. `path` leaves list places out: "structure.block.size"."""

    path: str
    description: str
    unit: str
    limits: str
    default: str
    example: str
    sections: tuple[type[BaseModel], ...]
    several: bool

    @property
    def required(self) -> bool:
        """Whether a case must give it."""
        return self.default == REQUIRED


def sections_of(annotation: object) -> tuple[type[BaseModel], ...]:
    """The section classes that a type holds, through lists, optional and one-of types."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return (annotation,)
    found: list[type[BaseModel]] = []
    for inner in typing.get_args(annotation):
        found += [section for section in sections_of(inner) if section not in found]
    return tuple(found)


@cache
def keys(section: type[BaseModel] = Case, above: str = "") -> tuple[Key, ...]:
    """Every key below a section, in the order of the schema, each section before what is in it.

    Kept, since the schema is fixed: every case of a sweep or study has its names compared with them."""
    found: list[Key] = []
    for name, field in section.model_fields.items():
        key = _key(f"{above}{name}", field)
        below: dict[str, Key] = {}  # of a name that several kinds of a section have, the first
        for inner in key.sections:
            for one in keys(inner, f"{key.path}."):
                below.setdefault(one.path, one)
        found += [key, *below.values()]
    return tuple(found)


def find(path: tuple[str | int, ...], kind: str = "") -> Key | None:
    """The key at a place of the case; list places are skipped. None when the schema has no such name. Names that
    several kinds of a gauge or an inflow have are those of `kind`, else of the first."""
    names = ".".join(part for part in path if isinstance(part, str))
    found = next((key for key in keys() if key.path == names), None)
    if not kind:
        return found
    places = [n for n, part in enumerate(path) if isinstance(part, int)]
    table = find(path[: places[0]]) if places else None
    if table is None:
        return found
    for section in table.sections:
        if "kind" in section.model_fields and kind in _choices(section.model_fields["kind"].annotation):
            return next((key for key in keys(section, f"{table.path}.") if key.path == names), found)
    return found


def names_in(path: tuple[str | int, ...]) -> list[str]:
    """The names that a section may hold; () is the whole file."""
    if not path:
        return list(Case.model_fields)
    key = find(path)
    return [] if key is None else list(dict.fromkeys(n for s in key.sections for n in s.model_fields))


def _key(path: str, field: FieldInfo) -> Key:
    parts = list(_leaves(field.annotation)) + list(field.metadata)
    unit = next((part.unit for part in parts if isinstance(part, InSI)), "")
    return Key(
        path=path,
        description=field.description or "",
        unit=unit,
        limits=_limits(field, parts),
        default=_default(field),
        example=_text(field.examples[0]) if field.examples else "",
        sections=sections_of(field.annotation),
        several=_is_list(field.annotation),
    )


def _leaves(annotation: object) -> Iterator[object]:
    """The metadata of every Annotated inside a type (field infos taken apart)."""
    if typing.get_origin(annotation) is typing.Annotated:
        for item in typing.get_args(annotation)[1:]:
            yield from item.metadata if isinstance(item, FieldInfo) else (item,)
    for inner in typing.get_args(annotation):
        if not isinstance(inner, str | int | float):
            yield from _leaves(inner)


_SIGNS = {"gt": "> ", "ge": "≥ ", "lt": "< ", "le": "≤ "}


def _limits(field: FieldInfo, parts: list) -> str:
    choices = _choices(field.annotation)
    if choices:
        return " | ".join(map(str, choices))
    found = []
    for part in parts:
        if isinstance(part, annotated_types.BaseMetadata | InSI):
            given = ((sign, getattr(part, name, None)) for name, sign in _SIGNS.items())
            text = [f"{sign}{limit:g}" for sign, limit in given if limit is not None]
            found += [item for item in text if item not in found]
    return ", ".join(found)


def _choices(annotation: object) -> list[str]:
    if typing.get_origin(annotation) is typing.Literal:
        return list(typing.get_args(annotation))
    found: list[str] = []
    for inner in typing.get_args(annotation):
        if not isinstance(inner, str) and not sections_of(inner):
            found += _choices(inner)
    return found


def _is_list(annotation: object) -> bool:
    origin = typing.get_origin(annotation)
    if origin is typing.Annotated or origin in (typing.Union, types.UnionType):
        return any(
            _is_list(inner) for inner in typing.get_args(annotation) if not isinstance(inner, FieldInfo)
        )
    return origin is tuple and bool(sections_of(annotation))


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return REQUIRED
    value = field.get_default(call_default_factory=True)
    return "" if value is None or value == () or isinstance(value, BaseModel) else _text(value)


def _text(value: object) -> str:
    """A value as it is written in TOML."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"' if value else '""'
    if isinstance(value, tuple | list):
        return "[" + ", ".join(_text(item) for item in value) + "]"
    return f"{value:g}" if isinstance(value, float) else str(value)
