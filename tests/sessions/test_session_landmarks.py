"""Whose landmarks a session uses: its own floor's, or all floors' where it really went there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.walks import camera_on, landmarks_at, log_of
from vislam2tag.common.errors import SessionError
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import ToldFloors
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks
from vislam2tag.sessions.prepared import landmarks_without_position
from vislam2tag.sessions.session_landmarks import (
    SessionLandmarks,
    ambiguous_floor,
    candidate_landmarks,
    landmarks_of_session,
)
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


def choose(site: Site, height: FloatArray, logged: str) -> SessionLandmarks:
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
    chosen = choose(site_of(TWO_FLOORS), CLIMB, logged)
    assert chosen.unused == ()
    assert chosen.landmarks.ids == ("a", "b")
    assert place_of(chosen.landmarks, "a") == (1, [1, 1])
    storeys = chosen.landmarks.storeys
    assert storeys is not None
    assert (storeys.own, storeys.number.tolist(), storeys.elevation_m.tolist()) == (1, [1], [0.0])


def test_two_landmarks_that_only_another_floor_has_make_it_a_walk_over_floors() -> None:
    chosen = choose(site_of(TWO_FLOORS), FLAT, "bcd")
    assert sorted(chosen.landmarks.ids) == ["a", "b", "c", "d"]
    assert place_of(chosen.landmarks, "a") == (1, [1, 1])
    assert place_of(chosen.landmarks, "d") == (2, [4, 4])
    storeys = chosen.landmarks.storeys
    assert storeys is not None
    assert (storeys.own, storeys.number.tolist(), storeys.elevation_m.tolist()) == (1, [1, 2], [0.0, 5.0])


def test_one_such_landmark_needs_a_climb() -> None:
    assert choose(site_of(TWO_FLOORS), CLIMB, "bc").unused == ()
    flat = choose(site_of(TWO_FLOORS), FLAT, "bc")
    assert (flat.unused, flat.landmarks.ids) == (("c",), ("a", "b"))
    assert flat.landmarks.storeys is not None
    assert flat.landmarks.storeys.number.tolist() == [1]


def test_a_landmark_that_corrections_put_on_another_floor_needs_no_climb() -> None:
    camera, log = walked(FLAT, "bc")
    considered = candidate_landmarks(site_of(TWO_FLOORS), KEY.floor, log.ids)
    assert landmarks_of_session(considered, KEY, camera, log, ["c"]).unused == ()


def test_a_floor_that_the_walker_told_needs_neither_landmark_nor_climb() -> None:
    camera, log = walked(FLAT, "ab")
    told = replace(camera, told_floors=ToldFloors(camera.time_ns[[100]], np.array([2])))
    considered = candidate_landmarks(site_of(TWO_FLOORS), KEY.floor, log.ids, [2])
    chosen = landmarks_of_session(considered, KEY, told, log)
    assert sorted(chosen.landmarks.ids) == ["a", "b", "c", "d"]
    assert place_of(chosen.landmarks, "a") == (1, [1, 1])  # told when which floor was: no clash
    assert chosen.landmarks.storeys is not None
    assert chosen.landmarks.storeys.number.tolist() == [1, 2]


def test_a_landmark_of_another_floor_is_a_finding_of_its_own() -> None:
    chosen = choose(site_of(TWO_FLOORS), FLAT, "bcx")
    _, log = walked(FLAT, "bcx")
    found = {finding.kind: finding for finding in landmarks_without_position(log, chosen.landmarks, chosen.unused)}
    assert set(found) == {"landmark_of_other_floor", "landmark_without_position"}
    assert "landmark c was seen" in found["landmark_of_other_floor"].message
    assert "lift ride" in found["landmark_of_other_floor"].message
    assert "landmarks x were seen" in found["landmark_without_position"].message


def test_an_id_in_two_places_is_an_error_that_names_both() -> None:
    with pytest.raises(SessionError) as caught:
        choose(site_of(TWO_FLOORS), CLIMB, "abcd")
    message = str(caught.value)
    assert "landmark a" in message
    assert "floor 1 (floor_1/marker_dict.csv:2) and floor 2 (floor_2/marker_dict.csv:4)" in message
    assert "corrections.toml" in message


def test_where_nobody_surveyed_the_own_floor_other_floors_ids_say_nothing() -> None:
    chosen = choose(site_of([row for row in TWO_FLOORS if row[0] == 2]), CLIMB, "acd")
    assert (chosen.landmarks.ids, chosen.unused) == ((), ())


def test_an_id_whose_place_is_not_known_on_one_floor_is_ambiguous_too() -> None:
    rows = [(1, "a", 1.0, 1.0), (2, "a", np.nan, np.nan), (2, "c", 3, 3), (2, "d", 4, 4)]
    with pytest.raises(SessionError, match="landmark a"):
        choose(site_of(rows), FLAT, "acd")


def test_the_same_id_at_the_same_place_is_no_clash_and_the_own_floors_counts() -> None:
    rows: list[Row] = [(0, "a", 1, 1), (1, "a", 1, 1), (2, "a", 1, 1), (2, "c", 3, 3), (2, "d", 4, 4)]
    chosen = choose(site_of(rows), FLAT, "acd")
    assert sorted(chosen.landmarks.ids) == ["a", "c", "d"]
    assert place_of(chosen.landmarks, "a") == (1, [1, 1])


def test_a_clash_of_ids_that_were_not_seen_does_not_matter() -> None:
    assert "a" in choose(site_of(TWO_FLOORS), FLAT, "bcd").landmarks.index


@pytest.mark.parametrize("own_first", [True, False])
def test_a_climb_among_ids_that_two_floors_share_is_a_finding(own_first: bool) -> None:
    rows = [*TWO_FLOORS, (0, "b", 2.0, 2.0), (2, "b", 7.0, 7.0)]
    (finding,) = doubts(rows if own_first else rows[::-1], CLIMB, "xab")
    assert (finding.kind, finding.severity, finding.count) == ("ambiguous_floor", "warning", 2)
    line = {True: (2, 4), False: (8, 6)}[own_first]
    assert (
        f"landmark a hangs on floor 1 (floor_1/marker_dict.csv:{line[0]}) and elsewhere on floor 2 "
        f"(floor_2/marker_dict.csv:{line[1]})"
    ) in finding.message
    assert "up or down by 2.9 m" in finding.message
    assert "taken for floor 1's" in finding.message
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
