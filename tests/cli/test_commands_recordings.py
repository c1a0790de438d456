"""``vislam2tag label``: any table gets the positions of the walks, whatever its clock."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.cli.command import the_error, vislam2tag
from tests.surveys import make_survey
from vislam2tag.api import label
from vislam2tag.common.errors import UsageError
from vislam2tag.pipeline.labels.process import process

BOOT_TO_UNIX_S = 1_700_000_000
"""In the tests: the table's clock less the phone's."""


@pytest.fixture(scope="module")
def labels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("label")
    process(make_survey(out / "survey", devices=("LG",), seconds=80.0), out / "labels")
    return out / "labels"


@pytest.fixture(scope="module")
def wifi(labels: Path) -> pl.DataFrame:
    """What the walk's own readings got, in whole milliseconds."""
    table = pl.read_parquet(labels / "wifi" / "*.parquet").filter(pl.col("status") == "ok")
    return table.with_columns(ms=pl.col("time_ns") // 1_000_000)


def same(found: pl.DataFrame, wifi: pl.DataFrame) -> None:
    assert found.height == wifi.height
    for ours, theirs in (("x_m", "x"), ("y_m", "y")):
        apart = (found[ours].cast(pl.Float64) - wifi[theirs]).abs().to_numpy()
        assert apart.max() < 0.02
    assert set(found["status"]) == {"ok"}


@pytest.mark.parametrize(
    ("name", "factor", "told"),
    [
        ("time_ns", 1_000_000, "column time_ns: since boot in ns"),
        ("timestamp", 1000, "column timestamp: since boot in us"),
        ("Time", 1, "column Time: since boot in ms"),
        ("t [s]", 0.001, "column t [s]: since boot in s"),
    ],
)
def test_boot_clocks(tmp_path: Path, labels: Path, wifi: pl.DataFrame, name: str, factor: float, told: str) -> None:
    lines = "".join(f"{ms * factor};12,5\n" for ms in wifi["ms"])
    (tmp_path / "co2.csv").write_text(f"{name};co2\n{lines}0;9,5\n")
    done = vislam2tag("label", tmp_path / "co2.csv", "--labels", labels)
    assert (done.returncode, done.stderr) == (0, "")
    assert told in done.stdout
    assert f"{wifi.height + 1} rows: {wifi.height} have a position, 1 are outside every walk" in done.stdout
    found = pl.read_csv(tmp_path / "co2-labelled.csv", infer_schema=False)
    assert found.columns == [name, "co2", "x_m", "y_m", "z_m", "floor", "sigma", "status"]
    assert found.row(-1)[1:] == ("9,5", None, None, None, None, None, "outside_frames")
    same(found.head(-1), wifi)


def unix(wifi: pl.DataFrame, form: str) -> list[object]:
    moments = [BOOT_TO_UNIX_S * 1000 + ms for ms in wifi["ms"]]
    if form == "iso":
        return [datetime.fromtimestamp(ms / 1000, UTC).isoformat() for ms in moments]
    return [ms * {"s": 1e-3, "ms": 1, "us": 1000, "ns": 1_000_000}[form] for ms in moments]


@pytest.mark.parametrize("form", ["s", "ms", "us", "ns", "iso"])
def test_unix_clocks_with_an_offset(tmp_path: Path, labels: Path, wifi: pl.DataFrame, form: str) -> None:
    pl.DataFrame({"timestamp": unix(wifi, form), "co2": wifi["ms"]}).write_parquet(tmp_path / "co2.parquet")
    out = tmp_path / "out.parquet"
    done = vislam2tag(
        "label", tmp_path / "co2.parquet", "--labels", labels, "--offset-s", str(BOOT_TO_UNIX_S), "--out", out
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert ("date and time (ISO 8601)" if form == "iso" else f"Unix time in {form}") in done.stdout
    same(pl.read_parquet(out), wifi)


def test_a_clock_is_found_by_access_points_that_both_heard(labels: Path, wifi: pl.DataFrame) -> None:
    table = pl.DataFrame(
        {"timestamp": unix(wifi, "ms"), "bssid": wifi["bssid"].str.to_uppercase(), "rssi": wifi["rssi_dbm"]}
    )
    made = label(table, str(labels))
    assert "according to common access points" in made.notes[1]
    assert f"{BOOT_TO_UNIX_S}.0" in made.notes[1]
    same(made.table, wifi)


def test_the_sigma_of_a_clock_is_part_of_the_positions(labels: Path, wifi: pl.DataFrame) -> None:
    """Another device's levels tell its clock to a quarter of a second at best, in which somebody walks on."""
    rng = np.random.default_rng(1)
    levels = wifi["rssi_dbm"].to_numpy() + rng.normal(0, 1, wifi.height) - 5.0
    made = label(pl.DataFrame({"timestamp": unix(wifi, "ms"), "bssid": wifi["bssid"], "rssi": levels}), labels)
    assert ", according to common access points" in made.notes[1]
    assert np.nanmedian((made.table["sigma"] - wifi["sigma"]).to_numpy()) > 0.05


def test_exchanged_columns_align_too_and_levels_in_another_form_are_named(labels: Path) -> None:
    wifi = pl.read_parquet(labels / "wifi" / "*.parquet")
    wifi = wifi.with_columns(ms=pl.col("time_ns") // 1_000_000)
    columns = {"ssid": wifi["bssid"], "bssid": "net", "rssi": wifi["rssi_dbm"]}
    table = pl.DataFrame({"timestamp": unix(wifi, "ms"), **columns})
    notes = label(table.with_columns(pl.format("{} dBm", "rssi").alias("rssi")), labels).notes
    assert ", according to common access points" in notes[1]
    assert notes[-1].startswith(f"exchanged_columns {table.height}: network names (SSID) are addresses")
    with pytest.raises(UsageError, match=r"their offset is unknown.*lost_sign .*the minus sign is missing"):
        label(table.with_columns(-pl.col("rssi")), labels)
    with pytest.raises(UsageError, match=r"--by levels: the table needs.*levels_not_dbm .*so they are percent"):
        label(table.with_columns((pl.col("rssi") + 100) * 2), labels, align="levels")


@pytest.fixture(scope="module")
def headset(labels: Path) -> pl.DataFrame:
    """What another device felt on the walk, by a clock of its own that starts when it is switched on."""
    rng = np.random.default_rng(4)
    own = pl.read_parquet(labels / "sensors" / "*.parquet").filter(pl.col("sensor") == "GYRO").sort("time_ns")
    taken_s = np.arange(2.0, 70.0, 1 / 40) + float(own["time_ns"][0]) * 1e-9
    axes = {
        f"gyro_{axis}": 57.3 * np.interp(taken_s, own["time_ns"].to_numpy() * 1e-9, own[value].to_numpy())
        + rng.normal(0, 1.0, len(taken_s))
        for axis, value in zip("xyz", ("v1", "v2", "v3"), strict=True)
    }
    return pl.DataFrame({"seconds_elapsed": taken_s - taken_s[0], "taken_ns": (taken_s * 1e9).astype(np.int64), **axes})


def test_a_clock_is_found_by_the_turns_that_both_felt(tmp_path: Path, labels: Path, headset: pl.DataFrame) -> None:
    headset.drop("taken_ns").write_csv(tmp_path / "headset.csv")
    done = vislam2tag("label", tmp_path / "headset.csv", "--labels", labels, "--by", "motion")
    assert done.returncode == 0, done.stderr
    assert ", according to common turn rates" in done.stdout
    found = pl.read_csv(tmp_path / "headset-labelled.csv")
    true = label(headset.select(time_ns="taken_ns"), labels).table
    for name in ("x_m", "y_m"):
        assert (found[name] - true[name]).abs().max() < 0.05  # type: ignore[operator]
    unix = headset.select(pl.col("seconds_elapsed").alias("unix_time") + BOOT_TO_UNIX_S, pl.col("^gyro_.$"))
    assert "according to common turn rates" in label(unix, labels).notes[1], "Unix times need no option"


def test_boot_times_within_a_walk_of_another_motion_are_reported(labels: Path, headset: pl.DataFrame) -> None:
    right = headset.drop("seconds_elapsed").rename({"taken_ns": "time_ns"})
    for table in (right, right[:400], right[100:1600:4]):
        assert len(label(table, labels).notes) == 1
    other = right.with_columns(pl.col("^gyro_.$").reverse())
    made = label(other, labels)
    assert made.notes[1].startswith(f"motion_mismatch {other.height}: the times are within the walk ")
    assert "but the turn rates do not match (correlation " in made.notes[1]
    assert set(made.table["status"]) == {"ok"}


@pytest.mark.parametrize(
    ("columns", "options", "message"),
    [
        ({}, ("--by", "motion"), "--by motion: the table needs columns such as gyro_x, gyro_y, gyro_z"),
        ({}, ("--by", "levels"), "--by levels: the table needs a column bssid and one of levels"),
        ({}, ("--by", "sound"), "--by sound: unknown method; choose one of motion, levels"),
        (
            {"acc_x": 1.0, "acc_y": 2.0, "acc_z": 9.0},
            ("--by", "motion"),
            "common accelerations: correlation",
        ),
    ],
)
def test_what_cannot_be_aligned_is_refused_with_its_figure(
    tmp_path: Path, labels: Path, columns: dict[str, float], options: tuple[str, ...], message: str
) -> None:
    rows = pl.DataFrame({"t": np.arange(0, 60, 0.1)}).with_columns(**{name: pl.lit(of) for name, of in columns.items()})
    rows.write_csv(tmp_path / "table.csv")
    assert message in the_error(vislam2tag("label", tmp_path / "table.csv", "--labels", labels, *options))


@pytest.mark.parametrize("device", ["LG", "in another's folder"])
def test_a_clock_is_taken_from_the_recorder(tmp_path: Path, labels: Path, wifi: pl.DataFrame, device: str) -> None:
    result = json.loads(next((labels / "sessions").glob("*.json")).read_text())
    folder = tmp_path / f"floor_{result['floor']}" / device / result["session"]
    folder.mkdir(parents=True)
    correction = f'[[set_device]]\ndevice = "{device}"\nto = "LG"\n'
    (tmp_path / "corrections.toml").write_text(correction if device != "LG" else "")
    start = {"wall_ms": BOOT_TO_UNIX_S * 1000 + 5000, "boot_ns": 5_000_000_000}
    (folder / "session.json").write_text(json.dumps({"start": start}))
    made = label(pl.DataFrame({"epoch": unix(wifi, "ms")}), labels, survey=tmp_path)
    same(made.table, wifi)
    later = [each + 100 * 86_400_000 for each in unix(wifi, "ms")]  # type: ignore[operator]
    said = label(pl.DataFrame({"epoch": later}), labels, survey=tmp_path).notes[-1]
    assert said.startswith("no row is within a walk: the table was recorded on 20")
    assert said.endswith("(UTC): not the same walk; choose the recording of that day")


@pytest.mark.parametrize("wall_ms", [10**30, 1e300, float("nan"), -(10**18)])
def test_a_recorders_clock_that_cannot_be_tells_nothing(
    tmp_path: Path, labels: Path, wifi: pl.DataFrame, wall_ms: float
) -> None:
    result = json.loads(next((labels / "sessions").glob("*.json")).read_text())
    folder = tmp_path / f"floor_{result['floor']}" / result["device"] / result["session"]
    folder.mkdir(parents=True)
    (folder / "session.json").write_text(json.dumps({"start": {"wall_ms": wall_ms, "boot_ns": 0}}))
    with pytest.raises(UsageError, match=r"their offset is unknown"):
        label(pl.DataFrame({"epoch": unix(wifi, "ms")}), labels, survey=tmp_path)


def test_times_beyond_all_clocks_are_no_times(labels: Path, wifi: pl.DataFrame) -> None:
    """They would come round in 64 bits, perhaps to within a walk."""
    boot = wifi["time_ns"].to_list()
    table = pl.DataFrame({"time_ns": [*boot, 2**63 - 1, -(2**63)]})
    assert label(table, labels).table["status"].to_list()[-2:] == ["invalid", "invalid"]
    seconds = pl.DataFrame({"time_s": [*(ns / 1e9 for ns in boot), 1e300, (boot[0] + 2**64) / 1e9]})
    assert label(seconds, labels).table["status"].to_list()[-2:] == ["invalid", "invalid"]
    dates = [*(["2021-12-20T09:14:00Z"] * 3), "9999-12-31T23:59:59Z", "0001-01-01T00:00:00+23:00"]
    found = label(pl.DataFrame({"time": dates}), labels, offset_s=0.0)
    assert found.table["status"].to_list() == [*["outside_frames"] * 3, "invalid", "invalid"]


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("time,co2\n1,2\n", ("--time-column", "when"), "there is no such column; the table has: time, co2"),
        ("time,co2\nnoon,2\n", (), "column time: contains no readable time"),
        ("time,co2\n2022-01-14T16:35:30,2\n", (), "has no time zone; pass it with --zone, such as Europe/Berlin"),
        ("time,co2\n1700000000,2\n", (), "their offset is unknown. Use --survey"),
        ("time,co2\n5,2\n", (), "its times are outside every walk in any unit"),
        ("time,status\n5,2\n", (), "the table already has a column status; rename it"),
        ("time,co2\n5,0,412,5\n", (), "line 2 has 4 fields, the first line 2: perhaps decimal commas"),
        ("time,co2\n5,2\n", ("--clock", "GPS"), "--clock GPS: expected one of boot, unix"),
        ("time,co2\n5,2\n", ("--offset-s", "nan"), "--offset-s nan: the offset is too large"),
        ("time,co2\n5,2\n", ("--offset-s", "1e308"), "--offset-s 1e+308: the offset is too large"),
        ("time,co2\n2022-01-14T16:35:30,2\n", ("--zone", "Europe"), "--zone Europe: is not a time zone"),
        ("time,co2\n5,2\n", ("--session", "Pixel"), "the folder has no walk with 'Pixel' in its name"),
    ],
)
def test_tables_that_cannot_be_labelled(
    tmp_path: Path, labels: Path, text: str, options: tuple[str, ...], message: str
) -> None:
    (tmp_path / "table.csv").write_text(text)
    done = vislam2tag("label", tmp_path / "table.csv", "--labels", labels, *options)
    assert message in the_error(done)
    assert [path.name for path in tmp_path.iterdir()] == ["table.csv"]


def test_a_table_with_motion_is_aligned_whatever_its_times_count_from(labels: Path, headset: pl.DataFrame) -> None:
    seconds = (headset["taken_ns"] - headset["taken_ns"][0]).cast(pl.Float64) * 1e-9
    axes = [name for name in headset.columns if name.startswith(("gyro", "Gyro", "w"))]
    made = label(headset.select(axes).with_columns(time=seconds), labels)
    assert "according to common turn rates" in made.notes[1]
    assert made.counts["ok"] > 0.9 * headset.height


@pytest.mark.parametrize(("hours", "word"), [(1, "earlier"), (-1, "later")])
def test_a_clock_that_is_an_hour_off_is_named(labels: Path, wifi: pl.DataFrame, hours: int, word: str) -> None:
    table = pl.DataFrame({"timestamp": [int(ms) + (BOOT_TO_UNIX_S + hours * 3600) * 1000 for ms in wifi["ms"]]})
    made = label(table, labels, offset_s=BOOT_TO_UNIX_S)
    assert f"{wifi.height} would be if the table's clock were 1 h {word}, as with daylight saving" in made.notes[1]


def test_rounded_times_and_cells_without_a_number_are_named(tmp_path: Path, labels: Path, wifi: pl.DataFrame) -> None:
    (tmp_path / "rounded.csv").write_text("time_ns,co2\n7.25494E+14,400\n7.25495E+14,401\n", encoding="utf-8")
    said = the_error(vislam2tag("label", tmp_path / "rounded.csv", "--labels", labels))
    assert "are rounded to 1 s; use the original file" in said
    lines = "".join(f"{ms}, AA, -60\n" for ms in wifi["ms"])
    (tmp_path / "cells.csv").write_text(f"time_ms, bssid, rssi\n{lines}soon, AA, N/A\n", encoding="utf-8")
    done = vislam2tag("label", tmp_path / "cells.csv", "--labels", labels)
    line = wifi.height + 2
    assert f"unreadable_cells 1 (lines {line}): column time_ms: cells such as 'soon' (line {line})" in done.stdout
    assert f"column rssi: cells such as 'N/A' (line {line})" in done.stdout
