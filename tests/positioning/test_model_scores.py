"""Figures of positions against hand-made truth.

Models are tried on walks left out: the best is chosen, and none is tried beyond the budget.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.positioning.radio_world import radio_world
from vislam2tag.common.errors import DatasetError
from vislam2tag.datasets.model import Storey
from vislam2tag.positioning import model_scores
from vislam2tag.positioning.model_scores import score, tried_models
from vislam2tag.positioning.places import Positions, ScanPlaces

STOREYS = (Storey("A", 0), Storey("A", 1), Storey("A", 3), Storey("B", 0))


def truth(storey: list[int], xy: list[list[float]]) -> ScanPlaces:
    n = len(storey)
    return ScanPlaces(STOREYS, np.array(storey), np.array(xy, dtype=float), np.full(n, 1.0), np.full(n, 0.1))


def positions(storey: list[int], xy: list[list[float]], radius: float = 2.0, z: float = 1.0) -> Positions:
    n = len(storey)
    found = Positions(
        STOREYS, np.array(storey), np.array(xy, dtype=float), np.full(n, z), np.eye(4)[np.maximum(storey, 0)],
        np.full(n, radius), np.full(n, 2 * radius),
    )  # fmt: skip
    return found.without(np.array(storey) < 0)


def test_errors_hits_and_penalties() -> None:
    true = truth([0, 0, 1, 0, 0], [[0, 0], [0, 0], [0, 0], [0, 0], [0, 0]])
    found = positions([0, 1, 2, 3, -1], [[3, 4], [1, 0], [0, 1], [0, 0], [9, 9]])
    result = score(found, true)
    assert result.scans == 5
    assert result.answered == pytest.approx(0.8)
    assert result.floor_hit == pytest.approx(1 / 4)
    assert result.building_hit == pytest.approx(3 / 4)
    assert result.plane.mean_m == pytest.approx(7 / 4)
    assert result.plane_on_floor.scans == 1
    assert result.plane_on_floor.max_m == pytest.approx(5)
    penalised = [5, 1 + 15, 1 + 30, 50]
    assert result.ipin_m == pytest.approx(np.quantile(penalised, 0.75))
    assert result.inside_68 == pytest.approx(3 / 4)
    assert result.inside_95 == pytest.approx(3 / 4)


def test_error_in_space_counts_height() -> None:
    result = score(positions([0], [[3, 0]], z=5.0), truth([0], [[0, 0]]))
    assert result.space.mean_m == pytest.approx(5.0)
    assert score(positions([0], [[3, 0]], z=np.nan), truth([0], [[0, 0]])).space.mean_m is None


def test_nothing_answered_has_no_figures() -> None:
    result = score(positions([-1], [[0, 0]]), truth([0], [[0, 0]]))
    assert (result.answered, result.floor_hit, result.ipin_m, result.plane.mean_m) == (0.0, None, None, None)


def test_other_storeys_are_refused() -> None:
    other = ScanPlaces((Storey("A", 0),), np.array([0]), np.zeros((1, 2)), np.zeros(1), np.zeros(1))
    with pytest.raises(ValueError, match="have different storeys"):
        score(positions([0], [[0, 0]]), other)


WORLD = radio_world(seed=1, walks=5)


def test_the_best_is_chosen_and_the_table_says_why() -> None:
    trial = tried_models(WORLD, clock=lambda: 0.0, candidates=("weighted-knn", "local-kriging"))
    assert {one.name for one in trial.tried} == {"local-kriging", "weighted-knn"}
    assert trial.chosen.score_m == min(one.score_m for one in trial.tried)
    assert trial.chosen.why == "chosen: the best"
    assert trial.tried[1].why.endswith("% worse")
    assert all(one.behind_m is not None and one.behind_m[0] <= one.behind_m[1] for one in trial.tried[1:])


def test_what_would_take_too_long_is_left_out_but_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model_scores, "_PROBED_WITH", 20)
    seconds = iter(range(1000))
    trial = tried_models(WORLD, 1.0, clock=lambda: float(next(seconds)), candidates=("weighted-knn", "local-kriging"))
    assert [(one.name, one.why) for one in trial.tried] == [
        ("weighted-knn", "chosen: the best"),
        ("local-kriging", "not tried: takes longer than the time budget"),
    ]


def test_one_fingerprint_tells_nothing() -> None:
    scans, places = WORLD
    with pytest.raises(DatasetError, match="choose one with --model"):
        tried_models((scans[:1], places[:1]))
