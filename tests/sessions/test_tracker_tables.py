"""The camera track and the landmark log."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.sessions.raw import FRAME_NS, START_NS
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.tracker_tables import LANDMARK_SCHEMA, POSE_COLUMNS, camera_track, landmark_log

IDENTITY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def track_of(
    times_ns: list[int], poses: Mapping[int, tuple[float, ...]] | None = None
) -> tuple[CameraTrack, dict[str, Finding]]:
    rows = [(i + 1, t, *(poses or {}).get(i, IDENTITY)) for i, t in enumerate(times_ns)]
    table = pl.DataFrame(rows, schema={"row": pl.Int64, "time_ns": pl.Int64, **POSE_COLUMNS}, orient="row")
    track, findings = camera_track(table, "poses.csv", FindingSettings())
    return track, {finding.kind: finding for finding in findings}


def test_clean_frames_are_all_usable() -> None:
    track, findings = track_of([START_NS + i * FRAME_NS for i in range(10)])
    assert track.usable.all()
    assert not findings


def test_first_of_equal_times_counts_and_backward_frames_do_not() -> None:
    track, findings = track_of([10, 20, 20, 15, 20, 30, 10, 40])
    ok, duplicate, invalid = Status.OK, Status.DUPLICATE, Status.INVALID
    assert track.status.tolist() == [ok, ok, duplicate, invalid, duplicate, ok, invalid, ok]
    assert findings["duplicate_times"].lines == (3, 5)
    assert findings["backward_times"].lines == (4, 7)


def test_one_time_far_ahead_is_named_as_what_makes_all_others_backward() -> None:
    track, findings = track_of([10, 20, 9_000, *range(30, 100)])
    assert track.usable.sum() == 3
    assert findings["backward_times"].count == 70
    assert "70 of them are earlier than line 3; if its time is wrong, remove that line" in (
        findings["backward_times"].message
    )
    _, findings = track_of([10, 9_000, 20, 30, *range(10_000, 10_010)])
    assert "line" not in findings["backward_times"].message


def test_a_frame_that_is_not_finite_neither_counts_nor_makes_others_backward() -> None:
    nan, inf = float("nan"), float("inf")
    poses = {1: (nan, *IDENTITY[1:]), 2: (*IDENTITY[:6], inf)}
    track, findings = track_of([10, 99, 20, 20, 30], poses)
    assert track.status.tolist() == [Status.OK, Status.INVALID, Status.INVALID, Status.OK, Status.OK]
    assert findings["non_finite_values"].lines == (2, 3)
    assert set(findings) == {"non_finite_values"}


def test_a_quaternion_that_cannot_be_normalised_makes_a_frame_invalid() -> None:
    track, findings = track_of([10, 20], {1: (*IDENTITY[:3], 0.0, 0.0, 0.0, 0.0)})
    assert track.status.tolist() == [Status.OK, Status.INVALID]
    assert findings["invalid_quaternions"].lines == (2,)


@pytest.mark.parametrize("column", range(7))
@pytest.mark.parametrize("value", [2e6, -1e300])
def test_absurdly_great_numbers_make_a_frame_invalid(column: int, value: float) -> None:
    pose = (*IDENTITY[:column], value, *IDENTITY[column + 1 :])
    track, findings = track_of([10, 20], {1: pose})
    assert track.status.tolist() == [Status.OK, Status.INVALID]
    assert findings["non_finite_values"].lines == (2,)


def test_gaps_are_reported_with_the_line_after_them() -> None:
    second = 1_000_000_000
    _, findings = track_of([0, second, 2 * second + 1, 5 * second])
    assert findings["frame_gap"].lines == (3, 4)
    assert "longest 3.0 s" in findings["frame_gap"].message


def test_a_session_without_a_usable_frame_is_an_error() -> None:
    for times, poses in (([], {}), ([10], {0: (float("nan"),) * 7})):
        _, findings = track_of(times, poses)
        assert findings["no_frames"].severity == Severity.ERROR


@given(st.lists(st.integers(0, 30), max_size=40))
def test_usable_frames_have_strictly_increasing_times_and_lose_no_new_maximum(times: list[int]) -> None:
    track, _ = track_of(times)
    usable = track.time_ns[track.usable]
    assert np.all(np.diff(usable) > 0)
    records = [t for i, t in enumerate(times) if all(t > earlier for earlier in times[:i])]
    assert usable.tolist() == records


@given(st.lists(st.floats(-4e5, 4e5), min_size=4, max_size=4).filter(lambda q: max(map(abs, q)) > 1e-6))
def test_quaternions_come_out_with_norm_one_and_the_same_direction(quaternion: list[float]) -> None:
    track, _ = track_of([1], {0: (0.0, 0.0, 0.0, *quaternion)})
    assert np.linalg.norm(track.orientation_acs[0]) == pytest.approx(1.0)
    np.testing.assert_allclose(track.orientation_acs[0] * np.linalg.norm(quaternion), quaternion, rtol=1e-9, atol=1e-9)


Row = tuple[str, int, float]
"""Id, time and x."""


def camera_at(times_ns: list[int]) -> CameraTrack:
    n = len(times_ns)
    position = np.zeros((n, 3))
    orientation = np.tile([0.0, 0, 0, 1], (n, 1))
    return CameraTrack(np.array(times_ns, dtype=np.int64), position, orientation, np.zeros(n, dtype=np.int8))


def log_of(rows: list[Row], camera: CameraTrack) -> tuple[LandmarkLog, dict[str, Finding]]:
    lines = [(i + 1, name, t, x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0) for i, (name, t, x) in enumerate(rows)]
    table = pl.DataFrame(lines, schema={"row": pl.Int64, **LANDMARK_SCHEMA}, orient="row")
    log, findings = landmark_log(table, "initPoses.csv", camera)
    return log, {finding.kind: finding for finding in findings}


def contents(log: LandmarkLog) -> list[tuple[str, int, float]]:
    columns = zip(log.landmark, log.frame, log.position_acs[:, 0], strict=True)
    return [(log.ids[landmark], int(frame), float(x)) for landmark, frame, x in columns]


def test_rows_are_sorted_by_landmark_in_order_of_first_sighting() -> None:
    log, findings = log_of(
        [("b", 10, 1), ("b", 20, 2), ("a", 20, 3), ("b", 30, 4), ("a", 30, 5)], camera_at([10, 20, 30])
    )
    assert log.ids == ("b", "a")
    assert contents(log) == [("b", 0, 1), ("b", 1, 2), ("b", 2, 4), ("a", 1, 3), ("a", 2, 5)]
    assert log.offsets.tolist() == [0, 3, 5]
    assert not findings


def test_spellings_of_an_id_are_one_landmark() -> None:
    log, _ = log_of([("10", 10, 1), ("10.0", 20, 2), ("010", 30, 3), ("+10", 40, 4)], camera_at([10, 20, 30, 40]))
    assert contents(log) == [("10", 0, 1), ("10", 1, 2), ("10", 2, 3), ("10", 3, 4)]


def test_rows_without_a_frame_of_their_time_are_reported() -> None:
    log, findings = log_of([("a", 10, 1), ("a", 11, 2), ("a", 99, 3)], camera_at([10, 20]))
    assert contents(log) == [("a", 0, 1)]
    assert findings["landmark_rows_without_frame"].lines == (2, 3)


def test_rows_of_a_frame_that_is_not_used_are_left_to_that_frames_finding() -> None:
    camera = camera_at([10, 20, 15])
    camera.status[2] = Status.INVALID
    log, findings = log_of([("a", 10, 1), ("a", 15, 2), ("a", 20, 3)], camera)
    assert contents(log) == [("a", 0, 1), ("a", 1, 3)]
    assert not findings


def test_the_first_of_rows_with_one_landmark_and_time_counts() -> None:
    log, findings = log_of([("a", 10, 1), ("b", 10, 2), ("a", 10, 3), ("a", 20, 4)], camera_at([10, 20]))
    assert contents(log) == [("a", 0, 1), ("a", 1, 4), ("b", 0, 2)]
    assert findings["duplicate_landmark_rows"].lines == (3,)


def test_rows_that_are_not_finite_are_not_used() -> None:
    log, findings = log_of([("a", 10, float("nan")), ("b", 10, 1)], camera_at([10]))
    assert log.ids == ("b",)
    assert findings["non_finite_values"].lines == (1,)


def test_lost_rows_and_frames_without_any_tracked_landmark() -> None:
    rows: list[Row] = [
        ("a", 10, 1),
        ("a", 20, 0),
        ("b", 20, 2),
        ("a", 30, 0),
        ("b", 30, 0),
        ("a", 40, 0),
        ("b", 40, 5e-7),
    ]
    log, findings = log_of(rows, camera_at([10, 20, 30, 40]))
    assert log.lost.tolist() == [False, True, True, True, False, True, True]
    assert findings["tracking_lost"].count == 2
    assert findings["tracking_lost"].lines == (4, 6)


def test_no_rows_and_no_frames() -> None:
    for rows, times in (([], [10]), ([("a", 10, 1.0)], []), ([], [])):
        log, _ = log_of(rows, camera_at(times))
        assert log.ids == ()
        assert log.offsets.tolist() == [0]


@given(st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 9), st.integers(1, 9)), max_size=60))
def test_agrees_with_a_plain_reading(rows: list[tuple[str, int, int]]) -> None:
    camera = camera_at(list(range(0, 10, 2)))
    log, _ = log_of([(name, t, float(x)) for name, t, x in rows], camera)
    expected: dict[tuple[str, int], float] = {}
    for name, t, x in rows:
        if t % 2 == 0:
            expected.setdefault((name, t // 2), float(x))
    assert {(name, frame): x for name, frame, x in contents(log)} == expected
    order = list(zip(log.landmark.tolist(), log.frame.tolist(), strict=True))
    assert order == sorted(order)
    firsts = [min(frame for name, frame in expected if name == landmark) for landmark in log.ids]
    assert firsts == sorted(firsts)
