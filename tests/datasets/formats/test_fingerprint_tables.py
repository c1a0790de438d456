"""Published tables of fingerprints, read by their descriptions: UTS, WiFine, Tampere, long-term, one's own."""

from __future__ import annotations

import datetime as dt
import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from sklearn.neighbors import NearestNeighbors

from tests.conftest import shared_folder
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.folder import Folder
from vislam2tag.datasets.fingerprint_tables import FILE, FingerprintTables, SetDescription
from vislam2tag.datasets.format_registry import ImportContext, import_format_of, import_named
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.point_fingerprints import OFFICIAL

FLOOR_OF_LEVELS_DBM = -105.0
"""What stands for "not heard" in the nearest neighbour that ../shared/algorithms.md gives the errors of."""
UTS_ACCESS_POINTS = ",".join(f"WAP{number:03d}" for number in range(1, 590))
SILENT = ",".join(["100"] * 587)
UTS_ROWS = f"-50,100,{SILENT},1.5,2.5,-3\n100,100,{SILENT},3.5,4.5,12\n"
WALK = {"rss": "-90,100\n100,-60\n", "crd": "1.5,2.5,3\n3.5,4.5,5\n", "tms": "20160602155217232\n20160602155220780\n"}
QUARTET = {
    "rss": "-50,100\n100,-60\n",
    "coordinates": "1,2,3.7\n3,4,0\n",
    "device": "HTC One\nLG\n",
    "date": "2017-08-18 11:59:23\n2017-08-18 11:00:00\n",
}
Files = dict[str, str]


def uts(rows: str = UTS_ROWS, head: str = "Pos_x,Pos_y,Floor_ID", name: str = "UTS_training.csv") -> Files:
    return {name: f"{UTS_ACCESS_POINTS},{head}\n{rows}"}


def wifine(name: str, *rows: str) -> Files:
    return {name: "\n".join(("0,1,num_visible_APs,timestamp,x,y,z,floorID", *rows)) + "\n"}


def quartet(part: str = "Training", **changed: str) -> Files:
    return {f"{part}_{role}_21Aug17.csv": text for role, text in (QUARTET | changed).items()}


def quartet_in(folder: Path, part: str = "Training", **changed: str) -> Path:
    """Write a part of the Tampere quartet into a folder; return that."""
    return written(folder, quartet(part, **changed))


def long_term(month: str, walk: str, **changed: str) -> Files:
    return {f"{month}/{walk}{role}.csv": text for role, text in (WALK | changed).items()}


def written(folder: Path, files: Files) -> Path:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def read(tmp_path: Path, name: str, files: Files) -> Dataset:
    """Write the files, which must be recognised, and read them."""
    folder = written(tmp_path / "set", files)
    assert import_format_of(folder).name == name
    return import_named(name).read(folder, ImportContext(Folder.at(tmp_path / "scratch")))


def parts(dataset: Dataset) -> list[str | None]:
    return dataset.splits[OFFICIAL].groups["group"].to_list()


def test_uts_with_both_parts(tmp_path: Path) -> None:
    dataset = read(tmp_path, "uts", uts() | uts(name="UTS_test.csv"))
    found = dataset.fingerprints.collect()
    assert found.select("scan_id", "floor", "x", "y", "readings").rows()[:2] == [
        ("UTS_test/wifi/000000", -3, 1.5, 2.5, 1),
        ("UTS_test/wifi/000001", 12, 3.5, 4.5, 0),
    ]
    assert dataset.readings.collect()["bssid"].to_list() == ["WAP001", "WAP001"]
    assert parts(dataset) == ["test", "test", "train", "train"]
    assert [floor.number for floor in dataset.info.floors] == [-3, 12]
    assert dataset.info.clock == "none"


def test_one_file_of_uts_with_the_further_columns(tmp_path: Path) -> None:
    head = "Pos_x,Pos_y,Floor_ID,Building_ID,User_ID,Phone_type,Time"
    folder = written(tmp_path / "set", uts(f"100,-60,{SILENT},1,2,0,B11,7,OPPO,2017\n", head))
    dataset = import_named("uts").read(folder / "UTS_training.csv", ImportContext(Folder.at(tmp_path)))
    row = dataset.fingerprints.collect().row(0, named=True)
    assert (row["building"], row["user"], row["device"]) == ("B11", "7", "OPPO")
    assert [(finding.kind, finding.count) for finding in dataset.info.findings] == [("unknown_columns", 1)]


@pytest.mark.parametrize("odd", ["1,,0", "1,2,9223372036854775807"])
def test_a_place_without_a_part_or_with_a_floor_beyond_all_numbers_is_none(tmp_path: Path, odd: str) -> None:
    dataset = read(tmp_path, "uts", uts(f"100,-60,{SILENT},{odd}\n100,-61,{SILENT},1,2,0\n"))
    found = dataset.fingerprints.collect()
    assert found.select("x", "floor", "status").rows() == [(None, None, "invalid"), (1.0, 0, "ok")]


def test_columns_may_be_named_by_addresses_that_are_not_masked(tmp_path: Path) -> None:
    files = uts(f"-50,-60,{SILENT.replace('100', '-70', 1)},1,2,0\n")
    names = ("021A.0000.0001", "02:00:00:00:00:00", "02-1a-00-00-00-02")
    for number, name in enumerate(names, start=1):
        files["UTS_training.csv"] = files["UTS_training.csv"].replace(f"WAP00{number}", name, 1)
    dataset = read(tmp_path, "uts", files)
    assert dataset.readings.collect()["bssid"].to_list() == ["02:1a:00:00:00:01", "02:1a:00:00:00:02"]
    (finding,) = dataset.info.findings
    assert (finding.kind, finding.count) == ("masked_addresses", 1)
    assert "columns of no address are skipped: 02:00:00:00:00:00. Possible cause: without" in finding.message


def test_wifine_has_walks_their_times_and_a_split(tmp_path: Path) -> None:
    train = wifine("train/train_4_1.csv", "-48.0,-100.0,1,0.0,1,2,0.5,0", "-50,-60,2,3.95,4,5,0.5,0")
    dataset = read(tmp_path, "wifine", train | wifine("test/test_45_e_1.csv", "-100.0,-71.5,1,0.0,7,8,9,1"))
    assert dataset.fingerprints.collect().select("scan_id", "floor", "x", "z", "start_ns", "readings").rows() == [
        ("test_45_e_1/wifi/000000", 1, 7.0, 9.0, 0, 1),
        ("train_4_1/wifi/000000", 0, 1.0, 0.5, 0, 1),
        ("train_4_1/wifi/000001", 0, 4.0, 0.5, 3_950_000_000, 2),
    ]
    assert dataset.readings.collect()["bssid"].to_list() == ["ap1", "ap0", "ap0", "ap1"]
    assert parts(dataset) == ["test", "train", "train"]


def test_wifine_validation_walks_are_in_neither_part_of_the_official_split(tmp_path: Path) -> None:
    train = wifine("train/train_4_1.csv", "-48.0,-100.0,1,0.0,1,2,0.5,0")
    val = wifine("val/val_45_e_1.csv", "-100.0,-71.5,1,0.0,7,8,9,1")
    test = wifine("test/test_46_e_1.csv", "-100.0,-70.5,1,0.0,7,8,9,1")
    groups = read(tmp_path / "all", "wifine", train | val | test).splits["official"].groups
    assert dict(groups.select(pl.col("id").str.split("_").list.first(), "group").rows()) == {
        "train": "train",
        "val": None,
        "test": "test",
    }
    assert "official" not in read(tmp_path / "without", "wifine", train | val).splits


def test_the_long_term_set_has_months_walks_and_times(tmp_path: Path) -> None:
    files = (
        long_term("01", "trn01") | long_term("01", "tst01") | long_term("02", "trn01", tms="noon\n20160602155220780\n")
    )
    dataset = read(tmp_path, "uji-library", files)
    found = dataset.fingerprints.collect()
    assert found["session"].unique().sort().to_list() == ["month_01.trn01", "month_01.tst01", "month_02.trn01"]
    assert found.select("floor", "x", "start_ns", "readings").rows()[:2] == [
        (3, 1.5, 1464882737232000000, 1),
        (5, 3.5, 1464882740780000000, 1),
    ]
    assert parts(dataset) == ["train", "train", None, None, "test", "test"]
    assert [(finding.kind, finding.count) for finding in dataset.info.findings] == [("unreadable_dates", 1)]


def test_a_small_quartet_of_tampere(tmp_path: Path) -> None:
    dataset = read(tmp_path, "tampere", quartet())
    one, other = dataset.fingerprints.collect().rows(named=True)
    assert (one["scan_id"], one["floor"], one["z"]) == ("HTC-One-2017-08-18/wifi/000000", 1, 3.7)
    assert (one["device"], one["date"], one["start_ns"]) == ("HTC One", dt.date(2017, 8, 18), 1503057563 * 10**9)
    assert (other["floor"], other["x"], other["y"]) == (0, 3.0, 4.0)
    assert dataset.readings.select("bssid", "rssi_dbm").collect().rows() == [("WAP001", -50.0), ("WAP002", -60.0)]
    assert [floor.elevation_m for floor in dataset.info.floors] == [0.0, 3.7]


def test_a_quartet_needs_neither_device_nor_date(tmp_path: Path) -> None:
    files = {name: text for name, text in (quartet() | quartet("Test")).items() if "_d" not in name}
    dataset = read(tmp_path, "tampere", files)
    assert dataset.fingerprints.collect()["scan_id"].to_list() == [f"fingerprints/wifi/{n:06d}" for n in range(4)]
    assert parts(dataset) == ["test", "test", "train", "train"]
    assert dataset.info.clock == "none"


def test_heights_between_floors_and_broken_dates_are_findings(tmp_path: Path) -> None:
    dataset = read(tmp_path, "tampere", quartet(coordinates="1,2,5\n3,4,0.04\n", date="yesterday\n\n"))
    assert {(finding.kind, finding.file, finding.lines) for finding in dataset.info.findings} == {
        ("height_off_floor", "Training_coordinates_21Aug17.csv", (1,)),
        ("unreadable_dates", "Training_date_21Aug17.csv", (1,)),
    }
    assert dataset.fingerprints.collect()["date"].null_count() == 2


@pytest.mark.parametrize(
    ("name", "files", "said"),
    [
        ("uts", uts(f"100,100,{SILENT},1,2,3\n", "X,Y,Floor_ID"), "no column Pos_x with numbers"),
        ("uts", {}, "contains no UTS_training"),
        ("uts", uts(name="a/UTS_test.csv") | uts(name="b/UTS_test.csv"), "contains UTS_test.csv twice"),
        (
            "wifine",
            wifine("train/train_4_1.csv", "-48.0,-100.0,1,0.0,,2,0.5,0"),
            r"train_4_1\.csv: line 2 has no x; expected the columns num_visible_APs, timestamp, x",
        ),
        ("wifine", {}, r"contains no train/train_\*"),
        ("tampere", quartet(coordinates="1,2,3.7\n"), "coordinates_21Aug17.csv: 1 lines, expected 2"),
        ("tampere", quartet(coordinates="1,2\n3,4\n"), r"line 1 has 2 values, expected 3 \(x, y, z\)"),
        ("tampere", quartet(coordinates="1,2,3\n3,north,0\n"), "line 2, column y: 'north' is not a number"),
        ("tampere", quartet(device="LG\n"), "device_21Aug17.csv: 1 lines, expected 2"),
        (
            "tampere",
            quartet() | {"Training_rss_22Aug17.csv": ""},
            "contains both Training_rss_21Aug17.csv and Training_rss_22Aug17.csv",
        ),
        (
            "tampere",
            {"Training_coordinates_21Aug17.csv": "1,2,3\n"},
            "has no training rss.csv; expected rss, coordinates",
        ),
        ("tampere", {}, "expected the four files of the Tampere data set"),
        ("uji-library", {"01/trn01rss.csv": "-90\n", "01/trn01crd.csv": "1,2,3\n"}, r"month 01 has no trn01tms\.csv"),
        ("uji-library", {}, "contains no MM/trnNNrss"),
    ],
)
def test_wrong_missing_or_double_files_are_reported(tmp_path: Path, name: str, files: Files, said: str) -> None:
    folder = written(tmp_path / "set", files)
    folder.mkdir(exist_ok=True)
    with pytest.raises(DatasetError, match=said):
        import_named(name).read(folder, ImportContext(Folder.at(tmp_path / "scratch")))


def sod(building: str, part: str, view: str = "", levels: str = "-50,100", numbers: str = "46,18,1,1,4,3") -> Files:
    """A sheet of SODIndoorLoc; ``numbers``: x, y, floor, building, user, phone."""
    place, people = numbers.rsplit(",", 2)[0], ",".join(numbers.split(",")[-2:])
    head = "MAC1,MAC2,ECoord,NCoord,FloorID,BuildingID,SceneID,UserID,PhoneID,SampleTimes"
    return {f"{part}_{building}{view}.csv": f"{head}\n{levels},{place},1,{people},1\n"}


def test_sodindoorloc_has_its_buildings_and_official_split(tmp_path: Path) -> None:
    files = {
        **sod("CETC331", "Training"),
        **sod("CETC331", "Testing", levels="-60,-70"),
        **sod("HCXY", "Training", "_AP_30", numbers="858.5,917,4,2,5,4"),
        **sod("HCXY", "Testing", "_AP", levels="100,-80", numbers="859.5,917,4,2,5,4"),
        **sod("HCXY", "Training", "_AP_Avg", levels="-105,-105", numbers="859.5,917,4,2,5,4"),
        **sod("HCXY", "Training", "_All_Avg", numbers="859.5,917,4,2,5,4"),
    }
    dataset = read(tmp_path, "sodindoorloc", files)
    found = dataset.fingerprints.select("session", "building", "floor", "x", "y", "device", "user").collect()
    assert sorted(found.rows()) == [
        ("Testing_CETC331", "CETC331", 1, 46.0, 18.0, "3", "4"),
        ("Testing_HCXY_AP", "HCXY", 4, 859.5, 917.0, "4", "5"),
        ("Training_CETC331", "CETC331", 1, 46.0, 18.0, "3", "4"),
        ("Training_HCXY_AP_30", "HCXY", 4, 858.5, 917.0, "4", "5"),
    ]
    heard = dataset.readings.select("scan_id", "bssid", "rssi_dbm").collect()
    assert sorted((scan.split("/")[0], *rest) for scan, *rest in heard.rows()) == [
        ("Testing_CETC331", "CETC331 MAC1", -60.0),
        ("Testing_CETC331", "CETC331 MAC2", -70.0),
        ("Testing_HCXY_AP", "HCXY MAC2", -80.0),
        ("Training_CETC331", "CETC331 MAC1", -50.0),
        ("Training_HCXY_AP_30", "HCXY MAC1", -50.0),
    ]
    assert sorted(map(str, parts(dataset))) == ["test", "test", "train", "train"]


def test_dungeon_assistant_has_heights_in_its_second_column(tmp_path: Path) -> None:
    addresses = "02:1a:00:00:00:01,02:1a:00:00:00:02"
    rows = "1.5,0.2,-3,2023-12-06 22:25:14,-61.0,\n2.5,0.3,4,2023-12-06 22:25:15,,-75.0\n"
    (tmp_path / "own.csv").write_text(f"1,2,3,write_time,{addresses}\n{rows}")
    assert import_format_of(tmp_path / "own.csv").name == "dungeon-assistant"
    dataset = import_named("dungeon-assistant").read(tmp_path / "own.csv", ImportContext(Folder.at(tmp_path / "s")))
    found = dataset.fingerprints.select("x", "y", "z", "floor", "start_ns").collect()
    started = int(dt.datetime(2023, 12, 6, 22, 25, 14, tzinfo=dt.UTC).timestamp()) * 10**9
    assert found.rows() == [(1.5, 3.0, 0.2, 0, started), (2.5, -4.0, 0.3, 0, started + 10**9)]
    assert dataset.readings.select("bssid", "rssi_dbm").collect().rows() == [
        ("02:1a:00:00:00:01", -61.0),
        ("02:1a:00:00:00:02", -75.0),
    ]


def test_tuji1_has_phones_by_number(tmp_path: Path) -> None:
    files = {
        "RSS_training.csv": "-50,100\n100,-60\n",
        "Coordinates_training.csv": "1.5,2.5,0,0,0,3\n3.5,4.5,0,0,0,1\n",
        "RSS_testing.csv": "-70,-80\n",
        "Coordinates_testing.csv": "5,6,0,0,0,5\n",
    }
    dataset = read(tmp_path, "tuji1", files)
    assert sorted(dataset.fingerprints.select("x", "y", "device").collect().rows()) == [
        (1.5, 2.5, "POCO"),
        (3.5, 4.5, "S20"),
        (5.0, 6.0, "A12"),
    ]
    assert sorted(map(str, parts(dataset))) == ["test", "train", "train"]


def test_sets_of_the_comparison_have_training_and_test_files(tmp_path: Path) -> None:
    files = {
        "DSI1_trnrss.csv": "-50,100\n100,-60\n",
        "DSI1_trncrd.csv": "1.5,2.5,0,2,0\n3.5,4.5,0,3,0\n",
        "DSI1_tstrss.csv": "-70,-80\n",
        "DSI1_tstcrd.csv": "5,6,0,2,0\n",
    }
    dataset = read(tmp_path, "trn-tst", files)
    assert sorted(dataset.fingerprints.select("building", "floor", "x", "y").collect().rows()) == [
        ("DSI1 0", 2, 1.5, 2.5),
        ("DSI1 0", 2, 5.0, 6.0),
        ("DSI1 0", 3, 3.5, 4.5),
    ]
    assert sorted(map(str, parts(dataset))) == ["test", "train", "train"]
    assert set(dataset.access_points.collect()["bssid"]) == {"DSI1 WAP001", "DSI1 WAP002"}


def test_real_sodindoorloc_is_whole(tmp_path: Path) -> None:
    (archive,) = shared_folder("sodindoorloc").glob("*.tar.xz")
    dataset = import_format_of(archive).read(archive, ImportContext(Folder.at(tmp_path)))
    counts = dataset.fingerprints.group_by("session").len().sort("session").collect()
    assert counts.rows() == [
        ("Testing_CETC331", 840),
        ("Testing_HCXY_AP", 860),
        ("Training_CETC331", 955),
        ("Training_HCXY_AP_30", 11370),
    ]


def test_real_dungeon_assistant_is_whole(tmp_path: Path) -> None:
    (archive,) = shared_folder("dungeon-assistant").glob("*.tar.xz")
    dataset = import_format_of(archive).read(archive, ImportContext(Folder.at(tmp_path)))
    found = dataset.fingerprints.select(pl.len(), low=pl.col("z").min(), high=pl.col("z").max()).collect()
    ((count, low, high),) = found.rows()
    assert (count, round(low, 1), round(high, 1)) == (1957, -0.6, 2.1)


def test_a_table_of_ones_own_by_its_description(tmp_path: Path) -> None:
    tables = FingerprintTables(
        SetDescription("ours", licence="CC0-1.0", creators=("Carberry, Josiah",)),
        files=re.compile(r"scans_\d+\.csv"),
        none_found="holds no scans_*.csv",
        columns={"east": pl.Float64(), "north": pl.Float64(), "storey": pl.Int32()},
        access_points=re.compile(r"[0-9a-f:]{17}"),
        needed=("east", "north", "storey"),
        not_heard=-128.0,
        fields={"x": pl.col("east"), "y": pl.col("north"), "floor": pl.col("storey"), "session": pl.col(FILE)},
    )
    text = "00:00:5e:00:53:01,00:00:5e:00:53:02,east,north,storey\n-50,-128,1,2,0\n-128,-60,3,4,1\n"
    folder = written(tmp_path / "set", {"scans_1.csv": text, "scans_2.csv": text})
    assert tables.recognises(folder)
    dataset = tables.read(folder, ImportContext(Folder.at(tmp_path)))
    assert dataset.fingerprints.collect()["session"].to_list() == ["scans_1", "scans_1", "scans_2", "scans_2"]
    assert dataset.readings.collect()["rssi_dbm"].to_list() == [-50, -60, -50, -60]
    assert (dataset.info.licence, dataset.info.creators[0].name, dataset.splits) == ("CC0-1.0", "Carberry, Josiah", {})


@pytest.fixture(scope="module")
def tampere(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    path = shared_folder("tampere")
    assert import_format_of(path).name == "tampere"
    return import_named("tampere").read(path, ImportContext(Folder.at(tmp_path_factory.mktemp("scratch"))))


def test_real_data_are_whole(tampere: Dataset) -> None:
    fingerprints = tampere.fingerprints.collect()
    assert tampere.access_points.collect().height == 992
    assert fingerprints["device"].n_unique() == 21
    assert [floor.number for floor in tampere.info.floors] == [0, 1, 2, 3, 4]
    assert tampere.splits[OFFICIAL].groups["group"].value_counts(sort=True).rows() == [("test", 3951), ("train", 697)]
    assert fingerprints["readings"].sum() == tampere.readings.collect().height
    assert not tampere.info.findings


def test_a_nearest_neighbour_errs_as_the_literature_says(tampere: Dataset) -> None:
    fingerprints = tampere.fingerprints.collect()
    place, level = fingerprints.select("x", "y").to_numpy(), levels(tampere, fingerprints["scan_id"])
    split = tampere.splits[OFFICIAL]
    train, test = (
        fingerprints.with_row_index().filter(pl.col("scan_id").is_in(part.implode()))["index"].to_numpy()
        for part in split.train_test_ids(split.fold(OFFICIAL))
    )
    nearest = train[NearestNeighbors(n_neighbors=1).fit(level[train]).kneighbors(level[test])[1][:, 0]]
    error_m = np.hypot(*(place[nearest] - place[test]).T).mean()
    floor = fingerprints["floor"].to_numpy()
    assert error_m == pytest.approx(9.40, abs=0.02)
    assert (floor[nearest] == floor[test]).mean() == pytest.approx(0.915, abs=0.001)


def levels(dataset: Dataset, scans: pl.Series) -> np.ndarray:
    readings, names = dataset.readings.collect(), dataset.access_points.collect()["bssid"]
    level = np.full((len(scans), len(names)), FLOOR_OF_LEVELS_DBM, dtype=np.float32)
    row = readings["scan_id"].replace_strict(scans, pl.int_range(len(scans), eager=True)).to_numpy()
    column = readings["bssid"].replace_strict(names, pl.int_range(len(names), eager=True)).to_numpy()
    level[row, column] = readings["rssi_dbm"].to_numpy()
    return level
