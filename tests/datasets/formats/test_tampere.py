"""The Tampere quartet: its real data, and small ones with what goes wrong."""

from __future__ import annotations

import datetime as dt
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from sklearn.neighbors import NearestNeighbors

from tests.conftest import shared_folder
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.folder import Folder
from vislam2tag.datasets.format_registry import ImportContext, import_format_of
from vislam2tag.datasets.formats.tampere import TABLES
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.point_fingerprints import OFFICIAL

FLOOR_OF_LEVELS_DBM = -105.0
"""What stands for "not heard" in the nearest neighbour that ../shared/algorithms.md gives the errors of."""


@pytest.fixture(scope="module")
def tampere(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    path = shared_folder("tampere")
    assert import_format_of(path).name == "tampere"
    return TABLES.read(path, ImportContext(Folder.at(tmp_path_factory.mktemp("scratch"))))


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


def quartet(folder: Path, part: str = "Training", **changed: str) -> Path:
    texts = {
        "rss": "-50,100\n100,-60\n",
        "coordinates": "1,2,3.7\n3,4,0\n",
        "device": "HTC One\nLG\n",
        "date": "2017-08-18 11:59:23\n2017-08-18 11:00:00\n",
    }
    folder.mkdir(exist_ok=True)
    for role, text in {**texts, **changed}.items():
        (folder / f"{part}_{role}_21Aug17.csv").write_text(text)
    return folder


def imported(folder: Path, tmp_path: Path) -> Dataset:
    return TABLES.read(folder, ImportContext(Folder.at(tmp_path / "scratch")))


def test_a_small_quartet(tmp_path: Path) -> None:
    dataset = imported(quartet(tmp_path / "t"), tmp_path)
    one, other = dataset.fingerprints.collect().rows(named=True)
    assert (one["scan_id"], one["floor"], one["z"]) == ("HTC-One-2017-08-18/wifi/000000", 1, 3.7)
    assert (one["device"], one["date"], one["start_ns"]) == ("HTC One", dt.date(2017, 8, 18), 1503057563 * 10**9)
    assert (other["floor"], other["x"], other["y"]) == (0, 3.0, 4.0)
    assert dataset.readings.select("bssid", "rssi_dbm").collect().rows() == [("WAP001", -50.0), ("WAP002", -60.0)]


def test_both_parts_and_neither_device_nor_date(tmp_path: Path) -> None:
    folder = quartet(quartet(tmp_path / "t"), "Test")
    for path in (*folder.glob("*device*"), *folder.glob("*date*")):
        path.unlink()
    dataset = imported(folder, tmp_path)
    assert dataset.fingerprints.collect()["scan_id"].to_list() == [f"fingerprints/wifi/{n:06d}" for n in range(4)]
    assert dataset.splits[OFFICIAL].groups["group"].to_list() == ["test", "test", "train", "train"]


def test_heights_between_floors_and_broken_dates_are_findings(tmp_path: Path) -> None:
    folder = quartet(tmp_path / "t", coordinates="1,2,5\n3,4,0.04\n", date="yesterday\n\n")
    dataset = imported(folder, tmp_path)
    assert {finding.kind: finding.lines for finding in dataset.info.findings} == {
        "height_off_floor": (1,),
        "unreadable_dates": (1,),
    }
    assert dataset.fingerprints.collect()["date"].null_count() == 2


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"coordinates": "1,2,3.7\n"}, "coordinates_21Aug17.csv: has 1 lines, expected 2"),
        ({"coordinates": "1,2\n3,4\n"}, r"line 1 has 2 values, expected 3 \(x, y, z\)"),
        ({"coordinates": "1,2,3\n3,north,0\n"}, "line 2, column y: 'north' is no number"),
        ({"device": "LG\n"}, "device_21Aug17.csv: has 1 lines, expected 2"),
        ({"rss": "-50,100\n100,loud\n"}, "line 2, column WAP002: 'loud' is no number"),
        ({"rss": "-50,100\n100\n"}, "line 2 has 1 values, expected 2"),
    ],
)
def test_wrong_files_are_told(tmp_path: Path, changed: dict[str, str], said: str) -> None:
    with pytest.raises(DatasetError, match=said):
        imported(quartet(tmp_path / "t", **changed), tmp_path)


def test_incomplete_or_double_quartets_are_told(tmp_path: Path) -> None:
    folder = quartet(tmp_path / "t")
    (folder / "Training_rss_22Aug17.csv").touch()
    with pytest.raises(DatasetError, match=r"holds both Training_rss_21Aug17.csv and Training_rss_22Aug17.csv"):
        imported(folder, tmp_path)
    for path in folder.glob("*_rss_*"):
        path.unlink()
    with pytest.raises(DatasetError, match=r"has no training rss"):
        imported(folder, tmp_path)
    (tmp_path / "empty").mkdir()
    with pytest.raises(DatasetError, match="expected the Tampere quartet"):
        imported(tmp_path / "empty", tmp_path)
