"""Units at the door: the SI value is right, and what is no quantity of the right kind is refused by name."""

import contextlib
import math
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coupler.case.units import COMMON, DIMENSIONS, factor_by_pint, to_si
from coupler.program.errors import UnitError
from coupler.program.provenance import ROOT

SIZES = st.floats(1e-9, 1e9)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("4 s", "s", 4.0),
        ("20 cm", "m", 0.2),
        ("2.4 t/m3", "kg/m3", 2400.0),
        ("1 g/cm^3", "kg/m3", 1000.0),
        ("5 MN/mm", "N/m", 5e9),
        ("0.5 MPa", "Pa", 5e5),
        ("1 kN/m2", "Pa", 1e3),
        ("30 deg", "rad", math.pi / 6),
        ("60 rpm", "rad/s", 2 * math.pi),
        ("9.81 m/s2", "m/s2", 9.81),
        ("36 km/h", "m/s", 10.0),
        ("2 kg m-3", "kg/m3", 2.0),
        ("1e3 mm", "m", 1.0),
        ("-.5 m", "m", -0.5),
        ("2400 kg/m³", "kg/m3", 2400.0),
        ("2 kg·m⁻³", "kg/m3", 2.0),
        ("30 %", "", 0.3),
        ("0.5", "", 0.5),
        ("5 ms", "s", 0.005),
        ("2 pascals", "Pa", 2.0),
    ],
)
def test_text_with_a_unit_becomes_si(text, unit, value):
    """Values from the definitions of the units; digits behind a unit are powers, which pint alone refuses."""
    assert to_si(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(("unit", "text"), [(unit, text) for unit in COMMON for text in COMMON[unit]])
def test_common_units_have_the_factors_of_pint(unit, text):
    """Bit for bit, so that a case means the same numbers whichever of the two reads it."""
    assert COMMON[unit][text] == factor_by_pint(text, unit, text)


def test_a_case_with_common_units_does_without_pint():
    """pint reads a thousand definitions when it begins, which takes longer than all the rest of reading a case."""
    script = (
        "import sys; from coupler.case.units import to_si; "
        "print(to_si('24 kN/m', 'N/m'), 'pint' in sys.modules, to_si('1 kgf', 'N'), 'pint' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=60
    )
    assert done.stdout.split() == ["24000.0", "False", "9.80665", "True"], done.stderr


@given(SIZES, st.sampled_from(sorted(DIMENSIONS)))
def test_a_number_and_its_text_in_si_mean_the_same(value, unit):
    assert to_si(value, unit) == value
    assert to_si(f"{value!r} {unit}", unit) == pytest.approx(value, rel=1e-12)


@given(SIZES)
def test_prefixes_scale_by_a_thousand(value):
    """k, M and m are exact powers of ten whatever the number, so the conversion is linear."""
    assert to_si(f"{value!r} kPa", "Pa") == pytest.approx(1e3 * value, rel=1e-12)
    assert to_si(f"{value!r} MPa", "Pa") == pytest.approx(1e6 * value, rel=1e-12)
    assert to_si(f"{value!r} mm", "m") == pytest.approx(1e-3 * value, rel=1e-12)


@given(
    SIZES,
    st.sampled_from(["m", "s", "kg", "Pa", "m/s", "kg/m3"]),
    st.sampled_from(["m", "s", "kg", "Pa", "m/s"]),
)
def test_another_dimension_is_refused_by_both_names(value, given_unit, wanted):
    if given_unit == wanted:
        return
    with pytest.raises(UnitError) as refusal:
        to_si(f"{value!r} {given_unit}", wanted)
    assert f"is {DIMENSIONS[given_unit]}, needs {DIMENSIONS[wanted]} [{wanted}]" in str(refusal.value)


@given(st.text(max_size=20))
def test_any_other_text_is_refused_with_words_and_never_crashes(text):
    """Whatever stands in a case file, the answer is a number or a UnitError; pint's own parser is not that robust."""
    with contextlib.suppress(UnitError):
        assert isinstance(to_si(text, "m"), float)


@pytest.mark.parametrize(
    ("value", "unit", "says"),
    [
        ("4", "s", "has no unit"),
        ("4 furlong/fortnigt", "m/s", "unknown unit"),
        ("3 m)", "m", "unknown unit"),
        ("6,5 s", "s", "a comma is no decimal point: write '6.5 s'; "),
        ("1,000 kg/m3", "kg/m3", "write '1.000 kg/m3', or '1000 kg/m3' if it parts thousands"),
        ("3 kpa", "Pa", "did you mean 'kPa'?"),
        ("3 mn/M", "N/m", "did you mean 'MN/m'?"),
        ("0.1 MPas", "Pa", "unknown unit 'MPas'; did you mean 'MPa'?"),
        ("3 kNs/m2", "Pa s", "unknown unit 'kNs/m2'; did you mean 'kN/m2'?"),
        ("fast", "m/s", "is not a number with a unit"),
        (True, "m", "is not a number"),
        ([1], "m", "is not a number"),
        ("30 deg", "", "is an angle, needs a plain number"),
        ("2 Hz", "rad/s", "is a frequency, needs an angular velocity"),
    ],
)
def test_refusals_name_the_value_and_the_remedy(value, unit, says):
    with pytest.raises(UnitError) as refusal:
        to_si(value, unit)
    assert says in str(refusal.value)
    assert repr(value) in str(refusal.value)
