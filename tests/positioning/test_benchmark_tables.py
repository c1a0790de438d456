"""The model that a benchmark recommends."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from vislam2tag.positioning.benchmark_record import ALL, BenchmarkRow
from vislam2tag.positioning.benchmark_tables import best_models, paired_interval
from vislam2tag.quality.evaluation.record import FigureWithInterval


def row(
    model: str, mean_m: float | None, floor_hit: float = 1.0, answered: float = 1.0, fold: str = ALL
) -> BenchmarkRow:
    figures = {"mean_m": mean_m, "floor_hit": floor_hit, "answered": answered}
    return BenchmarkRow(
        split="device",
        fold=fold,
        model=model,
        runs=1,
        test_scans=10,
        figures={name: FigureWithInterval(value=value) for name, value in figures.items()},
    )


def test_the_smallest_mean_over_all_folds_wins_and_the_next_is_named() -> None:
    rows = [row("weighted-knn", 3.0), row("trees", 2.0), row("net", None), row("weighted-knn", 0.5, fold="LG")]
    [best] = best_models(rows)
    assert (best.split, best.model, best.runner_up) == ("device", "trees", "weighted-knn")
    assert best.behind_m == pytest.approx(1.0)
    assert not best.alike


def test_who_answers_little_or_misses_floors_does_not_win() -> None:
    rows = [row("shy", 1.0, answered=0.5), row("flat", 1.5, floor_hit=0.8), row("sound", 2.0), row("near", 2.05)]
    [best] = best_models(rows)
    assert (best.model, best.runner_up, best.alike) == ("sound", "near", True)


def test_the_interval_is_of_the_same_scans_and_of_whole_walks() -> None:
    rng = np.random.default_rng(0)
    walk = np.arange(200) // 20
    hard = rng.exponential(10, 10)[walk]  # of both models alike
    walks = [f"walk {number}" for number in walk.tolist()]
    one = pl.DataFrame({"fold": "a", "scan_id": np.arange(200), "walk": walks, "error_m": hard})
    other = one.with_columns(error_m=pl.col("error_m") + 1 + pl.Series(rng.normal(0, 0.5, 10)[walk]))
    found = paired_interval(one, pl.concat([other, other]))  # two seeds
    assert found is not None
    assert 0.4 < found[0] < 1 < found[1] < 1.8
    unanswered = other.with_columns(error_m=pl.when(pl.col("walk") == "walk 0").then(None).otherwise("error_m"))
    assert paired_interval(one, unanswered) is not None
    assert paired_interval(one, other.filter(pl.col("walk").is_in(["walk 0", "walk 1"]))) is None
    [best] = best_models([row("weighted-knn", 3.0), row("trees", 2.0)], lambda *names: (len(names), 4.0))
    assert best.behind_interval_m == (3.0, 4.0)


def test_nothing_is_recommended_without_errors() -> None:
    assert best_models([]) == best_models([row("net", None)]) == []
