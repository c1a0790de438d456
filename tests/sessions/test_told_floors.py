"""Which sheets a walk saw, where its walker told on which floor they were."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.sessions.test_session_landmarks import FLAT, KEY, TWO_FLOORS, site_of, walked
from vislam2tag.core.context import ToldFloors
from vislam2tag.core.tracks import Landmarks
from vislam2tag.sessions.corrected import corrected_session
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.told_floors import floors_told, on_known_floors, with_told_floors
from vislam2tag.survey.corrections.file import Corrections, SetLandmarkFloor


def told_session(frames: list[int], floors: list[int]) -> Session:
    camera, log = walked(FLAT, "abcx")
    told = ToldFloors(camera.time_ns[frames], np.array(floors))
    return Session(KEY, replace(camera, told_floors=told), log, np.empty(0, dtype=np.int64), {}, (), ())


@pytest.fixture(scope="module")
def two_floors() -> Landmarks:
    return site_of(TWO_FLOORS).landmarks


def test_an_id_of_two_floors_is_that_floor_s_which_the_walker_told(two_floors: Landmarks) -> None:
    session = told_session([100, 200], [2, 1])
    assert floors_told(session) == (1, 2)
    corrections = with_told_floors(Corrections(), session, two_floors)
    corrected, uses = corrected_session(session, corrections)
    (use,) = uses
    assert use == "100 rows of landmark a are taken for those of a (floor 2) (the walker said so)."
    log = corrected.landmarks
    assert log.frame[log.rows_of(log.ids.index("a (floor 2)"))].tolist() == list(range(100, 200))
    assert log.frame[log.rows_of(log.ids.index("a"))].tolist() == [*range(100), *range(200, 300)]
    assert set(log.ids) == {"a", "b", "c", "x", "a (floor 2)"}  # c hangs on floor 2 alone, b on 1, x nowhere


def test_what_the_corrections_say_of_an_id_goes_before(two_floors: Landmarks) -> None:
    said = Corrections(set_landmark_floor=(SetLandmarkFloor(id="a", to=2, from_s=1.0, to_s=2.0),))
    assert with_told_floors(said, told_session([100], [2]), two_floors) is said


def test_nothing_changes_where_nobody_told_or_it_was_the_own_floor(two_floors: Landmarks) -> None:
    session = told_session([100], [1])
    silent = replace(session, camera=replace(session.camera, told_floors=None))
    for each in (session, silent):
        assert with_told_floors(Corrections(), each, two_floors) == Corrections()
    assert floors_told(silent) == ()


def test_a_floor_that_the_survey_does_not_have_is_left_out_and_told() -> None:
    session = told_session([100, 150, 200], [2, 77, 1])
    kept = on_known_floors(session, site_of(TWO_FLOORS))
    assert kept.camera.told_floors is not None
    assert kept.camera.told_floors.floor.tolist() == [2, 1]
    (finding,) = kept.findings
    assert (finding.kind, finding.count) == ("unknown_told_floor", 1)
    assert "floor 77" in finding.message
    assert on_known_floors(told_session([100], [77]), site_of(TWO_FLOORS)).camera.told_floors is None
    assert on_known_floors(kept, site_of(TWO_FLOORS)) is kept
