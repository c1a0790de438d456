"""Tables in memory: columns are checked, and what cannot be used is named by table, column and row."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from vislam2tag.common.errors import UsageError
from vislam2tag.common.given_tables import frame_of
from vislam2tag.sessions.in_memory import checked_column, landmarks_in_memory, session_in_memory
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.site.model import SessionKey

KEY = SessionKey(0, "in memory", "walk")
FRAMES = 5
POSE = {"tx": [0.0, 0.1, 0.2, 0.3, 0.4], **dict.fromkeys(("ty", "tz", "qx", "qy", "qz"), [0.0] * 5), "qw": [1.0] * 5}
POSES = pl.DataFrame({"time_ns": np.arange(FRAMES) * 33_333_333, **POSE})
SIGHTINGS = POSES.with_columns(id=pl.Series(["7", "07", "8", "8", "8"]), tx=pl.col("tx") + 1)


def session(
    poses: pl.DataFrame = POSES, sightings: pl.DataFrame = SIGHTINGS, sensors: pl.DataFrame | None = None
) -> Session:
    return session_in_memory(KEY, poses, sightings, sensors, FindingSettings())[0]


def test_a_session_has_all_poses_and_sightings_and_reports_numbers_that_are_not_finite() -> None:
    poses = POSES.with_columns(tx=pl.Series([0.0, None, np.nan, 0.3, 0.4]))
    read = session(poses)
    assert read.camera.usable.tolist() == [True, False, False, True, True]
    assert [(found.kind, found.file, found.lines) for found in read.findings] == [
        ("non_finite_values", "poses", (2, 3))
    ]
    assert (read.landmarks.ids, read.landmarks.frame.tolist()) == (("7", "8"), [0, 3, 4])


def test_air_pressure_comes_from_sensors() -> None:
    values = {f"v{i}": [1013.0] * FRAMES for i in range(1, 7)}
    sensors = pl.DataFrame({"time_ns": POSES["time_ns"], "sensor": ["PRESSURE"] * FRAMES, **values})
    pressure = session(sensors=sensors).camera.pressure
    assert pressure is not None
    assert pressure.pressure_hpa.tolist() == [1013.0] * FRAMES


@pytest.mark.parametrize(
    ("column", "values", "message"),
    [
        ("tx", ["a"] * 5, "table, column tx, row 1: expected numbers, metres; found 'a'"),
        ("qw", [True] * 5, "table, column qw, row 1: expected numbers, a unit quaternion's; found True"),
        ("id", ["1", " ", "2", "3", "4"], "row 2: expected text or whole numbers, the landmark's name; found ' '"),
    ],
)
def test_a_wrong_value_is_named_by_column_and_row(column: str, values: list[object], message: str) -> None:
    frame = pl.DataFrame({column: values})
    kind = pl.String if column == "id" else pl.Float64
    with pytest.raises(UsageError) as caught:
        checked_column(frame, "table", column, kind)
    assert str(caught.value).endswith(message)


@pytest.mark.parametrize("kind", [pl.Int64, pl.String, pl.Float64])
def test_a_column_without_rows_may_have_any_type(kind: type[pl.DataType]) -> None:
    for given in (pl.Int32, pl.String, pl.Boolean, pl.Null):
        assert checked_column(pl.DataFrame({"a": pl.Series([], dtype=given)}), "table", "a", kind).dtype == kind


def test_a_missing_column_is_named_with_those_expected_and_found() -> None:
    expected = (
        "sightings: the column id, qw is missing; expected id, time_ns, tx, ty, tz, qx, qy, qz, qw (or cam_x, cam_y, "
        "cam_z, from the camera; a quaternion may be left out); found time_ns, tx, ty, tz, qx, qy, qz"
    )
    with pytest.raises(UsageError) as caught:
        session(sightings=SIGHTINGS.drop("id", "qw"))
    assert str(caught.value) == expected
    with pytest.raises(UsageError, match=r"poses: the column tz is missing; .*; found t_ns, px, py, qx, qy, qz, qw$"):
        session(POSES.drop("tz").rename({"time_ns": "t_ns", "tx": "px", "ty": "py"}))


def test_positions_and_offsets_without_a_quaternion_are_read() -> None:
    place = SIGHTINGS.select("id", "time_ns", marker_x="tx", marker_y="ty", marker_z="tz")
    offset = SIGHTINGS.select("id", "time_ns", cam_x=pl.lit(1.0), cam_y=pl.lit(0.0), cam_z=pl.lit(0.0))
    for sightings in (place, offset):
        log = session(sightings=sightings).landmarks
        assert np.allclose(log.position_acs, session().landmarks.position_acs)
        assert (log.orientation_acs == (0.0, 0.0, 0.0, 1.0)).all()


def test_sightings_belong_to_frames_at_rounded_times() -> None:
    ms = SIGHTINGS.with_columns(time_ms=(pl.col("time_ns") / 1e6).round()).drop("time_ns")
    assert session(sightings=ms).landmarks.frame.tolist() == session().landmarks.frame.tolist()


def test_times_in_another_unit_are_refused() -> None:
    many = pl.concat([POSES] * 8).with_columns(time_ns=np.arange(40) * 33)
    with pytest.raises(
        UsageError, match="poses, column time_ns: times must be in nanoseconds, but these are in milliseconds"
    ) as caught:
        session(many, SIGHTINGS.head(0))
    assert str(caught.value).endswith("; rename the column to time_ms")


def test_rows_without_a_time_are_left_out_and_reported() -> None:
    times = pl.Series([None, *POSES["time_ns"][1:]])
    read = session(POSES.with_columns(time_ns=times), SIGHTINGS.with_columns(time_ns=times))
    assert read.camera.time_ns.tolist() == POSES["time_ns"].to_list()[1:]
    assert (read.landmarks.ids, read.landmarks.frame.tolist()) == (("7", "8"), [0, 1, 2, 3])
    assert [(found.kind, found.file, found.lines) for found in read.findings][:2] == [
        ("rows_without_time", "poses", (1,)),
        ("rows_without_time", "sightings", (1,)),
    ]


def test_dates_without_a_zone_beside_others_are_refused() -> None:
    dates = pl.from_epoch(POSES["time_ns"] + 1_700_000_000 * 10**9, time_unit="ns")
    local, zoned = (table.with_columns(time_ns=dates) for table in (POSES, SIGHTINGS))
    read = session(local, zoned)
    assert read.camera.time_ns.tolist() == [ns + 1_700_000_000 * 10**9 for ns in POSES["time_ns"]]
    with pytest.raises(UsageError, match="poses, column time_ns: the dates have no time zone, but those of sightings"):
        session(local, zoned.with_columns(time_ns=dates.dt.replace_time_zone("UTC")))


def test_what_is_no_table_is_refused() -> None:
    with pytest.raises(UsageError, match="poses: expected a Polars, pandas or Arrow table: "):
        frame_of(7, "poses")  # type: ignore[arg-type]


def test_landmarks_have_what_a_file_of_them_would_have() -> None:
    table = pl.DataFrame({"id": [7, 8, 8, 9, 10], "x": [1.0, 2.0, 3.0, None, 1e9], "y": [0.1, 0.2, 0.3, np.nan, 0.0]})
    landmarks, own, findings = landmarks_in_memory(table.with_columns(sigma_m=0.5), None, 0.02)
    assert (landmarks.ids, own, landmarks.surveyed.tolist()) == (("7", "8", "9"), 0, [True, True, False])
    assert landmarks.position_bcs[1].tolist() == [2.0, 0.2]
    assert landmarks.covariance_bcs[0, 0, 0] == 0.25
    assert [(found.kind, found.lines) for found in findings] == [
        ("non_finite_values", (5,)),
        ("duplicate_landmarks", (3,)),
    ]


def test_several_floors_need_the_one_on_which_the_walk_starts() -> None:
    table = pl.DataFrame({"id": ["a", "b", "c"], "x": [0.0] * 3, "y": [0.0] * 3, "floor": [2, 3, None]})
    with pytest.raises(
        UsageError, match=r"landmarks, column floor: there are 2, 3; pass floor=\.\.\. to specify on which"
    ):
        landmarks_in_memory(table, None, 0.02)
    landmarks, own, _ = landmarks_in_memory(table, 3, 0.02)
    assert (own, landmarks.floor.tolist()) == (3, [2, 3, 3])
    assert landmarks_in_memory(table.head(1), None, 0.02)[1] == 2
