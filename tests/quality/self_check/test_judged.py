"""A check says of how many landmarks it could leave one out, and why of none."""

from __future__ import annotations

from vislam2tag.common.judgement import Answer
from vislam2tag.quality.self_check.judged import judgement_of
from vislam2tag.quality.self_check.record import LeftOutMark, SessionCheck


def session(name: str, *landmarks: str, fixes: int = 0, error: str | None = None) -> SessionCheck:
    marks = [
        LeftOutMark(
            floor=0,
            landmark=landmark,
            passes=1,
            surveyed_m=(0.0, 0.0),
            offset_m=(0.1, 0.0),
            covariance_m2=(0.01, 0.0, 0.01),
            survey_covariance_m2=(0.001, 0.0, 0.001),
        )
        for landmark in landmarks
    ]
    return SessionCheck(
        slug=name,
        floor=0,
        device="LG",
        session=name,
        error=error,
        fixes=fixes,
        left_out=marks,
        well_founded=len(marks) >= 3,
    )


def test_each_landmark_counts_once() -> None:
    found = judgement_of([session("a", "1", "2", "3"), session("b", "2", "3", "4"), session("c", "1")], bad=0)
    assert found.answer is Answer.NOTHING_WRONG
    assert found.looked_at == "4 landmarks in 2 sessions"
    assert found.why == "1 session could not judge any"


def test_known_positions_are_counted_beside_landmarks() -> None:
    found = judgement_of([session("a", "1", "2", "3"), session("b", "x", "y", "z", fixes=3)], bad=1)
    assert (found.answer, found.looked_at) == (Answer.WRONG, "3 landmarks and 3 known positions in 2 sessions")


def test_too_few_none_read_and_none_there_differ() -> None:
    assert judgement_of([session("a", "1")], bad=0).answer is Answer.NOT_JUDGED
    failed = [session(name, error="no frames") for name in "ab"]
    assert judgement_of(failed, bad=0).why == "none of 2 sessions can be read or mapped"
    assert judgement_of(failed[:1], bad=0).why == "the session cannot be read or mapped"
    assert judgement_of([], bad=0).answer is Answer.NOT_LOOKED_AT
