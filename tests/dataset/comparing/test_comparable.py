from __future__ import annotations

from pathlib import Path

import pytest

from vislam2tag.common.errors import UsageError
from vislam2tag.dataset.comparing.comparable import ANNOTATED, comparable

WIFI_HEAD = "id,time,type,ssid,mac,rss,x_coord,y_coord\n"


def annotated(folder: Path, text: str, name: str = "wifi_annotated.csv") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_sessions_of_the_labelled_layout_are_its_folders(tmp_path: Path) -> None:
    annotated(tmp_path / "floor_0" / "LG" / "walk", WIFI_HEAD)
    found = comparable(tmp_path)
    assert (found.kind, found.sessions) == (ANNOTATED, {"floor_0/LG/walk"})


def test_a_folder_with_nothing_to_compare_is_refused(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text('{"program": "something else"}')
    with pytest.raises(UsageError, match="holds nothing to compare; give data sets"):
        comparable(tmp_path)
