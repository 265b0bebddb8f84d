"""The line of every key, on texts with everything TOML allows; tomllib decides which keys there are."""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coupler.case.toml_lines import key_lines, line_of

TEXT = '''# comment with [brackets] and a = 1
title = "one # no comment"

[tank]   # comment
lower = [0,
         1,  # [x]
         2]
"quoted key" = 3
a.b = """
[not_a_table]
x = 1
"""

[[structure.block]]
name = 'first = 1'
turn = { axis = [0, 0, 1], angle = "30 deg" }
[structure.block.inner]
deep = true
[[structure.block]]
name = "second"
[[structure.block.part]]
size = 1
'''


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("title",), 2),
        (("tank",), 4),
        (("tank", "lower"), 5),
        (("tank", "lower", 2), 7),
        (("tank", "quoted key"), 8),
        (("tank", "a", "b"), 9),
        (("structure", "block", 0), 14),
        (("structure", "block", 0, "name"), 15),
        (("structure", "block", 0, "turn", "angle"), 16),
        (("structure", "block", 0, "inner", "deep"), 18),
        (("structure", "block", 1), 19),
        (("structure", "block", 1, "name"), 20),
        (("structure", "block", 1, "part", 0, "size"), 22),
    ],
)
def test_lines_of_keys(path, line):
    assert key_lines(TEXT)[path] == line


def test_what_is_absent_is_found_at_the_section_it_belongs_to():
    lines = key_lines(TEXT)
    assert line_of(("structure", "block", 1, "density"), lines) == 19
    assert line_of(("nothing",), lines) is None


def paths(value, above=()):
    """Every path of a parsed TOML value."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield (*above, key)
        yield from paths(inner, (*above, key))


SCALARS = st.sampled_from(
    ["1", "-2.5e3", "true", '"a ] # } text"', "'[['", "2020-01-01T00:00:00Z", '"""x\n\n]"""']
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner, max_size=3).map(lambda items: "[ " + ",\n ".join(items) + "]")
        | st.dictionaries(st.sampled_from("abc"), inner.filter(lambda v: "\n" not in v), max_size=2).map(
            lambda table: "{" + ", ".join(f"{k} = {v}" for k, v in table.items()) + "}"
        )
    ),
    max_leaves=6,
)


@given(
    st.lists(st.tuples(st.sampled_from(["[[t]]", "[[t.u]]", "# c = 1", ""]), VALUES), min_size=1, max_size=6)
)
def test_the_scan_finds_exactly_the_keys_of_the_parser(chunks):
    """Random documents: the scan's keys and tomllib's are the same set, and lines never lie outside of the text."""
    text = "first = 1\n[[t]]\n"
    for n, (header, value) in enumerate(chunks):
        text += f"{header}\nk{n} = {value}\n"
    lines = key_lines(text)
    assert set(lines) >= set(paths(tomllib.loads(text)))
    assert {path for path in lines if path not in set(paths(tomllib.loads(text)))} == set()
    assert all(1 <= line <= text.count("\n") + 1 for line in lines.values())
