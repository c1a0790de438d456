"""File names of images: safe, different, and telling where they can."""

from __future__ import annotations

import re

from hypothesis import example, given
from hypothesis import strategies as st

from vislam2tag.sheets.sheet_folder import image_names

SAFE = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]*\.png")


def test_plain_ids_are_their_own_names() -> None:
    assert image_names(["7", "lobby", "A-12", "b.3"]) == ("7.png", "lobby.png", "A-12.png", "b.3.png")


@given(ids=st.lists(st.text(min_size=1), unique=True, min_size=1, max_size=8))
@example(ids=["..", ".", "...", ":", "::"])
@example(ids=["a", "A", "a/b", "a:b", "a b", "ab", "a\\b"])
@example(ids=["CON", "con", "nul.x", "com1", "console"])
@example(ids=["é", "è", "日本", "-"])
@example(ids=["x" * 300, "x" * 301])
def test_names_are_safe_and_differ_on_every_file_system(ids: list[str]) -> None:
    names = image_names(ids)
    assert len({name.lower() for name in names}) == len(ids)
    for name in names:
        assert SAFE.fullmatch(name), name
        assert len(name) <= 140
        assert not re.fullmatch(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\..*)?", name)
    assert image_names(ids) == names
