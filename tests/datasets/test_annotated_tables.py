"""Annotated tables are read whatever blanks lead their fields, and what is wrong is named by its line.

Privacy of labels that become no data set, and of the raw files beside them.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.common.errors import DatasetError
from vislam2tag.datasets.annotated_tables import (
    SENSORS_FILE,
    WIFI_FILE,
    PrivateLabels,
    hidden_wifi_file,
    read_annotated,
)
from vislam2tag.datasets.labelled import LabelledSession, open_labelled
from vislam2tag.datasets.privacy import Privacy, hashed
from vislam2tag.sessions.readings import WIFI_LINES

WIFI_HEAD = "id,time,type,ssid,mac,rss,x_coord,y_coord\n"


def annotated(folder: Path, text: str, name: str = WIFI_FILE) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_published_blanks_and_forms_of_numbers_go(tmp_path: Path) -> None:
    published = annotated(tmp_path / "a", WIFI_HEAD + "0,41001001651000, WLAN, eduroam, 5a:b3:17,-65,1.5,\n")
    ours = annotated(tmp_path / "b", WIFI_HEAD + "0,4.1001001651e13,WLAN,eduroam,5a:b3:17,-65.0,1.50,\n\n")
    assert read_annotated(published).equals(read_annotated(ours))
    assert read_annotated(ours).row(0) == (0, 41001001651000, "WLAN", "eduroam", "5a:b3:17", -65.0, 1.5, None)


@pytest.mark.parametrize("name", ['a, "b", c', "", ",", "x;y"])
def test_names_with_commas_are_read_whole(tmp_path: Path, name: str) -> None:
    path = annotated(tmp_path, WIFI_HEAD + f"0,1,WLAN,{name},5a:b3:17,-65,,\n")
    row = read_annotated(path).row(0, named=True)
    assert (row["mac"], row["rss"], row["x_coord"], row["ssid"]) == ("5a:b3:17", -65.0, None, name)


def test_quoted_names_are_read_as_written(tmp_path: Path) -> None:
    table = read_annotated(annotated(tmp_path, WIFI_HEAD + '0,1, WLAN, "a,b ""c""", 5a:b3:17,-65,,\n'))
    assert table["ssid"].item() == 'a,b "c"'


def test_sensors_are_typed(tmp_path: Path) -> None:
    head = "time,type,v1,v2,v3,v4,v5,v6,x_coord,y_coord\n"
    table = read_annotated(annotated(tmp_path, head + "1, ACC,1,2,3e-1,0,0,,1.5,2\r\n", SENSORS_FILE))
    assert table.row(0) == (1, "ACC", 1.0, 2.0, 0.3, 0.0, 0.0, None, 1.5, 2.0)


@pytest.mark.parametrize("name", [WIFI_FILE, SENSORS_FILE])
def test_a_file_without_rows_is_an_empty_table(tmp_path: Path, name: str) -> None:
    head = WIFI_HEAD if name == WIFI_FILE else "time,type,v1,v2,v3,v4,v5,v6,x_coord,y_coord"
    table = read_annotated(annotated(tmp_path, head, name))
    assert table.is_empty()
    assert table.schema["time"] == pl.Int64


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"wifi_annotated.csv: line 1: expected id,time"),
        ("id,time\n", r"line 1: expected id,time,.*found id,time"),
        (WIFI_HEAD + "0,1,WLAN\n", r"line 2: expected 8 fields, found 3"),
        (WIFI_HEAD + "0,1,WLAN,a,b,-1,1,1\n\n0,1,WLAN,a,b,loud,,\n", r"line 4: expected .* with numbers for .*rss"),
        (WIFI_HEAD + "0,1,WLAN,a,b,-1,1,1\n0,1,WLAN,a,,-1,1,1\n", r"line 3: expected id,time"),
    ],
)
def test_what_is_not_as_the_layout_says_is_named(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(DatasetError, match=message):
        read_annotated(annotated(tmp_path, text))


def test_a_sensors_line_with_a_field_too_many_is_named(tmp_path: Path) -> None:
    head = "time,type,v1,v2,v3,v4,v5,v6,x_coord,y_coord\n"
    path = annotated(tmp_path, head + "1, ACC,1,2,3,0,0,0,,,\n", SENSORS_FILE)
    with pytest.raises(DatasetError, match="line 2: expected 10 fields, found 11"):
        read_annotated(path)


KEY = b"0123456789abcdef"


@pytest.fixture
def opted_out(labels: Path, tmp_path: Path) -> tuple[str, tuple[LabelledSession, ...]]:
    """Labels where one reading of one access point names a network that opted out."""
    shutil.copytree(labels, tmp_path / "labels")
    file = min((tmp_path / "labels" / "wifi").iterdir())
    table = pl.read_parquet(file)
    named = pl.when(pl.int_range(pl.len()) == 3).then(pl.lit("home_nomap")).otherwise("ssid")
    table.with_columns(ssid=named).write_parquet(file)
    return str(table["bssid"][3]), open_labelled(tmp_path / "labels").sessions


def test_a_network_that_opted_out_goes_by_whatever_name(opted_out: tuple[str, tuple[LabelledSession, ...]]) -> None:
    bssid, sessions = opted_out
    private = PrivateLabels.of(sessions, Privacy())
    everywhere = pl.concat([session.table("wifi", ("bssid", "ssid")) for session in sessions])
    count = int((everywhere["bssid"] == bssid).sum())
    assert private.unwanted == {bssid}
    assert count > 1
    assert [(finding.kind, finding.count) for finding in private.findings] == [("nomap_left_out", count)]
    assert bssid not in private.hidden(everywhere)["bssid"]
    asked_for = PrivateLabels.of(sessions, Privacy(include_nomap=True))
    assert not asked_for.hides
    assert asked_for.hidden(everywhere).equals(everywhere)


def test_addresses_and_names_are_hidden() -> None:
    private = PrivateLabels(Privacy(hash_key=KEY, keep_ssids=False), frozenset({"x"}), 1)
    rows = private.hidden(pl.DataFrame({"bssid": ["a", "x", "b"], "ssid": ["n", "m", ""], "row": [1, 2, 3]}))
    assert rows.rows() == [(hashed("a", KEY), "", 1), (hashed("b", KEY), "", 3)]


def test_a_raw_file_keeps_what_is_not_hidden() -> None:
    data = b"0; 11; WLAN; a; b; c; 00:01; -40\n0;12;WLAN;;00:02;-41,5\ngarbage\n1; 13; WLAN; n\xff; 00:03; -42"
    rows = WIFI_LINES.read(data, "wifi.csv").rows.select("row", "bssid", "ssid")
    assert hidden_wifi_file(data, rows).split(b"\n") == [
        b"0; 11; WLAN; a; b; c; 00:01; -40",
        b"0;12;WLAN;;00:02;-41,5",
        b"1; 13; WLAN; n\xff; 00:03; -42",
        b"",
    ]
    private = rows.filter(pl.col("row") != 2).with_columns(bssid=pl.lit("hash"), ssid=pl.lit(""))
    assert hidden_wifi_file(data, private) == b"0; 11; WLAN; ; hash; -40\n1; 13; WLAN; ; hash; -42\n"


@given(ssid=st.text(st.characters(exclude_characters="\n\r", codec="utf-8"), max_size=12))
def test_what_is_rewritten_reads_back(ssid: str) -> None:
    data = f"5; 77; WLAN; {ssid}; 00:01; -40\n".encode()
    rows = WIFI_LINES.read(data, "wifi.csv").rows
    changed = rows.with_columns(bssid=pl.lit("hash"))
    back = WIFI_LINES.read(hidden_wifi_file(data, changed.select("row", "bssid", "ssid")), "wifi.csv").rows
    assert back.equals(changed)
