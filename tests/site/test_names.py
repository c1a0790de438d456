from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.site.model import (
    SessionKey,
    is_portable,
    landmark_id,
    portable_name,
    same_name,
    session_slugs,
    unique_slugs,
)

KEYS = st.builds(SessionKey, st.integers(-3, 3), st.text(min_size=1, max_size=6), st.text(min_size=1, max_size=200))


def test_colons_go_and_unsafe_characters_become_hyphens() -> None:
    keys = [SessionKey(4, "LG_ref", "2022-01-14T16:35:30"), SessionKey(-1, "One Plus/ä", "a b")]
    assert session_slugs(keys) == ("floor_4.LG_ref.2022-01-14T163530", "floor_-1.One-Plus-.a-b")


def test_only_colliding_slugs_get_a_suffix_and_always_the_same() -> None:
    keys = [SessionKey(1, "LG", name) for name in ("a b", "a?b", "A-B", "c")]
    slugs = session_slugs(keys)
    assert len({slug.lower() for slug in slugs}) == 4
    assert [slug[:12] for slug in slugs] == ["floor_1.LG.a", "floor_1.LG.a", "floor_1.LG.A", "floor_1.LG.c"]
    assert slugs[3] == "floor_1.LG.c"
    assert session_slugs(keys[::-1])[::-1] == slugs


@pytest.mark.parametrize("name", ["CON", "con.txt", "nul.", "LPT1.a.b", "walk.", "..."])
def test_names_that_windows_does_not_allow_are_marked(name: str) -> None:
    (slug,) = unique_slugs([name])
    assert slug.split(".")[0].lower() not in {"con", "nul", "lpt1"}
    assert not slug.endswith((".", " "))
    assert unique_slugs(["console", "walk.1"]) == ("console", "walk.1")


@given(st.lists(KEYS, unique=True, max_size=8))
def test_slugs_are_safe_and_unique_on_every_file_system(keys: list[SessionKey]) -> None:
    slugs = session_slugs(keys)
    assert len({slug.lower() for slug in slugs}) == len(keys)
    assert all(re.fullmatch(r"[A-Za-z0-9._-]{1,140}", slug) for slug in slugs)


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


@given(st.text(max_size=300))
def test_a_portable_name_is_one(name: str) -> None:
    made = portable_name(name)
    assert made == "" or is_portable(made)
    assert portable_name(made) == made


@pytest.mark.parametrize(
    ("name", "made"),
    [
        ("CON", "_CON"),
        ("aux.csv", "_aux.csv"),
        ("Com1 .txt", "_Com1 .txt"),
        ("conin$", "_conin$"),
        ("console", "console"),
        ("name.", "name"),
        ("name. .", "name"),
        (" name ", "name"),
        ("a/b:c", "a-b-c"),
        ("..", ""),
    ],
)
def test_names_are_brought_to_what_every_system_takes(name: str, made: str) -> None:
    assert portable_name(name) == made
    assert is_portable(name) == (name == made)


def test_names_that_are_one_file_on_some_systems_compare_equal() -> None:
    assert same_name("B\u00e4r") == same_name("ba\u0308R")
    assert same_name("a") != same_name("b")
