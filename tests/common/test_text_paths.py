"""Text is a path, and one path where several may stand."""

from __future__ import annotations

from pathlib import Path

from vislam2tag.common.text_paths import path_or_none, paths_of


def test_a_path_may_be_left_out() -> None:
    assert path_or_none(None) is None
    assert path_or_none("a") == path_or_none(Path("a")) == Path("a")


def test_one_path_or_several() -> None:
    assert paths_of("survey") == paths_of(Path("survey")) == [Path("survey")]
    assert paths_of(("a", Path("b"))) == [Path("a"), Path("b")]
