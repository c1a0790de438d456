"""Models are tried on walks left out: the best is chosen, and none is tried beyond the budget."""

from __future__ import annotations

import pytest

from tests.positioning.radio_world import radio_world
from vislam2tag.common.errors import DatasetError
from vislam2tag.positioning import model_choice
from vislam2tag.positioning.model_choice import tried_models

WORLD = radio_world(seed=1, walks=5)


def test_the_best_is_chosen_and_the_table_says_why() -> None:
    trial = tried_models(WORLD, clock=lambda: 0.0, candidates=("weighted-knn", "local-kriging"))
    assert {one.name for one in trial.tried} == {"local-kriging", "weighted-knn"}
    assert trial.chosen.score_m == min(one.score_m for one in trial.tried)
    assert trial.chosen.why == "chosen: the best"
    assert trial.tried[1].why.endswith("% worse")
    assert all(one.behind_m is not None and one.behind_m[0] <= one.behind_m[1] for one in trial.tried[1:])


def test_what_would_take_too_long_is_left_out_but_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model_choice, "_PROBED_WITH", 20)
    seconds = iter(range(1000))
    trial = tried_models(WORLD, 1.0, clock=lambda: float(next(seconds)), candidates=("weighted-knn", "local-kriging"))
    assert [(one.name, one.why) for one in trial.tried] == [
        ("weighted-knn", "chosen: the best"),
        ("local-kriging", "not tried: longer than the time budget"),
    ]


def test_one_fingerprint_tells_nothing() -> None:
    scans, places = WORLD
    with pytest.raises(DatasetError, match="name one by --model"):
        tried_models((scans[:1], places[:1]))
