"""Models are tried on walks left out: the best is chosen, two together where that gains, none beyond the budget."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.positioning.radio_world import radio_world
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.positioning import model_choice
from vislam2tag.positioning.model_choice import tried_models
from vislam2tag.positioning.models.combined import Combined, mean_positions
from vislam2tag.positioning.registry import model_named

WORLD = radio_world(seed=1, walks=5)


def test_the_best_is_chosen_and_the_table_says_why() -> None:
    trial = tried_models(WORLD, clock=lambda: 0.0, candidates=("knn", "weighted-knn"))
    assert {one.name for one in trial.tried} == {"knn", "weighted-knn", "combined"}
    allowed = 1.01 if trial.chosen.name == "combined" else 1.0
    assert trial.chosen.score_m <= allowed * min(one.score_m for one in trial.tried)
    assert trial.chosen.why.startswith("chosen")
    assert all(one.behind_m is not None and one.behind_m[0] <= one.behind_m[1] for one in trial.tried[1:])


@pytest.mark.parametrize(("allowed", "chosen"), [(-0.9, False), (9.0, True)])
def test_two_are_taken_together_where_they_err_hardly_more(
    monkeypatch: pytest.MonkeyPatch, allowed: float, chosen: bool
) -> None:
    monkeypatch.setattr(model_choice, "TOGETHER", allowed)
    trial = tried_models(WORLD, clock=lambda: 0.0, candidates=("knn", "weighted-knn"))
    assert (trial.chosen.name == "combined") == chosen
    best_m = min(one.score_m for one in trial.tried)
    assert any("better" in one.why for one in trial.tried[1:]) == (trial.chosen.score_m > best_m)


def test_what_would_take_too_long_is_left_out_but_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model_choice, "_PROBED_WITH", 20)
    seconds = iter(range(1000))
    trial = tried_models(WORLD, 1.0, clock=lambda: float(next(seconds)), candidates=("knn", "weighted-knn"))
    assert [(one.name, one.why) for one in trial.tried] == [
        ("knn", "chosen: the best"),
        ("weighted-knn", "not tried: longer than the time budget"),
    ]


def test_one_fingerprint_tells_nothing() -> None:
    scans, places = WORLD
    with pytest.raises(DatasetError, match="name one by --model"):
        tried_models((scans[:1], places[:1]))


def test_combined_is_the_mean_on_the_likeliest_storey_and_is_saved_whole() -> None:
    names = ("knn", "weighted-knn")
    model = Combined(models=names).fit(*WORLD)
    scans, _ = radio_world(seed=3)
    singles = [model_named(name).fit(*WORLD).predict(scans) for name in names]
    found = model.predict(scans)
    agree = singles[0].storey == singles[1].storey
    np.testing.assert_allclose(found.xy[agree], np.mean([one.xy for one in singles], axis=0)[agree])
    again = Combined(models=names)
    again.access_points_, again.storeys_ = model.access_points_, model.storeys_
    again.restore(model.arrays())
    np.testing.assert_array_equal(again.predict(scans).xy, found.xy)
    assert model.stated_params()["settings"] == [part.get_params() for part in model.parts_]
    with pytest.raises(UsageError, match="give at most one"):
        Combined(models=names, settings=({}, {}, {})).fit(*WORLD)
    with pytest.raises(UsageError, match="none that is combined itself"):
        Combined(models=("combined",)).fit(*WORLD)


def test_where_models_disagree_about_the_storey_the_likelier_ones_place_counts() -> None:
    scans, _ = radio_world(seed=3)
    sure = model_named("knn").fit(*WORLD).predict(scans)
    storey = (sure.storey + 1) % len(sure.storeys)
    unsure = replace(
        sure, storey=storey, storey_probability=np.full_like(sure.storey_probability, 1 / 3), xy=sure.xy + 9
    )
    found = mean_positions([sure, unsure])
    np.testing.assert_array_equal(found.storey, sure.storey)
    np.testing.assert_allclose(found.xy, sure.xy)
