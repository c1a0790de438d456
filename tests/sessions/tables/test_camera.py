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
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.tables.camera import POSE_COLUMNS, camera_track

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
