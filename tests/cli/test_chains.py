"""Commands take the folders of other commands: from a survey or a run to a model and positions."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import polars as pl
import pytest

from tests.cli.command import the_error, vislam2tag
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.survey import simulate


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A survey with a named building, its run, its labels and a data set with both technologies."""
    root = tmp_path_factory.mktemp("chain")
    simulate(regular_survey(3, "none", (0,), ("LG", "Pixel"), 2, 60.0, ble=True), root / "survey")
    for command in (
        ("site", "init", root / "survey", "--building", "Town hall"),
        ("run", root / "survey", "--out", root / "out", "--jobs", "1"),
        ("dataset", root / "out", "--ble-with-wifi", "--out", root / "both"),
        ("train", root / "out", "--model", "weighted-knn", "--out", root / "wifi.v2t"),
        ("train", root / "both", "--model", "weighted-knn", "--out", root / "both.v2t"),
    ):
        done = vislam2tag(*command)
        assert done.returncode == 0, done.stderr + done.stdout
    return root


def first_session(folder: Path) -> Path:
    return sorted((folder / "survey" / "floor_0" / "LG").iterdir())[0]


def test_the_output_of_run_is_taken(folder: Path, tmp_path: Path) -> None:
    time_ns = int((first_session(folder) / "poses.csv").read_text().splitlines()[500].split(";")[0])
    (tmp_path / "table.csv").write_text(f"time_ns,what\n{time_ns},door\n")
    for command in (
        ("figures", folder / "out", "--out", tmp_path / "figures"),
        ("split", folder / "out", "--by", "random", "--name", "again"),
        ("locate", folder / "wifi.v2t", folder / "out", "--out", tmp_path / "there.csv"),
        ("label", tmp_path / "table.csv", "--labels", folder / "out", "--out", tmp_path / "labelled.csv"),
    ):
        done = vislam2tag(*command)
        assert done.returncode == 0, (command, done.stderr)
    assert pl.read_csv(tmp_path / "labelled.csv")["x_m"].is_not_null().all()
    assert (folder / "out" / "dataset" / "splits" / "again.json").is_file()
    assert not (folder / "out" / "splits").exists()


def test_the_building_reaches_the_positions(folder: Path, tmp_path: Path) -> None:
    done = vislam2tag("locate", folder / "wifi.v2t", first_session(folder), "--out", tmp_path / "there.csv")
    assert done.returncode == 0, done.stderr
    assert set(pl.read_csv(tmp_path / "there.csv")["building"]) == {"Town hall"}
    info = json.loads((folder / "out" / "dataset" / "dataset.json").read_text())
    assert [floor["building"] for floor in info["floors"]] == ["Town hall"]
    assert "Town hall" in (folder / "out" / "dataset" / "README.md").read_text()


def test_a_session_and_its_wifi_file_are_located(folder: Path, tmp_path: Path) -> None:
    session = first_session(folder)
    scans = {line.split(";")[0].strip() for line in (session / "wifi.csv").read_text().splitlines()}
    shutil.copy(session / "wifi.csv", tmp_path / "walk.txt")
    for number, given in enumerate((session, session / "wifi.csv", tmp_path / "walk.txt")):
        out = tmp_path / f"{number}.csv"
        done = vislam2tag("locate", folder / "both.v2t", given, "--out", out)
        assert done.returncode == 0, done.stderr
        assert set(pl.read_csv(out)["scan_id"].cast(pl.String)) == scans
        assert ("with a track" in done.stdout) == (given == session)
        assert (f"{len(scans)} scans without a known BLE beacon" in done.stdout) == (given != session)


def test_other_folders_are_answered_with_the_next_command(folder: Path, tmp_path: Path) -> None:
    labels, survey = folder / "out" / "labels", folder / "survey"
    train = ("--model", "weighted-knn", "--out", tmp_path / "x.v2t")
    for given in (labels, survey):
        said = the_error(vislam2tag("train", given, *train))
        assert f"run `vislam2tag dataset {given} --out fingerprints`" in said
    assert "pass one of its sessions, such as" in vislam2tag("locate", folder / "wifi.v2t", survey).stderr
    assert "vislam2tag dataset" in vislam2tag("locate", folder / "wifi.v2t", labels).stderr
    assert "--ble-with-wifi" in vislam2tag("locate", folder / "both.v2t", folder / "out").stderr
