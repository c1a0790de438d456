"""Landmarks that a session may use.

Ids that walks logged, by what the session itself says and by what is kept of it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.intake.faults import change_fields
from tests.surveys import make_survey
from tests.walks import camera_on, landmarks_at, log_of
from vislam2tag.common.errors import SessionError
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import ToldFloors
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.diagnose import observe_session
from vislam2tag.pipeline.labels.survey_evidence import kept_walk, passes_record
from vislam2tag.pipeline.run.selection import session_task
from vislam2tag.sessions.corrected import corrected_session
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.prepared import landmarks_without_position, prepared_session
from vislam2tag.sessions.registry import open_survey
from vislam2tag.sessions.session_landmarks import (
    ToldLandmarks,
    ambiguous_floor,
    candidate_landmarks,
    floors_told,
    landmarks_of_session,
    on_known_floors,
    walk_id_shift,
    with_told_floors,
)
from vislam2tag.site.corrections.file import Corrections, SetLandmarkFloor
from vislam2tag.site.model import ControlPoints, Floor, SessionKey, Site

KEY = SessionKey(1, "LG", "walk")
FLAT = np.zeros(300)
CLIMB = np.linspace(0, 3.0, 300)

Row = tuple[int, str, float, float]


def site_of(rows: list[Row]) -> Site:
    """Floors 1 and 2 (5 m up), landmarks by (floor, id, x, y)."""
    marks = landmarks_at({str(i): (row[2], row[3]) for i, row in enumerate(rows)})
    marks = replace(
        marks,
        ids=tuple(row[1] for row in rows),
        floor=np.array([row[0] for row in rows]),
        source=tuple(f"floor_{row[0]}/marker_dict.csv:{i + 2}" for i, row in enumerate(rows)),
    )
    points = ControlPoints((), np.empty((0, 2)))
    floors = tuple(Floor(n, f"Floor {n}", 60.0, 30.0, e, None, points) for n, e in ((1, 0.0), (2, 5.0)))
    return Site(floors, marks)


def walked(height: FloatArray, logged: str) -> tuple[CameraTrack, LandmarkLog]:
    plane = np.column_stack((np.arange(len(height)) * 0.03, np.zeros(len(height))))
    camera = camera_on(plane)
    camera.position_acs[:, 1] += height
    return camera, log_of(camera, {name: np.ones((len(height), 3)) for name in logged})


def choose(site: Site, height: FloatArray, logged: str) -> tuple[Landmarks, tuple[str, ...]]:
    camera, log = walked(height, logged)
    return landmarks_of_session(candidate_landmarks(site, KEY.floor, log.ids), KEY, camera, log)


def doubts(rows: list[Row], height: FloatArray, logged: str) -> list[Finding]:
    return ambiguous_floor(site_of(rows).landmarks, KEY, *walked(height, logged))


TWO_FLOORS: list[Row] = [(1, "a", 1, 1), (1, "b", 9, 1), (2, "a", 5, 5), (2, "c", 3, 3), (2, "d", 4, 4)]


def place_of(landmarks: Landmarks, name: str) -> tuple[int, list[float]]:
    row = landmarks.index[name]
    return int(landmarks.floor[row]), landmarks.position_bcs[row].tolist()


@pytest.mark.parametrize("logged", ["ab", "a", "ax", "xy"])
def test_a_session_that_logs_what_its_floor_knows_uses_its_floor_alone(logged: str) -> None:
    chosen, unused = choose(site_of(TWO_FLOORS), CLIMB, logged)
    assert unused == ()
    assert chosen.ids == ("a", "b")
    assert place_of(chosen, "a") == (1, [1, 1])
    storeys = chosen.storeys
    assert storeys is not None
    assert (storeys.own, storeys.number.tolist(), storeys.elevation_m.tolist()) == (1, [1], [0.0])


def test_two_landmarks_that_only_another_floor_has_make_it_a_walk_over_floors() -> None:
    chosen, _ = choose(site_of(TWO_FLOORS), FLAT, "bcd")
    assert sorted(chosen.ids) == ["a", "b", "c", "d"]
    assert place_of(chosen, "a") == (1, [1, 1])
    assert place_of(chosen, "d") == (2, [4, 4])
    storeys = chosen.storeys
    assert storeys is not None
    assert (storeys.own, storeys.number.tolist(), storeys.elevation_m.tolist()) == (1, [1, 2], [0.0, 5.0])


def test_one_such_landmark_needs_a_climb() -> None:
    assert choose(site_of(TWO_FLOORS), CLIMB, "bc")[1] == ()
    flat, unused = choose(site_of(TWO_FLOORS), FLAT, "bc")
    assert (unused, flat.ids) == (("c",), ("a", "b"))
    assert flat.storeys is not None
    assert flat.storeys.number.tolist() == [1]


def test_a_landmark_that_corrections_put_on_another_floor_needs_no_climb() -> None:
    camera, log = walked(FLAT, "bc")
    considered = candidate_landmarks(site_of(TWO_FLOORS), KEY.floor, log.ids)
    assert landmarks_of_session(considered, KEY, camera, log, ["c"])[1] == ()


def test_a_floor_that_the_walker_told_needs_neither_landmark_nor_climb() -> None:
    camera, log = walked(FLAT, "ab")
    told = replace(camera, told_floors=ToldFloors(camera.time_ns[[100]], np.array([2])))
    considered = candidate_landmarks(site_of(TWO_FLOORS), KEY.floor, log.ids, [2])
    chosen, _ = landmarks_of_session(considered, KEY, told, log)
    assert sorted(chosen.ids) == ["a", "b", "c", "d"]
    assert place_of(chosen, "a") == (1, [1, 1])  # told when which floor was: no clash
    assert chosen.storeys is not None
    assert chosen.storeys.number.tolist() == [1, 2]


def test_a_landmark_of_another_floor_is_a_finding_of_its_own() -> None:
    chosen, unused = choose(site_of(TWO_FLOORS), FLAT, "bcx")
    _, log = walked(FLAT, "bcx")
    found = {finding.kind: finding for finding in landmarks_without_position(log, chosen, unused)}
    assert set(found) == {"landmark_of_other_floor", "landmark_without_position"}
    assert "landmark c was observed" in found["landmark_of_other_floor"].message
    assert "took a lift" in found["landmark_of_other_floor"].message
    assert "landmarks x were observed" in found["landmark_without_position"].message


def test_an_id_in_two_places_is_an_error_that_names_both() -> None:
    with pytest.raises(SessionError) as caught:
        choose(site_of(TWO_FLOORS), CLIMB, "abcd")
    message = str(caught.value)
    assert "landmark a" in message
    assert "floor 1 (floor_1/marker_dict.csv:2) and floor 2 (floor_2/marker_dict.csv:4)" in message
    assert "corrections.toml" in message


def test_where_nobody_surveyed_the_own_floor_other_floors_ids_say_nothing() -> None:
    chosen, unused = choose(site_of([row for row in TWO_FLOORS if row[0] == 2]), CLIMB, "acd")
    assert (chosen.ids, unused) == ((), ())


def test_an_id_whose_place_is_not_known_on_one_floor_is_ambiguous_too() -> None:
    rows = [(1, "a", 1.0, 1.0), (2, "a", np.nan, np.nan), (2, "c", 3, 3), (2, "d", 4, 4)]
    with pytest.raises(SessionError, match="landmark a"):
        choose(site_of(rows), FLAT, "acd")


def test_the_same_id_at_the_same_place_is_no_clash_and_the_own_floors_counts() -> None:
    rows: list[Row] = [(0, "a", 1, 1), (1, "a", 1, 1), (2, "a", 1, 1), (2, "c", 3, 3), (2, "d", 4, 4)]
    chosen, _ = choose(site_of(rows), FLAT, "acd")
    assert sorted(chosen.ids) == ["a", "c", "d"]
    assert place_of(chosen, "a") == (1, [1, 1])


def test_a_clash_of_ids_that_were_not_seen_does_not_matter() -> None:
    assert "a" in choose(site_of(TWO_FLOORS), FLAT, "bcd")[0].index


@pytest.mark.parametrize("own_first", [True, False])
def test_a_climb_among_ids_that_two_floors_share_is_a_finding(own_first: bool) -> None:
    rows = [*TWO_FLOORS, (0, "b", 2.0, 2.0), (2, "b", 7.0, 7.0)]
    (finding,) = doubts(rows if own_first else rows[::-1], CLIMB, "xab")
    assert (finding.kind, finding.severity, finding.count) == ("ambiguous_floor", "warning", 2)
    line = {True: (2, 4), False: (8, 6)}[own_first]
    assert (
        f"landmark a is on floor 1 (floor_1/marker_dict.csv:{line[0]}) and elsewhere on floor 2 "
        f"(floor_2/marker_dict.csv:{line[1]})"
    ) in finding.message
    assert "up or down by 2.9 m" in finding.message
    assert "All were assigned to floor 1." in finding.message
    assert "corrections.toml" in finding.message


@pytest.mark.parametrize(
    ("height", "logged"),
    [(FLAT, "ab"), (CLIMB, "b"), (CLIMB, "bx"), (CLIMB, "abc")],
    ids=["no climb", "only its own", "its own and one unknown", "one of another floor"],
)
def test_a_walk_whose_floors_are_plain_is_no_such_finding(height: FloatArray, logged: str) -> None:
    assert doubts(TWO_FLOORS, height, logged) == []


def test_one_place_on_two_floors_leaves_no_doubt_where_landmarks_are() -> None:
    assert doubts([(1, "a", 1, 1), (2, "a", 1, 1)], CLIMB, "a") == []


def test_shared_ids_of_a_floor_that_nobody_surveyed_are_no_such_finding() -> None:
    assert doubts([(2, "a", 1, 1), (3, "a", 5, 5)], CLIMB, "a") == []


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
    assert use == "100 rows of landmark a are assigned to a (floor 2) (the collector chose this floor)."
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


def shared(count: int) -> FloatArray:
    """Errors that all landmarks have in common, and some of their own."""
    return np.asarray(np.eye(3 * count) * 0.01 + 0.04, dtype=np.float64)


def told(*ids: str) -> ToldLandmarks:
    k = len(ids)
    return ToldLandmarks(
        ids,
        np.zeros(k, dtype=np.int64),
        np.arange(2.0 * k).reshape(k, 2),
        np.linspace(0.0, 0.1 * (k - 1), k),
        shared(k),
        sessions=3,
    )


SURVEY = replace(landmarks_at({"a": (1.0, 2.0), "b": (3.0, 4.0)}, sigma_m=0.1), source=("f:2", "f:3"))


def test_places_are_those_told_and_new_ones_are_added() -> None:
    given = told("c", "b").onto(SURVEY)
    assert given.ids == ("a", "b", "c")
    assert given.position_bcs.tolist() == [[1, 2], [2, 3], [0, 1]]
    assert given.heading_rad[1:].tolist() == [0.1, 0.0]
    assert given.source == ("f:2", "f:3", "")
    assert given.surveyed.all()


def test_errors_that_are_shared_stay_shared_and_others_apart() -> None:
    given = told("c", "b").onto(SURVEY)
    assert given.joint_covariance is not None
    rows = [4, 5, 2, 3, 8, 7]  # x, y of c and b, then their headings
    assert given.joint_covariance[np.ix_(rows, rows)] == pytest.approx(shared(2))
    assert given.joint_covariance[np.ix_([0, 1], [0, 1])] == pytest.approx(0.01 * np.eye(2))
    assert not given.joint_covariance[np.ix_([0, 1], rows)].any()
    assert given.covariance_bcs[1] == pytest.approx(0.01 * np.eye(2) + 0.04)
    assert given.heading_sigma_rad[1:] == pytest.approx(np.sqrt(0.05))


def test_the_part_of_some_landmarks_keeps_what_they_share() -> None:
    given = told("c", "b").onto(SURVEY)
    some = given.select([2, 0])
    assert some.joint_covariance is not None
    assert some.joint_covariance.shape == (6, 6)
    assert some.joint_covariance[0, 1] == pytest.approx(0.04)
    assert some.joint_covariance[0, 2] == 0


def test_an_unknown_heading_stays_unknown() -> None:
    one = replace(told("b"), heading_rad=np.array([np.nan])).onto(SURVEY)
    assert np.isnan([one.heading_rad[1], one.heading_sigma_rad[1]]).all()


SETTINGS = ProcessSettings()


@pytest.mark.parametrize("seed", [500, 506])
@pytest.mark.parametrize("by", [0, 1, -1])
def test_session_diagnosis_and_what_is_kept_say_the_same(seed: int, by: int, tmp_path: Path) -> None:
    survey = make_survey(tmp_path / "survey", devices=("LG",), seconds=120.0, severity="default", seed=seed)
    (session,) = survey.glob("floor_*/*/*/")
    change_fields("initPoses.csv", 0, lambda name: str(int(name) - by))(session)
    opened = open_survey(survey)
    task = session_task(opened.sessions[0], opened, Corrections(), SETTINGS)
    prepared = prepared_session(task)
    record = passes_record(prepared, SETTINGS.mapping.smoother.sighting_range_m)
    assert record is not None
    diagnosed = observe_session(SETTINGS, task).passes
    assert diagnosed is not None
    found = [
        walk_id_shift(prepared.session.camera, prepared.session.landmarks, prepared.landmarks),
        kept_walk(task.ref.key, record)[0].id_shift,
        diagnosed.id_shift,
    ]
    assert {None if one is None else one.shift for one in found} == {by or None}
    kinds = [finding.kind for finding in prepared.findings()]
    assert ("shifted_ids" in kinds) == (by != 0)
