from __future__ import annotations

from pathlib import Path

import pytest

from tests.locks import lock
from tests.site.site import write_survey
from vislam2tag.common.errors import SessionError
from vislam2tag.sessions.inspection import Inspection, inspect_survey
from vislam2tag.sessions.registry import hash_inputs, open_survey, read_session


def test_everything_of_a_survey_is_counted(tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    inspection = inspect_survey(write_survey(tmp_path), progress=lambda done, total: seen.append((done, total)))
    assert seen == [(0, 3), (1, 3), (2, 3), (3, 3)]
    one = inspection.floors[0]
    assert (one.landmarks, one.landmarks_unsurveyed, one.control_points, one.sessions) == (2, 0, 2, 2)
    assert one.plan == "floor_1/floorplan.jpg"
    session = inspection.sessions[0]
    assert (session.frames, session.usable_frames, session.sensor_rows, session.presses) == (60, 60, 300, 3)
    assert (session.wifi_scans, session.wifi_rows, session.scan_interval_s) == (4, 12, 0.2)
    assert (session.landmarks_seen, session.landmarks_surveyed) == (("10", "7"), 2)
    assert session.duration_s == 1.967
    assert session.frame_rate_hz == 30.0
    assert session.usable
    assert Inspection.model_validate_json(inspection.model_dump_json()) == inspection


def test_a_landmark_without_a_surveyed_position_is_a_finding(tmp_path: Path) -> None:
    write_survey(tmp_path, {"floor_4/marker_dict.csv": "id,x,y\n10,9,9\n7,,\n"})
    session = inspect_survey(tmp_path).sessions[2]
    assert (session.landmarks_seen, session.landmarks_surveyed) == (("10", "7"), 1)
    short, presses, finding = session.findings
    assert short.kind == "poses_not_judged"
    assert (finding.kind, finding.count) == ("landmark_without_position", 1)
    assert (presses.kind, presses.count) == ("missing_control_points", session.presses)
    assert finding.message.startswith("landmarks 7 were observed")


def test_ids_that_clash_over_the_floors_walked_fail_the_session(tmp_path: Path) -> None:
    write_survey(
        tmp_path, {"floor_4/marker_dict.csv": "id,x,y\n3,9,9\n", "floor_1/marker_dict.csv": "id,x,y\n10,1,1\n7,2,2\n"}
    )
    (tmp_path / "floor_2").mkdir()
    (tmp_path / "floor_2/marker_dict.csv").write_text("id,x,y\n10,5,5\n")
    sessions = inspect_survey(tmp_path).sessions
    assert [session.usable for session in sessions] == [True, True, False]
    assert "floor 1 (floor_1/marker_dict.csv:2) and floor 2 (floor_2/marker_dict.csv:2)" in str(sessions[2].error)


def test_a_locked_session_fails_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lock(monkeypatch, write_survey(tmp_path) / "floor_1/One Plus/walk")
    sessions = inspect_survey(tmp_path).sessions
    assert [session.usable for session in sessions] == [True, False, True]
    assert (sessions[1].format, sessions[1].error) == (
        "unknown",
        f"{tmp_path / 'floor_1/One Plus/walk'}: the folder cannot be opened; check its permissions",
    )


def test_a_session_locked_after_it_was_found_fails_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ref = open_survey(write_survey(tmp_path)).sessions[0]
    lock(monkeypatch, ref.folder)
    for read in (read_session, hash_inputs):
        with pytest.raises(SessionError, match=r"cannot be read: .*Permission denied"):
            read(ref)


def test_excluded_sessions_are_not_read_and_broken_ones_not_usable(tmp_path: Path) -> None:
    write_survey(tmp_path, {"corrections.toml": "[[exclude_session]]\nfloor = 4\n"})
    (tmp_path / "floor_4/LG/2022-01-14T16:35:30/poses.csv").unlink()
    (tmp_path / "floor_1/One Plus/walk/poses.csv").unlink()
    sessions = inspect_survey(tmp_path).sessions
    assert [(session.excluded, session.usable) for session in sessions] == [(False, True), (False, False), (True, True)]
    assert sessions[2].frames == 0
