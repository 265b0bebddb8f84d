"""The page about the case file is what the schema says, and every name says what it is."""

import pytest

from coupler.case.docs import PAGE, explanation, page
from coupler.case.keys import keys
from coupler.case.units import DIMENSIONS


def test_the_page_is_up_to_date():
    """Remedy: .venv/bin/python -m coupler.case.docs"""
    assert PAGE.read_text(encoding="utf-8") == page()


@pytest.mark.parametrize("key", list(keys()), ids=lambda key: key.path)
def test_every_name_has_a_description_and_a_known_unit(key):
    assert key.description
    assert key.unit in DIMENSIONS
    assert key.path in explanation(key.path)
