"""Durations and lengths of a walk, counted by hand.

What a walk met, as its result tells it.

Where a session's truth comes from, and what happens without it.

What landmarks lack is said in the strategy's own terms, and only where it mattered.
"""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.pipeline.labels.mapped import walk
from tests.quality.evaluation.maps import straight_walk
from tests.surveys import bytes_of, make_survey
from tests.walks import corridor_walk, log_of, to_acs
from vislam2tag.common.findings import Finding
from vislam2tag.core.placing import Candidate, Placing
from vislam2tag.core.status import Contradiction, EventKind, Status, TrackerEvent, counts_by_label
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Visit
from vislam2tag.core.transforms import Similarity2
from vislam2tag.estimation import smoother
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.labeling.results import PlacingRecord, SessionResult
from vislam2tag.labeling.tables import status_codes
from vislam2tag.pipeline.labels.findings import landmark_findings
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.labels.session_result import (
    TRUTH_FILE,
    contradiction_marks,
    distance_m,
    error_record,
    event_marks,
    frame_seconds,
    placing_record,
    scan_statistics,
    sigma_statistics,
    visit_marks,
    walk_statistics,
)
from vislam2tag.pipeline.run.selection import Selection
from vislam2tag.quality.evaluation.truth import CONTROL_POINTS
from vislam2tag.site.model import ControlPoints, Floor

OK, UNCERTAIN, LOST, INVALID = Status.OK, Status.UNCERTAIN, Status.TRACKING_LOST, Status.INVALID


def test_each_usable_frame_stands_for_the_time_to_the_next() -> None:
    camera, trajectory = walk(np.array([0.0, 0.5, 1.5, 4.0]), [OK, UNCERTAIN, LOST, OK])
    assert frame_seconds(camera, trajectory, 2.0) == {"ok": 0.5, "uncertain": 1.0, "tracking_lost": 2.5}
    assert counts_by_label(trajectory.status) == {"ok": 2, "tracking_lost": 1, "uncertain": 1}


def test_a_mapped_frame_stands_for_no_long_time() -> None:
    camera, trajectory = walk(np.array([0.0, 3.0, 4.0, 6.0, 7.0]), [OK, OK, INVALID, OK, OK])
    camera = replace(camera, status=np.array([0, 0, INVALID, 0, 0], dtype=np.int8))
    assert frame_seconds(camera, trajectory, 2.0) == {"ok": 1.0, "gap": 3.0, "invalid": 3.0}


def test_the_length_is_that_on_the_floor_where_it_is_mapped_and_the_trackers_elsewhere() -> None:
    camera, trajectory = walk(np.arange(8.0), [OK] * 4 + [LOST] * 4)
    trajectory.position_bcs[:4, 0] *= 1.1
    assert distance_m(camera, trajectory) == pytest.approx(3 * 1.1 + 4)


def test_a_walk_starts_at_its_first_frame_as_moments_of_corrections_do() -> None:
    camera, trajectory = walk(np.arange(4.0), [INVALID, INVALID, OK, OK])
    excluded = replace(camera, status=trajectory.status)
    found = walk_statistics(excluded, trajectory, 2.0)
    assert (found["start_ns"], found["duration_s"]) == (camera.time_ns[0], 1.0)
    nothing = replace(camera, status=np.full(4, INVALID, dtype=np.int8))
    assert walk_statistics(nothing, trajectory, 2.0)["start_ns"] is None


def test_how_sure_the_mapped_frames_are() -> None:
    _, trajectory = walk(np.arange(4.0), [OK, OK, UNCERTAIN, LOST], sigma_m=0.2)
    trajectory.covariance_bcs[2] = np.eye(2) * 4.0
    found = sigma_statistics(trajectory)
    assert found is not None
    assert (found.median_m, sum(found.frames.values())) == (0.2, 3)
    assert found.uncertain_share == pytest.approx(1 / 3, abs=1e-6)
    _, lost = walk(np.arange(2.0), [LOST, LOST])
    assert sigma_statistics(lost) is None


def test_how_a_walk_was_placed_on_its_plan() -> None:
    _, trajectory = walk(np.arange(4.0), [OK, OK, OK, OK])
    assert placing_record(trajectory) is None
    path = np.array([(1.234, 2.345), (3.0, 4.0)])
    candidates = (Candidate(0.61239, path, 0.3), Candidate(0.3, path + 1, 0.3))
    placing = Placing(
        way_m=123.456,
        misfit=0.12345,
        mirror=9.87,
        exchanged=8.76,
        floors=((2, 4.56),),
        labelled_share=0.123456,
        reason=Status.FITS_MIRROR,
        frame=(1, 3),
        candidates=candidates,
        best_tap=2,
    )
    record = placing_record(replace(trajectory, placing=placing))
    assert record is not None
    assert (record.labelled_share, record.reason, record.way_m) == (0.1235, "fits_mirror", 123.5)
    assert (record.misfit, record.mirror, record.exchanged, record.floors) == (0.123, 9.9, 8.8, {2: 4.6})
    assert (record.scale, record.scale_sigma) == (None, None)
    assert record.time_ns == trajectory.time_ns[[1, 3]].tolist()
    assert [one.weight for one in record.candidates] == [0.612, 0.3]
    assert record.candidates[0].points == [(1.23, 2.35), (3.0, 4.0)]
    assert record.best_tap_ns == trajectory.time_ns[2]
    alone = placing_record(replace(trajectory, placing=replace(placing, candidates=candidates[:1])))
    assert alone is not None
    assert alone.candidates == [], "one path is no choice"
    known = placing_record(replace(trajectory, placing=replace(placing, scale=1.01234, scale_sigma=0.00456)))
    assert known is not None
    assert (known.scale, known.scale_sigma) == (1.0123, 0.0046)
    assert PlacingRecord.model_validate_json(known.model_dump_json()) == known


def test_scans_and_statuses_of_a_table() -> None:
    table = pl.DataFrame(
        {
            "scan": [1, 1, 2, 3],
            "time_ns": [0, 0, 4 * 10**9, 8 * 10**9],
            "bssid": ["a", "b", "a", "a"],
            "repeated": [False, False, False, True],
            "status": ["gap", "ok", "ok", "duplicate"],
        }
    )
    assert list(counts_by_label(status_codes(table)).items()) == [("ok", 2), ("gap", 1), ("duplicate", 1)]
    found = scan_statistics(table)
    assert found is not None
    assert (found.scans, found.readings, found.repeated, found.access_points) == (3, 4, 1, 2)
    assert found.median_interval_s == 4.0
    assert scan_statistics(table.clear()) is None


FLOORS = np.array([1, 1, 2])


def test_marks_have_time_place_and_the_floor_where_it_is_another() -> None:
    _, trajectory = walk(np.arange(3.0), [Status.OK, Status.TRACKING_LOST, Status.OK])
    trajectory = replace(
        trajectory,
        visits=(Visit(0, "a", 0.12345), Visit(1, "", 0.0), Visit(2, "b", 1.0)),
        events=(
            TrackerEvent(EventKind.LOSS, 1, 0.5, reason="dark"),
            TrackerEvent(EventKind.BREAK, 2, 1.23456, 0.56789),
        ),
    )
    visits = visit_marks(replace(trajectory, floor=FLOORS), own=1)
    assert [(one.landmark, one.distance_m, one.position, one.floor) for one in visits] == [
        ("a", 0.123, (0.0, 10.0), None),
        ("", 0.0, None, None),
        ("b", 1.0, (2.0, 10.0), 2),
    ]
    assert [one.time_ns for one in visits] == trajectory.time_ns.tolist()
    assert all(one.floor is None for one in visit_marks(trajectory, own=1))
    loss, jump = event_marks(replace(trajectory, floor=FLOORS), own=1)
    assert (loss.turn_rad, loss.reason, loss.position, loss.floor) == (None, "dark", None, None)
    assert (jump.size_m, jump.turn_rad, jump.position, jump.floor) == (1.235, 0.5679, (2.0, 10.0), 2)


def test_a_contradiction_names_the_surveyed_place_of_its_landmark() -> None:
    _, trajectory = walk(np.arange(2.0), [Status.OK, Status.OK])
    unknown = np.full(2, np.nan)
    landmarks = Landmarks(
        ids=("a", "b"),
        floor=np.array([1, 2]),
        position_bcs=np.array([[1.0, 2.0], [3.004, 4.0]]),
        covariance_bcs=np.zeros((2, 2, 2)),
        z_m=unknown,
        heading_rad=unknown,
        heading_sigma_rad=unknown,
    )
    found = Contradiction("b", 0.98765, 0.1, (0.9, -0.4), 3)
    (mark,) = contradiction_marks(replace(trajectory, contradictions=(found,)), landmarks)
    assert (mark.floor, mark.landmark, mark.size_m, mark.passes) == (2, "b", 0.988, 3)
    assert (mark.surveyed_m, mark.offset_m) == ((3.0, 4.0), (0.9, -0.4))


def floor_with(points: ControlPoints) -> Floor:
    return Floor(3, "third", 20.0, 20.0, None, None, points)


POINTS = floor_with(ControlPoints(("0", "1"), np.array([[2.0, 0.5], [6.0, 0.0]])))
NO_POINTS = floor_with(ControlPoints((), np.empty((0, 2))))
PRESSES = np.array([3_000_000_000, 7_000_000_000])
NONE = PRESSES[:0]


def test_truth_comes_before_control_points(tmp_path: Path) -> None:
    (tmp_path / TRUTH_FILE).write_text("time_ns,x,y\n2000000000,1,3\n99000000000,0,0\n")
    record, findings = error_record(tmp_path, straight_walk(), PRESSES, POINTS)
    assert findings == []
    assert record is not None
    assert (record.sources, record.points, [row.sum_m for row in record.rows]) == ({TRUTH_FILE: 1}, 2, [3.0])


def test_presses_count_where_there_is_no_truth(tmp_path: Path) -> None:
    record, _ = error_record(tmp_path, straight_walk(), PRESSES, POINTS)
    assert record is not None
    assert (record.sources, record.points, [row.sum_m for row in record.rows]) == ({CONTROL_POINTS: 1}, 2, [0.5])


def test_presses_on_another_floor_say_nothing_of_this_ones_points(tmp_path: Path) -> None:
    walk = straight_walk()
    elsewhere = replace(walk, floor=np.where(walk.time_ns < 5_000_000_000, 4, 3))
    record, _ = error_record(tmp_path, elsewhere, PRESSES, POINTS)
    assert record is not None
    assert (record.points, [row.sum_m for row in record.rows]) == (1, [0.0])


@pytest.mark.parametrize(("presses", "points"), [(NONE, POINTS), (PRESSES, NO_POINTS)])
def test_without_either_nothing_is_known(tmp_path: Path, presses: np.ndarray, points: Floor) -> None:
    assert error_record(tmp_path, straight_walk(), presses, points) == (None, [])


def test_a_truth_that_is_none_is_a_finding_and_not_the_end(tmp_path: Path) -> None:
    (tmp_path / TRUTH_FILE).write_text("time;x;y\n1;2;3\n")
    record, (finding,) = error_record(tmp_path, straight_walk(), PRESSES, POINTS)
    assert (finding.kind, finding.file) == ("unreadable_truth", TRUTH_FILE)
    assert finding.message.startswith("expected a table with the header time_ns,x,y")
    assert record is not None
    assert record.sources == {CONTROL_POINTS: 1}


def test_truth_changes_errors_and_nothing_else(clean_survey: Path, clean_run: Path, tmp_path: Path) -> None:
    """Labels must not know it: without truth the tables keep their bytes; put back, the session is scored again."""
    survey = shutil.copytree(clean_survey, tmp_path / "survey")
    truths = {path: path.read_bytes() for path in survey.glob(f"floor_0/*/*/{TRUTH_FILE}")}
    for path in truths:
        path.unlink()
    only = Selection(floors=(0,))
    assert process(survey, tmp_path / "out", selection=only).errors is None
    labels = {name: digest for name, digest in bytes_of(tmp_path / "out").items() if name.endswith(".parquet")}
    assert labels
    assert labels.items() <= bytes_of(clean_run).items()
    for path, content in truths.items():
        path.write_bytes(content)
    errors = process(survey, tmp_path / "out", selection=only).errors
    assert errors is not None
    assert errors.sources == {TRUTH_FILE: len(truths)}


IN_LINE = {"a": (5.0, 0.5), "b": (15.0, 0.5), "c": (25.0, 0.5)}


def findings(strategy: str, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> list[Finding]:
    chosen = strategy_named(strategy, MappingSettings())
    trajectory = chosen.map(camera, log, landmarks)
    return landmark_findings(camera, log, landmarks, trajectory, 1.0, chosen.needs)


def test_an_affine_map_needs_three_landmarks_off_a_line() -> None:
    camera, log, landmarks, _ = corridor_walk(Similarity2.identity(), IN_LINE)
    (finding,) = findings("global-affine", camera, log, landmarks)
    assert finding.kind == "too_few_landmarks"
    assert (
        "sightings of three surveyed landmarks that are not on one line; visited within the radius: a, b, c"
        in finding.message
    )
    assert findings("global", camera, log, landmarks) == []


def test_a_mapped_walk_lacks_nothing_however_few_it_visited() -> None:
    camera, _, landmarks, truth = corridor_walk(Similarity2.identity(), {"a": (5.0, 0.5), "far": (15.0, 2.5)})
    seen = {
        name: to_acs(np.tile(landmarks.position_bcs[i], (len(truth), 1)), 1.4) for i, name in enumerate(landmarks.ids)
    }
    log = log_of(camera, {name: np.where(truth[:, :1] > 3, position, np.nan) for name, position in seen.items()})
    assert findings("global", camera, log, landmarks) == []
    assert [finding.kind for finding in findings("local", camera, log, landmarks)] == ["too_few_landmarks"]


def test_the_smoother_tells_what_a_walk_lacks_and_minds_no_height() -> None:
    camera, log, landmarks, _ = corridor_walk(Similarity2.identity(), IN_LINE)
    assert findings("smoother", camera, log, landmarks) == []
    log.position_acs[:, 1] += 3
    assert findings("smoother", camera, log, landmarks) == []
    for known in ([], [1]):
        (finding,) = findings("smoother", camera, log, landmarks.select(known))
        assert finding.kind == "too_few_landmarks"
        assert (
            "sightings of two surveyed landmarks half a metre apart, or of one with a surveyed heading"
            in finding.message
        )


def test_a_walk_whose_reweighting_does_not_converge_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    survey = make_survey(tmp_path / "survey", devices=("LG",), seconds=60)
    process(survey, tmp_path / "sure")
    monkeypatch.setattr(smoother, "MOST_ROUNDS", 1)
    monkeypatch.setattr(smoother, "CONVERGED_SIGMAS", 1e-9)
    process(survey, tmp_path / "unsure")
    sure, unsure = (
        {finding.kind: finding.message for finding in SessionResult.model_validate_json(path.read_bytes()).findings}
        for name in ("sure", "unsure")
        for path in (tmp_path / name / "sessions").glob("*.json")
    )
    assert "not_converged" not in sure
    assert re.search(r"path \(about [0-9.e-]+ standard deviations from its limit\)", unsure["not_converged"])
