"""What a benchmark finds over seeds, the tables of it, and the model that it recommends."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.positioning.benchmark import ALL, FIGURES, BenchmarkRow, RunRecord, RunTime, benchmark_rows, interval
from vislam2tag.positioning.benchmark_tables import (
    best_models,
    figure_text,
    latex_text,
    model_times,
    paired_interval,
    rows_csv,
    table_4,
    times_csv,
)
from vislam2tag.positioning.model_scores import ErrorQuantiles, Score
from vislam2tag.quality.evaluation.record import FigureWithInterval


def record(model: str, fold: str, seed: int | None, mean_m: float | None, split: str = "device") -> RunRecord:
    plane = ErrorQuantiles(scans=10, mean_m=mean_m, median_m=mean_m)
    score = Score(
        scans=10,
        answered=1.0,
        floor_hit=0.9,
        building_hit=1.0,
        plane=plane,
        plane_on_floor=plane,
        space=ErrorQuantiles(scans=0),
        ipin_m=mean_m,
        inside_68=0.7,
        inside_95=None,
    )
    return RunRecord(
        key="",
        model=model,
        parameters={},
        split=split,
        fold=fold,
        seed=seed,
        train_scans=20,
        access_points=5,
        score=score,
        versions={},
    )


def row_of(rows: list[BenchmarkRow], model: str, fold: str) -> BenchmarkRow:
    (row,) = (row for row in rows if (row.model, row.fold) == (model, fold))
    return row


def test_folds_count_the_same_and_seeds_give_the_interval() -> None:
    means = {("LG", 0): 1.0, ("LG", 1): 2.0, ("S20", 0): 3.0, ("S20", 1): 6.0}
    rows = benchmark_rows([record("net", fold, seed, value) for (fold, seed), value in means.items()])
    assert [row.fold for row in rows] == [ALL, "LG", "S20"]
    whole = row_of(rows, "net", ALL)
    assert (whole.runs, whole.test_scans) == (2, 20)
    figure = whole.figures["mean_m"]
    assert figure.value == 3.0
    half = 12.7062 * np.std([2.0, 4.0], ddof=1) / np.sqrt(2)
    assert figure.low == pytest.approx(3 - half, abs=1e-3)
    assert figure.high == pytest.approx(3 + half, abs=1e-3)
    assert whole.figures["inside_95"].value is None


def test_a_model_without_seeds_has_no_interval() -> None:
    (row,) = benchmark_rows([record("weighted-knn", "official", None, 2.5)])
    assert (row.runs, row.figures["mean_m"].value, row.figures["mean_m"].low) == (1, 2.5, None)


def test_a_model_that_failed_on_a_fold_has_no_row_over_all() -> None:
    rows = benchmark_rows([record("a", "LG", None, 1.0), record("a", "S20", None, 1.0), record("b", "LG", None, 1.0)])
    assert [(row.model, row.fold) for row in rows] == [("a", ALL), ("a", "LG"), ("b", "LG"), ("a", "S20")]


def test_a_figure_is_unknown_where_one_run_does_not_know_it() -> None:
    assert interval([1.0, None]).value is None
    assert interval([]).value is None


def test_intervals_of_shares_end_where_shares_end() -> None:
    assert interval([0.99, 1.0], share=True).high == 1.0
    assert interval([0.99, 1.0]).high == pytest.approx(1.0585, abs=1e-3)


@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=8))
def test_intervals_hold_their_mean(values: list[float]) -> None:
    figure = interval(values)
    assert figure.value is not None
    assert figure.low is not None
    assert figure.high is not None
    assert figure.low - 1e-5 <= figure.value <= figure.high + 1e-5


def test_times_are_ratios_to_nearest_neighbours() -> None:
    runs = [
        (record("weighted-knn", "LG", None, 1.0), RunTime(fit_s=2.0, predict_s=0.02)),
        (record("net", "LG", 0, 1.0), RunTime(fit_s=6.0, predict_s=0.02)),
    ]
    knn, net = model_times(runs)
    assert (knn.fit_ratio, net.fit_ratio, net.predict_ms) == (1.0, 3.0, 2.0)
    assert model_times(runs[1:])[0].fit_ratio is None
    assert times_csv([net]) == "model,fit_s,predict_ms,fit_ratio,predict_ratio\nnet,6.0,2.0,3.0,1.0\n"


def test_tables_as_text() -> None:
    rows = benchmark_rows([record("m_1", "LG", seed, 1.0 + seed) for seed in (0, 1)])
    head, line = rows_csv(rows).splitlines()
    cells = dict(zip(head.split(","), line.split(","), strict=True))
    assert (cells["model"], cells["mean_m"], cells["inside_95"]) == ("m_1", "1.5", "")
    assert len(cells) == 5 + 3 * len(FIGURES)
    text = latex_text(rows)
    assert "LG & m\\_1 & 90.0 [90.0, 90.0]\\,\\% & 1.50 [-4.85, 7.85]" in text
    assert text.count("\\\\") == 2
    assert figure_text("mean_m", rows[0].figures["mean_m"]) == "1.50 [-4.85 to 7.85]"
    assert figure_text("inside_95", rows[0].figures["inside_95"]) == "-"


def test_table_4_stands_beside_the_papers_numbers() -> None:
    rows = benchmark_rows(
        [
            record("multi-cel", "LG", 0, 2.6),
            record("multi-cel", "Pixel", 0, 3.0),
            record("multi-cel", "test", 0, 2.1, split="random"),
            record("weighted-knn", "test", None, 3.0, split="random"),
        ]
    )
    texts = table_4(rows).texts()
    assert texts["csv"].splitlines()[1:] == [
        "random 30 %,multi-cel,0.9,2.1,2.1,0.992,2.08,1.52",
        "random 30 %,weighted-knn,0.9,3,3,,,",
        "LG,multi-cel,0.9,2.6,2.6,0.992,2.59,1.71",
        "Pixel,multi-cel,0.9,3,3,,,",
    ]
    assert "| LG | multi-cel | 0.900 | 0.992 | 2.60 | 2.59 | 2.60 | 1.71 |" in texts["md"]
    assert texts["tex"].count("\\midrule") == 3
    assert "random 30 \\% & multi-cel & 0.900 & 0.992" in texts["tex"]


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
