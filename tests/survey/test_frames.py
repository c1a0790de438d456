"""Landmarks of other floors in the frame that a walk is mapped in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vislam2tag.survey.frame_change import changes_from, in_frame_of
from vislam2tag.survey.landmark_file import SurveyedLandmark, landmarks_from
from vislam2tag.survey.model import ControlPoints, Floor, Site
from vislam2tag.survey.site_file import Relation

NAN = float("nan")
MARKS = landmarks_from(
    [
        SurveyedLandmark("a", 0, 1.0, 2.0, 1.4, 0.1, 0.5, 0.05, ""),
        SurveyedLandmark("b", 1, 3.0, 0.0, 1.4, 0.1, 0.5, 0.05, ""),
        SurveyedLandmark("c", 1, NAN, NAN, NAN, 0.1, NAN, NAN, ""),
    ]
)


def site_of(relation: Relation) -> Site:
    floors = [
        Floor(number, "", None, None, None, None, ControlPoints((), np.empty((0, 2))), site_T_bcs=each.similarity())
        for number, each in enumerate((Relation(), relation))
    ]
    return Site(tuple(floors), MARKS)


def test_floors_that_share_a_frame_change_nothing() -> None:
    site = site_of(Relation())
    assert changes_from(site, 0) == {}
    assert in_frame_of(MARKS, site, 0) is MARKS


def test_landmarks_of_the_other_floor_turn() -> None:
    site = site_of(Relation(x_m=10.0, y_m=20.0, angle_deg=90.0))
    long = replace(MARKS, covariance_bcs=np.where(np.isinf(MARKS.covariance_bcs), np.inf, np.diag([4.0, 1.0])))
    turned = in_frame_of(long, site, 0)
    assert turned.position_bcs[:2] == pytest.approx(np.array([[1, 2], [10, 23]]))
    assert turned.covariance_bcs[1] == pytest.approx(np.diag([1.0, 4.0]))
    assert turned.heading_rad[:2] == pytest.approx([0.5, 0.5 + np.pi / 2])
    assert turned.surveyed.tolist() == [True, True, False]
    assert np.isposinf(turned.covariance_bcs[2]).any()
    back = in_frame_of(long, site, 1)
    assert back.position_bcs[1] == pytest.approx([3, 0])
    change = changes_from(site, 0)[1].new_T_old
    assert change @ np.array([10.0, 23.0]) == pytest.approx([3, 0])
