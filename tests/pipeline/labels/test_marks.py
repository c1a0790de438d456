"""What a walk met, as its result tells it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.pipeline.labels.mapped import walk
from vislam2tag.core.faults import Contradiction, EventKind, TrackerEvent
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Landmarks, Visit
from vislam2tag.pipeline.labels.marks import contradiction_marks, event_marks, visit_marks

FLOORS = np.array([1, 1, 2])


def test_marks_have_time_place_and_the_floor_where_it_is_another() -> None:
    _, trajectory = walk(np.arange(3.0), [Status.OK, Status.TRACKING_LOST, Status.OK])
    trajectory = replace(
        trajectory,
        visits=(Visit(0, "a", 0.12345), Visit(1, "", 0.0), Visit(2, "b", 1.0)),
        events=(
            TrackerEvent(EventKind.LOSS, 1, 0.5, reason="dark"),
            TrackerEvent(EventKind.BREAK, 2, 1.23456, 0.56789),
        ),
    )
    visits = visit_marks(replace(trajectory, floor=FLOORS), own=1)
    assert [(one.landmark, one.distance_m, one.position, one.floor) for one in visits] == [
        ("a", 0.123, (0.0, 10.0), None),
        ("", 0.0, None, None),
        ("b", 1.0, (2.0, 10.0), 2),
    ]
    assert [one.time_ns for one in visits] == trajectory.time_ns.tolist()
    assert all(one.floor is None for one in visit_marks(trajectory, own=1))
    loss, jump = event_marks(replace(trajectory, floor=FLOORS), own=1)
    assert (loss.turn_rad, loss.reason, loss.position, loss.floor) == (None, "dark", None, None)
    assert (jump.size_m, jump.turn_rad, jump.position, jump.floor) == (1.235, 0.5679, (2.0, 10.0), 2)


def test_a_contradiction_names_the_surveyed_place_of_its_landmark() -> None:
    _, trajectory = walk(np.arange(2.0), [Status.OK, Status.OK])
    unknown = np.full(2, np.nan)
    landmarks = Landmarks(
        ids=("a", "b"),
        floor=np.array([1, 2]),
        position_bcs=np.array([[1.0, 2.0], [3.004, 4.0]]),
        covariance_bcs=np.zeros((2, 2, 2)),
        z_m=unknown,
        heading_rad=unknown,
        heading_sigma_rad=unknown,
    )
    found = Contradiction("b", 0.98765, 0.1, (0.9, -0.4), 3)
    (mark,) = contradiction_marks(replace(trajectory, contradictions=(found,)), landmarks)
    assert (mark.floor, mark.landmark, mark.size_m, mark.passes) == (2, "b", 0.988, 3)
    assert (mark.surveyed_m, mark.offset_m) == ((3.0, 4.0), (0.9, -0.4))
