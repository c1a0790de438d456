from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.survey.names import landmark_id


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("10", "10"),
        (" 10\t", "10"),
        ("10.0", "10"),
        ("10,000", "10"),
        ("-3.", "-3"),
        ("007", "7"),
        ("07.0", "7"),
        ("+7", "7"),
        ("-07", "-7"),
        ("0", "0"),
        ("00", "0"),
        ("-0", "0"),
        ("0A", "0A"),
        ("07.5", "07.5"),
        ("10.5", "10.5"),
        ("1e1", "1e1"),
        ("Tür A", "Tür A"),
        ("", ""),
        ("  ", ""),
        ("a\x00", ""),
        ("a;b", ""),
        ("\ufffd", ""),
    ],
)
def test_ids_have_one_form(text: str, expected: str) -> None:
    assert landmark_id(text) == expected


@given(st.text())
def test_the_form_is_final(text: str) -> None:
    assert landmark_id(landmark_id(text)) == landmark_id(text)


@given(st.integers())
def test_integers_are_themselves_however_spelled(number: int) -> None:
    assert landmark_id(str(number)) == landmark_id(f" {number}.0") == str(number)
