"""Files at paths that the user gave appear whole, and leave nothing where they cannot."""

from __future__ import annotations

from pathlib import Path

import pytest

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.whole_file import file_to_write, write_file


def test_a_file_appears_when_the_block_ends(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    target.write_text("old")
    with file_to_write(target) as file:
        file.write(b"new")
        assert target.read_text() == "old"
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]


def test_a_block_that_fails_leaves_what_was_there(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    target.write_text("old")

    def interrupted() -> None:
        with file_to_write(target) as file:
            file.write(b"half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_places_that_cannot_be_written_are_reported(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    for target in (tmp_path / "absent" / "a.txt", tmp_path / "folder"):
        with pytest.raises(OutputError, match="cannot be written"):
            write_file(target, "new")
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]


def test_a_link_that_the_user_named_is_followed(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "disk" / "a.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to(tmp_path / "disk" / "a.txt")
    write_file(tmp_path / "link.txt", "new")
    assert (tmp_path / "disk" / "a.txt").read_text() == "new"
    assert (tmp_path / "link.txt").is_symlink()
