"""A session as every command sees it: read, corrected, with its landmarks in its own frame."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.sessions import phone_raw
from tests.sessions.raw import FRAMES, START_NS, clean_files, sensor_line, write_session
from tests.surveys import make_survey
from tests.walks import landmarks_at
from vislam2tag.common.errors import SessionError
from vislam2tag.core.context import PlacingHints, TrackerState
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Landmarks
from vislam2tag.core.transforms import Similarity2
from vislam2tag.sessions.prepared import PreparedSession, SessionTask, prepared_session, prepared_track, press_findings
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.site.corrections.file import Corrections
from vislam2tag.site.model import ControlPoints, Floor, Site
from vislam2tag.site.walkable.plan_costs import plan_costs


def marks() -> Landmarks:
    """Landmark 10 hangs on floor 1, landmark 7 on floor 2."""
    return replace(landmarks_at({"10": (1.1, 2.2), "7": (3.3, 4.4)}), floor=np.array([1, 2]))


def task(
    folder: Path, corrections: Corrections | None = None, files: dict[str, list[str]] | None = None
) -> SessionTask:
    """The clean session on floor 1 of a site whose floor 2 has a frame of its own."""
    turned = Similarity2(1j, 5 + 0j)
    floors = tuple(
        Floor(number, "", None, None, None, None, ControlPoints((), np.empty((0, 2))), site_T_bcs=frame)
        for number, frame in ((1, turned), (2, Similarity2.identity()))
    )
    ref = write_session(folder / "floor_1" / "LG" / "walk", files or clean_files())
    return SessionTask(ref, Site(floors, marks()), corrections or Corrections())


def with_sections(prepared: PreparedSession, later_from: int) -> PreparedSession:
    """The tracker began anew at a frame."""
    count = len(prepared.session.camera.time_ns)
    part = (np.arange(count) >= later_from).astype(np.int64)
    state = TrackerState(np.ones(count, dtype=bool), part, ("NONE",), np.zeros(count, dtype=np.int64))
    camera = replace(prepared.session.camera, state=state)
    return replace(prepared, session=replace(prepared.session, camera=camera))


def test_session_and_landmarks_are_corrected_and_each_use_is_told(tmp_path: Path) -> None:
    corrections = Corrections.model_validate(
        {
            "move_landmark": ({"id": "10", "x": 9.0, "y": 8.0},),
            "exclude_landmark": ({"id": "7"},),
        }
    )
    prepared = prepared_session(task(tmp_path, corrections))
    assert prepared.session.landmarks.ids == ("10",)
    assert prepared.landmarks.position_bcs.tolist() == [[9.0, 8.0]]
    assert [use.split(" is ")[0] for use in prepared.corrections] == ["Landmark 10", "Landmark 7"]


def test_landmarks_of_the_own_floor_stay_to_the_last_digit_in_a_site_of_several_frames(tmp_path: Path) -> None:
    prepared = prepared_session(task(tmp_path))
    assert prepared.task.frames.keys() == {1, 2}
    assert prepared.landmarks.position_bcs[prepared.landmarks.index["10"]].tolist() == [1.1, 2.2]


def test_a_landmark_that_only_another_floor_has_is_not_used_and_is_a_finding(tmp_path: Path) -> None:
    prepared = prepared_session(task(tmp_path))
    assert prepared.unused == ("7",)
    assert "landmark_of_other_floor" in {finding.kind for finding in prepared.findings()}


def test_the_longest_section_is_taken_alone_and_keeps_the_landmarks(tmp_path: Path) -> None:
    prepared = with_sections(prepared_session(task(tmp_path)), later_from=20)
    longest = prepared.longest_section()
    usable = longest.session.camera.usable
    assert np.flatnonzero(usable).tolist() == list(range(20, FRAMES))
    assert longest.landmarks is prepared.landmarks


def test_a_session_of_one_frame_cannot_be_mapped(tmp_path: Path) -> None:
    files = clean_files() | {"poses.csv": clean_files()["poses.csv"][:1]}
    prepared = prepared_session(task(tmp_path, files=files))
    assert (prepared.session.camera.status == Status.OK).sum() == 1
    with pytest.raises(SessionError, match="fewer than 2 usable camera frames"):
        prepared.refuse_without_frames()
    with pytest.raises(SessionError, match="fewer than 2 usable camera frames"):
        prepared.longest_section()


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_survey(tmp_path_factory.mktemp("presses") / "survey", devices=("LG",), seconds=20.0)


def kinds(root: Path, presses: str | None, points: str | None) -> list[str]:
    opened = open_survey(root)
    folder = opened.sessions[0].folder
    for file, text in ((folder / "refMarker.csv", presses), (folder.parents[1] / "refmarker.csv", points)):
        file.unlink(missing_ok=True)
        if text is not None:
            file.write_text(text)
    opened = open_survey(root)
    session = read_session(opened.sessions[0])
    return [finding.kind for finding in press_findings(session, opened.site.floors[0])]


@pytest.mark.parametrize(
    ("presses", "points", "expected"),
    [
        (None, None, []),
        ("0; 5\n", "1.0,2.0\n", []),
        ("0; 5\n1; 6\n", None, ["missing_control_points"]),
        (None, "1.0,2.0\n", ["missing_file"]),
        ("", "1.0,2.0\n", []),
    ],
)
def test_one_without_the_other_is_a_finding(
    survey: Path, presses: str | None, points: str | None, expected: list[str]
) -> None:
    assert kinds(survey, presses, points) == expected


def same_track(task: SessionTask) -> bool:
    """Whether the shorter reading gives poses, landmarks and air pressure as the whole one does."""
    whole, track = prepared_session(task).session, prepared_track(task).session
    pressure, shorter = whole.camera.pressure, track.camera.pressure
    assert pressure is not None
    assert shorter is not None
    return (
        np.array_equal(whole.camera.position_acs, track.camera.position_acs)
        and np.array_equal(whole.landmarks.position_acs, track.landmarks.position_acs)
        and whole.landmarks.ids == track.landmarks.ids
        and np.array_equal(pressure.time_ns, shorter.time_ns)
        and np.array_equal(pressure.pressure_hpa, shorter.pressure_hpa)
        and not track.tables["wifi"].height
    )


def test_track_is_read_without_the_readings(tmp_path: Path) -> None:
    air = [f"{START_NS + number * 50_000_000 + 1}; PRESSURE; 99{number}.0; 0; 0; 0; 0; 0" for number in range(5)]
    of_floor = task(tmp_path, files={**clean_files(), "sensors.csv": [sensor_line(0), *air, sensor_line(300)]})
    assert same_track(of_floor)
    ref = phone_raw.write_session(tmp_path / "floor_1" / "S20" / phone_raw.NAME, phone_raw.clean_rows())
    assert same_track(replace(of_floor, ref=ref))


def test_session_without_poses_is_read_whole(tmp_path: Path) -> None:
    files = {name: lines for name, lines in clean_files().items() if name == "sensors.csv"}
    assert prepared_track(task(tmp_path, files=files)).session.tables["sensors"].height == 300


def test_a_session_with_poses_has_the_plans_of_its_building_and_what_others_say(tmp_path: Path) -> None:
    root = make_survey(tmp_path / "survey", floors=2, devices=("LG",), seconds=5.0)
    (root / "floor_1" / "floorplan.jpg").unlink()
    opened = open_survey(root)
    ref = next(one for one in opened.sessions if one.key.floor == 0)
    hints = PlacingHints(north_rad=1.0)
    camera = prepared_session(SessionTask(ref, opened.site, Corrections(), hints=hints)).session.camera
    assert [plan.number for plan in camera.plans] == [0]
    assert camera.plans[0].costs is plan_costs(opened.site.floor(0))
    assert camera.own_floor == 0
    assert camera.hints is hints
    other = next(one for one in opened.sessions if one.key.floor == 1)
    above = prepared_session(SessionTask(other, opened.site, Corrections())).session.camera
    assert ([plan.number for plan in above.plans], above.own_floor, above.hints) == ([0], 1, None)
    for name in ("poses.csv", "initPoses.csv"):
        (ref.folder / name).unlink()
    tapped = Corrections.model_validate({"set_tap": ({"session": ref.key.session, "at_s": 1.0, "x": 5.0, "y": 6.0},)})
    blind = prepared_session(SessionTask(ref, opened.site, tapped, hints=hints)).session.camera
    assert blind.without_poses
    assert (blind.plans, blind.hints) == ((), None)
