"""Values with their errors: one rule of rounding, wherever a person reads them."""

import math
import re
from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rbdyn.base.words import error_alone, signed_with_error, value_alone, with_error
from rbdyn.result import Quantity

ROOT = Path(__file__).parents[2]
SIZES = st.floats(-12.0, 12.0).map(lambda power: 10.0**power)
VALUES = st.builds(lambda size, sign: sign * size, SIZES, st.sampled_from((-1.0, 0.0, 1.0)))


def last_digit(text: str) -> Decimal:
    """Unit of the last digit that is written: 0.01 of '2.35', 10 of '1230' with its last zero not written exactly."""
    mantissa, _, power = text.partition("e")
    return Decimal(1).scaleb(Decimal(mantissa).as_tuple().exponent + int(power or 0))


@given(value=VALUES, error=SIZES)
@example(value=231.472, error=0.0057)
@example(value=5.0, error=0.0996)
@example(value=1234.5, error=99.6)
@example(value=9999999.5, error=1234.0)
@example(value=-1e-9, error=0.03)
def test_invariant_value_and_error_end_at_the_same_decimal_and_parse_back(value, error):
    """Invariant: both end at one decimal, the error has two significant digits, both parse back to half a unit of it."""
    texts = with_error(value, error).split(" ± ")
    unit = Decimal(f"{Decimal(error):.1e}").adjusted() - 1
    assert last_digit(texts[0]) == last_digit(texts[1])
    # Whole tens and hundreds are written out: their last digit that counts stands before the point.
    assert last_digit(texts[1]) == Decimal(1).scaleb(unit if unit < 0 or "e" in texts[1] else 0)
    for text, number in zip(texts, (value, error), strict=True):
        assert abs(Decimal(text) - Decimal(number)) <= Decimal("0.5").scaleb(unit) + abs(Decimal(number)) * Decimal(
            "1e-15"
        )
        assert Decimal(text) % Decimal(1).scaleb(unit) == 0 and not re.match(r"-0\.?0*$", text)
    assert len(str(Decimal(texts[1]).scaleb(-unit).to_integral_value())) == 2


def test_unit_signs_and_parts_follow_the_same_rule():
    """Unit: a difference has its sign; a value without its error beside it, and an error alone, end where both would."""
    assert [signed_with_error(x, 0.52) for x in (1.0, -1.0, -0.001)] == ["+1.00 ± 0.52", "-1.00 ± 0.52", "+0.00 ± 0.52"]
    assert [value_alone(162.93, error) for error in (3.04, 0.74, None)] == ["162.9", "162.93", "162.93"]
    assert [error_alone(error) for error in (3.0, 0.744, 0.0, None, math.nan)] == ["± 3.0", "± 0.74", "± 0", "", ""]
    assert str(Quantity(162.93, 3.04, 0.744, 9.0)) == "162.9 ± 3.0 (statistical) ± 0.74 (numerical)"


@pytest.mark.parametrize("folder", ["rbdyn", "doe", "examples"])
def test_invariant_no_other_place_formats_a_value_with_its_error(folder):
    """Invariant: '{...} ± {...}' is written in one module alone."""
    own = re.compile(r"\} *(?:±|\+-) *\{")
    sources = [path for path in (ROOT / folder).rglob("*.py") if own.search(path.read_text(encoding="utf-8"))]
    assert [path.name for path in sources if path.name != "words.py"] == []


def test_unit_a_value_without_a_statistical_error_has_five_digits():
    """Unit: an error of the time steps alone bears no digits of a figure that scatters."""
    alone = Quantity(212.00564, None, 0.00039, 1.0)
    assert alone.value_text == "212.01" and alone.stated_error is None and alone.simulated_value.stated_error is None
    assert Quantity(212.00564, 0.3, 0.4, 9.0).simulated_value.error == pytest.approx(0.5)
    assert (
        Quantity(212.00564, 0.35, 0.00039, 1.0).value_text == "212.01"
        and Quantity(212.0, None, None, 1.0).value_text == "212"
    )
    assert Quantity(212.00564, 0.035, 0.00039, 9.0).value_text == "212.006"
