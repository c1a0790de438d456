from __future__ import annotations

import csv
import io
import re

import numpy as np
import pytest

from tests.quality.evaluation.maps import errors_at_origin
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import LandmarkLog
from vislam2tag.quality.evaluation.paper import (
    PaperTable,
    PaperWalk,
    WalkErrors,
    csv_text,
    landmark_movement_m,
    latex_text,
    markdown_text,
    table_1,
    table_2,
    walks_csv,
)
from vislam2tag.site.model import SessionKey


def log_of(*landmarks: list[tuple[float, float]], lost: bool = False) -> LandmarkLog:
    """Landmarks with these positions in the plane, one a frame."""
    plane: FloatArray = np.array([place for places in landmarks for place in places]).reshape(-1, 2)
    index = np.repeat(np.arange(len(landmarks)), [len(places) for places in landmarks])
    frame = np.concatenate([np.arange(len(places)) for places in landmarks])
    position = np.column_stack((plane[:, 0], np.zeros(len(plane)), -plane[:, 1]))
    ids = tuple(str(i) for i in range(len(landmarks)))
    return LandmarkLog(ids, index, frame, position, np.zeros((len(plane), 4)), np.full(len(plane), lost))


def test_a_landmark_that_stays_does_not_move() -> None:
    assert landmark_movement_m(log_of([(1.0, 2.0)] * 5)) == 0


def test_each_landmark_counts_once_however_often_it_was_logged() -> None:
    still = [(0.0, 0.0)] * 50
    moved = [(0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (3.0, 4.0)]
    assert landmark_movement_m(log_of(still, moved)) == pytest.approx((0 + 5 / 4) / 2)


def test_lost_tracking_tells_nothing() -> None:
    assert np.isnan(landmark_movement_m(log_of([(0.0, 0.0), (9.0, 9.0)], lost=True)))


KEY = SessionKey(1, "LG_ref", "s")
NAMES = {"local": "Local", "smoother": "Smoother & Co"}


@pytest.fixture
def table() -> PaperTable:
    nothing = float("nan")
    walks = [
        WalkErrors(KEY, {"local": 0.25, "smoother": 0.125}, False),
        WalkErrors(KEY, {"local": 4.0, "smoother": nothing}, True),
    ]
    return table_1(walks, tuple(NAMES))


def test_rows_are_statistics_over_walks_beside_the_papers(table: PaperTable) -> None:
    cells = {(row.selection, row.metric, cell.strategy): cell for row in table.rows for cell in row.cells}
    assert cells["all trajectories", "mean", "local"].here_m == pytest.approx(2.125)
    assert cells["all trajectories", "maximum", "local"].paper_m == 4.51
    assert cells["non-faulty trajectories", "median", "local"].here_m == 0.25
    assert cells["non-faulty trajectories", "median", "local"].paper_m == 0.49
    assert cells["all trajectories", "mean", "smoother"].walks == 1
    assert cells["all trajectories", "mean", "smoother"].paper_m is None


def test_csv_has_a_line_for_each_figure(table: PaperTable) -> None:
    lines = list(csv.DictReader(io.StringIO(csv_text(table))))
    assert len(lines) == 2 * 3 * len(NAMES)
    assert lines[0] == {
        "trajectories": "all trajectories",
        "metric": "mean",
        "strategy": "local",
        "walks": "2",
        "here_m": "2.1250",
        "paper_m": "0.91",
    }
    assert lines[1]["paper_m"] == ""


def test_markdown_gives_the_paper_a_column_where_it_has_the_strategy(table: PaperTable) -> None:
    lines = markdown_text(table, NAMES).splitlines()
    assert lines[2] == "| trajectories | metric | Local | paper | Smoother & Co |"
    assert lines[4] == "| all trajectories (1 to 2 walks) | mean | 2.12 | 0.91 | 0.12 |"
    assert {line.count("|") for line in lines[2:]} == {6}


def test_latex_rows_have_as_many_cells_as_columns(table: PaperTable) -> None:
    text = latex_text(table, NAMES)
    columns = len(re.search(r"\\begin\{tabular\}\{(\w+)\}", text).group(1))  # type: ignore[union-attr]
    rows = [line for line in text.splitlines() if line.endswith(r"\\") and "multicolumn" not in line]
    assert {len(re.findall(r"(?<!\\)&", row)) + 1 for row in rows} == {columns}
    assert r"Smoother \& Co" in text
    assert text.count(r"\multirow{3}{*}") == 2


def test_no_walk_is_a_dash() -> None:
    (row, *_) = markdown_text(table_2([], tuple(NAMES)), NAMES).splitlines()[4:]
    assert row == "| all trajectories (0 walks) | mean | - | 0.73 | - |"


def test_walks_count_only_labels_that_are_sure() -> None:
    points = errors_at_origin(np.array([(0.1, 0.0), (0.3, 0.0), (9.0, 0.0)]), np.array([0.1, np.nan, 2.0]))
    walk = PaperWalk(KEY, {"smoother": points}, faulty=False, movement_m=0.5, max_sigma_m=0.5)
    assert walk.errors.error_m == {"smoother": pytest.approx(0.2)}
    (line,) = csv.DictReader(io.StringIO(walks_csv([walk])))
    assert (line["points"], line["labelled"], line["error_m"], line["truth"]) == ("3", "2", "0.2000", "control_points")
