"""Messages for refused values: an error of pydantic is converted to a place in the file and a sentence."""

from __future__ import annotations

from collections.abc import Sized
from typing import get_args

from coupler.case.gauges import Gauge
from coupler.case.keys import Key, find, keys, names_in, sections_of
from coupler.case.toml_lines import shown
from coupler.case.types import KeyPath
from coupler.case.water import Inflow
from coupler.program.errors import briefly, did_you_mean


def _kinds_of(tables: object) -> tuple[str, ...]:
    """What `kind` may be in a table that is one of several, in their order."""
    return tuple(get_args(table.model_fields["kind"].annotation)[0] for table in sections_of(tables))


GAUGE_KINDS, INFLOW_KINDS = _kinds_of(Gauge), _kinds_of(Inflow)


def explain_error(error: dict) -> tuple[KeyPath, str]:
    """Key path and message of one entry of `ValidationError.errors()`."""
    path, of = _path(error["loc"])
    kind, value, context = error["type"], error.get("input"), error.get("ctx", {})
    key = find(path, of)
    if kind == "extra_forbidden":
        return path, _unknown(path)
    if kind == "missing" and isinstance(path[-1], int):
        return path[:-1], f"too few values ({path[-1]}); {_is(key)}"
    if kind == "missing":
        return path, f"missing; {_is(key)}"
    if kind in _COMPARE:
        word, name = _COMPARE[kind]
        unit = f" {key.unit}" if key and key.unit else ""
        return path, f"{briefly(value)} is out of range; must be {word} {context[name]:g}{unit}"
    if kind == "literal_error":
        return path, f"{briefly(value)} is not known; one of {context['expected']}" + _near(
            value, context["expected"]
        )
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        return _kind(path, kind, context)
    if kind == "value_error":
        return path, str(context["error"])
    if kind in ("tuple_type", "list_type") and isinstance(value, str) and _quoted(value, key):
        return path, _unquoted(path, value, key)
    return path, _shape(kind, value, context, key, error["msg"])


_COMPARE = {
    "greater_than": ("greater than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
}


def _path(place: tuple) -> tuple[KeyPath, str]:
    """The place without the kind of a gauge or an inflow, which pydantic puts between the list place and the key, and
    this kind; "" without one."""
    for above, kinds in ((("gauge",), GAUGE_KINDS), (("water", "inflow"), INFLOW_KINDS)):
        n = len(above) + 1
        if len(place) > n and place[: n - 1] == above and place[n] in kinds:
            return place[:n] + place[n + 1 :], place[n]
    return place, ""


def _unknown(path: KeyPath) -> str:
    name = str(path[-1])
    here = [known for known in names_in(path[:-1]) if known != name]
    elsewhere = [key.path for key in keys() if key.path.endswith(f".{name}") or key.path == name]
    if ".".join(part for part in path if isinstance(part, str)) in elsewhere:
        return f"unknown name for this kind; it belongs to {_kinds_with(path)}"
    if elsewhere:  # an exact name is a better hint than a similar one
        nearest = max(elsewhere, key=lambda known: _preferred(known, path))
        inside = _shared(nearest, path) == nearest.count(".")
        other = "" if inside or not here else f" Known here: {', '.join(here)}"
        return f"unknown name here; did you mean '{nearest}'?{other}"
    hint = did_you_mean(name, here)
    if hint:
        return f"unknown name{hint}"
    return f"unknown name; known here: {', '.join(here)}" if here else "unknown name"


def _kinds_with(path: KeyPath) -> str:
    """The kinds of a list of several that have a name, in words."""
    key = find(path[:-1])
    sections = () if key is None else key.sections
    found = [s for s in sections if str(path[-1]) in s.model_fields]
    kinds = [get_args(s.model_fields["kind"].annotation)[0] for s in found if "kind" in s.model_fields]
    return "kind = " + ", ".join(f"'{kind}'" for kind in kinds) if kinds else "others"


def _preferred(known: str, path: KeyPath) -> tuple[int, bool, int]:
    """Order of the names that are as well known elsewhere: sections in common with the place; a section itself; few
    sections above it."""
    key = find(tuple(known.split(".")))
    return _shared(known, path), key is not None and bool(key.sections), -known.count(".")


def _shared(known: str, path: KeyPath) -> int:
    """How many sections, from the first on, a name has in common with a place in the file."""
    wanted = [part for part in path[:-1] if not isinstance(part, int)]
    common = 0
    for one, other in zip(known.split(".")[:-1], wanted):
        if one != other:
            break
        common += 1
    return common


def _is(key: Key | None) -> str:
    if key is None:
        return "it is required"
    unit = f" [{key.unit}]" if key.unit else ""
    name = key.path.rsplit(".", 1)[-1]
    if key.sections:
        head = f"[[{key.path}]]" if key.several else f"[{key.path}]"
        return f"write a section {head}: {key.description}"
    example = f", for instance {name} = {key.example}" if key.example else ""
    return f"{key.description}{unit}{example}"


def _near(value: object, expected: str) -> str:
    return did_you_mean(str(value), [word.strip("' ") for word in expected.replace(" or ", ",").split(",")])


def _kind(path: KeyPath, kind: str, context: dict) -> tuple[KeyPath, str]:
    """A gauge or an inflow without a kind, or of an unknown kind."""
    what, kinds = (
        ("what comes in", INFLOW_KINDS) if path[0] == "water" else ("what the gauge measures", GAUGE_KINDS)
    )
    if kind == "union_tag_not_found":
        return (*path, "kind"), f"missing; {what}, one of {', '.join(kinds)}"
    tag = str(context["tag"])
    return (*path, "kind"), f"{briefly(tag)} is not known; one of {', '.join(kinds)}" + did_you_mean(
        tag, kinds
    )


def _quoted(value: str, key: Key | None) -> list[str]:
    """The items that a text was meant to be as a list, texts in quotes; none where it was hardly meant as one."""
    inside = value.strip()
    if inside.startswith("[") and inside.endswith("]"):
        inside = inside[1:-1]
    elif not _words(key):
        return []
    items = [item.strip().strip("\"'") for item in inside.split(",")]
    if key is None or key.several or any(set("[]{}=\"'") & set(item) or not item for item in items):
        return []
    return [item if _is_number(item) else f'"{item}"' for item in items]


def _is_number(item: str) -> bool:
    try:
        float(item)
    except ValueError:
        return False
    return True


def _words(key: Key | None) -> str:
    """What the items of a list of known words may be, in words; empty for other keys."""
    return key.limits.replace(" | ", ", ") if key is not None and " | " in key.limits else ""


def _unquoted(path: KeyPath, value: str, key: Key | None) -> str:
    """A list of texts without quotes, which the command line takes away unless the whole of it is quoted."""
    meant, allowed = f"[{', '.join(_quoted(value, key))}]", _words(key)
    return (
        f"{briefly(value)} is not a list, in which names and numbers with units need quotes; write {meant}, on the "
        f"command line --set '{shown(path)}={meant}'; "
        + (f"each is one of {allowed}" if allowed else _is(key))
    )


def _shape(kind: str, value: object, context: dict, key: Key | None, message: str) -> str:
    """Wrong kinds of values: a list where a number belongs, a text where a switch belongs, and so on."""
    if kind == "string_pattern_mismatch":
        return f"{briefly(value)} is no name; use letters, digits, - and _, beginning with a letter"
    if kind in ("tuple_type", "list_type") and key is not None and key.several:
        return f"write [[{key.path}]] with double brackets: there may be several"
    if kind == "list_type" and isinstance(value, str):
        return f"{briefly(value)} is not a list; write [{briefly(value)}]"
    if kind in ("tuple_type", "list_type"):
        return f"{briefly(value)} is not a list of numbers; {_is(key)}"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return f"{briefly(value)} is not a section; {_is(key)}"
    if kind == "too_long" and isinstance(value, Sized):
        return f"{len(value)} values where {context['max_length']} belong; {_is(key)}"
    if kind == "too_short" and isinstance(value, Sized):
        return f"{len(value)} values where at least {context['min_length']} belong; {_is(key)}"
    if kind == "string_too_short":
        return f"{briefly(value)} is empty; {_is(key)}"
    if kind == "bool_type":
        return f"{briefly(value)} is neither true nor false"
    if kind == "finite_number":
        return f"{briefly(value)} is not a finite number"
    if kind == "int_type":
        return f"{briefly(value)} is not a whole number"
    if kind == "string_type":
        return f"{briefly(value)} is not a text; put it in quotes"
    return f"{message[:1].lower()}{message[1:]}"
