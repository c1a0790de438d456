"""The check of whole surveys: records, pages, floors, failures."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.surveys import bytes_of, make_survey
from vislam2tag.common.errors import OutputError, UsageError
from vislam2tag.labeling.settings import LabelSettings
from vislam2tag.pipeline.labels.check import CHECK_FILE, PAGE_FILE, check
from vislam2tag.pipeline.run.selection import Selection
from vislam2tag.quality.self_check_record import Fault, SessionCheck, SurveyCheck
from vislam2tag.settings import Settings

SHIFT_M = 1.0


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_survey(tmp_path_factory.mktemp("check") / "survey", floors=2, sessions=2, seconds=150, severity="mild")


@pytest.fixture(scope="module")
def found(survey: Path) -> SurveyCheck:
    return check(survey)


def with_shifted_landmark(survey: Path, into: Path, landmark: str) -> Path:
    """Copy a survey in which a landmark of floor 0 was measured wrongly along x."""
    shutil.copytree(survey, into)
    file = into / "floor_0" / "marker_dict.csv"
    header, *rows = file.read_text().splitlines()
    column = header.split(",").index("x")
    for i, row in enumerate(rows):
        cells = row.split(",")
        if cells[0] == landmark:
            cells[column] = str(float(cells[column]) + SHIFT_M)
        rows[i] = ",".join(cells)
    file.write_text("\n".join([header, *rows]) + "\n")
    return into


def most_seen(found: SurveyCheck) -> str:
    """The landmark of floor 0 that most sessions left out."""
    seen = [mark.landmark for session in found.sessions for mark in session.left_out if mark.floor == 0]
    names, counts = np.unique(seen, return_counts=True)
    return str(names[counts.argmax()])


def test_every_session_has_its_accuracy(found: SurveyCheck) -> None:
    assert [session.slug for session in found.sessions] == sorted(session.slug for session in found.sessions)
    assert len(found.sessions) == 8
    assert found.failed == 0
    for session in found.sessions:
        assert 0 < session.labelled <= session.frames
        assert len(session.left_out) <= session.landmarks
        assert session.low_m is not None
        assert session.high_m is not None
        assert session.estimated_m is not None
        assert session.low_m < session.estimated_m < session.high_m
        assert session.well_founded == (len(session.left_out) >= 3)


def test_good_landmarks_are_not_accused(found: SurveyCheck) -> None:
    assert [bad for bad in found.bad_landmarks if bad.fault is not Fault.DOUBT] == []


def test_each_floor_has_three_places_that_would_help(found: SurveyCheck) -> None:
    assert [floor.number for floor in found.floors] == [0, 1]
    for floor in found.floors:
        assert len(floor.places) == 3
        assert all(0 < place.gain_m < floor.expected_m for place in floor.places)
        assert floor.frames == sum(session.frames for session in found.sessions if session.floor == floor.number)


@pytest.mark.slow
def test_a_wrongly_surveyed_landmark_is_named_with_where_it_is(
    survey: Path, found: SurveyCheck, tmp_path: Path
) -> None:
    landmark = most_seen(found)
    wrong = check(with_shifted_landmark(survey, tmp_path / "wrong", landmark), selection=Selection(floors=(0,)))
    bad = {(bad.floor, bad.landmark): bad for bad in wrong.bad_landmarks}
    assert (0, landmark) in bad
    assert bad[0, landmark].offset_m == pytest.approx((-SHIFT_M, 0.0), abs=0.4)


@pytest.mark.slow
def test_files_are_the_same_however_many_workers(survey: Path, found: SurveyCheck, tmp_path: Path) -> None:
    one, two = tmp_path / "one", tmp_path / "deep" / "two"
    floor = Selection(floors=(1,))
    checked = check(survey, out=one, selection=floor)
    assert checked == check(survey, out=two, selection=floor, jobs=2)
    assert checked.sessions == [session for session in found.sessions if session.floor == 1]
    assert bytes_of(one) == bytes_of(two)
    assert set(bytes_of(one)) == {CHECK_FILE, PAGE_FILE}
    assert SurveyCheck.model_validate(json.loads((one / CHECK_FILE).read_text())) == checked


def test_sessions_are_reported_and_selected(survey: Path) -> None:
    seen: list[tuple[SessionCheck, int]] = []
    selection = Selection(floors=(1,), devices=("LG",))
    check(survey, selection=selection, progress=lambda session, total: seen.append((session, total)))
    assert [(session.floor, session.device, total) for session, total in seen] == [(1, "LG", 2)] * 2
    with pytest.raises(UsageError, match="--floor 7"):
        check(survey, selection=Selection(floors=(7,)))


@pytest.mark.slow
def test_a_session_that_cannot_be_read_is_told_and_the_others_go_on(survey: Path, tmp_path: Path) -> None:
    copy = tmp_path / "survey"
    shutil.copytree(survey, copy)
    folder = next(path for path in sorted((copy / "floor_0" / "LG").iterdir()) if path.is_dir())
    (folder / "poses.csv").write_text("")
    broken = check(copy, selection=Selection(floors=(0,)), out=tmp_path / "out")
    assert broken.failed == 1
    (error,) = (session.error for session in broken.sessions if session.error)
    assert folder.name in error
    assert error in json.loads((tmp_path / "out" / CHECK_FILE).read_text())["sessions"][0]["error"]


@pytest.mark.slow
def test_accuracy_is_that_of_labels_certain_enough(survey: Path) -> None:
    def labelled(limit_m: float) -> list[int]:
        settings = Settings(labels=LabelSettings(max_sigma_m=limit_m))
        return [session.labelled for session in check(survey, settings, selection=Selection((0,), ("LG",))).sessions]

    none, some, everything = labelled(0.001), labelled(0.08), labelled(float("inf"))
    assert none == [0, 0]
    assert all(0 < a < b for a, b in zip(some, everything, strict=True))


def test_output_among_the_raw_data_is_refused(survey: Path) -> None:
    with pytest.raises(OutputError, match="among the survey's sessions"):
        check(survey, out=survey / "floor_0" / "out")


def test_real_walks_are_as_good_as_estimated(real_walks: Path) -> None:
    found = check(real_walks)
    assert [len(session.left_out) for session in found.sessions] == [7, 9, 7]
    for session in found.sessions:
        assert session.estimated_m is not None
        assert 0.05 < session.estimated_m < 0.4
