"""What version 0.2 wrote opens with the commands that users use, with the same numbers, or is refused by name.

``tests/data/outputs-0.2`` has one small output of each kind; its README says which command made each.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from tests.cli.command import vislam2tag
from tests.surveys import bytes_of
from vislam2tag.api import LabelRule, open_dataset, read_settings

OUTPUTS = Path(__file__).parent / "data" / "outputs-0.2"
FRAMES, SCANS, ROWS = 450, 26, 959
"""Frames of both walks, Wi-Fi scans, and rows of all tables of the data set."""
ONE = ("--jobs", "1")


@pytest.fixture
def old(tmp_path: Path) -> Path:
    """A copy that commands may change."""
    return Path(shutil.copytree(OUTPUTS, tmp_path / "old"))


def answer(*arguments: str | Path, code: int = 0) -> Any:
    """What the command prints as JSON."""
    done = vislam2tag(*arguments, "--json")
    assert done.returncode == code, (done.stdout, done.stderr)
    return json.loads(done.stdout)


def places(dataset: Path) -> pl.DataFrame:
    """Places of a data set's labelled Wi-Fi scans, in order."""
    table = pl.read_parquet(dataset / "fingerprints.parquet")
    wifi = table.filter((pl.col("technology") == "wifi") & pl.col("x").is_not_null())
    return wifi.select("floor", pl.col("x", "y").cast(pl.Float64)).sort("x", "y")


def same_places(found: pl.DataFrame, expected: pl.DataFrame, within_m: float) -> None:
    assert found.height == expected.height
    for column in ("x", "y"):
        assert np.abs(found[column].to_numpy() - expected[column].to_numpy()).max() <= within_m


def test_labels_become_the_same_data_set(old: Path, tmp_path: Path) -> None:
    answer("dataset", old / "run" / "labels", "--survey", old / "survey", "--out", tmp_path / "set", *ONE)
    found = places(tmp_path / "set")
    assert found.height == SCANS
    same_places(found, places(old / "run" / "dataset"), 1e-6)


def test_labels_place_a_table_by_its_times(old: Path, tmp_path: Path) -> None:
    labels = old / "run" / "labels"
    wifi = pl.read_parquet(labels / "wifi" / "floor_0.LG.*.parquet").filter(pl.col("status") == "ok")
    wifi.select("time_ns", "rssi_dbm").write_csv(tmp_path / "table.csv")
    answer("label", tmp_path / "table.csv", "--labels", labels, "--session", "LG", "--out", tmp_path / "found.parquet")
    found = pl.read_parquet(tmp_path / "found.parquet").select(pl.col("x_m", "y_m").cast(pl.Float64))
    same_places(found.rename({"x_m": "x", "y_m": "y"}), wifi, 1e-3)


def test_labels_are_exported_as_the_same_trajectories(old: Path, tmp_path: Path) -> None:
    answer("export", old / "run" / "labels", "--format", "tum", "--out", tmp_path / "tum", *ONE)
    before, after = bytes_of(old / "exported" / "tum"), bytes_of(tmp_path / "tum")
    tracks = {name for name in before if name.endswith((".tum", ".txt"))}
    assert len(tracks) == 4
    assert {name: after[name] for name in tracks} == {name: before[name] for name in tracks}


def test_sessions_are_mapped_again_into_older_labels(old: Path) -> None:
    labels = old / "run" / "labels"
    before = pl.read_parquet(labels / "trajectory" / "*.parquet")
    assert before.height == FRAMES
    answer("process", old / "survey", "--out", labels, *ONE)
    same_places(pl.read_parquet(labels / "trajectory" / "*.parquet"), before, 0.02)


def test_a_run_goes_on_in_its_older_folder(old: Path) -> None:
    expected = places(old / "run" / "dataset")
    answer("run", old / "survey", "--out", old / "run", *ONE)
    same_places(places(old / "run" / "dataset"), expected, 0.02)


def test_a_data_set_has_its_tables_and_splits(old: Path) -> None:
    dataset = old / "run" / "dataset"
    verified = answer("verify", dataset, OUTPUTS / "run" / "dataset")
    assert (verified["rows"], verified["differences"]) == (ROWS, [])
    assert {one.version for one in open_dataset(dataset).info.sources} == {"0.2.0"}
    splits = {one["name"]: one for one in answer("split", dataset)}
    assert set(splits) == {"block", "device", "random", "trajectory", "walks"}
    folds = {(fold["fold"], fold["of"]): (fold["train"], fold["test"]) for fold in splits["walks"]["folds"]}
    assert folds["test_1", "wifi"] == folds["test_2", "wifi"] == (13, 13)


def test_a_data_set_trains_a_model_that_knows_its_places(old: Path, tmp_path: Path) -> None:
    dataset, model = old / "run" / "dataset", tmp_path / "model.v2t"
    answer("train", dataset, "--model", "weighted-knn", "--set", "k=1", "--out", model)
    answer("locate", model, dataset, "--out", tmp_path / "found.csv")
    found = pl.read_csv(tmp_path / "found.csv").select(pl.col("x", "y").cast(pl.Float64)).sort("x", "y")
    same_places(found, places(dataset), 0.01)


@pytest.mark.parametrize(("form", "within_m"), [("parquet", 1e-6), ("uji", 1e-3), ("comford", 1e-3), ("gia", 1.0)])
def test_an_export_is_read_back(form: str, within_m: float, old: Path, tmp_path: Path) -> None:
    answer("import", old / "exported" / form, "--format", form, "--out", tmp_path / "set")
    same_places(places(tmp_path / "set"), places(old / "run" / "dataset"), within_m)


def test_exported_trajectories_are_a_truth(old: Path, tmp_path: Path) -> None:
    truth = old / "exported" / "tum"
    options = ("--strategy", "smoother", "--out", tmp_path / "evaluated", *ONE)
    answer("evaluate", old / "survey", "--truth", truth, *options)
    errors = pl.read_csv(tmp_path / "evaluated" / "errors.csv").filter(pl.col("over") == "points")
    assert set(errors["points"]) >= {FRAMES}
    assert errors["max_m"].max() == pytest.approx(0, abs=0.02)


def test_an_evaluation_is_made_again_in_its_older_folder(old: Path) -> None:
    before = pl.read_csv(old / "evaluated" / "errors.csv")
    answer("evaluate", old / "survey", "--strategy", "smoother", "--out", old / "evaluated", *ONE)
    after = pl.read_csv(old / "evaluated" / "errors.csv")
    assert after.height == before.height
    assert after["points"].to_list() == before["points"].to_list()
    assert np.abs((after["mean_m"] - before["mean_m"]).to_numpy()).max() <= 0.02


def test_radio_maps_are_made_again_in_their_older_folder(old: Path) -> None:
    def arrays() -> dict[str, np.ndarray]:
        with np.load(old / "maps" / "floor_0.wifi.npz") as file:
            return {name: file[name] for name in file.files}

    before = arrays()
    answer("radio-maps", old / "run" / "dataset", "--cell", "4m", "--most", "2", "--out", old / "maps")
    after = arrays()
    assert after.keys() == before.keys()
    for name, array in before.items():
        assert after[name].shape == array.shape
        if array.dtype.kind == "f":
            np.testing.assert_allclose(after[name], array, atol=0.1)


def test_a_benchmark_keeps_its_older_runs(old: Path) -> None:
    before = pl.read_csv(old / "compared" / "scores.csv")
    dataset = old / "run" / "dataset"
    answer("benchmark", dataset, "--model", "weighted-knn", "--split", "walks", "--out", old / "compared")
    after = pl.read_csv(old / "compared" / "scores.csv")
    assert after.select("model", "split", "fold", "mean_m").equals(before.select("model", "split", "fold", "mean_m"))


def test_planned_landmarks_are_printed_and_walked_past(old: Path, tmp_path: Path) -> None:
    table = old / "plan" / "landmarks.csv"
    ids = pl.read_csv(table)["id"].cast(pl.String).to_list()
    answer("sheets", table, "--out", tmp_path / "sheets")
    manifest = pl.read_csv(tmp_path / "sheets" / "images" / "manifest.csv", infer_schema=False)
    assert manifest["id"].to_list() == ids
    trial = ("--devices", "1", "--sessions", "1", "--minutes", "0.5", "--severity", "none", "--landmarks", table)
    answer("simulate", tmp_path / "trial", "--site", old / "site", *trial)
    (floor,) = answer("site", "show", tmp_path / "trial")["floors"]
    assert floor["landmarks"] == len(ids)


def test_a_site_has_its_floor_and_landmarks(old: Path) -> None:
    (floor,) = answer("site", "show", old / "site")["floors"]
    assert (floor["floor"], floor["landmarks"], floor["pixel_m"]) == (0, 12, 0.05)
    assert floor["extent_m"] == [0.0, 60.0, 0.0, 32.0]


def test_a_fleet_lists_its_survey_and_goes_on(old: Path) -> None:
    fleet = old / "fleet"
    (before,) = answer("fleet", "list", fleet)
    assert (before["survey"], before["sessions"], before["frames"], before["state"]) == ("ward", 1, FRAMES // 2, "done")
    assert answer("fleet", "status", fleet)["sessions"] == 1
    answer("fleet", "process", fleet, *ONE)
    (after,) = answer("fleet", "list", fleet)
    assert (after["frames_labelled"], after["distance_m"]) == (before["frames_labelled"], before["distance_m"])


def test_corrections_are_applied(old: Path) -> None:
    shutil.copy(old / "corrections.toml", old / "survey")
    sessions = answer("inspect", old / "survey")["sessions"]
    assert [one["device"] for one in sessions if one["excluded"]] == ["OnePlus"]
    answer("process", old / "survey", "--out", old / "corrected", *ONE)
    record = json.loads(next((old / "corrected" / "sessions").glob("*LG*")).read_text(encoding="utf-8"))
    assert "28.52" in json.dumps(record["corrections"])


def test_settings_are_read(old: Path) -> None:
    settings = read_settings(old / "settings.toml")
    assert (settings.strategy, settings.labels.rule) == ("smoother", LabelRule.INTERPOLATE)
    assert (settings.labels.max_sigma_m, settings.labels.max_gap_s) == (0.4, 1.5)
    assert settings.mapping.smoother.sighting_range_m == 5.0
    planned = answer("process", old / "survey", "--config", old / "settings.toml", "--out", old / "new", "--dry-run")
    assert len(planned) == 2


def test_landmarks_that_walks_gave_are_mapped_with(old: Path) -> None:
    landmarks = old / "landmarks" / "completed.csv"
    answer("process", old / "survey", "--landmarks", landmarks, "--out", old / "labels", *ONE)
    found = pl.read_parquet(old / "labels" / "trajectory" / "*.parquet")
    same_places(found, pl.read_parquet(old / "run" / "labels" / "trajectory" / "*.parquet"), 0.05)
