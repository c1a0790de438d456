from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.dataset.comparing.comparable import ANNOTATED, comparable, read_annotated

WIFI_HEAD = "id,time,type,ssid,mac,rss,x_coord,y_coord\n"


def annotated(folder: Path, text: str, name: str = "wifi_annotated.csv") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_published_spaces_and_forms_of_numbers_go(tmp_path: Path) -> None:
    published = annotated(tmp_path / "a", WIFI_HEAD + "0,41001001651000, WLAN, eduroam, 5a:b3:17,-65,1.5,\n")
    ours = annotated(tmp_path / "b", WIFI_HEAD + "0,41001001651000,WLAN,eduroam,5a:b3:17,-65.0,1.50,\n")
    assert read_annotated(published).equals(read_annotated(ours))
    assert read_annotated(ours).row(0) == ("0", 41001001651000, "WLAN", "eduroam", "5a:b3:17", -65.0, 1.5, None)


@pytest.mark.parametrize("name", ['a, "b", c', "", ",", "x;y"])
def test_names_with_commas_are_read_whole(tmp_path: Path, name: str) -> None:
    path = annotated(tmp_path, WIFI_HEAD + f"0,1,WLAN,{name},5a:b3:17,-65,,\n")
    row = read_annotated(path).row(0, named=True)
    assert (row["mac"], row["rss"], row["x_coord"]) == ("5a:b3:17", -65.0, None)
    assert row["ssid"].count(",") == name.count(",")


def test_quoted_names_are_read_as_written(tmp_path: Path) -> None:
    table = read_annotated(annotated(tmp_path, WIFI_HEAD + '0,1, WLAN, "a,b ""c""", 5a:b3:17,-65,,\n'))
    assert table["ssid"].item() == 'a,b "c"'


def test_a_file_without_rows_is_an_empty_table(tmp_path: Path) -> None:
    table = read_annotated(annotated(tmp_path, WIFI_HEAD))
    assert table.is_empty()
    assert table.schema["time"] == pl.Int64


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"wifi_annotated.csv: expected the header id,time"),
        ("id,time\n", r"expected the header id,time,.*found id,time"),
        (WIFI_HEAD + "0,1,WLAN\n", r"line 2: expected 8 fields, found 3"),
        (WIFI_HEAD + "0,1,WLAN,a,b,loud,,\n", r"expected numbers in rss"),
    ],
)
def test_what_is_not_as_the_layout_says_is_named(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(DatasetError, match=message):
        read_annotated(annotated(tmp_path, text))


def test_a_sensors_line_with_a_field_too_many_is_named(tmp_path: Path) -> None:
    head = "time,type,v1,v2,v3,v4,v5,v6,x_coord,y_coord\n"
    path = annotated(tmp_path, head + "1, ACC,1,2,3,0,0,0,,,\n", "sensors_annotated.csv")
    with pytest.raises(DatasetError, match="line 2: expected 10 fields, found 11"):
        read_annotated(path)


def test_sessions_of_the_labelled_layout_are_its_folders(tmp_path: Path) -> None:
    annotated(tmp_path / "floor_0" / "LG" / "walk", WIFI_HEAD)
    found = comparable(tmp_path)
    assert (found.kind, found.sessions) == (ANNOTATED, {"floor_0/LG/walk"})


def test_a_folder_with_nothing_to_compare_is_refused(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text('{"program": "something else"}')
    with pytest.raises(UsageError, match="holds nothing to compare; give data sets"):
        comparable(tmp_path)
