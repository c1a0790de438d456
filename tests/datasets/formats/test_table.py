from __future__ import annotations

import math
from pathlib import Path

import pandas as pd
import polars as pl
import pytest

from vislam2tag import api
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.intake.columns import COLUMNS_FILE
from vislam2tag.pipeline.datasets.import_export import ImportOptions, import_format

A, B = "02:1a:00:00:00:01", "02:1a:00:00:00:02"


def heard(dataset: api.Dataset) -> list[tuple[object, ...]]:
    """x, y, floor, access point and level of each reading, sorted."""
    table = dataset.readings.join(dataset.fingerprints.select("scan_id", "floor", "x", "y"), on="scan_id")
    return sorted(table.select("x", "y", "floor", "bssid", "rssi_dbm").collect().rows())


def melted(rows: pd.DataFrame, points: list[str], not_heard: float = math.nan) -> list[tuple[object, ...]]:
    long = rows.melt(id_vars=["x", "y", "floor"], value_vars=points)
    long = long[long["value"].notna() & (long["value"] != not_heard)]
    return sorted(long.itertuples(index=False, name=None))


def test_wide_table_with_own_names(tmp_path: Path) -> None:
    path = tmp_path / "sodindoor.csv"
    path.write_text("MAC1,MAC2,ECoord,NCoord,FloorID\n-60,100,10.5,3.2,1.0\n-70,-82,12.5,3.2,2.0\n")
    frame = pd.read_csv(path).rename(columns={"ECoord": "x", "NCoord": "y", "FloorID": "floor"})
    first = import_format(path, tmp_path / "a")
    assert heard(first) == melted(frame, ["MAC1", "MAC2"], 100)
    again = import_format(path, tmp_path / "b", ImportOptions(columns=tmp_path / "a" / COLUMNS_FILE))
    assert heard(again) == heard(first)


def test_wide_table_of_addresses_with_gaps(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(f"x,y,{A},{B}\n1.5,2,-61.0,\n2.5,2,,-75.0\n")
    frame = pd.read_csv(path).assign(floor=0)
    assert heard(import_format(path, tmp_path / "out")) == melted(frame, [A, B])


def test_decimal_commas_preamble_row_numbers_and_floor_names(tmp_path: Path) -> None:
    folder = tmp_path / "f"
    folder.mkdir()
    (folder / "train.csv").write_text("# a survey\n;px;py;storey;AP1;AP2\n0;1,5;2,5;EG;-60;\n1;2,5;2,5;2. OG;-61;-70\n")
    (folder / "test.csv").write_text("# a survey\n;px;py;storey;AP1;AP2\n0;7,5;2,5;EG;-62;\n")
    parts = [pd.read_csv(file, sep=";", decimal=",", comment="#") for file in folder.iterdir()]
    frame = pd.concat(parts).rename(columns={"px": "x", "py": "y"})
    frame["floor"] = frame["storey"].map({"EG": 0, "2. OG": 2})
    found = import_format(folder, tmp_path / "out")
    assert heard(found) == melted(frame, ["AP1", "AP2"])
    assert "official" in found.info.splits


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_long_table(tmp_path: Path, suffix: str) -> None:
    frame = pl.DataFrame(
        {"X": [1.0, 1.0, 2.0], "Y": [3.0, 3.0, 4.0], "floor": [1, 1, 2], "bssid": [A, B, A], "rssi": [-60, -80, -70]}
    )
    path = tmp_path / f"t.{suffix}"
    frame.write_csv(path) if suffix == "csv" else frame.write_parquet(path)
    found = import_format(path, tmp_path / "out")
    assert heard(found) == sorted(frame.select("X", "Y", "floor", "bssid", pl.col("rssi").cast(pl.Float64)).rows())
    assert found.fingerprints.collect().height == 2


def test_message_names_found_and_expected_columns(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("foo,qz,AP1\n1,2,-60\n")
    with pytest.raises(DatasetError, match=r"found the columns foo, qz, AP1; expected for x one of x, .*--columns"):
        import_format(path, tmp_path / "out", ImportOptions(format_name="table"))
    assert not (tmp_path / "out").exists()


def test_what_would_be_silently_wrong_is_said(tmp_path: Path) -> None:
    metres = tmp_path / "metres.csv"
    metres.write_text("LONGITUDE,LATITUDE,AP1,AP2\n-7541.2,4864921.1,-60,-70\n-7540.2,4864920.1,-61,-71\n")
    with pytest.raises(DatasetError, match=r'are not degrees.* x = "LONGITUDE", y = "LATITUDE"'):
        import_format(metres, tmp_path / "out", ImportOptions(format_name="table"))
    columns = tmp_path / "columns.toml"
    columns.write_text('x = "LONGITUDE"\ny = "LATITUDE"\nlatitude = ""\nlongitude = ""\n')
    options = ImportOptions(format_name="table", columns=columns)
    found = import_format(metres, tmp_path / "metres", options)
    assert found.fingerprints.select("x", "y").collect().rows() == [(-7541.2, 4864921.1), (-7540.2, 4864920.1)]
    (assumed,) = (each for each in found.info.findings if each.kind == "assumed_columns")
    assert "no column as floor, so that all fingerprints are on floor 0" in assumed.message
    folder = tmp_path / "two"
    folder.mkdir()
    (folder / "a.csv").write_text("x,y,floor,AP1,AP2\n1,2,3,-60,-70\n")
    (folder / "b.csv").write_text("x,y,AP1,AP2\n1,2,-60,-70\n")
    with pytest.raises(DatasetError, match=r"b\.csv: has other columns of places or levels than a\.csv"):
        import_format(folder, tmp_path / "out")


def test_degrees_become_metres_east_and_north_of_the_origin(tmp_path: Path) -> None:
    path = tmp_path / "degrees.csv"
    path.write_text("lat,lon,AP1,AP2\n50.001,6.0,-60,-70\n50.0,6.001,-61,-71\n")
    found = import_format(path, tmp_path / "out", ImportOptions(origin=(50.0, 6.0)))
    (first, second) = found.fingerprints.select("x", "y").sort("x").collect().rows()
    assert first == (pytest.approx(0, abs=1e-3), pytest.approx(111.23, abs=0.1))
    assert second == (pytest.approx(71.7, abs=0.1), pytest.approx(0, abs=0.01))


def test_rows_of_one_scan_id_are_one_fingerprint_and_two_header_rows_one_header(tmp_path: Path) -> None:
    path = tmp_path / "scans.csv"
    rows = f"7,1.5,2.5,1,{A},-60\n7,1.5,2.5,1,{B},-70\n8,1.5,2.5,1,{A},-65\n"
    path.write_text(f"scan_id,x,y,floor,mac,rssi\n,m,m,,,dBm\n{rows}")
    frame = pd.read_csv(path, skiprows=[1])
    found = import_format(path, tmp_path / "out")
    counts = found.fingerprints.select("readings").collect()["readings"]
    assert sorted(counts) == sorted(frame.groupby("scan_id").size())
    assert heard(found) == sorted(frame[["x", "y", "floor", "mac", "rssi"]].itertuples(index=False, name=None))


@pytest.mark.parametrize(
    ("text", "number"),
    [
        *(("3", 3), ("3.0", 3), ("-1", -1), ("-2.0", -2), ("F2", 2), ("Floor -1", -1), ("floor_3", 3), ("L-2", 2)),
        *(
            ("EG", 0),
            ("Ground floor", 0),
            ("2. OG", 2),
            ("OG2", 2),
            ("UG", -1),
            ("2. UG", -2),
            ("B1", -1),
            ("roof", None),
            ("9" * 25, None),
        ),
    ],
)
def test_floors(tmp_path: Path, text: str, number: int | None) -> None:
    path = tmp_path / "t.csv"
    path.write_text(f"x,y,floor,AP1,AP2\n1,2,{text},-60,-70\n3,4,5,-61,-71\n")
    found = import_format(path, tmp_path / "out")
    floors = dict(found.fingerprints.select("readings", "floor").collect().rows())
    assert sorted(found.fingerprints.collect()["floor"].to_list(), key=str) == sorted([number, 5], key=str), floors
    assert ("unknown_floor" in {each.kind for each in found.info.findings}) == (number is None)


@pytest.mark.parametrize(
    ("text", "zone", "moment"),
    [
        ("1700000000", None, "2023-11-14T22:13:20Z"),
        ("1700000000123", None, "2023-11-14T22:13:20.123Z"),
        ("2023-07-01 12:00:00", None, "2023-07-01T12:00:00Z"),
        ("2023-07-01 12:00:00", "Europe/Berlin", "2023-07-01T10:00:00Z"),
        ("2023-07-01T12:00:00.5+02:00", None, "2023-07-01T10:00:00.5Z"),
        ("2023-07-01T12:00:00Z", "Europe/Berlin", "2023-07-01T12:00:00Z"),
        ("01.07.2023 12:00", None, "2023-07-01T12:00:00Z"),
        ("07/31/2023 12:00:01 PM", None, "2023-07-31T12:00:01Z"),
        ("2023/07/31", None, "2023-07-31T00:00:00Z"),
    ],
)
def test_times(tmp_path: Path, text: str, zone: str | None, moment: str) -> None:
    path, columns = tmp_path / "t.csv", tmp_path / "columns.toml"
    path.write_text(f"x,y,time,AP1,AP2\n1,2,{text},-60,-70\n3,4,{text},-61,-71\n")
    columns.write_text("" if zone is None else f'zone = "{zone}"\n')
    found = import_format(path, tmp_path / "out", ImportOptions(columns=columns))
    assert found.fingerprints.collect()["start_ns"].to_list() == [pd.Timestamp(moment).value] * 2
    assumed = [each for each in found.info.findings if each.kind == "assumed_zone"]
    assert len(assumed) == (zone is None and text[0] != "1" and text[-1] != "Z" and "+" not in text)
    assert all(each.severity == "info" and 'write zone = "Europe/Berlin"' in each.message for each in assumed)
    again = import_format(path, tmp_path / "again", ImportOptions(columns=tmp_path / "out" / COLUMNS_FILE))
    assert again.fingerprints.collect().equals(found.fingerprints.collect())


def test_times_that_cannot_be_read_and_unknown_zones(tmp_path: Path) -> None:
    path, columns = tmp_path / "t.csv", tmp_path / "columns.toml"
    path.write_text("x,y,time,AP1,AP2\n1,2,noon,-60,-70\n3,4,2023-07-01,-61,-71\n")
    found = import_format(path, tmp_path / "out")
    (unread,) = (each for each in found.info.findings if each.kind == "unreadable_dates")
    assert (unread.count, "times such as noon are not used" in unread.message) == (1, True)
    columns.write_text('zone = "Nowhere"\n')
    with pytest.raises(UsageError, match="zone = 'Nowhere' is unknown; expected a zone such as Europe/Berlin"):
        import_format(path, tmp_path / "wrong", ImportOptions(columns=columns))


UUID = "FDA50693-A4E2-4FB1-AFCF-C6EB07647825"


def test_long_table_of_ble_beacons(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(f"x,y,uuid,major,minor,rssi\n1,2,{UUID},1,2,-60\n1,2,{UUID},1,3,-61\n")
    found = import_format(path, tmp_path / "out")
    assert found.fingerprints.collect()["technology"].to_list() == ["ble"]
    assert found.readings.collect()["bssid"].to_list() == [f"{UUID.lower()}-1-2", f"{UUID.lower()}-1-3"]


def test_wide_table_of_wifi_and_ble(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(f"x,y,{A},{B},beacon1\n1,2,-60,,-80\n3,4,-61,-71,\n5,6,,,\n7,8,,,-81\n")
    found = import_format(path, tmp_path / "out")
    rows = found.fingerprints.select("technology", "x", "readings").sort("technology", "x").collect().rows()
    assert rows == [("ble", 1.0, 1), ("ble", 7.0, 1), ("wifi", 1.0, 1), ("wifi", 3.0, 2), ("wifi", 5.0, 0)]
    assert {group.technology for group in found.info.groupings} == {"wifi", "ble"}


def test_long_table_with_a_column_of_technologies(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(f"x,y,bssid,rssi,type\n1,2,{A},-60,WLAN\n1,2,{B},-61,Bluetooth\n")
    found = import_format(path, tmp_path / "out")
    assert sorted(found.fingerprints.collect()["technology"].to_list()) == ["ble", "wifi"]


def test_cells_of_a_grid_need_their_size(tmp_path: Path) -> None:
    path, columns = tmp_path / "iBeacon_RSSI_Labeled.csv", tmp_path / "columns.toml"
    rows = ["O02,10-18-2016 11:15:21,-200,-60,-200", "P01,10-18-2016 11:15:19,-78,-200,-200"]
    rows += ["P02,10-18-2016 11:15:17,-200,-77,-75", "?,10-18-2016 11:15:17,-200,-70,-71"]
    path.write_text("location,date,b3001,b3002,b3003\n" + "\n".join(rows) + "\n")
    said = (
        r'location contains cells of a grid such as O02, whose size in metres is unknown.*cell = "location" and cell_m'
    )
    path.write_text(path.read_text().replace("?", "P03"))
    with pytest.raises(DatasetError, match=said):
        import_format(path, tmp_path / "out")
    columns.write_text('cell = "location"\n')
    with pytest.raises(DatasetError, match=said):
        import_format(path, tmp_path / "out", ImportOptions(columns=columns))
    columns.write_text('cell = "location"\ncell_m = 2.5\nnot_heard = -200.0\n')
    path.write_text(path.read_text().replace("P03", "?"))
    found = import_format(path, tmp_path / "out", ImportOptions(columns=columns))
    table = found.fingerprints.select("technology", "x", "y").sort("x", "y", nulls_last=True).collect()
    places = [(letter * 2.5, number * 2.5) for letter, number in ((14, 2), (15, 1), (15, 2))]
    assert table.rows() == [*(("ble", *place) for place in places), ("ble", None, None)]
    assert found.readings.collect().height == 6
    (unread,) = (each for each in found.info.findings if each.kind == "unreadable_cells")
    assert unread.lines == (5,)


def test_columns_that_are_not_used_are_named_once(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("x,y,room,note,AP1,AP2\n1,2,a,b,-60,-70\n")
    found = import_format(path, tmp_path / "out")
    (unused,) = (each for each in found.info.findings if each.kind == "unknown_columns")
    assert unused.message == "unknown columns are skipped: room, note"


def test_columns_file_repeats_options(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("lat,lon,AP1,AP2\n50.001,6.0,0,90\n50.0,6.001,50,-1\n")
    scale = api.LevelScale((0, -100), (100, -50))
    options = ImportOptions(format_name="table", origin=(50.0, 6.0), not_heard=-1, levels=scale)
    found = import_format(path, tmp_path / "out", options)
    assert sorted(found.readings.collect()["rssi_dbm"]) == [-100.0, -75.0, -55.0]
    text = (tmp_path / "out" / COLUMNS_FILE).read_text()
    assert text.splitlines() == [
        'latitude = "lat"',
        'longitude = "lon"',
        'access_points = "AP*"',
        "not_heard = -1.0",
        "levels = [[0.0, -100.0], [100.0, -50.0]]",
        "origin = [50.0, 6.0]",
    ]
    again = import_format(path, tmp_path / "again", ImportOptions(columns=tmp_path / "out" / COLUMNS_FILE))
    for table in ("fingerprints", "readings"):
        assert again.tables[table].collect().equals(found.tables[table].collect())


@pytest.mark.parametrize(
    ("header", "written"),
    [
        ("x,y,WAP001,WAP002", '"WAP*"'),
        (f"x,y,{A},{B}", '"??:??:??:??:??:??"'),
        ("x,y,1,2", '["1", "2"]'),
        ("x,y,building,b1,b2", '["b1", "b2"]'),
        ("x,y,AP1,MAC2", '["AP1", "MAC2"]'),
    ],
)
def test_access_points_are_written_as_a_pattern_if_one_fits(tmp_path: Path, header: str, written: str) -> None:
    path = tmp_path / "t.csv"
    path.write_text(
        f"{header}\n" + "".join(f"{','.join(['3'] * (header.count(',') - 1))},-6{n},-7{n}\n" for n in (1, 2))
    )
    found = import_format(path, tmp_path / "out")
    assert f"access_points = {written}\n" in (tmp_path / "out" / COLUMNS_FILE).read_text()
    again = import_format(path, tmp_path / "again", ImportOptions(columns=tmp_path / "out" / COLUMNS_FILE))
    assert heard(again) == heard(found)


def test_tables_with_times_but_no_place_are_recordings(tmp_path: Path) -> None:
    path = tmp_path / "wifi.csv"
    path.write_text(f"time,bssid,rssi\n2023-07-01 12:00:00,{A},-60\n2023-07-01 12:00:01,{B},-61\n")
    own = tmp_path / "log.csv"
    path.rename(own)
    with pytest.raises(DatasetError) as caught:
        import_format(own, tmp_path / "out")
    assert f"vislam2tag label {own} --labels LABELS" in str(caught.value)
    assert f"vislam2tag attach WALK {own}" in str(caught.value)
    assert "found the columns time, bssid, rssi; expected for x one of x" in str(caught.value)


def test_a_header_without_rows(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    for header in ("x,y,floor,AP1,AP2", "x,y,floor,bssid,rssi"):
        path.write_text(header + "\n")
        with pytest.raises(DatasetError, match="contains no row below its header; expected one for each fingerprint"):
            import_format(path, tmp_path / "out")


def test_a_table_without_header(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("1,2,-60\n3,4,-61\n")
    with pytest.raises(DatasetError, match=r"has no header; found 3 columns\. Write a line with their names above"):
        import_format(path, tmp_path / "out")


def test_addresses_in_other_notations_and_masked_ones(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("x,y,02-1A-00-00-00-01,021a.0000.0002,02:00:00:00:00:00\n1,2,-60,-70,-80\n3,4,-61,-71,-81\n")
    found = import_format(path, tmp_path / "out")
    assert found.access_points.collect()["bssid"].sort().to_list() == [A, B]
    (masked,) = (each for each in found.info.findings if each.kind == "masked_addresses")
    assert "columns of no address are skipped: 02:00:00:00:00:00. Possible cause" in masked.message


def finding(dataset: api.Dataset, kind: str) -> list[api.Finding]:
    return [each for each in dataset.info.findings if each.kind == kind]


def restarting(scans: int = 2, places: int = 3) -> pd.DataFrame:
    """Scan numbers that start again at each of some places; both access points are heard in each."""
    rows = [
        {"scan_nr": scan, "tour": place, "x": float(place), "y": 1.0, "bssid": name, "rss": -60.0 - scan - place - ap}
        for place in range(places)
        for scan in range(scans)
        for ap, name in enumerate((A, B))
    ]
    return pd.DataFrame(rows)


def test_scan_numbers_that_start_again_are_split_by_place(tmp_path: Path) -> None:
    path, columns = tmp_path / "t.csv", tmp_path / "columns.toml"
    frame = restarting()
    frame.to_csv(path, index=False)
    found = import_format(path, tmp_path / "out")
    assert heard(found) == sorted(frame.assign(floor=0)[["x", "y", "floor", "bssid", "rss"]].itertuples(index=False))
    assert found.fingerprints.collect().height == frame.groupby(["tour", "scan_nr"]).ngroups
    (said,) = finding(found, "repeated_scan_numbers")
    assert (said.count, said.severity) == (2, "warning")
    assert 'name the column of walks in columns.toml: session = "NAME"' in said.message
    columns.write_text('session = "tour"\n')
    named = import_format(path, tmp_path / "named", ImportOptions(columns=columns))
    assert heard(named) == heard(found)
    assert not finding(named, "repeated_scan_numbers")
    frame.rename(columns={"tour": "walk_no"}).to_csv(path, index=False)
    known = import_format(path, tmp_path / "known")
    assert known.fingerprints.collect()["session"].n_unique() == 3
    assert not finding(known, "repeated_scan_numbers")


def test_scan_numbers_that_start_again_at_one_place_are_split_by_time(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    frame = restarting().assign(x=0.0)
    frame["when"] = pd.to_datetime("2023-07-01T12:00:00Z") + pd.to_timedelta(frame["tour"], "h")
    frame.to_csv(path, index=False)
    found = import_format(path, tmp_path / "out")
    assert found.fingerprints.collect().height == frame.groupby(["tour", "scan_nr"]).ngroups
    assert found.fingerprints.collect()["start_ns"].n_unique() == 3


def test_a_scan_whose_readings_have_own_places_and_times_stays_whole(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    names = [f"02:1a:00:00:00:{number:02x}" for number in range(8)]
    rows = [f"1,{1.5 + number / 100},2,{1700000000 + number},{name},-60" for number, name in enumerate([*names, A])]
    path.write_text("scan_id,x,y,time,bssid,rssi\n" + "\n".join(rows) + "\n")
    found = import_format(path, tmp_path / "out")
    assert found.fingerprints.collect().height == 1
    assert not finding(found, "repeated_scan_numbers")


def test_repeated_addresses_without_a_column_of_scans(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    restarting(places=1).rename(columns={"scan_nr": "durchgang"}).to_csv(path, index=False)
    found = import_format(path, tmp_path / "out")
    (said,) = finding(found, "merged_scans")
    assert (said.count, said.severity) == (1, "warning")
    assert said.message.startswith("an address occurs up to 2 times within a fingerprint: several scans at one place")
    assert said.message.endswith("(columns that are not used: durchgang, tour)")


@pytest.mark.parametrize(
    ("header", "rows", "floors"),
    [
        ("level,bssid,rssi", f"-2,{A},-60|0,{B},-61", [-2, 0]),
        ("level,bssid,signal", f"1. OG,{A},-60|EG,{B},-61", [0, 1]),
        ("level,AP1,AP2", "2,-60,|0,,-61", [0, 2]),
        ("level,storey,AP1,AP2", "2,4,-60,|0,5,,-61", [4, 5]),
        ("level,bssid", f"-60,{A}|-61,{B}", [0, 0]),
        ("level,bssid,rssi", f"-70,{A},-60|-71,{B},-61", [0, 0]),
        ("level,bssid,power", f"-60,{A},3|-61,{B},2", [0, 0]),
    ],
)
def test_a_column_level_is_the_floor_if_it_is_no_level(
    tmp_path: Path, header: str, rows: str, floors: list[int]
) -> None:
    path = tmp_path / "t.csv"
    lines = [f"{number},1,{row}" for number, row in enumerate(rows.split("|"))]
    path.write_text(f"x,y,{header}\n" + "\n".join(lines) + "\n")
    found = import_format(path, tmp_path / "out")
    assert sorted(found.fingerprints.collect()["floor"].to_list()) == floors
    assert sorted(found.readings.collect()["rssi_dbm"].to_list()) == [-61, -60]


@pytest.mark.parametrize("cells", [("EG", "1. OG"), ("-1", "2")])
def test_a_column_level_of_floors_alone_is_asked_for(tmp_path: Path, cells: tuple[str, str]) -> None:
    path = tmp_path / "t.csv"
    path.write_text(f"x,y,level,bssid\n1,2,{cells[0]},{A}\n3,2,{cells[1]},{B}\n")
    with pytest.raises(DatasetError, match=r'(?s)expected for level one of .*floor = "level"'):
        import_format(path, tmp_path / "out", ImportOptions(format_name="table"))


def filled(rows: int, filler: float, share: int) -> pd.DataFrame:
    """A wide table in which one of ``share`` cells is the filler."""
    levels = {
        f"AP{ap}": [filler if (row + ap) % share == 0 else -50.0 - (7 * row + 5 * ap) % 40 for row in range(rows)]
        for ap in range(6)
    }
    return pd.DataFrame({"x": [float(row) for row in range(rows)], "y": 1.0, "floor": 0, **levels})


def test_files_of_a_folder_share_a_filler_and_may_have_further_columns(tmp_path: Path) -> None:
    folder = tmp_path / "f"
    folder.mkdir()
    train, test = filled(40, -110, 3), filled(12, -110, 12)
    train.assign(device="Pixel", walk_no=7).to_csv(folder / "train.csv", index=False)
    test.to_csv(folder / "test.csv", index=False)
    found = import_format(folder, tmp_path / "out")
    assert heard(found) == melted(pd.concat([train, test]), [f"AP{ap}" for ap in range(6)], -110)
    said = {each.file: (each.count, each.message) for each in finding(found, "unstated_filler")}
    assert said["test.csv"][0] == int((test == -110).to_numpy().sum())
    assert said["test.csv"][1].startswith("-110 is read as 'not heard', as in train.csv")
    assert not finding(found, "all_heard")
    devices = found.fingerprints.select("device", "session").collect().to_series().value_counts().rows()
    assert sorted(devices, key=str) == sorted([("Pixel", 40), (None, 12)], key=str)
    again = import_format(folder, tmp_path / "again", ImportOptions(columns=tmp_path / "out" / COLUMNS_FILE))
    assert heard(again) == heard(found)


def test_a_stated_filler_that_is_not_in_the_table(tmp_path: Path) -> None:
    path, long = tmp_path / "t.csv", tmp_path / "long.csv"
    filled(40, -110, 3).to_csv(path, index=False)
    found = import_format(path, tmp_path / "out", ImportOptions(not_heard=100))
    (said,) = finding(found, "never_not_heard")
    assert said.severity == "warning"
    assert said.message.startswith(
        "no level is 100, which is stated as 'not heard'; 33 % of the levels are -110, which may mean 'not heard'"
    )
    assert not finding(import_format(path, tmp_path / "right", ImportOptions(not_heard=-110)), "never_not_heard")
    long.write_text(f"x,y,bssid,rssi\n1,2,{A},-60\n3,4,{B},-61\n")
    named = import_format(long, tmp_path / "long", ImportOptions(format_name="table", not_heard=100))
    assert [each.message for each in finding(named, "never_not_heard")] == [
        "no level is 100, which is stated as 'not heard'. Correct --not-heard, or leave it out"
    ]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('x = "a"\ny = "a"', 'columns.toml: x = "a" and y = "a": a column has one meaning; correct one of them'),
        ('access_points = ["AP1", "AP3"]', "access_points has AP3: no column has this name"),
        ('x = "a"\naccess_points = ["AP1", "a"]', "access_points has a: the column is named as x, too"),
    ],
)
def test_contradictory_columns_files_are_refused(tmp_path: Path, text: str, said: str) -> None:
    path, columns = tmp_path / "t.csv", tmp_path / "columns.toml"
    path.write_text("a,x,y,AP1,AP2\n1,1,2,-60,-70\n2,3,4,-61,-71\n")
    columns.write_text(text + "\n")
    with pytest.raises(DatasetError) as caught:
        import_format(path, tmp_path / "out", ImportOptions(format_name="table", columns=columns))
    assert said in str(caught.value)


def test_dashes_are_not_heard_and_unreadable_cells_are_one_finding(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("x,y,AP1,AP2,AP3\n1,2,-60,-,\n3,4,weak,-61,-\n5,6,-62,?,weak\n")
    found = import_format(path, tmp_path / "out")
    assert [level for *_, level in heard(found)] == [-60, -61, -62]
    (unread,) = finding(found, "unreadable_cells")
    assert (unread.count, unread.lines) == (3, (3, 4))
    assert "column AP1: cells such as 'weak' (line 3) cannot be read" in unread.message
    (empty,) = finding(found, "empty_levels")
    assert empty.count == 6  # with those that cannot be read
