"""Numbers with units."""

import pytest

from romgen.settings.quantities import UNITS, parse_quantity


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("9.1 kN", "N", 9100.0),
        ("1.5mm", "m", 1.5e-3),
        (" -2e-3 m ", "m", -2e-3),
        ("195 GPa", "Pa", 195e9),
        ("7.9e-9 t/mm^3", "kg/m^3", 7900.0),
        ("7.9 g/cm3", "kg/m^3", 7900.0),
        ("0.4 %", "1", 0.004),
        ("0.1 ms", "s", 1e-4),
        ("20 N/mm^3", "N/m^3", 2e10),
        ("3 m", "m", 3.0),
    ],
)
def test_text_becomes_si(text: str, unit: str, value: float) -> None:
    # one decimal-to-binary conversion and one product: three half units in the last place
    assert parse_quantity(text, unit) == pytest.approx(value, rel=3.4e-16)


@pytest.mark.parametrize("text", ["1.5 furlong", "mm", "1,5 mm", "1.5 kN m", "", "3"])
def test_nonsense_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"unknown unit|not a number"):
        parse_quantity(text, "m")


def test_numbers_pass_unchanged() -> None:
    assert parse_quantity(2.5, "m") == 2.5


def test_bare_numbers_are_si() -> None:
    for unit in UNITS:
        assert parse_quantity(f"2.5 {unit}" if unit != "1" else "2.5", unit) == 2.5
