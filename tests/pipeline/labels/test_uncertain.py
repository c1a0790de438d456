"""What a strategy knows of its own uncertainty, through a whole run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.unsure import EVENTS, OFFSET_M, unsure_registered
from vislam2tag.common.error_statistics import lower_edge_m
from vislam2tag.core.status import EventKind
from vislam2tag.labeling.results import SessionResult, Summary
from vislam2tag.labeling.settings import LabelSettings
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.run.selection import Selection
from vislam2tag.settings import Settings

LIMIT_M = 0.5


@pytest.fixture(scope="module")
def runs(clean_survey: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[float, Path]:
    """Output folders by limit of uncertainty."""
    folder = tmp_path_factory.mktemp("unsure")
    outs = {LIMIT_M: folder / "limited", float("inf"): folder / "unlimited"}
    with unsure_registered():
        for limit, out in outs.items():
            settings = Settings(strategy="unsure", labels=LabelSettings(max_sigma_m=limit))
            process(clean_survey, out, settings, selection=Selection(floors=(0,)))
    return outs


@pytest.mark.parametrize("table", ["trajectory", "wifi", "sensors"])
def test_rows_above_the_limit_are_uncertain_and_lose_nothing(runs: dict[float, Path], table: str) -> None:
    limited, unlimited = (pl.read_parquet(out / table / "*.parquet") for out in runs.values())
    assert limited.drop("status").equals(unlimited.drop("status"))
    assert "uncertain" not in unlimited["status"]
    above = (unlimited["status"] == "ok") & (unlimited["sigma"] > LIMIT_M)
    assert 0.1 < (above.sum() / len(above)) < 0.9
    expected = unlimited.select(pl.when(above).then(pl.lit("uncertain")).otherwise("status").alias("status"))
    assert limited.select("status").equals(expected)


def results(out: Path) -> list[SessionResult]:
    return [SessionResult.model_validate_json(path.read_bytes()) for path in sorted(out.glob("sessions/*.json"))]


def frames_of(out: Path, result: SessionResult) -> pl.DataFrame:
    return pl.read_parquet(out / "trajectory" / f"{result.slug}.parquet")


def test_results_hold_events_at_their_time_and_place(runs: dict[float, Path]) -> None:
    for result in results(runs[LIMIT_M]):
        frames = frames_of(runs[LIMIT_M], result)
        update, loss = result.events
        assert (update.kind, update.size_m, update.turn_rad) == (EventKind.MAP_UPDATE, 0.42, -0.1)
        assert update.time_ns == frames["time_ns"][EVENTS[0].frame]
        assert update.position == pytest.approx(frames.select("x", "y").row(EVENTS[0].frame), abs=0.006)
        assert (loss.kind, loss.turn_rad, loss.position) == (EventKind.LOSS, None, None)


def test_a_contradicting_landmark_is_a_result_and_a_finding_at_its_row(
    runs: dict[float, Path], clean_survey: Path
) -> None:
    row = (clean_survey / "floor_0/marker_dict.csv").read_text().splitlines()[1].split(",")
    for result in results(runs[LIMIT_M]):
        (mark,) = result.contradictions
        assert (mark.floor, mark.landmark, mark.size_m, mark.passes, mark.offset_m) == (0, row[0], 0.5, 3, OFFSET_M)
        assert mark.surveyed_m == pytest.approx((float(row[1]), float(row[2])), abs=0.006)
        (finding,) = (finding for finding in result.findings if finding.kind == "contradicting_landmark")
        assert (finding.file, finding.lines) == ("floor_0/marker_dict.csv", (2,))
        assert f"landmark {row[0]} contradicts the others by 0.50 m" in finding.message


def test_sigma_statistics_are_of_the_mapped_frames(runs: dict[float, Path]) -> None:
    for result in results(runs[LIMIT_M]):
        mapped = frames_of(runs[LIMIT_M], result).drop_nulls("x")
        assert result.sigma is not None
        assert result.sigma.median_m == pytest.approx(mapped["sigma"].median(), abs=1e-4)
        assert result.sigma.uncertain_share == pytest.approx((mapped["status"] == "uncertain").mean(), abs=1e-6)
        assert sum(result.sigma.frames.values()) == len(mapped)


def test_errors_are_those_of_the_labels_against_the_truth(runs: dict[float, Path], clean_survey: Path) -> None:
    for result in results(runs[LIMIT_M]):
        folder = clean_survey / f"floor_{result.floor}" / result.device / result.session
        joined = frames_of(runs[LIMIT_M], result).drop_nulls("x").join(pl.read_csv(folder / "truth.csv"), on="time_ns")
        error = np.hypot(joined["x"] - joined["x_right"], joined["y"] - joined["y_right"])
        assert result.errors is not None
        assert result.errors.sources == {"truth.csv": 1}
        assert sum(result.errors.inside) == sum(sum(row.errors.values()) for row in result.errors.rows) == len(error)
        assert sum(row.sum_m for row in result.errors.rows) == pytest.approx(float(error.sum()), abs=1e-3)
        for row in result.errors.rows:
            assert row.sigma is not None
            within = joined["sigma"].is_between(lower_edge_m(row.sigma) - 1e-9, lower_edge_m(row.sigma + 1) + 1e-9)
            assert within.sum() >= sum(row.errors.values())


def test_the_summary_adds_up_over_sessions(runs: dict[float, Path]) -> None:
    summary = Summary.model_validate_json((runs[LIMIT_M] / "summary.json").read_bytes())
    every = results(runs[LIMIT_M])
    assert summary.events == {"loss": 2, "map_update": 2}
    (found,) = summary.contradictions
    assert (found.sessions, found.seen, found.greatest_m) == (2, 2, 0.5)
    assert found.offset_m == pytest.approx(OFFSET_M)
    assert summary.findings["contradicting_landmark"] == 2
    assert summary.sigma is not None
    assert summary.errors is not None
    sigma_m = np.concatenate([frames_of(runs[LIMIT_M], result).drop_nulls("x")["sigma"] for result in every])
    assert summary.sigma.median_m == pytest.approx(np.median(sigma_m), rel=0.05)
    assert summary.sigma.uncertain_share == pytest.approx(np.mean(sigma_m > LIMIT_M), abs=1e-5)
    assert summary.errors.points == sum(result.errors.points for result in every if result.errors)


def test_drawn_points_carry_their_sigma(runs: dict[float, Path]) -> None:
    for result in results(runs[LIMIT_M]):
        frames = frames_of(runs[LIMIT_M], result).drop_nulls("x")
        for stretch in result.drawing.mapped:
            assert len(stretch.sigma_m) == len(stretch.points)
            assert stretch.sigma_m == sorted(stretch.sigma_m)
            assert (min(stretch.sigma_m) > LIMIT_M - 1e-3) == (stretch.status == "uncertain")
        assert result.drawing.mapped[0].sigma_m[0] == pytest.approx(frames["sigma"][0], abs=1e-3)
        assert not any(stretch.sigma_m for stretch in result.drawing.discarded)
