"""Where a session's truth comes from, and what happens without it."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.quality.evaluation.maps import straight_walk
from tests.surveys import bytes_of
from vislam2tag.pipeline.labels.accuracy import TRUTH_FILE, error_record
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.run.selection import Selection
from vislam2tag.quality.evaluation.truth import CONTROL_POINTS
from vislam2tag.site.model import ControlPoints, Floor


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
