"""Commands that make a data set and show what is in it: ``dataset``, ``figures`` and ``radio-maps``."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import polars as pl
import pytest
from typer.testing import CliRunner

from tests.cli.command import the_error, vislam2tag
from tests.datasets.factory import bssid, small_dataset
from tests.surveys import bytes_of, make_survey
from vislam2tag.cli.app import app
from vislam2tag.cli.commands_datasets import metres_of, seconds_of, start_of
from vislam2tag.common.errors import UsageError, Vislam2tagError
from vislam2tag.datasets.folder import open_dataset, write_dataset
from vislam2tag.pipeline.labels.process import process


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_survey(tmp_path_factory.mktemp("survey") / "campus", seconds=60.0)


@pytest.fixture(scope="module")
def labels(survey: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("labels") / "labels"
    process(survey, out)
    return out


@pytest.mark.parametrize(("text", "seconds"), [("1s", 1.0), ("500ms", 0.5), (" 2.5 s ", 2.5), ("1.5min", 90.0)])
def test_durations(text: str, seconds: float) -> None:
    assert seconds_of(text, "--window") == pytest.approx(seconds)


@pytest.mark.parametrize("text", ["", "1", "s", "0s", "-1s", "1h", "1e3s", "1,5s", "0.0 ms", "0.9ms"])
def test_other_texts_are_no_durations(text: str) -> None:
    with pytest.raises(UsageError, match=r"--window .*such as 500ms, 2s"):
        seconds_of(text, "--window")


def test_a_survey_becomes_a_data_set(survey: Path, labels: Path, tmp_path: Path) -> None:
    done = vislam2tag("dataset", survey, "--out", tmp_path / "set", "--jobs", "1", "--people", "2", "--hours", "0.5")
    assert done.returncode == 0, done.stderr
    assert "fingerprints" in done.stdout.splitlines()[0]
    assert f"page: {tmp_path / 'set/report.html'}" in done.stdout
    assert done.stderr == ""
    built = open_dataset(tmp_path / "set")
    assert built.info.name == "campus"
    statistics = json.loads((tmp_path / "set/statistics.json").read_text())
    assert statistics["effort"]["person_hours"] == 1.0
    assert (tmp_path / "set/plans/floor_0.jpg").is_file()
    of_labels = vislam2tag(
        "dataset", labels, "--survey", survey, "--out", tmp_path / "again", "--people", "2", "--hours", "0.5"
    )
    assert of_labels.returncode == 0
    assert bytes_of(tmp_path / "again") == bytes_of(tmp_path / "set")


def test_a_file_of_settings_says_how_a_survey_is_processed_and_grouped(survey: Path, tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text("strategy = 'local'\n[dataset]\nble_window_s = 2.0\nmagnetic_window_s = 1.0\n")
    config = ("--config", file, "--magnetic-window", "2s")
    done = vislam2tag("dataset", survey, "--out", tmp_path / "set", "--jobs", "1", *config)
    assert done.returncode == 0, done.stderr
    told = json.loads((tmp_path / "set/dataset.json").read_text())["sources"][0]["settings"]
    assert told["process"]["strategy"] == "local"
    assert (told["dataset"]["ble_window_s"], told["dataset"]["magnetic_window_s"]) == (2.0, 2.0)


def test_options_reach_the_data_set(labels: Path, tmp_path: Path) -> None:
    (tmp_path / "key").write_text("a secret of at least sixteen bytes")
    (tmp_path / "about.toml").write_text('title = "Our building"\nlicence = "CC-BY-4.0"\n')
    done = vislam2tag(
        *("dataset", labels, "--out", tmp_path / "set", "--name", "lab", "--window", "500ms", "--ble-window", "2s"),
        *("--magnetic-window", "1s", "--imu-window", "2s", "--max-sigma-m", "0.05", "--building", "main", "--no-ssid"),
        *("--hash-bssid", tmp_path / "key", "--describe", tmp_path / "about.toml", "--radios", "--jobs", "1"),
    )
    assert done.returncode == 0, done.stderr
    built = open_dataset(tmp_path / "set")
    assert (built.info.name, built.info.title, built.info.licence) == ("lab", "Our building", "CC-BY-4.0")
    assert built.info.groupings[0].window_s == 0.5
    assert built.info.bssid_key is not None
    points = built.access_points.collect()
    assert points["ssid"].null_count() == len(points) > 0
    assert points["bssid"].str.len_chars().unique().to_list() == [32]
    scans = built.fingerprints.collect()
    assert set(scans["building"]) == {"main"}
    assert "uncertain" in set(scans["status"])
    windows = built.tables["imu_windows"].collect()
    assert windows["accelerometer"].list.len().unique().to_list() == [300]
    spans = built.tables["magnetic"].select((pl.col("end_ns") - pl.col("start_ns")).max()).collect().item()
    assert 0.9e9 < spans < 1e9


def test_wrong_use_is_one_message(labels: Path, tmp_path: Path) -> None:
    for arguments, part in (
        ((labels, "--window", "soon"), "--window soon"),
        ((labels, "--imu-window", "0s"), "--imu-window 0s"),
        ((tmp_path / "missing",), "no such folder"),
        ((labels, "--people", "2"), "--people 2: also pass --hours"),
        ((labels, "--hours", "1e308"), "--people 1 --hours 1e+308: this is too much for a survey"),
        ((labels, "--building", "a", "--building", "b"), "2 names for 1 sources"),
        ((labels, "--hash-bssid", tmp_path / "missing"), "the key cannot be read"),
        ((labels, "--describe", tmp_path / "missing"), "cannot be read"),
    ):
        done = CliRunner().invoke(app, ["dataset", "--out", str(tmp_path / "set"), *map(str, arguments)])
        assert isinstance(done.exception, Vislam2tagError)
        assert part in str(done.exception)
        assert "\n" not in str(done.exception)
    assert "no such folder" in the_error(vislam2tag("dataset", tmp_path / "missing", "--out", tmp_path / "set"))
    assert not (tmp_path / "set").exists()


def test_a_set_of_a_walk_without_label_is_exit_code_3(survey: Path, tmp_path: Path) -> None:
    lone = make_survey(tmp_path / "lone", devices=("LG",), seconds=30.0)
    for file in (*lone.glob("floor_0/LG/*/initPoses.csv"), *lone.glob("floor_0/*.jpg")):
        file.unlink()
    done = vislam2tag("dataset", lone, "--out", tmp_path / "set", "--jobs", "1")
    assert done.returncode == 3
    assert "session_without_label: 1 " in done.stdout
    assert "failed" in done.stderr
    assert open_dataset(tmp_path / "set").fingerprints.collect()["x"].is_null().all()


def test_a_georeference_that_came_later_reaches_the_set(survey: Path, labels: Path, tmp_path: Path) -> None:
    placed = tmp_path / "campus"
    shutil.copytree(survey, placed)
    assert vislam2tag("site", "init", placed, "--georeference", "50.78,6.06,12").returncode == 0
    done = vislam2tag("dataset", labels, "--survey", placed, "--out", tmp_path / "set", "--jobs", "1")
    assert done.returncode == 0, done.stderr
    georeference = open_dataset(tmp_path / "set").info.floors[0].georeference
    assert georeference is not None
    assert georeference.latitude_deg == pytest.approx(50.78)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("data") / "set"
    write_dataset(small_dataset(), folder)
    return folder


def test_figures_are_drawn_and_coverage_is_shown(dataset: Path, tmp_path: Path) -> None:
    done = vislam2tag("figures", dataset, "--out", tmp_path / "out", "--start", "0:5,11")
    assert done.returncode == 0, done.stderr
    assert "walk to fill the gaps" in done.stdout
    assert (tmp_path / "out" / "coverage.svg").read_bytes().startswith(b"<?xml")
    assert (tmp_path / "out" / "rssi.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--start", "1;2"), "--start 1;2: expected FLOOR:X,Y"),
        (("--cell-m", "0"), "--cell-m 0.0: Input should be greater than or equal to 0.05"),
        (("--radius-m", "nan"), "--radius-m nan: Input should be"),
    ],
)
def test_wrong_values_are_one_line(dataset: Path, tmp_path: Path, arguments: tuple[str, ...], told: str) -> None:
    assert told in the_error(vislam2tag("figures", dataset, "--out", tmp_path / "out", *arguments))
    assert not (tmp_path / "out").exists()


def test_starts_may_name_a_building() -> None:
    assert start_of("1:12.5,-3") == (("", 1), (12.5, -3.0))
    assert start_of("wing a/b/-1:0,4") == (("wing a/b", -1), (0.0, 4.0))
    with pytest.raises(UsageError, match="BUILDING/FLOOR"):
        start_of("1:2")


@pytest.mark.usefixtures("undrawn_figures")
def test_maps_are_written_and_told(dataset: Path, tmp_path: Path) -> None:
    done = vislam2tag("radio-maps", dataset, "--out", tmp_path / "maps", "--cell", "2m", "--most", "2")
    assert done.returncode == 0, done.stderr
    assert "Radio maps" in done.stdout
    limit = "at most 2 access points of each floor are mapped, the most often received ones; --most maps more"
    assert limit in done.stdout
    assert f"page: {tmp_path / 'maps' / 'index.html'}\nnext: vislam2tag train " in done.stdout
    names = sorted(path.name for path in (tmp_path / "maps").iterdir() if path.name[0] != ".")
    assert names == ["figures", "floor_0.wifi.npz", "floor_1.wifi.npz", "geotiff", "index.html", "radio_maps.json"]
    assert len(list((tmp_path / "maps" / "geotiff").rglob("*.tif"))) == 4


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--ap", "00:00"), "--ap 00:00: no such access point in this data set"),
        (("--cell", "1"), "--cell 1: expected a length above zero with a unit, such as 1m or 50cm"),
        (("--cell", "1mm"), "--cell 1mm: expected a length"),
        (("--reach", "0m"), "--reach 0m: expected a length"),
        (("--cell", "1cm"), "choose a larger --cell"),
    ],
)
def test_wrong_values_are_told_in_one_line(
    arguments: tuple[str, ...], message: str, dataset: Path, tmp_path: Path
) -> None:
    done = vislam2tag("radio-maps", dataset, "--out", tmp_path / "maps", *arguments)
    assert message in the_error(done)
    assert list(tmp_path.iterdir()) == []


def test_nothing_labelled_is_told(tmp_path: Path) -> None:
    write_dataset(small_dataset(unlabelled=12), tmp_path / "set")
    done = vislam2tag("radio-maps", tmp_path / "set", "--out", tmp_path / "maps", "--ap", bssid(0, 0))
    assert "so no map can be made" in the_error(done)


@pytest.mark.parametrize(("text", "metres"), [("1m", 1.0), ("50cm", 0.5), (" 1.5 m ", 1.5)])
def test_lengths_have_a_unit(text: str, metres: float) -> None:
    assert metres_of(text, "--cell") == pytest.approx(metres)
