from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import LandmarkLog
from vislam2tag.quality.evaluation.paper.walks import landmark_movement_m


def log_of(*landmarks: list[tuple[float, float]], lost: bool = False) -> LandmarkLog:
    """Landmarks with these positions in the plane, one a frame."""
    plane: FloatArray = np.array([place for places in landmarks for place in places]).reshape(-1, 2)
    index = np.repeat(np.arange(len(landmarks)), [len(places) for places in landmarks])
    frame = np.concatenate([np.arange(len(places)) for places in landmarks])
    position = np.column_stack((plane[:, 0], np.zeros(len(plane)), -plane[:, 1]))
    ids = tuple(str(i) for i in range(len(landmarks)))
    return LandmarkLog(ids, index, frame, position, np.zeros((len(plane), 4)), np.full(len(plane), lost))


def test_a_landmark_that_stays_does_not_move() -> None:
    assert landmark_movement_m(log_of([(1.0, 2.0)] * 5)) == 0


def test_each_landmark_counts_once_however_often_it_was_logged() -> None:
    still = [(0.0, 0.0)] * 50
    moved = [(0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (3.0, 4.0)]
    assert landmark_movement_m(log_of(still, moved)) == pytest.approx((0 + 5 / 4) / 2)


def test_lost_tracking_tells_nothing() -> None:
    assert np.isnan(landmark_movement_m(log_of([(0.0, 0.0), (9.0, 9.0)], lost=True)))
