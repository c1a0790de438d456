"""UJIIndoorLoc: our own files and files as published."""

from __future__ import annotations

import datetime as dt
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest

from tests.datasets.factory import SCANS, small_dataset
from tests.datasets.formats.round_trip import (
    ODD_BSSID,
    ODD_DEVICE,
    exported,
    imported,
    odd_dataset,
    through,
    with_split,
)
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.datasets.format_registry import import_format_of
from vislam2tag.datasets.formats.uji import wap_columns
from vislam2tag.datasets.schema import FINGERPRINTS

TAIL = "LONGITUDE,LATITUDE,FLOOR,BUILDINGID,SPACEID,RELATIVEPOSITION,USERID,PHONEID,TIMESTAMP"


def published(folder: Path) -> Path:
    """The two files as published: 520 columns, most of them empty, places as projected metres."""
    folder.mkdir()
    header = ",".join([*(f"WAP{number:03d}" for number in range(1, 521)), TAIL])

    def row(levels: dict[int, int], rest: str) -> str:
        return ",".join([*(str(levels.get(number, 100)) for number in range(1, 521)), rest])

    train = [
        row({1: -97, 520: 0}, "-7541.264300000295,4864920.778200001,2,1,106,2,2,23,1371713733"),
        row({2: -60}, "-7536.621199999005,4864934.225099999,2,1,106,2,2,23,1371713691"),
    ]
    test = [row({2: -71}, "-7515.916799999774,4864889.66300000,1,1,0,0,0,0,1380872703")]
    (folder / "trainingData.csv").write_text("\n".join([header, *train]) + "\n")
    (folder / "validationData.csv").write_text("\n".join([header, *test]) + "\n")
    return folder


def test_files_as_published(tmp_path: Path) -> None:
    assert import_format_of(published(tmp_path / "UJIndoorLoc")).name == "uji"
    read = imported("uji", tmp_path / "UJIndoorLoc", tmp_path / "scratch")
    rows = read.fingerprints.sort("start_ns").collect()
    assert rows["x"].to_list() == [-7536.621199999005, -7541.264300000295, -7515.916799999774]
    assert rows["floor"].to_list() == [2, 2, 1]
    assert rows["building"].to_list() == ["1"] * 3
    assert rows["user"].to_list() == ["2", "2", None]  # 0 says that the user is not known
    assert rows["date"].to_list() == [dt.date(2013, 6, 20)] * 2 + [dt.date(2013, 10, 4)]
    assert rows["session"].to_list()[0] == "building_1.user_2.phone_23.2013-06-20"
    heard = read.readings.collect()
    assert sorted(zip(heard["bssid"], heard["rssi_dbm"], strict=True)) == [
        ("WAP001", -97.0),
        ("WAP002", -71.0),
        ("WAP002", -60.0),
        ("WAP520", 0.0),
    ]
    train, test = read.splits["official"].train_test_ids(read.splits["official"].info.folds[0])
    assert (len(train), len(test)) == (2, 1)


def test_one_file_alone_has_no_split(tmp_path: Path) -> None:
    folder = published(tmp_path / "UJIndoorLoc")
    read = imported("uji", folder / "validationData.csv", tmp_path / "scratch")
    assert read.fingerprints.collect().height == 1
    assert not read.splits


def test_names_come_back_however_odd(tmp_path: Path) -> None:
    dataset = odd_dataset()
    back = through(dataset, "uji", tmp_path)
    rows = back.fingerprints.collect()
    assert set(rows["device"]) == {ODD_DEVICE, "Pixel"}
    assert set(rows["user"]) == {'Ö\'Neil, "B"'}
    assert set(rows["building"]) == {""}
    assert ODD_BSSID in back.access_points.collect()["bssid"]
    assert back.access_points.collect()["ssid"].null_count() == 10


def test_times_in_milliseconds_are_recognised(tmp_path: Path) -> None:
    folder = published(tmp_path / "UJIndoorLoc")
    seconds = imported("uji", folder, tmp_path / "scratch")
    file = folder / "trainingData.csv"
    head, *rows = file.read_text().splitlines()
    file.write_text("\n".join([head, *(f"{row}000" for row in rows)]) + "\n")
    read = imported("uji", folder, tmp_path / "scratch2")
    times = [each.fingerprints.select("start_ns", "session").collect() for each in (seconds, read)]
    assert times[0].equals(times[1])
    (finding,) = (each for each in read.info.findings if each.kind == "time_unit")
    assert finding.file == "trainingData.csv"
    assert "these are in milliseconds" in finding.message


def test_times_that_a_spreadsheet_rounded_are_not_used(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    rows = "-60,100,1.5,2.5,3.0,1,0,0,4,5,1.38E+09\n100,-70,3.5,4.5,1.0,1,0,0,4,5,1.38E+09\n"
    (tmp_path / "in" / "trainingData.csv").write_text(f"wap001,wap002,{TAIL.lower()}\n{rows}")
    dataset = imported("uji", tmp_path / "in", tmp_path / "scratch")
    found = dataset.fingerprints.select("x", "y", "floor", "start_ns").sort("x").collect()
    assert found.rows() == [(1.5, 2.5, 3, None), (3.5, 4.5, 1, None)]
    assert "rounded_times" in {finding.kind for finding in dataset.info.findings}


def test_times_that_are_no_dates_are_reported(tmp_path: Path) -> None:
    folder = published(tmp_path / "UJIndoorLoc")
    file = folder / "validationData.csv"
    file.write_text(file.read_text().replace("1380872703", "60"))
    findings = imported("uji", folder, tmp_path / "scratch").info.findings
    (finding,) = (each for each in findings if each.kind == "unreadable_dates")
    assert (finding.file, finding.count) == ("validationData.csv", 1)
    assert "times such as 60 are no dates from 2010 to 2035" in finding.message


def test_a_place_beyond_the_solar_system_is_no_error(tmp_path: Path) -> None:
    folder = published(tmp_path / "UJIndoorLoc")
    file = folder / "validationData.csv"
    head, row = file.read_text().splitlines()
    cells = row.split(",")
    cells[head.split(",").index("LONGITUDE")] = "1.8e18"
    file.write_text(f"{head}\n{','.join(cells)}\n")
    read = imported("uji", file, tmp_path / "scratch")
    assert read.access_points.collect().height == 1


def test_names_that_are_formulas_are_text_and_come_back(tmp_path: Path) -> None:
    plain = small_dataset()
    rows = plain.fingerprints.with_columns(device=pl.lit('=HYPERLINK("http://x")'), user=pl.lit("'-2+3"))
    dataset = replace(plain, tables={**plain.tables, FINGERPRINTS: rows})
    for escape, device in ((True, "'=HYPER"), (False, "=HYPER")):
        out = tmp_path / str(escape)
        exported(dataset, "uji", out, escape_formulas=escape)
        assert f'1,"{device}' in (out / "phones.csv").read_text()
        assert "1,''-2+3" in (out / "users.csv").read_text()
        back = imported("uji", out, tmp_path / f"scratch {escape}").fingerprints.collect()
        assert (set(back["device"]), set(back["user"])) == ({'=HYPERLINK("http://x")'}, {"'-2+3"})


@pytest.mark.parametrize("name", ["uji", "comford"])
def test_buildings_with_floors_of_the_same_number(tmp_path: Path, name: str) -> None:
    plain = small_dataset()
    building = pl.when(pl.col("device") == "Pixel").then(pl.lit("annex, east")).otherwise(pl.lit("main"))
    tables = {
        **plain.tables,
        **{each: plain.tables[each].with_columns(building=building) for each in (FINGERPRINTS, "sessions")},
    }
    back = through(replace(plain, tables=tables), name, tmp_path)
    rows = back.fingerprints.group_by("device", "building", "floor").len().sort("device", "floor").collect()
    known = SCANS - 1
    assert rows.rows() == [
        ("Galaxy", "main", 0, known),
        ("Galaxy", "main", 1, known),
        ("Pixel", "annex, east", 0, known),
        ("Pixel", "annex, east", 1, known),
    ]
    assert [(floor.building, floor.number) for floor in back.info.floors] == [
        ("annex, east", 0),
        ("annex, east", 1),
        ("main", 0),
        ("main", 1),
    ]


def test_parts_of_the_chosen_split(tmp_path: Path) -> None:
    dataset = with_split(small_dataset(unlabelled=0), folds=2)
    with pytest.raises(UsageError, match=r"has 2 folds; choose one with --fold: floor_0.Galaxy.walk/x"):
        exported(dataset, "uji", tmp_path / "a", split="by_walk")
    findings = exported(dataset, "uji", tmp_path / "b", split="by_walk", fold="floor_0.Galaxy.walk/x")
    assert [(finding.kind, finding.count) for finding in findings] == [("in_neither_part", 4)]
    train = pl.read_csv(tmp_path / "b" / "trainingData.csv")
    test = pl.read_csv(tmp_path / "b" / "validationData.csv")
    assert (train.height, test.height) == (3 * (SCANS - 1), SCANS - 1)
    assert set(test["FLOOR"]) == {0}
    assert test.columns[-9:] == TAIL.split(",")


def test_without_split_there_is_one_file_and_it_is_said(tmp_path: Path) -> None:
    findings = exported(small_dataset(), "uji", tmp_path / "out")
    assert not (tmp_path / "out" / "validationData.csv").exists()
    assert [finding.kind for finding in findings] == ["unlabelled_left_out", "no_split"]


def test_whole_levels_are_whole_numbers(tmp_path: Path) -> None:
    plain = small_dataset()
    whole = replace(plain, tables={**plain.tables, "readings": plain.readings.with_columns(pl.col("rssi_dbm").round())})
    exported(whole, "uji", tmp_path / "out")
    first = (tmp_path / "out" / "trainingData.csv").read_text().splitlines()[1]
    assert first.startswith("-42,-53,-65,-77,100,")


def test_times_are_seconds_of_the_walks_own_day(tmp_path: Path) -> None:
    back = through(small_dataset(), "uji", tmp_path)
    assert set(back.fingerprints.collect()["date"]) == {dt.date(2026, 3, 1), dt.date(2026, 3, 2)}


def test_pieces_make_the_same_file_as_the_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    exported(small_dataset(), "uji", tmp_path / "whole")
    monkeypatch.setattr("vislam2tag.datasets.writing._CELLS_AT_ONCE", 30)
    exported(small_dataset(), "uji", tmp_path / "pieces")
    whole, pieces = ((tmp_path / name / "trainingData.csv").read_bytes() for name in ("whole", "pieces"))
    assert whole == pieces


def test_a_line_without_a_floor_is_named(tmp_path: Path) -> None:
    folder = published(tmp_path / "UJIndoorLoc")
    file = folder / "trainingData.csv"
    file.write_text(file.read_text().replace("4864934.225099999,2,1", "4864934.225099999,,1"))
    with pytest.raises(DatasetError, match=r"trainingData.csv: line 3 has no FLOOR"):
        imported("uji", folder, tmp_path / "scratch")


def test_a_floor_beyond_all_numbers_is_none(tmp_path: Path) -> None:
    folder = published(tmp_path / "UJIndoorLoc")
    file = folder / "trainingData.csv"
    file.write_text(file.read_text().replace("4864934.225099999,2,1", "4864934.225099999,9223372036854775,1"))
    floors = imported("uji", file, tmp_path / "scratch").fingerprints.collect()["floor"]
    assert sorted(floors, key=str) == [2, None]


def test_columns_are_numbered_with_enough_digits() -> None:
    assert wap_columns(2) == ["WAP001", "WAP002"]
    assert wap_columns(1000)[0] == "WAP0001"
