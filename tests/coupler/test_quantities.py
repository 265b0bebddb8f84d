"""Numbers for people: short, and without powers of ten where whole digits say it."""

import pytest

from coupler.program.quantities import in_one_unit, length, moment_of, percent, quantity


@pytest.mark.parametrize(
    ("said", "wanted"),
    [
        (moment_of(0.5678), "0.5678 s"),
        (moment_of(0.001), "1 ms"),
        (moment_of(9999.7), "10000 s"),
        (moment_of(36000.0), "36000 s"),
        (length(0.05), "50 mm"),
        (length(12.345), "12.3 m"),
        (length(999.7), "1000 m"),
        (length(12345.6), "12346 m"),
        (percent(0.0123), "1.23 %"),
        (percent(9.9999), "1000 %"),
        (percent(-12.5), "-1250 %"),
        (quantity(999.97, "N"), "1000 N"),
        (quantity(9999.7, "kg/m3"), "10000 kg/m³"),
        (quantity(2.5e-10, "Pa"), "0.25 nPa"),
        (in_one_unit(-12345678.0, 1), "-12346"),
        (quantity(None, "m"), "–"),
    ],
)
def test_numbers_are_said_without_powers_of_ten(said, wanted):
    """A tide of ten hours ends at 36000 s, not at 3.6e+04 s."""
    assert said == wanted
