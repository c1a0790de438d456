"""COMFORD, read by the package ``comford`` itself and by our importer."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import polars as pl
import pytest
from comford.data.base import BaseDataset
from comford.evaluation import evaluate

from tests.datasets.factory import SCANS, small_dataset
from tests.datasets.formats.round_trip import ODD_BSSID, exported, imported, odd_dataset, through, with_split
from vislam2tag.common.errors import DatasetError
from vislam2tag.datasets.format_registry import import_format_of


def loaded(root: Path) -> BaseDataset:
    """What the package makes of the three files."""
    params = {
        "root": str(root),
        "undetected_value": -120,
        "split_availability": {"train": True, "validation": False, "test": True},
        "split_storage_map": {"train": "training", "test": "testing"},
    }
    dataset = BaseDataset("ours", params)
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        dataset.process_intermediate_to_final()
        dataset.load_final()
    return dataset


def test_the_package_loads_and_evaluates_it(tmp_path: Path) -> None:
    exported(with_split(small_dataset()), "comford", tmp_path / "out", split="by_walk")
    theirs = loaded(tmp_path / "out")
    train, test = theirs.features_train, theirs.features_test
    assert (len(train), len(test)) == (3 * (SCANS - 2), SCANS - 2)
    assert train["00:11:22:33:00:00_rssi"].iloc[0] == pytest.approx(-43.8, abs=5)
    assert (test.filter(like="_rssi").to_numpy() == -120).any()
    truth = theirs.coordinates_test
    assert truth["x"].tolist() == [5.0 + 3.0 * scan for scan in range(1, SCANS - 1)]
    figures = evaluate(truth, truth.assign(x=truth["x"] + 3, y=truth["y"] + 4))
    assert figures["error_2d_mean_m"] == pytest.approx(5.0)
    assert figures["error_vertical_mean_m"] == pytest.approx(0.0)
    assert figures["floor_accuracy"] == figures["building_accuracy"] == 1.0


def test_the_package_takes_odd_names(tmp_path: Path) -> None:
    exported(with_split(odd_dataset()), "comford", tmp_path / "out", split="by_walk")
    assert f"{ODD_BSSID}_rssi" in loaded(tmp_path / "out").features_train.columns


def test_walks_heights_headings_and_times_come_back(tmp_path: Path) -> None:
    dataset = with_split(small_dataset())
    back = through(dataset, "comford", tmp_path, split="by_walk")
    assert import_format_of(tmp_path / "out").name == "comford"
    rows, before = back.fingerprints.collect(), dataset.fingerprints.drop_nulls("x").collect()
    for name in ("session", "x", "y", "z", "floor", "heading_deg", "device", "date"):
        assert rows[name].to_list() == before[name].to_list(), name
    assert rows["start_ns"].diff()[1] == before["start_ns"].diff()[1]
    assert back.readings.collect()["frequency_mhz"].to_list() == [2412.0] * back.readings.collect().height
    train, test = back.splits["official"].train_test_ids(back.splits["official"].info.folds[0])
    assert (len(train), len(test)) == (3 * (SCANS - 2), SCANS - 2)


def test_files_of_others(tmp_path: Path) -> None:
    """Headers as the package's documentation has them, names of its own, a validation set."""
    folder = tmp_path / "intermediate"
    folder.mkdir()
    (folder / "Samples.csv").write_text(
        "sample_id;x;y;z;timestamp;test/train/val;floor;building;device;user;configurations;orientation\n"
        "0;1.5;2;None;1371713733;training;0;1;None;None;None;None\n"
        "1;2.5;2;None;None;validation;2.0;1;A;B;None;north\n"
    )
    (folder / "RSSI.csv").write_text("sample_id;rssi;ap_id;channel\n0;-60.0;AP1;6\n1;-70;AP2;None\n7;-1;AP1;None\n")
    (folder / "APs.csv").write_text("ap_id;technology;x;y;z\nAP1;WiFi;None;None;None\nAP2;BLE;1;2;3\n")
    back = imported("comford", tmp_path, tmp_path / "scratch")
    rows = back.fingerprints.sort("x").collect()
    assert rows["technology"].to_list() == ["wifi", "ble"]
    assert rows["floor"].to_list() == [0, 2]
    assert rows["start_ns"].to_list() == [1371713733_000000000, None]
    assert rows["heading_deg"].to_list() == [None, None]
    assert [(finding.kind, finding.count) for finding in back.info.findings] == [("unknown_samples", 1)]
    official = back.splits["official"]
    assert official.groups["group"].sort().to_list() == ["test", "train"]


@pytest.mark.parametrize(
    ("file", "text", "said"),
    [
        ("Samples.csv", "sample_id;x\n1;2\n", "line 1 has 2 columns; expected sample_id, x, y"),
        ("Samples.csv", "a;b;c;d;e;f;g;h;i;j;k;l\n1;x;2;3;4;5;6;7;8;9;0;0\n", "line 2: x, y and floor must be numbers"),
        ("RSSI.csv", "a;b;c;d\n0;loud;AP1;6\n", "line 2: rssi must be a number"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, file: str, text: str, said: str) -> None:
    exported(small_dataset(), "comford", tmp_path / "out")
    (tmp_path / "out" / "intermediate" / file).write_text(text)
    with pytest.raises(DatasetError, match=f"{file}: {said}"):
        imported("comford", tmp_path / "out", tmp_path / "scratch")


def test_readings_without_a_level_are_counted(tmp_path: Path) -> None:
    plain = small_dataset()
    level = pl.when(pl.col("bssid").str.ends_with("00")).then(None).otherwise("rssi_dbm").alias("rssi_dbm")
    plain.tables["readings"] = plain.readings.with_columns(level)  # type: ignore[index]
    findings = exported(plain, "comford", tmp_path / "out")
    assert ("unknown_levels_left_out", 88) in {(finding.kind, finding.count) for finding in findings}
