"""What the sheets' typeface can draw."""

from __future__ import annotations

import pytest

from vislam2tag.sheets.page import MISSING, printable


@pytest.mark.parametrize("text", ["lobby 7", "Küche", "Αθήνα", "Москва", "n° 4 – 5", ""])
def test_european_letters_are_drawn(text: str) -> None:
    assert printable(text) == text


def test_what_is_not_drawn_is_marked() -> None:
    assert printable("7日") == f"7{MISSING}"
    assert printable(MISSING) == MISSING
