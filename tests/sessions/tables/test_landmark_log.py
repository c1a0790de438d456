from __future__ import annotations

import numpy as np
import polars as pl
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.common.findings import Finding
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.sessions.tables.landmark_log import LANDMARK_SCHEMA, landmark_log

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
