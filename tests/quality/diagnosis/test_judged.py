"""A diagnosis says how many landmarks it could judge, and why it could judge none."""

from __future__ import annotations

from tests.quality.diagnosis.made_walks import PLACES, evidence, made_survey
from vislam2tag.common.judgement import Answer
from vislam2tag.quality.diagnosis.judged import judgement_of


def test_walks_past_surveyed_landmarks_judge_these() -> None:
    found = judgement_of(evidence(made_survey(), {**PLACES, "99": 0j}), sessions=5, failed=1, faults=0)
    assert found.answer is Answer.NOTHING_WRONG
    assert found.looked_at == "8 landmarks in 4 walks"
    assert found.why == (
        "1 landmark could not be judged, no walk passes enough others there; 1 session cannot be read or mapped"
    )


def test_two_surveyed_landmarks_do_not_judge_one_another() -> None:
    table = {name: PLACES[name] for name in "12"}
    found = judgement_of(evidence(made_survey(), table), sessions=4, failed=0, faults=0)
    assert (found.answer, found.looked_at) == (Answer.NOT_JUDGED, "")
    assert found.why.startswith("no walk passes 3 surveyed landmarks")


def test_known_positions_of_walks_without_poses_count() -> None:
    found = judgement_of(evidence([], PLACES), sessions=1, failed=0, faults=0, fixes=6)
    assert (found.answer, found.looked_at) == (Answer.NOTHING_WRONG, "6 known positions")


def test_no_session_and_none_that_can_be_read_differ() -> None:
    nothing = evidence([], PLACES)
    assert judgement_of(nothing, sessions=0, failed=0, faults=0).answer is Answer.NOT_LOOKED_AT
    assert judgement_of(nothing, sessions=2, failed=2, faults=0).why == ("none of 2 sessions can be read or mapped")
    assert judgement_of(nothing, sessions=1, failed=1, faults=0).why == "the session cannot be read or mapped"
