"""What labels do to positioning: one model, trained on the labels of several strategies and on the truth.

Simulated surveys (2 floors, 2 phones, 3 walks each of 3 minutes). Each walk of a floor and phone tests once, and the
others train: by the labels of one strategy (status ok alone), by the truth of the same scans, or by the truth of all.
Test positions are always the truth. Errors are pooled over the surveys of a severity, in metres in the plane.

    python benchmarks/label_quality.py
    python benchmarks/label_quality.py --models weighted-knn multi-cel --severity severe --seeds 1 2 --csv quality.csv
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.status import Status
from vislam2tag.dataset.folder import open_dataset
from vislam2tag.dataset.model import Dataset
from vislam2tag.evaluation.truth import read_truth
from vislam2tag.pipeline.datasets.build import BuildOptions, build_dataset
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.labels.session import code_of
from vislam2tag.pipeline.run.keys import code_key, key_of
from vislam2tag.positioning.metrics import plane_error_m
from vislam2tag.positioning.registry import model_named
from vislam2tag.positioning.scans.learning_data import LearningData, learning_data
from vislam2tag.sessions.registry import open_survey
from vislam2tag.settings import Settings
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.survey import simulate

STRATEGIES = ("global", "local-corrected", "smoother")
TRUTH = "truth"
WALKS = 3
"""Walks of each floor and phone; each tests once."""


@dataclass(frozen=True)
class Labels:
    """One survey's scans as one strategy labels them, or as they are."""

    name: str
    data: LearningData
    of_all: float
    """Share of all scans that is labelled."""


@dataclass
class Pool:
    """Errors in metres, survey after survey."""

    label_m: list[FloatArray]
    position_m: list[FloatArray]
    same_scans_m: list[FloatArray]
    """Of the model trained on the truth of the scans that are labelled."""
    on_floor: list[BoolArray]
    labelled: list[float]


def main() -> None:
    """Make the surveys, train, print a table for each severity and model."""
    options = _options()
    rows = []
    for severity in options.severity:
        pools: dict[tuple[str, str], Pool] = {}
        for seed in options.seeds:
            for labels, truth in _labelled_surveys(severity, seed, options.cache):
                label_m = _label_errors_m(labels.data, truth)
                same_scans = truth[np.isin(truth.ids, labels.data.ids)]
                for model in options.models:
                    pool = pools.setdefault((model, labels.name), Pool([], [], [], [], []))
                    position_m, on_floor = _tested(model, labels.data, truth)
                    pool.label_m.append(label_m)
                    pool.position_m.append(position_m)
                    same_m = position_m if labels.name == TRUTH else _tested(model, same_scans, truth)[0]
                    pool.same_scans_m.append(same_m)
                    pool.on_floor.append(on_floor)
                    pool.labelled.append(labels.of_all)
        rows += [_row(severity, model, name, pool) for (model, name), pool in sorted(pools.items())]
    table = pl.DataFrame(rows)
    with pl.Config(tbl_rows=-1, tbl_cols=-1, tbl_width_chars=200, float_precision=2):
        print(table)
    if options.csv is not None:
        table.write_csv(options.csv, float_precision=4)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--models", nargs="+", default=["weighted-knn"])
    parser.add_argument("--severity", nargs="+", default=["default", "severe"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3])
    parser.add_argument("--cache", type=Path, help="folder that keeps the surveys' data sets for later calls")
    parser.add_argument("--csv", type=Path)
    return parser.parse_args()


def _labelled_surveys(severity: str, seed: int, cache: Path | None) -> Iterator[tuple[Labels, LearningData]]:
    """Yield the labels of each strategy and the truth, each with the truth of all scans."""
    with tempfile.TemporaryDirectory() as scratch:
        root = (cache or Path(scratch)) / f"{severity}_{seed}_{_code()[:12]}"
        survey = root / "survey"
        if not survey.exists():
            simulate(regular_survey(seed, severity, sessions=WALKS, duration_s=180.0), survey)
        datasets = {name: _dataset(root, survey, name) for name in STRATEGIES}
        truth = learning_data(_as_it_was(datasets["smoother"], survey))
        for name, dataset in datasets.items():
            data = learning_data(dataset)
            yield Labels(name, data, len(data) / len(truth)), truth
        yield Labels(TRUTH, truth, 1.0), truth


def _code() -> str:
    """Key of the source that makes the surveys' data sets: a kept folder of another source is not taken."""
    strategies = [code_of("published", Settings(strategy=name)) for name in STRATEGIES]
    return key_of(strategies, code_key(simulate.__module__, regular_survey.__module__, build_dataset.__module__))


def _dataset(root: Path, survey: Path, strategy: str) -> Dataset:
    folder = root / strategy
    if not folder.exists():
        labels = root / f"{strategy}.labels"
        process(survey, labels, Settings(strategy=strategy))
        build_dataset(labels, folder, options=BuildOptions(surveys=(survey,)))
    return open_dataset(folder)


def _as_it_was(dataset: Dataset, survey: Path) -> Dataset:
    """Give every scan the mean of the true places of its readings: all of them can be learned from then."""
    places = pl.concat(
        [_true_readings(dataset, ref.slug, ref.folder, ref.key.floor) for ref in open_survey(survey).sessions]
    )
    true = places.group_by("scan_id").agg(pl.col("x", "y").mean(), pl.col("floor").first())
    fingerprints = dataset.fingerprints.drop("x", "y", "floor").join(true.lazy(), on="scan_id", maintain_order="left")
    fingerprints = fingerprints.with_columns(status=pl.lit(Status.OK.label))
    return replace(dataset, tables={**dataset.tables, "fingerprints": fingerprints})


def _true_readings(dataset: Dataset, slug: str, folder: Path, floor: int) -> pl.DataFrame:
    """Return the readings of one walk at their true places; those outside the truth are left out."""
    truth = read_truth(folder / "truth.csv")
    readings = dataset.readings.filter(pl.col("scan_id").str.starts_with(f"{slug}/")).collect()
    since = readings["time_ns"].to_numpy() - truth.time_ns[0]
    knots = truth.time_ns - truth.time_ns[0]
    x, y = (np.interp(since, knots, axis, left=np.nan, right=np.nan) for axis in truth.position_bcs.T)
    placed = readings.select("scan_id").with_columns(
        x=pl.Series(x), y=pl.Series(y), floor=pl.lit(floor, dtype=pl.Int32)
    )
    return placed.filter(pl.col("x").is_finite())


def _label_errors_m(labels: LearningData, truth: LearningData) -> FloatArray:
    place = {name: row for row, name in enumerate(truth.ids.tolist())}
    known = np.isin(labels.ids, truth.ids)
    rows = np.array([place[name] for name in labels.ids[known].tolist()], dtype=np.int64)
    return np.asarray(np.hypot(*(labels.places.xy[known] - truth.places.xy[rows]).T))


def _tested(model: str, labels: LearningData, truth: LearningData) -> tuple[FloatArray, BoolArray]:
    """Train on all walks but one of each floor and phone, in turn, and test on the truth of those; unknown: NaN."""
    sessions = sorted(set(truth.scans.session.tolist()))
    errors, hits = [], []
    for fold in range(WALKS):
        held_out = sessions[fold::WALKS]
        train = labels[~np.isin(labels.scans.session, held_out)]
        test = truth[np.isin(truth.scans.session, held_out)]
        found = model_named(model).fit(train.scans, train.places).predict(test.scans)
        errors.append(plane_error_m(found, test.places))
        hits.append(found.storey == test.places.storey)
    return np.concatenate(errors), np.concatenate(hits)


def _row(severity: str, model: str, name: str, pool: Pool) -> dict[str, str | float]:
    label_m, position_m = np.concatenate(pool.label_m), np.concatenate(pool.position_m)
    position_m = position_m[np.isfinite(position_m)]
    return {
        "severity": severity,
        "model": model,
        "labels": name,
        "labelled": float(np.mean(pool.labelled)),
        **_quantiles("label", label_m),
        **_quantiles("position", position_m),
        "same_scans_mean_m": float(np.nanmean(np.concatenate(pool.same_scans_m))),
        "floor_hit": float(np.concatenate(pool.on_floor).mean()),
    }


def _quantiles(what: str, error_m: FloatArray) -> dict[str, float]:
    median, p95 = np.quantile(error_m, [0.5, 0.95])
    return {f"{what}_mean_m": float(error_m.mean()), f"{what}_median_m": float(median), f"{what}_p95_m": float(p95)}


if __name__ == "__main__":
    main()
