"""Commands take the folders of other commands: from a survey or a run to a model and positions."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from tests.cli.command import the_error, vislam2tag
from tests.pipeline.positioning.test_serve import asked as answer_of
from vislam2tag.pipeline.positioning.serve import ServedAnswers
from vislam2tag.positioning.model_files import load_model
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.survey import simulate


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A survey with a named building, its run, its labels and a data set with both technologies."""
    root = tmp_path_factory.mktemp("chain")
    simulate(regular_survey(3, "none", (0,), ("LG", "Pixel"), 2, 60.0, ble=True), root / "survey")
    (root / "survey" / "floor_0" / "rooms.csv").write_text("name,x,y\nLong corridor,30,25.6\n")
    for command in (
        ("site", "init", root / "survey", "--building", "Town hall"),
        ("site", "set", root / "survey", "--floor", "0", "--name", "Ground floor"),
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


def test_building_and_floor_reach_the_positions_and_pages(folder: Path, tmp_path: Path) -> None:
    done = vislam2tag("locate", folder / "wifi.v2t", first_session(folder), "--out", tmp_path / "there.csv")
    assert done.returncode == 0, done.stderr
    there = pl.read_csv(tmp_path / "there.csv")
    assert (set(there["building"]), set(there["floor_name"])) == ({"Town hall"}, {"Ground floor"})
    info = json.loads((folder / "out" / "dataset" / "dataset.json").read_text())
    assert [floor["building"] for floor in info["floors"]] == ["Town hall"]
    assert "| Town hall 0 | Ground floor |" in (folder / "out" / "dataset" / "README.md").read_text()
    assert "Town hall, Ground floor (floor 0)" in (folder / "out" / "dataset" / "report.html").read_text()
    assert "Ground floor" in (folder / "out" / "labels" / "report.html").read_text()
    said = the_error(vislam2tag("locate", folder / "wifi.v2t", folder / "out", "--out", tmp_path / "there.xlsx"))
    assert "positions are written as CSV or JSON lines" in said
    said = the_error(vislam2tag("locate", folder / "wifi.v2t", first_session(folder) / "ble.csv"))
    assert f"Pass its session, {first_session(folder)}" in said
    corridor = pl.col("y").is_between(25.3, 25.9) & pl.col("x").is_between(15, 50)
    there = pl.read_csv(tmp_path / "there.csv").filter(corridor)
    assert there.height > 0
    assert set(there["room"]) == {"Long corridor"}
    assert "rooms with a name: Long corridor" in (folder / "out" / "dataset" / "README.md").read_text()
    for page in ("index.html", "labels/report.html", "check/check.html"):
        text = (folder / "out" / page).read_text()
        assert "<h1>Town hall (survey)</h1>" in text
        assert "Ground floor" in text


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


@pytest.mark.parametrize(("time", "factor"), [("time_ns", 1), ("time", 1), ("time", 1000)])
@pytest.mark.parametrize("scan", [True, False], ids=["scan", "no scan"])
def test_a_table_of_readings_is_located_scan_by_scan(
    folder: Path, tmp_path: Path, time: str, factor: int, *, scan: bool
) -> None:
    rows = [
        [cell.strip() for cell in line.split(";")]
        for line in (first_session(folder) / "wifi.csv").read_text().splitlines()
    ]
    head = [*(["scan"] if scan else []), time, "bssid", "rssi"]
    lines = [",".join([*([row[0]] if scan else []), str(int(row[1]) // factor), row[4], row[5]]) for row in rows]
    (tmp_path / "table.csv").write_text("\n".join([",".join(head), *lines, ""]))
    done = vislam2tag("locate", folder / "wifi.v2t", tmp_path / "table.csv", "--out", tmp_path / "there.csv")
    assert done.returncode == 0, done.stderr
    expected = vislam2tag(
        "locate", folder / "wifi.v2t", first_session(folder) / "wifi.csv", "--out", tmp_path / "x.csv"
    )
    assert expected.returncode == 0, expected.stderr
    found, wanted = (pl.read_csv(tmp_path / name).select("x", "y") for name in ("there.csv", "x.csv"))
    if scan:
        assert found.equals(wanted)
    else:  # only the times show where a scan ends
        assert abs(found.height - wanted.height) <= 0.3 * wanted.height


def test_a_data_set_is_not_overwritten_by_a_model(folder: Path) -> None:
    file = folder / "both" / "dataset.json"
    before = file.read_bytes()
    said = the_error(vislam2tag("train", folder / "both", "--model", "weighted-knn", "--out", file))
    assert "would overwrite a file of a data set" in said
    assert file.read_bytes() == before


def test_a_request_with_both_technologies_is_answered(folder: Path) -> None:
    answers = ServedAnswers(load_model(folder / "both.v2t"), folder / "out")
    dataset = folder / "both"
    scans = pl.read_parquet(dataset / "readings.parquet").join(
        pl.read_parquet(dataset / "access_points.parquet").select("bssid", "technology"), on="bssid"
    )
    first = scans.filter(pl.col("scan_id") == scans.filter(technology="ble")["scan_id"][0])

    def readings(*technologies: str) -> dict[str, float]:
        own = first.filter(pl.col("technology").is_in(technologies))
        return dict(zip(own["bssid"], own["rssi_dbm"].cast(pl.Float64), strict=True))

    def asked(*technologies: str) -> dict[str, Any]:
        request = {"scans": [{"scan_id": "here", "readings": readings(*technologies)}]}
        answer = answer_of(answers, "POST", "/locate", json=request)
        assert answer.status_code == 200, answer.text
        return dict(answer.json())

    both, wifi, ble = asked("wifi", "ble"), asked("wifi"), asked("ble")
    truth = pl.read_parquet(dataset / "fingerprints.parquet").filter(scan_id=first["scan_id"][0])
    assert abs(both["positions"][0]["x"] - truth["x"][0]) < 5.0
    assert both["positions"][0]["floor_name"] == "Ground floor"
    assert both["notes"] == []
    assert ["BLE beacon" in note for note in wifi["notes"]] == [True]
    assert ["Wi-Fi access point" in note for note in ble["notes"]] == [True]
    model = answer_of(answers, "GET", "/model").json()
    assert (model["technology"], model["floors"][0]["name"]) == ("wifi+ble", "Ground floor")


def test_a_session_with_only_beacons_needs_a_model_of_beacons(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(first_session(folder), tmp_path / "walk")
    (tmp_path / "walk" / "wifi.csv").unlink()
    for model in ("wifi.v2t", "both.v2t"):
        said = the_error(vislam2tag("locate", folder / model, tmp_path / "walk"))
        assert "has no readings of wifi, which the model was trained on (readings of: ble)" in said
        assert "`vislam2tag train --technology ble`" in said
    train = ("--technology", "ble", "--model", "weighted-knn", "--out", tmp_path / "ble.v2t")
    assert vislam2tag("train", folder / "both", *train).returncode == 0
    done = vislam2tag("locate", tmp_path / "ble.v2t", tmp_path / "walk", "--out", tmp_path / "there.csv")
    assert done.returncode == 0, done.stderr
    assert set(pl.read_csv(tmp_path / "there.csv")["floor_name"]) == {"Ground floor"}


def test_labels_are_the_track_of_a_session(folder: Path, tmp_path: Path) -> None:
    session = first_session(folder)
    for given in (session, session / "wifi.csv"):
        by_labels = ("--track", folder / "out", "--out", tmp_path / "there.csv")
        done = vislam2tag("locate", folder / "wifi.v2t", given, *by_labels)
        assert done.returncode == 0, done.stderr
        scans = pl.read_csv(tmp_path / "there.csv").height
        assert f"others of their walk: {scans}, {scans} of them with a track" in done.stdout
    (tmp_path / "track.csv").write_text("session,time_ns,x,y\nother,1,0.0,0.0\n")
    said = the_error(vislam2tag("locate", folder / "wifi.v2t", session, "--track", tmp_path / "track.csv"))
    assert "contains no track of session floor_0.LG." in said
    slug = min((folder / "out" / "labels" / "trajectory").glob("*LG*.parquet")).stem
    (tmp_path / "track.csv").write_text(f"session,time_ns,x,y\n{slug},1,0.0,0.0\n")
    said = the_error(vislam2tag("locate", folder / "wifi.v2t", session, "--track", tmp_path / "track.csv"))
    assert f"the track of session {slug} has no position at the times of its scans" in said
    said = the_error(vislam2tag("locate", folder / "wifi.v2t", session, "--track", folder / "survey"))
    assert "it is a survey; pass the output folder of `vislam2tag process`" in said


@pytest.mark.parametrize(
    ("command", "given", "said"),
    [
        (("inspect", "GIVEN"), "out", "it is the output of `vislam2tag run`: pass the survey"),
        (("label", "TABLE", "--labels", "GIVEN"), "both", "it is a data set; pass the folder that was the --out"),
        (("import", "GIVEN", "--out", "NEW"), "out/labels", "it is the output of `vislam2tag process`"),
        (("export", "GIVEN", "--format", "csv", "--out", "NEW"), "survey", "it is a survey; `vislam2tag dataset"),
        (("split", "GIVEN", "--by", "random"), "wifi.v2t", "it is a model of `vislam2tag train`"),
        (("verify", "GIVEN", "GIVEN"), "survey", "it is a survey"),
        (("locate", "GIVEN", "TABLE"), "out", "it is the output of `vislam2tag run`; pass a model file"),
        (("studio", "SURVEY", "--labels", "GIVEN", "--export", "NEW"), "both", "it is a data set; pass the folder"),
        (("studio", "SURVEY", "--compare", "GIVEN", "--export", "NEW"), "survey", "first run `vislam2tag process"),
    ],
)
def test_refused_folders_are_named(
    folder: Path, tmp_path: Path, command: tuple[str, ...], given: str, said: str
) -> None:
    (tmp_path / "table.csv").write_text("time_ns,what\n1,door\n")
    places = {
        "GIVEN": folder / given,
        "TABLE": tmp_path / "table.csv",
        "NEW": tmp_path / "new",
        "SURVEY": folder / "survey",
    }
    assert said in " ".join(the_error(vislam2tag(*(places.get(word, word) for word in command))).split())


def test_other_folders_are_answered_with_the_next_command(folder: Path, tmp_path: Path) -> None:
    labels, survey = folder / "out" / "labels", folder / "survey"
    train = ("--model", "weighted-knn", "--out", tmp_path / "x.v2t")
    for given in (labels, survey):
        said = the_error(vislam2tag("train", given, *train))
        assert f"run `vislam2tag dataset {given} --out fingerprints`" in said
    assert "pass one of its sessions, such as" in vislam2tag("locate", folder / "wifi.v2t", survey).stderr
    assert "vislam2tag dataset" in vislam2tag("locate", folder / "wifi.v2t", labels).stderr
    assert "--ble-with-wifi" in vislam2tag("locate", folder / "both.v2t", folder / "out").stderr
