from __future__ import annotations

import csv
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.quality.evaluation.maps import errors_at_origin
from vislam2tag.core.arrays import FloatArray
from vislam2tag.quality.evaluation.metrics import (
    FIGURES,
    average,
    dense_csv,
    error_curve,
    figure_text,
    latex_text,
    points_within_sigma,
    retention,
    rows_csv,
    sessions_csv,
    strategy_errors,
    summarise,
    table_rows,
    truth_name,
)
from vislam2tag.quality.evaluation.record import (
    DenseRow,
    ErrorRow,
    FigureWithInterval,
    SessionEvaluation,
    StrategyErrors,
)


def test_summary() -> None:
    summary = summarise(np.array([1.0, 2.0, 3.0, np.nan]))
    assert (summary.count, summary.labelled_share, summary.mean_m) == (4, 0.75, 2.0)
    assert (summary.median_m, summary.p75_m, summary.p95_m, summary.max_m) == pytest.approx((2.0, 2.5, 2.9, 3.0))
    assert summary.rmse_m == pytest.approx((14 / 3) ** 0.5)
    nothing = summarise(np.array([np.nan]))
    assert nothing.labelled_share == 0
    assert np.isnan(nothing.mean_m)


def test_each_walk_counts_once() -> None:
    long, short, nothing = np.full(900, 1.0), np.array([3.0, np.nan]), np.array([np.nan])
    walks = average([summarise(errors) for errors in (long, short, nothing)])
    assert (walks.count, walks.mean_m, walks.max_m) == (903, 2.0, 2.0)
    assert walks.labelled_share == pytest.approx(0.5)
    assert np.isnan(average([]).mean_m)


def walk(errors: FloatArray, strategy: str = "local") -> StrategyErrors:
    """A walk along x whose labels lie so far to the left; NaN: not labelled."""
    label = np.column_stack((np.where(np.isnan(errors), np.nan, 0.0), errors))
    return strategy_errors(errors_at_origin(label), "", strategy)


def session(slug: str, *walks: StrategyErrors, **details: Any) -> SessionEvaluation:
    names: dict[str, Any] = {"floor": 1, "device": "LG", "session": slug, "faulty": False}
    return SessionEvaluation(slug=slug, measured=list(walks), **(names | details))


def row_of(rows: list[ErrorRow], **wanted: str) -> ErrorRow:
    wanted = {"group": "all", "selection": "all walks", "over": "walks"} | wanted
    [found] = [row for row in rows if all(getattr(row, name) == value for name, value in wanted.items())]
    return found


def test_a_walk_is_reduced_to_its_figures() -> None:
    one = walk(np.array([0.3, -0.1, np.nan, 0.2]))
    assert (one.points, one.labelled, sum(one.errors.values())) == (4, 3, 3)
    assert [one.mean_m, one.max_m, one.sum_m] == pytest.approx([0.2, 0.3, 0.6])
    assert [one.along_m, one.across_m, one.ahead_m] == pytest.approx([0, 0.2, 0])
    nothing = walk(np.array([np.nan]))
    assert (nothing.labelled, nothing.mean_m, nothing.along_m, nothing.errors) == (0, None, None, {})


def test_labels_that_are_not_sure_enough_are_none() -> None:
    one = errors_at_origin(np.ones((3, 2)), np.array([0.2, 0.6, np.nan]))
    assert points_within_sigma(one, 0.5).labelled.tolist() == [True, False, True]
    assert points_within_sigma(one, float("inf")).labelled.all()


def test_retention_is_counted_where_local_labels() -> None:
    local = np.array([True, True, False, False])
    assert retention(local, np.array([True, False, True, True])) == 0.5
    assert retention(np.zeros(4, dtype=np.bool_), local) is None


def test_over_walks_each_counts_once_and_over_points_each_point() -> None:
    rows = table_rows([session("a", walk(np.full(900, 1.0))), session("b", walk(np.array([4.0, np.nan])))])
    walks, points = row_of(rows), row_of(rows, over="points")
    assert (walks.mean_m.value, walks.max_m.value, walks.labelled.value) == (2.5, 4.0, 0.75)
    assert points.mean_m.value == pytest.approx((900 + 4) / 901, abs=1e-4)
    assert points.labelled.value == pytest.approx(901 / 902, abs=1e-4)
    assert points.rmse_m.value == pytest.approx(((900 + 16) / 901) ** 0.5, abs=1e-4)
    assert walks.mean_m.low is None


def test_errors_across_the_walk_and_ahead_are_averaged_where_the_direction_is_known() -> None:
    rows = table_rows([session("a", walk(np.array([1.0, -1.0, 1.0]))), session("b", walk(np.array([4.0])))])
    walks, points = row_of(rows), row_of(rows, over="points")
    assert (walks.across_m.value, points.across_m.value) == (2.5, 1.75)
    assert (walks.along_m.value, walks.ahead_m.value) == (0, 0)
    standing = walk(np.array([1.0])).model_copy(update={"headed": 0, "along_m": None, "across_m": None})
    assert row_of(table_rows([session("a", standing)]), over="points").across_m.value is None


def test_walks_without_faults_floors_and_devices_have_rows() -> None:
    good = session("a", walk(np.array([1.0])))
    bad = session("b", walk(np.array([3.0])), faulty=True, floor=2, device="OnePlus")
    rows = table_rows([good, bad])
    assert row_of(rows).mean_m.value == 2
    assert row_of(rows, selection="without faults").mean_m.value == 1
    assert row_of(rows, group="floor 2").mean_m.value == 3
    assert row_of(rows, group="OnePlus").mean_m.value == 3
    assert not [row for row in rows if row.group == "OnePlus" and row.selection == "without faults"]
    assert {row.group for row in table_rows([good])} == {"all"}


def test_a_strategy_that_labels_nothing_has_a_row_without_figures() -> None:
    row = row_of(table_rows([session("a", walk(np.array([np.nan, np.nan])))]))
    assert (row.walks, row.points, row.labelled.value, row.mean_m.value, row.max_m.value) == (0, 2, 0, None, None)


@given(st.lists(st.floats(0.002, 50), min_size=1, max_size=60))
def test_figures_over_points_are_those_of_the_points(errors: list[float]) -> None:
    half = len(errors) // 2
    parts = [np.array(errors[:half]), np.array(errors[half:])]
    row = row_of(table_rows([session(str(i), walk(part)) for i, part in enumerate(parts)]), over="points")
    exact = summarise(np.array(errors))
    assert row.mean_m.value == pytest.approx(exact.mean_m, abs=2e-4)
    assert row.rmse_m.value == pytest.approx(exact.rmse_m, abs=2e-4)
    assert row.max_m.value == pytest.approx(exact.max_m, abs=2e-4)
    # Half of the errors lie below the median, to a bin's width: a twelfth of its value.
    median = row.median_m.value
    assert median is not None
    assert np.mean(np.array(errors) < median / 1.1) <= 0.5 <= np.mean(np.array(errors) <= median * 1.1)


def test_quantiles_over_walks_are_numpys_also_with_unlabelled_walks() -> None:
    values = np.array([0.3, 0.1, np.nan, 0.9, 0.5, 0.2])
    row = row_of(table_rows([session(str(i), walk(np.array([value]))) for i, value in enumerate(values)]))
    exact = summarise(values)
    for name in FIGURES:
        figure = getattr(row, name)
        assert figure.value == pytest.approx(getattr(exact, name), abs=1e-4)
        assert (figure.low is None) == (name == "max_m")
        assert figure.low is None or figure.low <= figure.value <= figure.high


def test_intervals_hold_about_as_often_as_they_say() -> None:
    rng = np.random.default_rng(5)
    hits = 0
    for _ in range(60):
        means = rng.gamma(4.0, 0.1, 30)
        row = row_of(table_rows([session(str(i), walk(np.array([mean]))) for i, mean in enumerate(means)]))
        assert row.mean_m.low is not None
        assert row.mean_m.high is not None
        hits += row.mean_m.low <= 0.4 <= row.mean_m.high
    assert 51 <= hits <= 60


def test_a_walk_of_many_points_is_no_more_certain_than_one_of_few() -> None:
    def width(points: int) -> float:
        rng = np.random.default_rng(1)
        walks = [session(str(i), walk(np.full(points, error))) for i, error in enumerate(rng.uniform(0.1, 1, 12))]
        mean = row_of(table_rows(walks), over="points").mean_m
        assert mean.low is not None
        assert mean.high is not None
        return mean.high - mean.low

    assert width(500) == pytest.approx(width(5), rel=1e-6)


def test_the_curve_ends_at_the_share_labelled() -> None:
    curve = error_curve([walk(np.array([0.1, 0.2, np.nan, np.nan])), walk(np.array([3.0, 0.3]))])
    assert curve is not None
    assert curve.share[-1] == pytest.approx(4 / 6)
    assert curve.share[0] == 0
    assert np.interp(1.0, curve.error_m, curve.share) == pytest.approx(3 / 6)
    assert curve.low is None


def test_the_band_holds_the_curve() -> None:
    rng = np.random.default_rng(2)
    curve = error_curve([walk(rng.gamma(2.0, scale, 50)) for scale in rng.uniform(0.1, 1.0, 12)])
    assert curve is not None
    assert curve.low is not None
    assert curve.high is not None
    assert (curve.low <= curve.share + 1e-12).all()
    assert (curve.share <= curve.high + 1e-12).all()
    assert (curve.high - curve.low).max() > 0.1
    assert (np.diff(curve.low) >= -1e-12).all()


def test_without_any_label_there_is_no_curve() -> None:
    assert error_curve([walk(np.array([np.nan]))]) is None


SESSIONS = [session(str(i), walk(np.array([0.1 * i, 1.0]), "local_50%")) for i in range(6)]


def test_rows_have_their_bounds_beside_them() -> None:
    rows = table_rows(SESSIONS)
    [first, *_] = list(csv.DictReader(rows_csv(rows).splitlines()))
    mean = rows[0].mean_m
    assert (float(first["mean_m"]), float(first["mean_m_low"]), float(first["mean_m_high"])) == (
        mean.value,
        mean.low,
        mean.high,
    )
    assert (first["max_m_low"], first["over"], first["walks"]) == ("", "walks", "6")


def test_a_session_without_figures_has_a_line_that_says_why() -> None:
    failed = session("b").model_copy(update={"error": "no poses, none"})
    silent = session("c").model_copy(update={"missing": ["no presses"]})
    lines = list(csv.DictReader(sessions_csv([*SESSIONS[:1], failed, silent]).splitlines()))
    assert [line["session"] for line in lines] == ["0", "b", "c"]
    assert [line["error"] for line in lines] == ["", "no poses, none", "no presses"]
    assert (lines[0]["mean_m"], lines[1]["mean_m"]) == ("0.5", "")


def test_latex_escapes_names_and_has_a_line_for_each_selection() -> None:
    text = latex_text(table_rows(SESSIONS))
    assert "all walks & local\\_50\\% & 6 & 100\\,\\% & 0.62 [" in text
    assert text.count("\\midrule") == 2
    assert all(line.count("&") == 12 for line in text.splitlines() if line.endswith("\\\\"))


def test_dense_rows() -> None:
    row = DenseRow(strategy="local", what="speed", low=2.5, high=None, points=3, mean_m=0.5, labelled=1.0)
    assert dense_csv([row]).splitlines()[1] == "local,speed,2.5,,3,0.5,,1.0"


def test_figures_and_names_as_people_read_them() -> None:
    assert figure_text(FigureWithInterval(value=0.314, low=0.25, high=0.4)) == "0.31 [0.25 to 0.40]"
    assert figure_text(FigureWithInterval(value=None)) == "-"
    assert truth_name("control_points", "nearest") == "control points (nearest)"
    assert truth_name("dense", "") == "dense truth"
