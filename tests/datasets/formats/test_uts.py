"""UTSIndoorLoc's two tables."""

from __future__ import annotations

from pathlib import Path

import pytest

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.folder import Folder
from vislam2tag.datasets.format_registry import ImportContext, import_format_of
from vislam2tag.datasets.formats.uts import TABLES
from vislam2tag.datasets.point_fingerprints import OFFICIAL

ACCESS_POINTS = ",".join(f"WAP{number:03d}" for number in range(1, 590))
SILENT = ",".join(["100"] * 587)


def written(folder: Path, name: str = "UTS_training.csv", head: str = "Pos_x,Pos_y,Floor_ID", rows: str = "") -> Path:
    folder.mkdir(exist_ok=True)
    default = f"-50,100,{SILENT},1.5,2.5,-3\n100,100,{SILENT},3.5,4.5,12\n"
    (folder / name).write_text(f"{ACCESS_POINTS},{head}\n{rows or default}")
    return folder


def test_both_parts(tmp_path: Path) -> None:
    folder = written(written(tmp_path / "uts"), "UTS_test.csv")
    assert import_format_of(folder).name == "uts"
    dataset = TABLES.read(folder, ImportContext(Folder.at(tmp_path)))
    found = dataset.fingerprints.collect()
    assert found.select("scan_id", "floor", "x", "y", "readings").rows()[:2] == [
        ("UTS_test/wifi/000000", -3, 1.5, 2.5, 1),
        ("UTS_test/wifi/000001", 12, 3.5, 4.5, 0),
    ]
    assert dataset.readings.collect()["bssid"].to_list() == ["WAP001", "WAP001"]
    assert dataset.splits[OFFICIAL].groups["group"].to_list() == ["test", "test", "train", "train"]
    assert [floor.number for floor in dataset.info.floors] == [-3, 12]
    assert dataset.info.clock == "none"


def test_one_file_with_the_further_columns(tmp_path: Path) -> None:
    head = "Pos_x,Pos_y,Floor_ID,Building_ID,User_ID,Phone_type,Time"
    folder = written(tmp_path / "uts", head=head, rows=f"100,-60,{SILENT},1,2,0,B11,7,OPPO,2017\n")
    dataset = TABLES.read(folder / "UTS_training.csv", ImportContext(Folder.at(tmp_path)))
    row = dataset.fingerprints.collect().row(0, named=True)
    assert (row["building"], row["user"], row["device"]) == ("B11", "7", "OPPO")
    assert [(finding.kind, finding.count) for finding in dataset.info.findings] == [("unknown_columns", 1)]


def test_a_place_that_lacks_a_part_is_none(tmp_path: Path) -> None:
    folder = written(tmp_path / "uts", rows=f"100,-60,{SILENT},1,,0\n100,-61,{SILENT},1,2,0\n")
    found = TABLES.read(folder, ImportContext(Folder.at(tmp_path))).fingerprints.collect()
    assert found.select("x", "status").rows() == [(None, "invalid"), (1.0, "ok")]


def test_a_floor_beyond_all_numbers_is_none(tmp_path: Path) -> None:
    folder = written(tmp_path / "uts", rows=f"100,-60,{SILENT},1,2,9223372036854775807\n100,-61,{SILENT},1,2,0\n")
    found = TABLES.read(folder, ImportContext(Folder.at(tmp_path))).fingerprints.collect()
    assert found.select("floor", "status").rows() == [(None, "invalid"), (0, "ok")]


@pytest.mark.parametrize(
    ("head", "rows", "said"),
    [
        ("X,Y,Floor_ID", f"100,100,{SILENT},1,2,3\n", "has no column Pos_x with numbers"),
        ("Pos_x,Pos_y,Floor_ID", f"100,100,{SILENT},1,2,F3\n", "line 2, column Floor_ID: 'F3' is no number"),
        ("Pos_x,Pos_y,Floor_ID", f"100,100,{SILENT},1,2\n", "line 2 has 591 values, expected 592"),
    ],
)
def test_wrong_files_are_told(tmp_path: Path, head: str, rows: str, said: str) -> None:
    folder = written(tmp_path / "uts", head=head, rows=rows)
    with pytest.raises(DatasetError, match=said):
        TABLES.read(folder, ImportContext(Folder.at(tmp_path)))


def test_a_folder_without_the_files_or_with_two_sets_is_told(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="holds no UTS_training"):
        TABLES.read(tmp_path, ImportContext(Folder.at(tmp_path)))
    written(tmp_path / "a")
    written(tmp_path / "b")
    with pytest.raises(DatasetError, match="twice"):
        TABLES.read(tmp_path, ImportContext(Folder.at(tmp_path)))
