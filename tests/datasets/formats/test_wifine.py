"""WiFine's trajectories: a table each, in folders by part."""

from __future__ import annotations

from pathlib import Path

import pytest

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.folder import Folder
from vislam2tag.datasets.format_registry import ImportContext, import_format_of
from vislam2tag.datasets.formats.wifine import TABLES
from vislam2tag.datasets.point_fingerprints import OFFICIAL

HEAD = "0,1,num_visible_APs,timestamp,x,y,z,floorID"


def written(folder: Path, name: str, *rows: str) -> Path:
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text("\n".join((HEAD, *rows)) + "\n")
    return folder


def test_walks_their_times_and_the_split(tmp_path: Path) -> None:
    folder = written(tmp_path / "w", "train/train_4_1.csv", "-48.0,-100.0,1,0.0,1,2,0.5,0", "-50,-60,2,3.95,4,5,0.5,0")
    written(folder, "val/val_45_e_1.csv", "-100.0,-71.5,1,0.0,7,8,9,1")
    assert import_format_of(folder).name == "wifine"
    dataset = TABLES.read(folder, ImportContext(Folder.at(tmp_path)))
    found = dataset.fingerprints.collect()
    assert found.select("scan_id", "floor", "x", "z", "start_ns", "readings").rows() == [
        ("train_4_1/wifi/000000", 0, 1.0, 0.5, 0, 1),
        ("train_4_1/wifi/000001", 0, 4.0, 0.5, 3_950_000_000, 2),
        ("val_45_e_1/wifi/000000", 1, 7.0, 9.0, 0, 1),
    ]
    assert dataset.readings.collect()["bssid"].to_list() == ["ap0", "ap0", "ap1", "ap1"]
    assert dataset.splits[OFFICIAL].groups["group"].to_list() == ["train", "train", "test"]


def test_a_line_without_a_place_is_told(tmp_path: Path) -> None:
    folder = written(tmp_path / "w", "train/train_4_1.csv", "-48.0,-100.0,1,0.0,,2,0.5,0")
    with pytest.raises(DatasetError, match=r"train_4_1\.csv: line 2 has no x; expected the columns"):
        TABLES.read(folder, ImportContext(Folder.at(tmp_path)))


def test_a_folder_of_something_else(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match=r"holds no train/train_\*"):
        TABLES.read(tmp_path, ImportContext(Folder.at(tmp_path)))
