"""Which surveys are planned, and that their sessions do not depend on one another."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.simulation.scenario import paper_evaluation, regular_survey
from vislam2tag.simulation.settings import Climb, severity_level
from vislam2tag.simulation.survey import walk_and_track


def test_papers_evaluation() -> None:
    scenario = paper_evaluation(1)
    pressed = [session for session in scenario.sessions if session.presses]
    tracked = [session for session in scenario.sessions if session.total_station]
    assert len(pressed) == 24
    assert {(s.key.floor, s.key.device) for s in pressed} == {
        (floor, device) for floor in (1, 4) for device in ("LG_ref", "OnePlus_ref")
    }
    assert {(s.key.floor, s.key.device) for s in tracked} == {(4, "LG_tachy"), (4, "OnePlus_tachy")}
    assert np.median([s.duration_s for s in pressed]) == pytest.approx(180, abs=20)
    assert max(s.duration_s for s in pressed) == 900
    assert sorted(int(s.fault_quantile * 24) for s in pressed) == list(range(24))
    assert len({s.key for s in scenario.sessions}) == len(scenario.sessions)


def test_station_landmarks_stand_in_one_corridor() -> None:
    floor = paper_evaluation(3).building.floor(4)
    ten, nine = (floor.landmark_position[floor.landmark_ids.index(name)] for name in ("10", "9"))
    assert abs(ten[1] - nine[1]) < 2.3
    assert abs(ten[0] - nine[0]) > 10


def test_a_misspelt_choice_is_refused() -> None:
    with pytest.raises(TypeError, match="presure"):
        regular_survey(1, presure=True)  # type: ignore[call-arg]


def test_walks_that_climb_need_another_floor() -> None:
    with pytest.raises(ValueError, match="two floors"):
        regular_survey(1, floors=(0,), climb=Climb.STAIRS)
    scenario = regular_survey(1, floors=(0, 1), climb=Climb.STAIRS)
    assert {session.climb for session in scenario.sessions} == {Climb.STAIRS}


def test_sessions_of_a_device_share_one_boot_clock() -> None:
    sessions = regular_survey(1, sessions=3).sessions
    for device in ("LG", "OnePlus"):
        own = [s for s in sessions if s.key.device == device]
        assert len({s.boot_unix_ns for s in own}) == 1
        assert all(s.start_ns > 0 for s in own)
        assert len({s.start_ns for s in own}) == len(own)


def test_more_sessions_change_no_other() -> None:
    small = regular_survey(5, floors=(0,), devices=("LG",), sessions=1, duration_s=30.0)
    large = regular_survey(5, floors=(0, 1), devices=("LG", "OnePlus"), sessions=2, duration_s=30.0)
    same = next(s for s in large.sessions if s.key == small.sessions[0].key)
    assert same == small.sessions[0]
    first, second = walk_and_track(small, small.sessions[0]), walk_and_track(large, same)
    assert first[0].position.tobytes() == second[0].position.tobytes()
    assert first[1].position_acs.tobytes() == second[1].position_acs.tobytes()


@pytest.mark.parametrize(("severity", "level"), [("none", 0.0), ("default", 1.0), ("1.5", 1.5), (0.25, 0.25)])
def test_severity_by_name_or_number(severity: str | float, level: float) -> None:
    assert severity_level(severity) == level


@pytest.mark.parametrize("severity", ["bad", -1, float("nan")])
def test_severity_that_cannot_be(severity: str | float) -> None:
    with pytest.raises(ValueError, match=r"severity|convert"):
        severity_level(severity)


def test_unknown_floor() -> None:
    with pytest.raises(KeyError):
        paper_evaluation(1).building.floor(7)
