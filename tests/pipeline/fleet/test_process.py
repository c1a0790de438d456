"""A fleet is processed: as each survey would be alone, nothing twice, and one bad survey ends nothing."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.pipeline.fleet.conftest import SmallFleet
from tests.pipeline.fleet.trees import tree_of
from tests.surveys import bytes_of, make_survey
from vislam2tag.pipeline.fleet.catalogue import Fleet
from vislam2tag.pipeline.labels.process import process
from vislam2tag.settings import Settings


def test_labels_are_those_of_each_survey_alone(fleet: SmallFleet, tmp_path: Path) -> None:
    for name, survey in fleet.surveys.items():
        process(survey, tmp_path / name, Settings(strategy="local-corrected"))
        there = bytes_of(fleet.s3.download(f"{fleet.name}/labels/{name}", tmp_path / f"{name}-there"))
        assert there == bytes_of(tmp_path / name)


def test_what_is_done_is_not_done_again(fleet: SmallFleet, tmp_path: Path) -> None:
    tree = tree_of(Path(fleet.address), tmp_path / "before")
    assert {"labels/ward/summary.json", "labels/ward/report.html"} <= tree.keys()
    fleet.s3.seen()
    before = Fleet(Path(fleet.address)).record()
    again = vislam2tag("fleet", "process", fleet.address, "--jobs", "1", "--config", fleet.config, "--json")
    requests = fleet.s3.seen()
    assert again.returncode == 0, again.stderr
    assert json.loads(again.stdout)["states"] == {"done": 2}
    put = {each.removeprefix(f"PUT /bucket/{fleet.name}/") for each in requests if each.startswith("PUT")}
    assert {name for name in put if "probe" not in name} == {"report/index.html"}
    assert len(requests) < len(fleet.processed) / 2
    assert Fleet(Path(fleet.address)).record() == before
    assert tree_of(Path(fleet.address), tmp_path / "after") == tree


def test_a_bad_session_and_a_bad_survey_are_told_and_the_rest_goes_on(fleet: SmallFleet, tmp_path: Path) -> None:
    store = tmp_path / "fleet"
    assert vislam2tag("fleet", "add", store, *fleet.surveys.values()).returncode == 0
    next((store / "surveys" / "hall").glob("floor_0/LG/*/poses.csv")).write_text("spoilt")
    (store / "surveys" / "ward" / "corrections.toml").write_text("spoilt")
    done = vislam2tag("fleet", "process", store, "--jobs", "1", "--config", fleet.config)
    assert done.returncode == 1
    assert "floor 0 / LG" in done.stderr
    assert "ward" in done.stderr
    rows = {row["survey"]: row for row in Fleet(store).catalogue().to_dicts()}
    assert (rows["hall"]["state"], rows["hall"]["failed"]) == ("failed", 1)
    assert rows["ward"]["state"] == "unreadable"
    assert "corrections.toml" in rows["ward"]["error"]
    (store / "surveys" / "ward" / "corrections.toml").unlink()
    one = vislam2tag("fleet", "process", store, "--jobs", "1", "--config", fleet.config, "--survey", "ward")
    assert one.returncode == 0, one.stderr
    assert vislam2tag("fleet", "status", store).stdout.splitlines()[1:3] == [
        "done: 1 survey, 2 sessions",
        "failed: 1 survey, 2 sessions",
    ]
    assert vislam2tag("verify", store / "labels" / "ward", f"{fleet.address}/labels/ward").returncode == 0


def test_a_fleet_whose_frames_are_all_uncertain_is_labelled_as_its_surveys_are(
    fleet: SmallFleet, tmp_path: Path
) -> None:
    config = tmp_path / "settings.toml"
    config.write_text("[labels]\nmax_sigma_m = 0.0001\n")
    alone = vislam2tag(
        "process", fleet.surveys["ward"], "--out", tmp_path / "out", "--jobs", "1", "--config", config, "--json"
    )
    frames = json.loads(alone.stdout)["frames"]
    assert frames["uncertain"] > 0
    assert "ok" not in frames
    store = tmp_path / "fleet"
    assert vislam2tag("fleet", "add", store, fleet.surveys["ward"]).returncode == 0
    done = vislam2tag("fleet", "process", store, "--jobs", "1", "--config", config)
    assert (done.returncode, alone.returncode) == (0, 0), done.stderr
    assert "done: 1 survey, 2 sessions" in done.stdout
    assert done.stdout.splitlines()[-1].startswith("next: open ")


def test_a_fleet_with_shifted_ids_fails_as_its_survey_does(tmp_path: Path) -> None:
    survey, store = make_survey(tmp_path / "hall", seconds=90.0), tmp_path / "fleet"
    table = survey / "floor_0" / "marker_dict.csv"
    head, *rows = table.read_text().splitlines()
    shifted = [f"{int(row.partition(',')[0]) + 1},{row.partition(',')[2]}" for row in rows]
    table.write_text("\n".join([head, *shifted]) + "\n")
    assert vislam2tag("process", survey, "--out", tmp_path / "out", "--jobs", "1").returncode == 1
    assert vislam2tag("fleet", "add", store, survey).returncode == 0
    for _ in range(2):  # what is unchanged is no less wrong
        done = vislam2tag("fleet", "process", store, "--jobs", "1")
        assert done.returncode == 1
        assert "hall: walks and landmark tables have different ids" in done.stderr
        assert done.stdout.splitlines()[-1] == f"next: vislam2tag fleet list {store}"
    assert "failed: 1 survey" in done.stdout
    assert "hall: walks and landmark tables have different ids" in vislam2tag("fleet", "list", store).stdout


@pytest.mark.parametrize("command", ["process", "list", "status", "report"])
def test_where_no_fleet_is_it_is_told_how_to_begin_one(command: str, tmp_path: Path) -> None:
    assert "start one with vislam2tag fleet add" in the_error(vislam2tag("fleet", command, tmp_path))


def test_an_unknown_survey_is_told(fleet: SmallFleet) -> None:
    done = vislam2tag("fleet", "process", fleet.address, "--survey", "wrad")
    assert the_error(done).startswith(f"error: wrad: {fleet.address} has no such survey")
