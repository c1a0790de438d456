"""A second phone's recording is tied to a walk by its clock, and labelled as if one phone had recorded both."""

from __future__ import annotations

import json
import shutil
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.cli.command import the_error, vislam2tag
from tests.sessions.companion_walks import OtherClock, write_sensor_logger
from tests.sessions.phone_raw import HEADERS, NAME, START_NS, clean_rows, write_session
from tests.sessions.phone_raw import record as phone_record
from tests.studio.receiving.zips import record, session_zip
from tests.surveys import bytes_of, make_survey
from vislam2tag.core.clocks import ClockAlignment
from vislam2tag.pipeline.labels.process import process
from vislam2tag.sessions.clocks import first_clear, possible_alignments
from vislam2tag.sessions.companions import read_recording, with_companions
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import hash_inputs, open_survey, read_session

OFFSET_S, RATE = 1.7e9, 4e-5


def folder_of(survey: Path) -> Path:
    return open_survey(survey).sessions[0].folder


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_survey(tmp_path_factory.mktemp("attach") / "survey", devices=("LG",), seconds=80.0)


@pytest.fixture(scope="module")
def walked(whole: Path) -> Session:
    return read_session(open_survey(whole).sessions[0])


@pytest.fixture(scope="module")
def clock(walked: Session) -> OtherClock:
    return OtherClock(OFFSET_S, RATE, int(walked.camera.time_ns[0]))


@pytest.fixture(scope="module")
def zipped(walked: Session, clock: OtherClock, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The zip that the second phone shares."""
    folder = tmp_path_factory.mktemp("pixel") / "2023-11-14_22-13-20"
    write_sensor_logger(folder, walked, clock)
    path = folder.with_suffix(".zip")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(folder.iterdir()):
            archive.write(file, file.name)
    return path


@pytest.fixture
def without_wifi(whole: Path, tmp_path: Path) -> Path:
    """The same survey as a phone leaves it that hears no access points."""
    survey = tmp_path / "survey"
    shutil.copytree(whole, survey)
    (folder_of(survey) / "WiFi.csv").unlink(missing_ok=True)
    for path in folder_of(survey).iterdir():
        if "wifi" in path.name.lower():
            path.unlink()
    return survey


def test_wifi_of_a_second_phone_is_labelled_as_if_of_the_first(
    without_wifi: Path, zipped: Path, walked: Session, clock: OtherClock, tmp_path: Path
) -> None:
    walk = folder_of(without_wifi)
    before = bytes_of(walk) | bytes_of(zipped.parent)
    done = vislam2tag("attach", walk, zipped, "--json")
    assert done.returncode == 0, done.stderr
    made = json.loads(done.stdout)
    tie = made["tie"]
    assert tie["by"] == "turns that both measured"
    assert made["inside"]["wifi"] > 0.9 * made["rows"]["wifi"]
    offset_error_s = (tie["offset_ns"] - int(clock.of(np.array([tie["at_ns"]]))[0]) + tie["at_ns"]) * 1e-9
    assert abs(offset_error_s) < 0.02
    assert abs(tie["rate"] - RATE) < 1e-4
    written = walk / "companions" / "2023-11-14_22-13-20.json"
    after = bytes_of(walk) | bytes_of(zipped.parent)
    assert after.pop("companions/2023-11-14_22-13-20.json")
    assert after == before, "neither recording is touched"

    process(without_wifi, tmp_path / "labels")
    found = pl.read_parquet(tmp_path / "labels" / "wifi" / "*.parquet").filter(status="ok")
    assert found.height > 0.9 * made["inside"]["wifi"]
    heard_ns = walked.tables["wifi"].filter(~pl.col("repeated"))["time_ns"].to_numpy()[found["row"].to_numpy() - 2]
    frames = pl.read_parquet(tmp_path / "labels" / "trajectory" / "*.parquet").filter(status="ok")
    frames_ns = frames["time_ns"].to_numpy()
    x, y, sigma = (np.interp(heard_ns, frames_ns, frames[name].to_numpy()) for name in ("x", "y", "sigma"))
    assert np.hypot(found["x"].to_numpy() - x, found["y"].to_numpy() - y).max() < 0.05
    lever = np.sqrt(found["sigma"].to_numpy() ** 2 - sigma**2)
    assert np.median(lever) == pytest.approx(0.3 / np.sqrt(2), abs=0.02), "the lever arm is part of sigma"
    (ref,) = open_survey(without_wifi).sessions
    (kept,) = (tmp_path / "labels" / "sessions").glob("*.json")
    recorded = {file["name"]: file["sha256"] for file in json.loads(kept.read_text())["files"]}
    assert recorded == hash_inputs(ref), "what is kept holds as long as tie and recording do"
    written.unlink()
    assert hash_inputs(ref).keys() == {name for name in recorded if not name.startswith("companions/")}


def test_a_table_and_sensors_that_both_have_get_names_of_their_own(
    whole: Path, walked: Session, clock: OtherClock, tmp_path: Path
) -> None:
    survey = tmp_path / "survey"
    shutil.copytree(whole, survey)
    walk = folder_of(survey)
    write_sensor_logger(walk / "companions" / "pixel", walked, clock)
    (walk / "companions" / "pixel" / "WiFi.csv").unlink()
    assert vislam2tag("attach", walk, walk / "companions" / "pixel").returncode == 0
    gyro = walked.tables["sensors"].filter(sensor="GYRO")[::3]
    ours_s = gyro["time_ns"].to_numpy() * 1e-9
    axes = {"v1": "gyro_x", "v2": "gyro_y", "v3": "gyro_z"}
    band = gyro.select(list(axes)).rename(axes).with_columns(timestamp_ms=(ours_s + 5.0) * 1e3)
    band.write_csv(tmp_path / "band.csv")
    assert vislam2tag("attach", walk, tmp_path / "band.csv", "--lever-arm-m", "0.5").returncode == 0
    shutil.move(survey, tmp_path / "moved")
    process(tmp_path / "moved", tmp_path / "labels")
    labelled = pl.read_parquet(tmp_path / "labels" / "sensors_band" / "*.parquet")
    assert labelled.filter(status="ok").height > 0.9 * band.height
    assert (tmp_path / "labels" / "sensors_pixel").is_dir(), "a recording within the survey moves with it"


def test_the_zip_of_our_own_app_is_taken_as_it_is(
    without_wifi: Path, walked: Session, clock: OtherClock, tmp_path: Path
) -> None:
    turns = walked.tables["sensors"].filter((pl.col("sensor") == "GYRO") & ~pl.col("repeated"))[1::2]
    stamps = clock.of(turns["time_ns"].to_numpy()).tolist()
    values = turns.select("v1", "v2", "v3").to_numpy().tolist()
    files = {
        "session.json": record(),
        "Sensors.csv": "\n".join(
            (
                HEADERS["Sensors.csv"],
                *(f"{t},GYRO,{x},{y},{z},,,,3" for t, (x, y, z) in zip(stamps, values, strict=True)),
            )
        ).encode(),
    }
    (tmp_path / "other.zip").write_bytes(session_zip(files))
    walk = folder_of(without_wifi)
    done = vislam2tag("attach", walk, tmp_path / "other.zip", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["taken_for"] == "a recording of phone"


def test_a_recording_of_another_walk_is_refused_with_its_figures(
    without_wifi: Path, tmp_path: Path, walked: Session
) -> None:
    rng = np.random.default_rng(8)
    seconds = np.arange(0, 90, 0.02)
    rates = np.repeat(rng.normal(0, 1, (len(seconds) // 25 + 1, 3)), 25, axis=0)[: len(seconds)]
    pl.DataFrame({"t_s": seconds, **{f"gyro_{a}": rates[:, i] for i, a in enumerate("xyz")}}).write_csv(
        tmp_path / "other.csv"
    )
    said = the_error(vislam2tag("attach", folder_of(without_wifi), tmp_path / "other.csv"))
    assert "turns that both measured: correlation 0." in said
    assert not (folder_of(without_wifi) / "companions").exists()


def test_a_recording_of_another_day_is_refused_with_both_dates(tmp_path: Path) -> None:
    walk = tmp_path / "floor_1" / "LG" / NAME
    start = {"wall_ms": 1_639_991_640_000, "boot_ns": START_NS}
    write_session(walk, clean_rows(), phone_record(start=start))
    table = pl.DataFrame({"time_s": [1_654_074_840 + 0.1 * row for row in range(700)]})
    table.with_columns(gyro_x=1.0, gyro_y=0.5, gyro_z=0.0).write_csv(tmp_path / "band.csv")
    said = the_error(vislam2tag("attach", walk, tmp_path / "band.csv"))
    assert "band.csv was recorded on 2022-06-01 09:14 to 09:15 (UTC), the walk on 2021-12-20 09:14 to 09:14" in said
    assert "turn at corners" not in said


def test_a_tie_that_leaves_most_of_a_recording_without_counterpart_is_refused(
    without_wifi: Path, tmp_path: Path, walked: Session
) -> None:
    gyro = walked.tables["sensors"].filter((pl.col("sensor") == "GYRO") & ~pl.col("repeated"))
    seconds = (gyro["time_ns"].to_numpy() - gyro["time_ns"][0]) * 1e-9
    rng = np.random.default_rng(8)
    own = gyro.select("v1", "v2", "v3").to_numpy()
    more = rng.normal(0, 0.5, (3 * len(seconds), 3))
    times = np.concatenate([seconds + k * (seconds[-1] + 0.02) for k in range(4)])
    turns = pl.DataFrame(np.concatenate((own, more)), schema=["gyro_x", "gyro_y", "gyro_z"])
    table = turns.with_columns(t_s=times)
    table.write_csv(tmp_path / "long.csv")
    said = the_error(vislam2tag("attach", folder_of(without_wifi), tmp_path / "long.csv"))
    assert "only 25 % of the recording is within the walk" in said
    assert "cut a longer recording to the walk" in said
    table[: len(seconds)].write_csv(tmp_path / "cut.csv")
    assert vislam2tag("attach", folder_of(without_wifi), tmp_path / "cut.csv").returncode == 0


def test_units_and_blanks_of_a_table_are_read_and_reported(without_wifi: Path, tmp_path: Path, walked: Session) -> None:
    turns = walked.tables["sensors"].filter((pl.col("sensor") == "GYRO") & ~pl.col("repeated"))
    lines = [
        f"{t * 1e-9:.4f}, " + ", ".join(f"{np.degrees(value):.4f}" for value in values)
        for t, *values in turns.select("time_ns", "v1", "v2", "v3").rows()
    ]
    lines[3] = lines[3].rpartition(",")[0] + ", N/A"
    text = "\n".join(("Time (s), gyro_x, gyro_y, gyro_z", *lines))
    (tmp_path / "band.csv").write_text(text, encoding="utf-8")
    walk = folder_of(without_wifi)
    done = vislam2tag("attach", walk, tmp_path / "band.csv", "--json")
    assert done.returncode == 0, done.stderr
    assert [each["kind"] for each in json.loads(done.stdout)["findings"]] == ["unreadable_cells", "sensor_unit"]
    (ref,) = open_survey(without_wifi).sessions
    session = with_companions(read_session(ref), ref.folder)
    attached = session.tables["sensors_band"].select("v1", "v2", "v3").to_numpy()
    assert attached == pytest.approx(np.delete(turns.select("v1", "v2", "v3").to_numpy(), 3, axis=0), abs=1e-5)
    assert {each.kind for each in session.findings} >= {"unreadable_cells", "sensor_unit"}


def test_what_is_wrong_is_named(without_wifi: Path, zipped: Path, tmp_path: Path) -> None:
    walk = folder_of(without_wifi)
    (tmp_path / "empty").mkdir()
    (tmp_path / "co2.csv").write_text("time_ns,co2\n1,2\n", encoding="utf-8")
    for arguments, message in (
        ((walk, tmp_path / "gone.zip"), "no such file or folder"),
        ((walk, tmp_path / "empty"), "contains no recording of a known app"),
        ((walk, tmp_path / "co2.csv"), "the recording has nothing to compare"),
        ((tmp_path / "empty", zipped), "not a session folder"),
        ((walk, zipped, "--by", "stars"), "unknown method; choose one of motion, levels, taps"),
        ((walk, zipped, "--lever-arm-m", "99"), "expected 0 to 10 m between"),
    ):
        assert message in the_error(vislam2tag("attach", *arguments))


def test_addresses_that_are_masked_are_named_where_levels_do_not_tell(
    walked: Session, whole: Path, tmp_path: Path
) -> None:
    heard = walked.tables["wifi"].select("time_ns", "bssid", "rssi_dbm")
    masked = heard.with_columns(bssid=pl.lit("02:00:00:00:00:00"))
    pl.concat([heard.head(1), masked]).write_csv(tmp_path / "other.csv")
    done = the_error(vislam2tag("attach", folder_of(whole), tmp_path / "other.csv"))
    assert f"masked_addresses {masked.height}: 02:00:00:00:00:00 is not an address" in done


def test_a_companion_that_changed_since_is_an_error_of_the_session(without_wifi: Path, zipped: Path) -> None:
    walk = folder_of(without_wifi)
    (walk / "companions").mkdir()
    inside = walk / "companions" / "pixel.zip"
    shutil.copy(zipped, inside)
    assert vislam2tag("attach", walk, inside).returncode == 0
    assert "already exists" in the_error(vislam2tag("attach", walk, inside))
    inside.write_bytes(inside.read_bytes() + b"\0")
    shown = json.loads(vislam2tag("inspect", without_wifi, "--json").stdout)
    (finding,) = (each for each in shown["sessions"][0]["findings"] if each["kind"] == "companion_missing")
    assert "was changed since it was attached" in finding["message"]
    (walk / "companions" / "pixel.json").write_text("{}", encoding="utf-8")
    assert "is not a valid link to an attached recording" in vislam2tag("inspect", without_wifi).stdout


def offset_error_s(found: ClockAlignment, clock: OtherClock) -> float:
    assert found.offset_ns is not None, found.figures
    at_ns = np.array([clock.zero_ns + 40_000_000_000])
    return float((found.ours(clock.of(at_ns)) - at_ns)[0]) * 1e-9


def test_a_walk_of_poses_alone_is_tied_to_its_poses(walked: Session, zipped: Path, clock: OtherClock) -> None:
    none = {name: table.clear() for name, table in walked.tables.items()}
    possible = possible_alignments(replace(walked, tables=none), read_recording(zipped))
    assert list(possible) == ["turns that both measured"]
    _, found, _ = first_clear(possible, lambda _: 1.0)
    assert found is not None
    lag_s = walked.camera.pose_lag_s or 0.0
    assert abs(offset_error_s(found, clock) - lag_s) < 0.02, "poses are stamped when drawn, and labels follow them"


def test_without_motion_levels_tell_the_offset_or_taps_do(walked: Session, zipped: Path, clock: OtherClock) -> None:
    other = read_recording(zipped)
    by_levels = possible_alignments(walked, other, "levels")
    assert list(by_levels) == ["access points that both received"]
    _, found, _ = first_clear(by_levels, lambda _: 1.0)
    assert found is not None
    assert abs(offset_error_s(found, clock)) < max(0.5, 3 * found.sigma_s)
    taps_ns = clock.zero_ns + np.array((3, 11, 12, 31, 55)) * 1_000_000_000
    tapped = replace(other, taps_ns=clock.of(taps_ns))
    _, found, _ = first_clear(possible_alignments(replace(walked, presses_ns=taps_ns), tapped, "taps"), lambda _: 1.0)
    assert found is not None
    assert abs(offset_error_s(found, clock)) < 0.02
