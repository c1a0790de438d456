"""UJI's long-term library set: four files a walk, a folder a month."""

from __future__ import annotations

from pathlib import Path

import pytest

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.folder import Folder
from vislam2tag.datasets.format_registry import ImportContext, import_format_of
from vislam2tag.datasets.formats.uji_library import TABLES
from vislam2tag.datasets.point_fingerprints import OFFICIAL

FILES = {"rss": "-90,100\n100,-60\n", "crd": "1.5,2.5,3\n3.5,4.5,5\n", "tms": "20160602155217232\n20160602155220780\n"}


def written(folder: Path, month: str, walk: str, **files: str) -> Path:
    (folder / month).mkdir(parents=True, exist_ok=True)
    for role, text in (FILES | files).items():
        (folder / month / f"{walk}{role}.csv").write_text(text)
    return folder


def test_months_walks_and_times(tmp_path: Path) -> None:
    folder = written(written(written(tmp_path / "db", "01", "trn01"), "01", "tst01"), "02", "trn01")
    assert import_format_of(folder).name == "uji-library"
    dataset = TABLES.read(folder, ImportContext(Folder.at(tmp_path)))
    found = dataset.fingerprints.collect()
    assert found["session"].unique().sort().to_list() == ["month_01.trn01", "month_01.tst01", "month_02.trn01"]
    assert found.select("floor", "x", "start_ns", "readings").rows()[:2] == [
        (3, 1.5, 1464882737232000000, 1),
        (5, 3.5, 1464882740780000000, 1),
    ]
    assert dataset.splits[OFFICIAL].groups["group"].to_list() == ["train", "train", None, None, "test", "test"]


def test_files_that_do_not_fit_are_told(tmp_path: Path) -> None:
    folder = written(tmp_path / "db", "01", "trn01", crd="1,2,3\n")
    with pytest.raises(DatasetError, match=r"trn01crd\.csv: has 1 lines, expected 2"):
        TABLES.read(folder, ImportContext(Folder.at(tmp_path)))
    (folder / "01" / "trn01tms.csv").unlink()
    with pytest.raises(DatasetError, match=r"month 01 has no trn01tms\.csv"):
        TABLES.read(folder, ImportContext(Folder.at(tmp_path)))
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    with pytest.raises(DatasetError, match="holds no MM/trnNNrss"):
        TABLES.read(elsewhere, ImportContext(Folder.at(tmp_path)))
