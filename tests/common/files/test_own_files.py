"""The record of a folder's own files owns what it names, and names nothing outside its folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.own_files import OWN_FILES, OwnFiles

RECORD = OwnFiles.of(["summary.json", "plans/floor_0.png"], ["sessions", "wifi"], ["floor_0_a", "floor_0_a.b"])


def test_it_owns_what_it_names_and_itself() -> None:
    owned = ("summary.json", "plans/floor_0.png", "wifi/floor_0_a.parquet", "sessions/floor_0_a.b.json", OWN_FILES)
    assert all(map(RECORD.owns, owned))


@pytest.mark.parametrize(
    "relative",
    [
        "notes.txt",
        "plans",
        "plans/notes.txt",
        "sessions/notes.json",
        "wifi/floor_0_a",
        "wifi/floor_0_mine.parquet",
        "backup/floor_0_a.parquet",
        "wifi/old/floor_0_a.parquet",
        "floor_0_a.parquet",
        "wifi/.hidden",
    ],
)
def test_all_else_is_the_users(relative: str) -> None:
    assert not RECORD.owns(relative)


def test_it_is_read_as_it_was_written(tmp_path: Path) -> None:
    assert OwnFiles.read(tmp_path) is None
    (tmp_path / OWN_FILES).write_text(RECORD.text())
    assert OwnFiles.read(tmp_path) == RECORD


def test_two_records_become_one() -> None:
    both = RECORD.with_those_of(OwnFiles.of(["summary.json", "report.html"], ["rtt"], ["floor_1_c"]))
    assert both.owns("report.html")
    assert both.owns("wifi/floor_1_c.parquet")
    assert both.files == ("plans/floor_0.png", "report.html", "summary.json")


@pytest.mark.parametrize(
    "content",
    [
        "",
        "[]",
        '{"files": ["../other"]}',
        '{"files": ["/etc/passwd"]}',
        '{"files": ["C:/other"]}',
        '{"files": ["a/../../other"]}',
        '{"files": ["a\\\\b"]}',
        '{"files": [""]}',
        '{"folders": ["a/b"]}',
        '{"stems": [".."]}',
        '{"stems": ["a/b"]}',
        '{"of_a_later_version": 1}',
    ],
)
def test_a_record_that_is_damaged_or_leads_out_of_its_folder_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / OWN_FILES).write_text(content)
    with pytest.raises(OutputError, match=r"\.vislam2tag-files: is damaged"):
        OwnFiles.read(tmp_path)
