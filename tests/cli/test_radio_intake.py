"""Addresses and levels that come in: what the commands make of notations, masks, fillers and lost signs."""

from __future__ import annotations

import hashlib
import hmac
import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.datasets.factory import bssid, small_dataset
from vislam2tag.cli.commands_formats import scale_of
from vislam2tag.common.errors import UsageError
from vislam2tag.datasets.folder import open_dataset, write_dataset
from vislam2tag.datasets.privacy import key_name, read_key
from vislam2tag.intake.level_scales import CURE
from vislam2tag.pipeline.positioning.train import TrainPlan, train
from vislam2tag.positioning.model_files import load_model, save_model

NOTATIONS: tuple[Callable[[str], str], ...] = (
    str.upper,
    lambda name: name.replace(":", "-").upper(),
    lambda name: name.replace(":", ""),
    lambda name: ".".join(name.replace(":", "")[i : i + 4] for i in (0, 4, 8)),
)
HEARD = ((-61, 8), (-87, 5), (-60, 10), (-75, 11), (-77, 0), (-66, 2), (-97, 3))
"""Level of each fingerprint's reading and the access point's column."""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("place")
    write_dataset(small_dataset(), root / "set")
    train(root / "set", TrainPlan("weighted-knn", {"k": 1}), root / "model.v2t")
    return root


def wide(folder: Path, filler: float, access_points: int = 12, repeats: int = 2) -> Path:
    """A table of UJIIndoorLoc's columns with two levels heard in each row."""
    names = [f"WAP{number:03d}" for number in range(1, access_points + 1)]
    rows = [",".join([*names, "LONGITUDE,LATITUDE,FLOOR,BUILDINGID,SPACEID,RELATIVEPOSITION,USERID,PHONEID,TIMESTAMP"])]
    for number in range(repeats * len(HEARD)):
        cells = [f"{filler:g}"] * access_points
        for shift in (0, 1):
            level, column = HEARD[(number + shift) % len(HEARD)]
            cells[column] = str(level)
        rows.append(",".join([*cells, f"{number}.5,4864900.0,0,0,0,0,1,3,{1380000000 + number}"]))
    folder.mkdir()
    (folder / "trainingData.csv").write_text("\n".join(rows) + "\n")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("filler", [-98, -100, -105, -110, -120, -150, -200, 0, 1, -1])
def test_a_filler_that_is_not_stated_is_found(tmp_path: Path, filler: float) -> None:
    stated, other = (wide(tmp_path / name, level) for name, level in (("stated", 100), ("other", filler)))
    made = {}
    for folder in (stated, other):
        done = vislam2tag("import", folder, "--out", tmp_path / f"{folder.name}-set", "--json")
        assert done.returncode == 0, done.stderr
        made[folder] = {each["kind"]: each["count"] for each in json.loads(done.stdout)["findings"]}
    assert (
        open_dataset(tmp_path / "other-set")
        .readings.collect()
        .equals(open_dataset(tmp_path / "stated-set").readings.collect())
    )
    assert open_dataset(tmp_path / "stated-set").readings.collect().height == 28
    assert made[other] == made[stated] | {"unstated_filler": 14 * 12 - 28}


def test_the_user_says_what_stands_for_not_heard(tmp_path: Path) -> None:
    folder = wide(tmp_path / "uji", -98, access_points=12)
    for level, readings in (("-98", 28), ("100", 14 * 12)):
        out = tmp_path / f"set{level}"
        done = vislam2tag("import", folder, "--out", out, "--not-heard", level)
        assert done.returncode == 0, done.stderr
        assert "unstated_filler" not in done.stdout
        assert open_dataset(out).readings.collect().height == readings
    asked = vislam2tag("import", tmp_path, "--format", "comford", "--out", tmp_path / "none", "--not-heard", "-98")
    assert "--not-heard: comford only lists received access points" in the_error(asked)


@pytest.mark.parametrize(
    "text", ["", "3", "0=-100", "0=-100,0=-50", "0=-100,1=-100", "0=a,1=2", "0=-100,1=inf", "1=2=3"]
)
def test_what_is_no_scale(text: str) -> None:
    with pytest.raises(UsageError, match=r"--levels .*expected two numbers with their dBm, such as 0=-100,100=-50"):
        scale_of(text, "--levels")


def test_a_scale() -> None:
    assert scale_of("0=-104, 1=0", "--levels") == ((0, -104), (1, 0))


def test_a_table_in_which_all_are_heard_is_no_silent_one(tmp_path: Path) -> None:
    head = "WAP001,WAP002,LONGITUDE,LATITUDE,FLOOR,BUILDINGID,SPACEID,RELATIVEPOSITION,USERID,PHONEID,TIMESTAMP\n"
    rows = "".join(f"{-50 - n},{-60 - 2 * n},{n},1,0,0,0,0,1,1,{1380000000 + n}\n" for n in range(8))
    (tmp_path / "trainingData.csv").write_text(head + rows)
    done = vislam2tag("import", tmp_path / "trainingData.csv", "--out", tmp_path / "set")
    assert done.returncode == 0
    assert "all_heard 8: trainingData.csv: every access point is heard in every row" in done.stdout
    listed = open_dataset(tmp_path / "set").readings.collect()
    assert listed.height == 16


def test_a_peak_at_the_edge_is_asked_for(tmp_path: Path) -> None:
    head = "WAP1,WAP2,WAP3,WAP4,LONGITUDE,LATITUDE,FLOOR,BUILDINGID,SPACEID,RELATIVEPOSITION,USERID,PHONEID,TIMESTAMP\n"
    rows = ""
    for n in range(20):
        levels = [-50 - (7 * n + 13 * ap) % 40 if ap != n % 4 else -90 for ap in range(4)]
        rows += f"{','.join(map(str, levels))},{n},1,0,0,0,0,1,1,{1380000000 + n}\n"
    (tmp_path / "trainingData.csv").write_text(head + rows)
    error = the_error(vislam2tag("import", tmp_path / "trainingData.csv", "--out", tmp_path / "set"))
    assert "25 % of the levels are -90 (the next level is -89). If it means 'not heard'" in error
    assert "--not-heard -90" in error
    assert not (tmp_path / "set").exists()


def scans(path: Path, rows: Sequence[tuple[str, str, object]]) -> Path:
    path.write_text("scan_id,bssid,rssi_dbm\n" + "".join(f"{scan},{name},{level}\n" for scan, name, level in rows))
    return path


def test_every_notation_is_located_alike(place: Path, tmp_path: Path) -> None:
    names = [bssid(0, number) for number in range(4)]
    rows = [("a", name, -45 - number) for number, name in enumerate(names)]
    expected = vislam2tag("locate", place / "model.v2t", scans(tmp_path / "plain.csv", rows)).stdout
    assert ",unknown," not in expected
    for number, notation in enumerate(NOTATIONS):
        written = scans(tmp_path / f"{number}.csv", [(scan, notation(name), level) for scan, name, level in rows])
        assert vislam2tag("locate", place / "model.v2t", written).stdout == expected
    mixed = [(s, NOTATIONS[n % 4](name), level) for n, (s, name, level) in enumerate(rows)]
    assert vislam2tag("locate", place / "model.v2t", scans(tmp_path / "mixed.csv", mixed)).stdout == expected


def test_levels_and_masks_that_locate_leaves_out(place: Path, tmp_path: Path) -> None:
    rows = [("a", bssid(0, number), level) for number, level in enumerate((65, 70, 59))]
    done = vislam2tag("locate", place / "model.v2t", scans(tmp_path / "sign.csv", [*rows, ("a", bssid(0, 3), -60)]))
    assert (
        "lost_sign: 3 (lines 2, 3, 4): most levels of the file are positive, so the minus sign is missing"
        in done.stderr
    )
    odd = [("a", "02:00:00:00:00:00", -50), ("a", "", -50), ("a", bssid(0, 1), -127), ("a", bssid(0, 2), 127)]
    done = vislam2tag("locate", place / "model.v2t", scans(tmp_path / "odd.csv", odd))
    assert done.returncode == 3
    assert "nothing could be located: no line is usable" in done.stderr
    assert "next: " not in done.stderr
    assert "masked_addresses: 2 (lines 2, 3)" in done.stderr
    assert "absurd_levels: 2 (lines 4, 5)" in done.stderr
    assert CURE in done.stderr
    assert "02:00:00:00:00:00, an empty field are not addresses; these rows are skipped" in done.stderr.replace(
        "an empty field, 02:00:00:00:00:00", "02:00:00:00:00:00, an empty field"
    )


def test_fillers_of_listed_scans_are_found(place: Path, tmp_path: Path) -> None:
    heard = {(scan, point): -50 - 3 * scan - point for scan in range(6) for point in (scan % 4, (scan + 1) % 4)}
    full = [(str(s), bssid(0, p), heard.get((s, p), -110)) for s in range(6) for p in range(8)]
    listed = [row for row in full if row[2] != -110]
    expected = vislam2tag("locate", place / "model.v2t", scans(tmp_path / "listed.csv", listed))
    found = vislam2tag("locate", place / "model.v2t", scans(tmp_path / "full.csv", full))
    assert found.stdout == expected.stdout
    assert "unstated_filler" not in expected.stderr
    assert f"unstated_filler: {48 - 12} (" in found.stderr
    assert "-110 is the most frequent level (75 % of the levels) and at the edge of all others" in found.stderr


def test_a_file_that_lost_all_signs_is_imported_as_the_user_says(tmp_path: Path) -> None:
    folder = wide(tmp_path / "uji", 100)
    (folder / "trainingData.csv").write_text((folder / "trainingData.csv").read_text().replace("-", ""))
    refused = vislam2tag("import", folder, "--out", tmp_path / "set")
    assert refused.returncode == 2
    assert "the minus sign is missing (65 instead of -65). Negate the levels, or pass --levels" in the_error(refused)
    assert not (tmp_path / "set").exists()
    done = vislam2tag("import", folder, "--out", tmp_path / "set", "--levels", "1=-1,100=-100")
    assert done.returncode == 0, done.stderr
    levels = open_dataset(tmp_path / "set").readings.collect()["rssi_dbm"]
    assert levels.unique().sort().to_list() == [-97, -87, -77, -75, -66, -61, -60]


def test_a_file_of_levels_out_of_range_is_no_successful_import(tmp_path: Path) -> None:
    folder = wide(tmp_path / "uji", 100)
    (folder / "trainingData.csv").write_text((folder / "trainingData.csv").read_text().replace("-", "-3"))
    done = vislam2tag("import", folder, "--out", tmp_path / "set")
    assert done.returncode == 3
    assert "readings: 0" in done.stdout
    assert "absurd_levels" in done.stdout
    assert "no reading of these files is usable; correct the problems above" in done.stderr
    assert "next: " not in done.stdout
    assert vislam2tag("import", folder, "--out", tmp_path / "set", "--json").returncode == 3


def test_models_of_hashed_addresses_match_in_the_notation_that_was_hashed(place: Path, tmp_path: Path) -> None:
    (tmp_path / "key").write_text("0123456789abcdef0123456789abcdef")
    key, saved = read_key(tmp_path / "key"), load_model(place / "model.v2t")
    rows = [("a", bssid(0, number).replace(":", "-").upper(), -45 - number) for number in range(4)]
    expected = vislam2tag("locate", place / "model.v2t", scans(tmp_path / "scans.csv", rows)).stdout
    assert ",unknown," not in expected
    saved = replace(saved, origin=saved.origin.model_copy(update={"bssid_key": key_name(key)}))
    names = saved.model.access_points_
    for notation in (str, lambda name: name.replace(":", "-")):  # as 0.2 hashed them, in any case
        codes = (hmac.new(key, notation(name).encode(), hashlib.sha256).hexdigest()[:32] for name in names)
        saved.model.access_points_ = tuple(codes)
        save_model(saved, tmp_path / "hashed.v2t")
        done = vislam2tag("locate", tmp_path / "hashed.v2t", tmp_path / "scans.csv", "--hash-bssid", tmp_path / "key")
        assert done.stdout == expected


def survey(root: Path, files: dict[str, str]) -> Path:
    session = root / "floor_1" / "A" / "w1"
    session.mkdir(parents=True)
    (root / "floor_dimensions.csv").write_text("id,width,height\n1,20,10\n")
    (root / "floor_1" / "marker_dict.csv").write_text("id,x,y\n1,1,1\n2,9,1\n")
    (session / "Metadata.csv").write_text("version,platform,appVersion\n3,android,1.40.0\n")
    for name, text in files.items():
        (session / name).write_text(text)
    return root


def kinds_of(folder: Path) -> dict[tuple[str, str], int]:
    done = vislam2tag("inspect", folder, "--json")
    (session,) = json.loads(done.stdout)["sessions"]
    return {(each["kind"], each["file"]): each["count"] for each in session["findings"] if each["kind"] != "no_frames"}


def test_masked_addresses_are_no_stale_rows(tmp_path: Path) -> None:
    names = ["02:00:00:00:00:00", "021A.0000.0001", "02:00:00:00:00:00", "02-1a-00-00-00-02", "", "FFFFFFFFFFFF"]
    rows = "".join(
        f"{1_700_000_000 + 10 * scan}000000000,{scan}.0,n,{name},2412,-7{number},\n"
        for scan in range(2)
        for number, name in enumerate(names)
    )
    head = "time,seconds_elapsed,ssid,bssid,frequency,level,capabilities\n"
    folder = survey(tmp_path / "masked", {"WiFi.csv": head + rows})
    assert kinds_of(folder) == {("masked_addresses", "WiFi.csv"): 8}


def test_only_bluetooth_lost_its_sign(tmp_path: Path) -> None:
    head = "time,seconds_elapsed,ssid,bssid,frequency,level,capabilities\n"
    wifi = head + "1700000001000000000,1.0,n,021A00000001,2412,-70,\n"
    ble = "time,seconds_elapsed,id,rssi\n" + "".join(
        f"170000000{n}000000000,{n}.0,AABBCCDDEE0{n},{60 + n}\n" for n in range(1, 6)
    )
    folder = survey(tmp_path / "ble", {"WiFi.csv": wifi, "Bluetooth.csv": ble})
    assert kinds_of(folder) == {("lost_sign", "Bluetooth.csv"): 5}


def test_older_models_match(place: Path, tmp_path: Path) -> None:
    saved = load_model(place / "model.v2t")
    rows = [("a", bssid(0, number), -45 - number) for number in range(4)]
    expected = vislam2tag("locate", place / "model.v2t", scans(tmp_path / "scans.csv", rows)).stdout
    for notation in NOTATIONS:
        saved.model.access_points_ = tuple(map(notation, load_model(place / "model.v2t").model.access_points_))
        save_model(saved, tmp_path / "old.v2t")
        assert vislam2tag("locate", tmp_path / "old.v2t", tmp_path / "scans.csv").stdout == expected
