"""`--option KEY=VALUE` of a cluster engine as keywords of submitit or dask-jobqueue."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from coupler.program.errors import BadCall

Value = int | str | list[str]


def keywords(options: Iterable[str], lists: Collection[str]) -> dict[str, Value]:
    """Values by key: whole numbers, texts, and for a key in `lists` all its values in the order given.

    Raises BadCall for another key that is given twice.
    """
    found: dict[str, Value] = {}
    wrong = []
    for option in options:
        key, _, text = option.partition("=")
        if key in lists:
            found.setdefault(key, []).append(text)
        elif key in found:
            known = ", ".join(sorted(lists))
            wrong.append(
                f"--option {key}: given twice ({found[key]}, {text}); those that may be repeated are {known}"
            )
        else:
            found[key] = int(text) if text.isdecimal() else text
    if wrong:
        raise BadCall(wrong)
    return found
