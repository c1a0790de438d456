"""A survey of which few landmarks are measured: sessions reduced, joined, told."""

from __future__ import annotations

import csv
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.surveys import bytes_of, make_survey
from vislam2tag.common.errors import OutputError, SurveyError, UsageError
from vislam2tag.core.arrays import of_landmarks
from vislam2tag.core.tracks import Landmarks
from vislam2tag.pipeline.labels.landmark_results import (
    LandmarkRow,
    LandmarkSurvey,
    check_targets,
    landmark_file_text,
    landmark_survey,
    shared_errors,
    write_completed,
)
from vislam2tag.pipeline.labels.landmark_survey import JointSurvey, WalkedPasses, join_sessions, survey_landmarks
from vislam2tag.sessions.registry import open_survey
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import Climb
from vislam2tag.simulation.survey import simulate

SURVEYED = ("2", "5", "8")
Row = list[str]


@pytest.fixture(scope="module", name="survey")
def _survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six walks on one floor at default severity, 12 landmarks; only read."""
    return make_survey(tmp_path_factory.mktemp("landmarks") / "survey", sessions=3, seconds=120.0, severity="default")


@pytest.fixture(scope="module", name="truth")
def _truth(survey: Path) -> Landmarks:
    return open_survey(survey).site.landmarks


def rewritten(survey: Path, copy: Path, change: Callable[[Row], Row | None]) -> Path:
    """Copy a survey with other rows in its landmark file."""
    shutil.copytree(survey, copy)
    path = copy / "floor_0/marker_dict.csv"
    head, *rows = csv.reader(path.read_text().splitlines())
    kept = [new for row in rows if (new := change(row)) is not None]
    path.write_text("\n".join(",".join(row) for row in [head, *kept]) + "\n")
    return copy


def few(row: Row) -> Row:
    return row if row[0] in SURVEYED else [row[0], "", ""]


def rows_of(survey: LandmarkSurvey) -> dict[str, LandmarkRow]:
    return {row.landmark: row for row in survey.landmarks}


@pytest.fixture(scope="module", name="joint")
def _joint(survey: Path, tmp_path_factory: pytest.TempPathFactory) -> JointSurvey:
    return survey_landmarks(rewritten(survey, tmp_path_factory.mktemp("few") / "s", few))


@pytest.fixture(scope="module", name="result")
def _result(joint: JointSurvey) -> LandmarkSurvey:
    return landmark_survey(joint)


def misses(result: LandmarkSurvey, truth: Landmarks) -> dict[str, float]:
    """Distance of each estimated landmark from its true place, metres."""
    return {
        row.landmark: float(np.hypot(*(truth.position_bcs[truth.index[row.landmark]] - (row.x_m, row.y_m))))
        for row in result.landmarks
        if not row.surveyed and row.x_m is not None and row.y_m is not None
    }


def test_a_stretch_leads_from_one_known_landmark_to_the_next_or_to_an_end() -> None:
    passes = WalkedPasses(np.array([0, 1, 0, 2]), np.array([5.0, 20.0, 32.0, 90.0]), 100.0)
    assert passes.longest_stretch_m(np.array([True, True, True])) == 58.0
    assert passes.longest_stretch_m(np.array([False, False, True])) == 90.0
    assert passes.longest_stretch_m(np.array([True, False, False])) == 68.0
    assert passes.longest_stretch_m(np.zeros(3, dtype=np.bool_)) == 100.0


def test_all_landmarks_passed_get_a_position_near_the_truth(result: LandmarkSurvey, truth: Landmarks) -> None:
    off = misses(result, truth)
    rows = rows_of(result)
    assert set(off) == {row.landmark for row in result.landmarks if not row.surveyed and row.passes}
    assert len(off) >= 7
    assert np.mean(list(off.values())) < 0.4
    assert max(off[name] / (rows[name].sigma_m or 0) for name in off) < 5


def test_surveyed_landmarks_stay_and_agree_with_the_rest(result: LandmarkSurvey, truth: Landmarks) -> None:
    for name in SURVEYED:
        row = rows_of(result)[name]
        assert (row.x_m, row.y_m) == pytest.approx(truth.position_bcs[truth.index[name]].tolist())
        assert (row.surveyed, row.sigma_m) == (True, 0.02)
        assert row.discrepancy_m is not None
        assert row.discrepancy_sigma_m is not None
        assert row.discrepancy_m < 4 * row.discrepancy_sigma_m


def test_landmarks_in_no_file_take_part_and_are_told(survey: Path, truth: Landmarks, tmp_path: Path) -> None:
    place = rewritten(survey, tmp_path / "s", lambda row: row if row[0] in SURVEYED else None)
    result = landmark_survey(survey_landmarks(place))
    off = misses(result, truth)
    assert len(off) >= 7
    assert np.mean(list(off.values())) < 0.4
    assert all(row.note.startswith("not in any landmark file") for row in result.landmarks if row.landmark in off)
    assert all(row.floor == 0 for row in result.landmarks)


def test_a_landmark_surveyed_elsewhere_is_named(survey: Path, tmp_path: Path) -> None:
    def moved(row: Row) -> Row:
        return [row[0], str(float(row[1]) + 3), row[2]] if row[0] == "4" else row

    result = landmark_survey(survey_landmarks(rewritten(survey, tmp_path / "s", moved)))
    rows = rows_of(result)
    odd = result.references.odd[0]
    assert odd.culprit == "landmark 4 on floor 0"
    assert odd.references[0].size_m == pytest.approx(3, abs=0.5)
    assert "measure it again" in odd.summary
    assert {row.landmark for row in result.references.compared} >= set(rows)
    assert rows["4"].note == "contradicts the others: measure it again"
    assert rows["4"].discrepancy_m == pytest.approx(3, abs=0.5)
    assert sum("contradicts" in row.note for row in rows.values()) == 1


def test_without_enough_surveyed_landmarks_nothing_is_placed_and_the_cause_is_told(
    survey: Path, tmp_path: Path
) -> None:
    place = rewritten(survey, tmp_path / "s", lambda row: row if row[0] == "5" else [row[0], "", ""])
    result = landmark_survey(survey_landmarks(place))
    assert not any(session.used for session in result.sessions)
    assert all("not related to the survey" in session.note for session in result.sessions)
    others = [row for row in result.landmarks if not row.surveyed]
    assert {(row.x_m, row.sigma_m) for row in others} == {(None, None)}
    reasons = {"no walk observed it", "observed only by walks that are not related to the survey"}
    assert {row.note for row in others} <= reasons


def test_moved_by_corrections_for_one_session_is_another_place(survey: Path, tmp_path: Path, truth: Landmarks) -> None:
    place = rewritten(survey, tmp_path / "s", few)
    before = landmark_survey(survey_landmarks(place))
    session = open_survey(place).sessions[0].key.session
    (place / "corrections.toml").write_text(
        f'[[move_landmark]]\nid = "5"\nx = 1.0\ny = 2.0\nsession = "{session}"\ndevice = "LG"\n'
    )
    joint = survey_landmarks(place)
    assert [p.moved_to for p in joint.places if p.moved_to] in ([], [(1.0, 2.0)])
    result = landmark_survey(joint)
    assert [row.landmark for row in result.landmarks] == [row.landmark for row in before.landmarks]
    assert rows_of(result)["5"].x_m == rows_of(before)["5"].x_m


def test_sessions_come_in_any_order_and_from_any_number_of_processes(
    survey: Path, result: LandmarkSurvey, tmp_path: Path
) -> None:
    place = rewritten(survey, tmp_path / "s", few)
    joint = survey_landmarks(place, jobs=2)
    assert landmark_survey(joint).landmarks == result.landmarks
    again = join_sessions(joint.survey, joint.sessions[::-1], 0.02)
    assert landmark_survey(again).landmarks == result.landmarks


def test_an_unreadable_session_is_told_and_the_others_go_on(survey: Path, tmp_path: Path, truth: Landmarks) -> None:
    place = rewritten(survey, tmp_path / "s", few)
    poses = next(place.glob("floor_0/LG/*/poses.csv"))
    poses.unlink()
    poses.mkdir()
    result = landmark_survey(survey_landmarks(place))
    spoilt = [session for session in result.sessions if not session.used]
    assert [session.session for session in spoilt] == [poses.parent.name]
    assert spoilt[0].note
    assert np.mean(list(misses(result, truth).values())) < 0.5


def test_a_session_without_frames_is_told_as_such(survey: Path, tmp_path: Path) -> None:
    place = rewritten(survey, tmp_path / "s", few)
    next(place.glob("floor_0/LG/*/poses.csv")).write_text("")
    notes = [session.note for session in landmark_survey(survey_landmarks(place)).sessions if not session.used]
    assert len(notes) == 1
    assert "fewer than 2 usable camera frames" in notes[0]


def test_a_floor_without_sessions_is_a_usage_error(survey: Path) -> None:
    with pytest.raises(UsageError, match="--floor 7: the survey has no session with this floor; it has: 0"):
        survey_landmarks(survey, floors=(7,))


def test_the_file_is_read_back_as_it_was_written(result: LandmarkSurvey, survey: Path, tmp_path: Path) -> None:
    write_completed(result, tmp_path / "completed.csv")
    read = open_survey(survey, landmark_file=tmp_path / "completed.csv").site.landmarks
    assert read.ids == tuple(row.landmark for row in result.landmarks)
    for row, position, covariance, heading in zip(
        result.landmarks, read.position_bcs, read.covariance_bcs, read.heading_rad, strict=True
    ):
        if row.x_m is not None and row.sigma_m is not None:
            assert position.tolist() == [row.x_m, row.y_m]
            assert covariance[0, 0] == pytest.approx(row.sigma_m**2)
        else:
            assert np.isnan(position).all()
        assert (row.heading_rad is None) == np.isnan(heading)


def test_errors_that_landmarks_share_are_read_back_but_not_of_those_changed_since(
    joint: JointSurvey, survey: Path, tmp_path: Path
) -> None:
    shared = shared_errors(joint)
    assert shared is not None
    file = tmp_path / "completed.csv"
    write_completed(landmark_survey(joint), file, shared=shared)
    read = open_survey(survey, landmark_file=file).site.landmarks
    assert read.joint_covariance is not None
    rows = np.array([read.index[name] for name in shared.ids])
    assert np.allclose(of_landmarks(read.joint_covariance, rows), shared.covariance)
    one, other = (2 * read.index[name] for name in ("1", "12"))
    apart = np.sqrt(read.joint_covariance[one, one] * read.joint_covariance[other, other])
    assert abs(read.joint_covariance[one, other]) > 0.02 * apart

    lines = [re.sub(r"^1,[-.\d]+", "1,3.5", line) for line in file.read_text().splitlines()]
    file.write_text("\n".join(lines) + "\n")
    changed = open_survey(survey, landmark_file=file).site.landmarks
    assert changed.joint_covariance is not None
    assert not changed.joint_covariance[one, np.arange(len(changed.joint_covariance)) // 2 != one // 2].any()
    assert changed.covariance_bcs[one // 2][0, 0] < read.covariance_bcs[one // 2][0, 0]

    (tmp_path / "completed.covariance.parquet").write_bytes(b"no table")
    with pytest.raises(SurveyError, match=r"make completed\.csv again with vislam2tag survey-landmarks"):
        open_survey(survey, landmark_file=file)
    write_completed(landmark_survey(joint), file)
    assert open_survey(survey, landmark_file=file).site.landmarks.joint_covariance is None


def test_ids_with_commas_and_quotes_survive(tmp_path: Path, survey: Path) -> None:
    row = LandmarkRow(floor=0, landmark='a "b", c', surveyed=True, x_m=1, y_m=2, sigma_m=0.1, sessions=0, passes=0)
    text = landmark_file_text(LandmarkSurvey(version="", shift_m=0.1, landmarks=(row,), sessions=(), findings=()))
    (tmp_path / "c.csv").write_text(text)
    assert open_survey(survey, landmark_file=tmp_path / "c.csv").site.landmarks.ids == ('a "b", c',)


def test_both_files_are_written_or_none(result: LandmarkSurvey, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        write_completed(result, tmp_path / "completed.csv", tmp_path / "gone" / "report.json")
    assert bytes_of(tmp_path) == {}


def test_the_surveys_own_files_are_refused(survey: Path, tmp_path: Path) -> None:
    (tmp_path / "link.csv").symlink_to(survey / "floor_0/marker_dict.csv")
    for name in (survey / "floor_0/marker_dict.csv", survey / "floor_0/new.csv", tmp_path / "link.csv"):
        with pytest.raises(OutputError, match="this path is among the survey's own files"):
            check_targets(survey, tmp_path / "fine.csv", name)
    check_targets(survey, survey / "completed.csv")


def test_new_landmarks_belong_to_the_floor_where_walks_passed_them(tmp_path: Path) -> None:
    scenario = regular_survey(4, "mild", devices=("LG",), sessions=3, duration_s=240.0, climb=Climb.STAIRS)
    simulate(scenario, tmp_path / "s")
    truth = open_survey(tmp_path / "s").site.landmarks
    sizes = tmp_path / "s/floor_dimensions.csv"
    head, *rows = sizes.read_text().splitlines()
    sizes.write_text("\n".join([f"{head},elevation", *(f"{row},{3.6 * int(row[0])}" for row in rows)]) + "\n")
    for floor, surveyed in ((0, 4), (1, 2)):
        file = tmp_path / f"s/floor_{floor}/marker_dict.csv"
        file.write_text("\n".join(file.read_text().splitlines()[: surveyed + 1]) + "\n")
    result = landmark_survey(survey_landmarks(tmp_path / "s"))
    new = [row for row in result.landmarks if not row.surveyed]
    assert {row.floor for row in new} == {0, 1}
    assert all(row.floor == truth.floor[truth.index[row.landmark]] for row in new)
    assert max(misses(result, truth).values()) < 0.8
    heights = [row.z_m for row in new if row.z_m is not None]
    assert len(heights) == len(new)
    assert np.abs(np.array(heights) - 1.4).max() < 0.6
