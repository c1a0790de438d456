"""Heights and floors of the real walks: one goes down a flight of stairs and comes back, the others stay level."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import Storeys
from vislam2tag.core.tracks import Landmarks
from vislam2tag.estimation.heights import estimate_heights, vertical_span_m
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.prepared import SessionTask, prepared_session
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.corrections.file import Corrections

UPSTAIRS = ("303", "306")
"""Landmarks of the upper storey on the walk that takes the stairs; all its others hang on the lower one."""


def session_named(real_walks: Path, name: str) -> tuple[Session, Landmarks]:
    survey = open_survey(real_walks)
    ref = next(ref for ref in survey.sessions if ref.key.session == name)
    prepared = prepared_session(SessionTask(ref, survey.site, Corrections()))
    return prepared.session, prepared.landmarks


@pytest.fixture
def stairs(real_walks: Path) -> tuple[Session, Landmarks]:
    return session_named(real_walks, "oblique_209_occam")


def third(values: FloatArray, number: int) -> float:
    """Median of the first, middle or last part of a walk; the stairs are taken in between."""
    edges = ((0.0, 0.1), (0.2, 0.75), (0.9, 1.0))[number]
    first, last = (round(share * len(values)) for share in edges)
    return float(np.median(values[first:last]))


def test_the_walk_down_the_stairs_comes_out_as_such(stairs: tuple[Session, Landmarks]) -> None:
    session, landmarks = stairs
    one_folder = replace(landmarks, storeys=Storeys(2, np.array([2]), np.array([10.0])))
    heights = estimate_heights(session.camera, session.landmarks, one_folder)
    assert third(heights.z_m, 0) == pytest.approx(11.6, abs=0.5)
    assert 4.4 < third(heights.z_m, 0) - third(heights.z_m, 1) < 5.1
    assert third(heights.z_m, 2) == pytest.approx(third(heights.z_m, 0), abs=0.4)
    assert set(heights.floor.tolist()) == {2}
    assert 4.5 < vertical_span_m(session.camera, session.landmarks) < 5.6


@pytest.mark.parametrize("elevations", [(0.0, 4.8), (np.nan, np.nan)])
def test_its_landmarks_floors_give_each_frame_its_own(
    stairs: tuple[Session, Landmarks], elevations: tuple[float, float]
) -> None:
    session, landmarks = stairs
    floor = np.array([2 if name in UPSTAIRS else 1 for name in landmarks.ids])
    two = replace(landmarks, floor=floor, storeys=Storeys(2, np.array([1, 2]), np.array(elevations)))
    heights = estimate_heights(session.camera, session.landmarks, two)
    down, up = np.flatnonzero(np.diff(heights.floor))
    assert [heights.floor[frame] for frame in (0, down + 1, up + 1)] == [2, 1, 2]
    logged = session.camera.position_acs[:, 1]
    assert logged[[down, up]] == pytest.approx([-2.2, -2.2], abs=0.6)
    if np.isfinite(elevations).all():
        assert third(heights.z_m, 1) == pytest.approx(1.5, abs=0.4)
        assert third(heights.z_m, 0) == pytest.approx(6.2, abs=0.5)
    else:
        assert np.isnan(heights.z_m).all()


@pytest.mark.parametrize("name", ["725overlay", "floor_2_obright"])
def test_level_walks_stay_level(real_walks: Path, name: str) -> None:
    session, landmarks = session_named(real_walks, name)
    floor = session.key.floor
    known = replace(landmarks, storeys=Storeys(floor, np.array([floor]), np.array([0.0])))
    z = estimate_heights(session.camera, session.landmarks, known).z_m
    assert np.median(z) == pytest.approx(1.4, abs=0.3)
    assert np.ptp(z) < 1.8


def test_sessions_of_one_floor_use_it_alone_and_have_no_height_without_elevations(real_walks: Path) -> None:
    for ref in open_survey(real_walks).sessions:
        session, landmarks = session_named(real_walks, ref.key.session)
        assert set(landmarks.floor.tolist()) == {ref.key.floor}
        heights = estimate_heights(session.camera, session.landmarks, landmarks)
        assert np.isnan(heights.z_m).all()
        assert set(heights.floor.tolist()) == {ref.key.floor}
