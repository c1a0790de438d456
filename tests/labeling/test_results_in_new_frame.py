"""Results of sessions in another frame."""

from __future__ import annotations

import pytest

from vislam2tag.core.faults import EventKind
from vislam2tag.labeling.results import (
    ContradictionMark,
    Drawing,
    EventMark,
    SessionResult,
    SigmaStatistics,
    Stretch,
    VisitMark,
)
from vislam2tag.labeling.results_in_new_frame import changed_result, floors_of_result
from vislam2tag.site.frame_change import FrameChange

RESULT = SessionResult(
    slug="s",
    fingerprint="f",
    floor=0,
    device="d",
    session="s",
    format="published",
    strategy="smoother",
    version="1",
    distance_m=10.0,
    visits=[
        VisitMark(landmark="1", time_ns=0, distance_m=1.0, position=(1.0, 0.0)),
        VisitMark(landmark="2", time_ns=0, distance_m=1.0, position=None),
        VisitMark(landmark="3", time_ns=0, distance_m=1.0, position=(1.0, 0.0), floor=1),
    ],
    events=[EventMark(time_ns=0, kind=next(iter(EventKind)), size_m=1.0, turn_rad=None, position=(2.0, 0.0))],
    contradictions=[
        ContradictionMark(
            floor=0, landmark="1", size_m=1.0, sigma_m=0.1, passes=2, surveyed_m=(1.0, 1.0), offset_m=(1.0, 0.0)
        )
    ],
    sigma=SigmaStatistics(median_m=0.1, p95_m=0.2, uncertain_share=0.0, frames={1: 2}),
    drawing=Drawing(mapped=[Stretch(status="ok", points=[(1.0, 0.0), (2.0, 0.0)], sigma_m=[0.1, 0.2])], raw=[]),
    elsewhere={1: Drawing(wifi=[(1.0, 0.0)])},
)
TURN = {0: FrameChange(number=0, x_m=10, angle_deg=90), 1: FrameChange(number=1, y_m=5)}


def test_every_place_turns_with_its_floor() -> None:
    changed = changed_result(RESULT, TURN)
    assert [mark.position for mark in changed.visits] == [(10.0, 1.0), None, (1.0, 5.0)]
    assert changed.events[0].position == (10.0, 2.0)
    (contradiction,) = changed.contradictions
    assert (contradiction.surveyed_m, contradiction.offset_m) == ((9.0, 1.0), (0.0, 1.0))
    assert changed.drawing.mapped[0].points == [(10.0, 1.0), (10.0, 2.0)]
    assert changed.elsewhere[1].wifi == [(1.0, 5.0)]
    assert (changed.sigma, changed.distance_m) == (RESULT.sigma, 10.0)
    assert changed.fingerprint != RESULT.fingerprint
    assert changed.findings == []
    assert floors_of_result(RESULT) == {0, 1}


def test_statistics_of_another_scale_are_left_out_and_told() -> None:
    changed = changed_result(RESULT, {**TURN, 0: FrameChange(number=0, scale=2.0)})
    assert changed.sigma is None
    assert [finding.kind for finding in changed.findings] == ["statistics_left_out"]
    assert changed.distance_m == 20.0
    assert changed.drawing.mapped[0].sigma_m == pytest.approx([0.2, 0.4])
    assert changed.contradictions[0].size_m == 2.0
