"""Commands that make and use a positioning model: ``train`` and ``locate``."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.datasets.factory import bssid, small_dataset
from vislam2tag.cli.options import parameters_of
from vislam2tag.common.errors import UsageError
from vislam2tag.datasets.folder import write_dataset
from vislam2tag.datasets.privacy import Privacy, key_name, with_privacy
from vislam2tag.datasets.splits import standard_splits
from vislam2tag.pipeline.positioning.train import TrainPlan, train

KEY = b"0123456789abcdef"


def test_a_model_is_trained_tested_and_the_same_again(tmp_path: Path) -> None:
    small = small_dataset()
    hashed = with_privacy(replace(small, splits=standard_splits(small)), Privacy(hash_key=KEY))
    write_dataset(hashed, tmp_path / "set")
    arguments = ("train", tmp_path / "set", "--model", "local-kriging", "--set", "k=4", "--seed", "3")
    for out in ("a.v2t", "b.v2t"):
        done = vislam2tag(*arguments, "--split", "device", "--fold", "Pixel", "--out", tmp_path / out)
        assert done.returncode == 0, done.stderr
    for text in (
        "local-kriging: learned 22 fingerprints of small (split device, fold Pixel), 10 access points, 2 floors",
        "calibration: 68 % circles contain",
        "tested on 22 fingerprints: mean error",
        f"access points are hashed with key {key_name(KEY)}",
        f"model: {tmp_path / 'b.v2t'}",
    ):
        assert text in done.stdout
    assert (tmp_path / "a.v2t").read_bytes() == (tmp_path / "b.v2t").read_bytes()


def test_without_a_model_a_table_says_which_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    write_dataset(small_dataset(), tmp_path / "set")
    done = vislam2tag("train", tmp_path / "set", "--budget-s", "0", "--out", tmp_path / "a.v2t")
    assert done.returncode == 0, done.stderr
    for text in ("Cross-validation over walks", "chosen", "local-kriging", "right floor", "learned 44 fingerprints"):
        assert text in done.stdout


def test_values_are_read_as_json_or_text() -> None:
    texts = ["k=5", "exponent=2.5", "distance=cosine", "on=true", "heads=[1, 2]", "a=b=c", "none="]
    assert parameters_of(texts) == {
        "k": 5,
        "exponent": 2.5,
        "distance": "cosine",
        "on": True,
        "heads": (1, 2),
        "a": "b=c",
        "none": "",
    }
    for wrong in ("k", "=5"):
        with pytest.raises(UsageError, match="expected PARAMETER=VALUE"):
            parameters_of([wrong])


HEADER = "scan_id,status,building,floor,floor_name,room,x,y,z,radius_68_m,radius_95_m,floor_probability"


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("place")
    write_dataset(small_dataset(), root / "set")
    train(root / "set", TrainPlan("weighted-knn", {"k": 1}), root / "model.v2t")
    rows = f"here,{bssid(1, 1)},-41\nhere,{bssid(1, 2)},-60\nfar,stranger,-50\nbad,{bssid(1, 1)},loud\n"
    (root / "scans.csv").write_text("scan_id,bssid,rssi_dbm\n" + rows)
    return root


def test_positions_come_on_standard_output_and_the_summary_beside(place: Path) -> None:
    done = vislam2tag("locate", place / "model.v2t", place / "scans.csv")
    assert done.returncode == 0, done.stderr
    header, here, far, bad = done.stdout.splitlines()
    assert header == HEADER
    assert here.startswith("here,unlike,,1,")  # two of ten are heard
    assert (far, bad) == ("far,unknown,,,,,,,,,,", "bad,unknown,,,,,,,,,,")
    assert "3 scans: 1 located, 2 unknown (without any of the model's 10 access points)" in done.stderr
    assert "malformed_lines: 1 (lines 5): expected scan_id, bssid, rssi_dbm" in done.stderr


def test_positions_go_to_a_file_in_the_form_of_its_name(place: Path, tmp_path: Path) -> None:
    for name in ("positions.jsonl", "positions.csv"):
        done = vislam2tag("locate", place / "model.v2t", place / "set", "--out", tmp_path / name)
        assert done.returncode == 0, done.stderr
        assert "48 scans: 48 located, 0 unknown" in done.stdout
    rows = [json.loads(line) for line in (tmp_path / "positions.jsonl").read_text().splitlines()]
    assert list(rows[0]) == HEADER.split(",")
    assert len((tmp_path / "positions.csv").read_text().splitlines()) == len(rows) + 1 == 49
    assert sorted(path.name for path in tmp_path.iterdir()) == ["positions.csv", "positions.jsonl"]


def test_faults_are_one_line_and_leave_nothing(place: Path, tmp_path: Path) -> None:
    model, scans, out = place / "model.v2t", place / "scans.csv", tmp_path / "out.csv"
    assert "not a model file, or damaged" in the_error(vislam2tag("locate", scans, scans, "--out", out))
    before = scans.read_bytes()
    assert "would overwrite an input" in the_error(vislam2tag("locate", model, scans, "--out", scans))
    assert scans.read_bytes() == before
    nowhere = tmp_path / "absent" / "out.csv"
    assert "absent/out.csv: cannot be written" in the_error(vislam2tag("locate", model, scans, "--out", nowhere))
    (tmp_path / "circle").symlink_to("circle")
    the_error(vislam2tag("locate", tmp_path / "circle", scans, "--out", out))
    (tmp_path / "circle").unlink()
    assert not list(tmp_path.iterdir())


def test_walks_are_filtered_and_smoothed(place: Path, tmp_path: Path) -> None:
    (tmp_path / "track.csv").write_text("session,time_ns,x,y\nanother,1,2,3\n")
    model, out = place / "model.v2t", tmp_path / "positions.csv"
    done = vislam2tag("locate", model, place / "set", "--track", tmp_path / "track.csv", "--out", out)
    assert done.returncode == 0, done.stderr
    assert "scans used together with others of their walk: 48, 0 of them with a track" in done.stdout
    smooth = out.read_bytes()
    assert vislam2tag("locate", model, place / "set", "--sequence", "filter", "--out", out).returncode == 0
    assert out.read_bytes() != smooth
    refused = vislam2tag("locate", model, place / "scans.csv", "--sequence", "smoother", "--out", tmp_path / "none.csv")
    assert "need the columns session and time_ns" in the_error(refused)
    assert not (tmp_path / "none.csv").exists()


def test_serving_takes_no_scans_and_locating_needs_some(tmp_path: Path) -> None:
    arguments = ("locate", tmp_path / "model.v2t")
    assert "scans arrive over HTTP" in the_error(vislam2tag(*arguments, tmp_path / "scans.csv", "--serve"))
    assert "pass SCANS, or --serve" in the_error(vislam2tag(*arguments))


@pytest.mark.parametrize(
    ("name", "text", "why", "step"),
    [
        ("loud.csv", "scan_id,bssid,rssi_dbm\ns1,02:1a:00:00:00:01,80\n", "no line is usable", "correct the lines"),
        ("other.jsonl", '{"d": "x", "s": {"wifi": {}}}\n', "no line is usable", "correct the lines"),
        ("none.csv", "scan_id,bssid,rssi_dbm\n", "the input contains no scan", "correct the lines"),
        (
            "strangers.csv",
            "scan_id,bssid,rssi_dbm\ns1,06:00:00:00:00:01,-50\ns2,06:00:00:00:00:01,-60\n",
            "no scan contains any of the model's 10 access points",
            "use a model of the building",
        ),
    ],
)
def test_scans_without_any_position_are_no_success(
    place: Path, tmp_path: Path, name: str, text: str, why: str, step: str
) -> None:
    scans, out = tmp_path / name, tmp_path / "positions.csv"
    scans.write_text(text)
    done = vislam2tag("locate", place / "model.v2t", scans, "--out", out)
    assert done.returncode == 3
    assert f"nothing could be located: {why}" in done.stdout
    assert done.stdout.splitlines()[-1].startswith(step)
    assert "next: " not in done.stdout
    assert "draw x and y" not in done.stdout
    told = vislam2tag("locate", place / "model.v2t", scans, "--out", out, "--json")
    record = json.loads(told.stdout)
    assert (told.returncode, record["located"]) == (3, 0)
    assert record["judgement"] == {"answer": "not_judged", "looked_at": "", "why": why, "warnings": 0}
