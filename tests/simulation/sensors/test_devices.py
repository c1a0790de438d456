import pytest

from vislam2tag.simulation.choices import Locale
from vislam2tag.simulation.sensors.devices import device_names, make_device
from vislam2tag.simulation.writing.session import DecimalMarks


def test_the_first_phones_are_the_published_ones() -> None:
    assert device_names(2) == ("LG", "OnePlus")
    assert device_names(6) == ("LG", "OnePlus", "Galaxy", "S20", "Phone5", "Phone6")


def test_a_phone_keeps_its_constants_whatever_it_is_used_for() -> None:
    assert make_device("LG_ref", Locale.MIXED, 3) == make_device("LG", Locale.MIXED, 3)
    assert make_device("LG", Locale.MIXED, 3).receiver != make_device("LG", Locale.MIXED, 4).receiver
    assert make_device("LG", Locale.MIXED, 3).receiver != make_device("S20", Locale.MIXED, 3).receiver


@pytest.mark.parametrize(
    ("name", "locale", "marks"),
    [
        ("LG", Locale.MIXED, DecimalMarks(",", ",")),
        ("OnePlus_tachy", Locale.MIXED, DecimalMarks(",", ".")),
        ("Phone5", Locale.MIXED, DecimalMarks(".", ".")),
        ("Galaxy", Locale.DE, DecimalMarks(",", ",")),
        ("LG", Locale.EN, DecimalMarks(".", ".")),
    ],
)
def test_decimal_marks(name: str, locale: Locale, marks: DecimalMarks) -> None:
    assert make_device(name, locale, 0).marks == marks
