from __future__ import annotations

import pytest

from vislam2tag.views import page


def unbroken(text: str) -> str:
    return text.replace(" ", "\u00a0")


@pytest.mark.parametrize(
    ("share", "text"),
    [(None, "–"), (0.0, "0 %"), (0.001, "< 1 %"), (0.5, "50 %"), (0.994, "99 %"), (0.9999, "> 99 %"), (1.0, "100 %")],
)
def test_percent_never_rounds_to_all_or_nothing(share: float | None, text: str) -> None:
    assert page.percent(share) == unbroken(text)


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (None, "–"),
        (0.0, "0.0 s"),
        (59.94, "59.9 s"),
        (59.96, "1 min 00 s"),
        (245.4, "4 min 05 s"),
        (3599.7, "1 h 00 min"),
        (7380, "2 h 03 min"),
    ],
)
def test_duration(seconds: float | None, text: str) -> None:
    assert page.duration(seconds) == unbroken(text)


def test_numbers_carry_units() -> None:
    assert page.distance(1234.4) == unbroken("1\u202f234 m")
    assert page.distance(12_340) == unbroken("12.3 km")
    assert page.distance(None) == "–"
    assert page.number(1.236, 2, "m/s") == unbroken("1.24 m/s")
    assert page.number(None, 2, "m/s") == "–"
    assert page.size(1_500) == unbroken("1.5 kB")
    assert page.size(2_300_000) == unbroken("2.3 MB")
    assert page.words("scan_throttling") == "scan throttling"
