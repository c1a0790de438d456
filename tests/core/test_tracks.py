"""Tracks and logs in part: sections of a session, some of its landmarks, its usable frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vislam2tag.core.context import TrackerState
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import (
    CameraTrack,
    LandmarkLog,
    longest_section,
    one_section,
    section_numbers,
    to_plane,
)

SECTIONS = (0, 0, 1, 1, 1, 2)


def camera(status: tuple[int, ...] = (0,) * 6) -> CameraTrack:
    count = len(status)
    return CameraTrack(
        time_ns=np.arange(count) * 500_000_000,
        position_acs=np.zeros((count, 3)),
        orientation_acs=np.tile((0.0, 0.0, 0.0, 1.0), (count, 1)),
        status=np.array(status, dtype=np.int8),
    )


def in_sections(track: CameraTrack, tracking: tuple[bool, ...] = (True,) * 6, words: str = "NNNNNN") -> CameraTrack:
    names = {"N": "NONE", "D": "DARK", "F": "FAST"}
    failure = np.array([list(names).index(word) for word in words])
    return replace(track, state=TrackerState(np.array(tracking), np.array(SECTIONS), tuple(names.values()), failure))


def log() -> LandmarkLog:
    """Landmark a in frames 0, 1 and 3, b in 4, c in 5."""
    frame = np.array([0, 1, 3, 4, 5])
    return LandmarkLog(
        ids=("a", "b", "c"),
        landmark=np.array([0, 0, 0, 1, 2]),
        frame=frame,
        position_acs=np.column_stack((frame, frame, frame)).astype(np.float64),
        orientation_acs=np.zeros((5, 4)),
        lost=np.array([False, True, False, False, False]),
        row=frame + 1,
        seen=frame > 0,
    )


def test_landmarks_that_stay_are_numbered_anew_with_their_rows() -> None:
    some = log().select([0, 2])
    assert some.ids == ("a", "c")
    assert [some.frame[some.rows_of(i)].tolist() for i in (0, 1)] == [[0, 1, 3], [5]]
    assert (some.row.tolist(), some.lost.tolist()) == ([1, 2, 4, 6], [False, True, False, False])
    assert some.seen is not None
    assert some.seen.tolist() == [False, True, True, True]
    assert log().rows_kept(np.array([False, True, False, False, True])).ids == ("a", "c")


def test_a_section_alone_has_its_frames_and_landmarks() -> None:
    track, kept = one_section(in_sections(camera()), log(), 1)
    assert np.flatnonzero(track.usable).tolist() == [2, 3, 4]
    assert set(track.status[~track.usable].tolist()) == {Status.INVALID}
    assert (kept.ids, kept.frame.tolist()) == (("a", "b"), [3, 4])


def test_the_longest_section_is_that_of_most_usable_frames() -> None:
    unusable = (0, 0, Status.INVALID, Status.INVALID, 0, 0)
    for status, frames in (((0,) * 6, [2, 3, 4]), (unusable, [0, 1])):
        track, _ = longest_section(in_sections(camera(status)), log())
        assert np.flatnonzero(track.usable).tolist() == frames
    no_last = in_sections(camera((0, 0, 0, 0, 0, Status.INVALID)))
    assert section_numbers(no_last).tolist() == [0, 1]
    whole = camera()
    assert longest_section(whole, log())[0] is whole
    assert section_numbers(whole).tolist() == [0]


def test_duration_and_rate_are_of_usable_frames_and_a_hole_does_not_lower_the_rate() -> None:
    track = replace(camera((0, 0, 0, 0, 0, Status.INVALID)), time_ns=np.array([0, 1, 2, 3, 13, 14]) * 100_000_000)
    assert track.duration_s == pytest.approx(1.3)
    assert track.frame_rate_hz == pytest.approx(10.0)
    assert (camera((Status.INVALID,)).duration_s, camera((0,)).frame_rate_hz) == (0.0, None)


def test_the_plane_is_right_handed_seen_from_above() -> None:
    assert to_plane(np.array([[1.0, 2.0, 3.0]])).tolist() == [[1.0, -3.0]]


def test_the_reason_is_the_commonest_of_the_frames_lost() -> None:
    state = in_sections(camera(), (True, False, False, False, False, True), "FDFFNF").state
    assert state is not None
    assert state.reason(0, 6) == "FAST"
    assert state.reason(0, 3) == "DARK"  # as common as the other: the first in order of letters
    assert (state.reason(4, 5), state.reason(5, 6)) == ("", "")
