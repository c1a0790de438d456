"""Tags of levels are understood as OpenStreetMap writes them, and a level is chosen by any of its names."""

from __future__ import annotations

import pytest

from vislam2tag.site.plans.levels import chosen_level, in_order, levels_of


@pytest.mark.parametrize(
    ("value", "levels"),
    [
        ("0", {"0"}),
        (0.0, {"0"}),
        ("0;1", {"0", "1"}),
        ("0-3", {"0", "1", "2", "3"}),
        ("-2--1; 0.5", {"-2", "-1", "0.5"}),
        ("1-0", {"0", "1"}),
        ([0, "1"], {"0", "1"}),
        ("EG", {"EG"}),
        ("0-999999999", {"0-999999999"}),
        (None, set()),
        ("", set()),
    ],
)
def test_levels_of_a_tag(value: object, levels: set[str]) -> None:
    assert levels_of(value) == levels


def test_order() -> None:
    assert in_order(frozenset({"EG", "10", "-1", "2"})) == ["-1", "2", "10", "EG"]


LEVELS = [("id-1", "KG", "-1"), ("id0", "EG", "0")]


@pytest.mark.parametrize(("wanted", "number"), [("0", 1), ("0.0", 1), ("eg", 1), ("-1", 0), ("id-1", 0), ("", 0)])
def test_a_level_by_any_name(wanted: str, number: int) -> None:
    assert chosen_level(LEVELS, wanted) == number


def test_the_only_level_needs_no_name() -> None:
    assert chosen_level(LEVELS[:1], None) == 0


@pytest.mark.parametrize(
    ("levels", "wanted", "message"),
    [
        (LEVELS, None, "has the levels -1, 0: choose one with --level"),
        (LEVELS, "7", "has no level 7; there are: -1, 0"),
        ([("A", "0"), ("A", "1")], "A", "has 2 levels A; there are: 0, 1"),
        ([("west", "0"), ("east", "0"), ("top", "1")], "0", "has 2 levels 0; there are: west, east, 1"),
        ([], "0", "has no levels"),
    ],
)
def test_none_or_several(levels: list[tuple[str, ...]], wanted: str | None, message: str) -> None:
    with pytest.raises(OSError, match=message):
        chosen_level(levels, wanted)
