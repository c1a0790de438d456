"""At which control point a press was made: by its label, and by written routes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.quality.evaluation.press_identity import ROUTE_FILE, identify_presses, read_route

PLACES = np.array([[0.0, 0.0], [6.0, 0.0], [12.0, 0.0], [12.0, 6.0], [6.0, 8.0], [0.0, 7.0]])


def identified(labels: FloatArray, points: FloatArray, route: IntArray | None = None) -> list[int]:
    time_ns = np.arange(len(labels), dtype=np.int64) * 6_000_000_000
    found, _ = identify_presses(time_ns, labels, np.full(len(labels), np.nan), points, route)
    return [int(point) for point in found]


def test_good_labels_tell_their_points_in_any_order() -> None:
    order = [2, 1, 0, 5, 4, 1, 2, 3]
    assert identified(PLACES[order] + 0.4, PLACES) == order


def test_a_walk_that_lies_aside_finds_its_points_together() -> None:
    # 3.4 m to the right: for four of the points another one is nearer.
    order = [0, 1, 2, 3, 4, 5, 0]
    labels = PLACES[order] + (3.4, 0.0)
    nearest = np.linalg.norm(labels[:, None] - PLACES, axis=2).argmin(axis=1)
    assert (nearest != order).any()
    assert identified(labels, PLACES) == order


def test_labels_in_the_middle_are_ambiguous() -> None:
    points = np.array([[0.0, 1.0], [0.0, -1.0], [20.0, 0.0]])
    assert identified(np.array([[0.0, 0.05], [20.1, 0.0]]), points) == [-1, 2]


def test_a_press_without_a_label_is_told_by_the_route_alone() -> None:
    labels = PLACES[:4].copy()
    labels[2] = np.nan
    assert identified(labels, PLACES) == [0, 1, -1, 3]
    assert identified(labels, PLACES, np.arange(4)) == [0, 1, 2, 3]


def test_a_route_tells_points_that_stand_together() -> None:
    points = np.array([[0.0, 0.0], [5.0, 0.4], [5.0, -0.4], [10.0, 0.0]])
    labels = np.array([[0.1, 0.0], [5.0, 0.05], [10.2, 0.0]])
    assert identified(labels, points)[1] == -1
    assert identified(labels, points, np.array([0, 2, 3])) == [0, 2, 3]


def test_missing_and_double_presses_along_a_route() -> None:
    route = np.array([0, 1, 2, 3, 4, 5, 0, 1])
    order = [0, 1, 1, 2, 4, 5, 0, 1]
    assert identified(PLACES[order] + 0.3, PLACES, route) == order


def test_a_single_point_and_no_press() -> None:
    assert identified(np.array([[0.2, 0.0], [0.1, 0.1]]), PLACES[:1]) == [0, 0]
    assert identified(np.empty((0, 2)), PLACES) == []


def test_an_uncertain_label_is_clear_no_longer() -> None:
    time_ns = np.zeros(1, dtype=np.int64)
    label, points = np.array([[1.5, 0.0]]), PLACES[:2]
    sure, sure_probability = identify_presses(time_ns, label, np.array([0.1]), points)
    unsure, unsure_probability = identify_presses(time_ns, label, np.array([4.0]), points)
    assert (sure[0], unsure[0]) == (0, -1)
    assert 0.5 < unsure_probability[0] < sure_probability[0] <= 1


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1), st.floats(-np.pi, np.pi), st.floats(-1e4, 1e4))
def test_identity_does_not_depend_on_the_frame(seed: int, turn: float, shift: float) -> None:
    rng = np.random.default_rng(seed)
    order = rng.integers(0, len(PLACES), 10)
    labels = PLACES[order] + rng.normal(0, 1.5, (10, 2))
    matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    time_ns, unknown = np.arange(10, dtype=np.int64) * 6_000_000_000, np.full(10, np.nan)
    _, plain = identify_presses(time_ns, labels, unknown, PLACES)
    _, moved = identify_presses(time_ns, labels @ matrix.T + shift, unknown, PLACES @ matrix.T + shift)
    assert moved == pytest.approx(plain, abs=1e-6)


def test_stated_probabilities_come_true() -> None:
    rng = np.random.default_rng(1)
    right, stated = [], []
    for _ in range(150):
        order = rng.integers(0, len(PLACES), 8)
        labels = PLACES[order] + rng.normal(0, 2.0, (8, 2))
        found, probability = identify_presses(np.arange(8) * 6_000_000_000, labels, np.full(8, 2.0), PLACES)
        clear = found >= 0
        right += (found == order)[clear].tolist()
        stated += probability[clear].tolist()
    assert len(right) > 300
    assert np.mean(right) == pytest.approx(np.mean(stated), abs=0.05)


IDS = ("0", "1", "2")


@pytest.fixture
def session(tmp_path: Path) -> Path:
    folder = tmp_path / "floor_1" / "LG" / "a"
    folder.mkdir(parents=True)
    return folder


def test_the_sessions_route_counts_before_the_floors(tmp_path: Path, session: Path) -> None:
    assert read_route(tmp_path, session, IDS) is None
    (tmp_path / "floor_1" / ROUTE_FILE).write_text("point\n0\n1\n")
    found = read_route(tmp_path, session, IDS)
    assert found is not None
    assert found.tolist() == [0, 1]
    (session / ROUTE_FILE).write_text("\ufeffPoint\n2\n\n1\n2\n")
    found = read_route(tmp_path, session, IDS)
    assert found is not None
    assert found.tolist() == [2, 1, 2]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "expected the header 'point'"),
        ("0\n1\n", "expected the header 'point'"),
        ("point\n", "expected the header 'point'"),
        (
            "point\n0\n7\n",
            r"route\.csv:3: there is no control point '7' on this floor: refmarker.csv has 3 ids \(0, 1, 2\)",
        ),
    ],
)
def test_a_wrong_route_is_refused(tmp_path: Path, session: Path, content: str, message: str) -> None:
    (session / ROUTE_FILE).write_text(content)
    with pytest.raises(SurveyError, match=message):
        read_route(tmp_path, session, IDS)
