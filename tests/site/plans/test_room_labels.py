"""Which texts are labels of rooms."""

from __future__ import annotations

import pytest

from vislam2tag.site.plans.room_labels import room_labels
from vislam2tag.site.plans.source import PlanText


def labels(*texts: str) -> list[str]:
    return [one.text for one in room_labels([PlanText(text, (0.0, 0.0)) for text in texts])]


@pytest.mark.parametrize("number", ["101", "1.23", "A-102", "E 012", "101a", "B2.014", "H.1.204", "2/14"])
def test_numbers_of_rooms(number: str) -> None:
    assert labels(number, "Office", "12.5 m2", "1:100", "A", "7", "+3.50", "12,5") == [number]


def test_dimensions_repeat_and_room_numbers_do_not() -> None:
    assert labels("4.25", "4.25", "3.50", "3.50", "1.01 A") == ["1.01 A"]


def test_a_number_counts_once_and_is_found_among_lines() -> None:
    assert labels("E.012\nOffice\n23 m2", *(f"E.1{number}" for number in range(10, 30)), "E.012") == [
        "E.012", *(f"E.1{number}" for number in range(10, 30))
    ]  # fmt: skip


def test_names_count_without_numbers() -> None:
    assert labels("Büro", "WC", "Building 12", "Flur") == ["Büro", "WC", "Flur"]
