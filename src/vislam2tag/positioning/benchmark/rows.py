"""Runs summed up: the mean of each figure over seeds, and how far it would scatter with other seeds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import TypeVar

import numpy as np
from scipy.stats import t as student_t

from vislam2tag.evaluation.record import FigureWithInterval
from vislam2tag.positioning.benchmark.record import BenchmarkRow, ModelTime, RunRecord, RunTime
from vislam2tag.positioning.metrics import Score

ALL = "all"
"""Fold of a row over all folds."""
REFERENCE = "weighted-knn"
"""Model whose time others are measured by."""
LEVEL = 0.95
_DIGITS = 6
_T = TypeVar("_T")

FIGURES: Mapping[str, Callable[[Score], float | None]] = MappingProxyType(
    {
        "floor_hit": lambda one: one.floor_hit,
        "mean_m": lambda one: one.plane.mean_m,
        "median_m": lambda one: one.plane.median_m,
        "p75_m": lambda one: one.plane.p75_m,
        "p95_m": lambda one: one.plane.p95_m,
        "on_floor_mean_m": lambda one: one.plane_on_floor.mean_m,
        "on_floor_median_m": lambda one: one.plane_on_floor.median_m,
        "on_floor_p75_m": lambda one: one.plane_on_floor.p75_m,
        "on_floor_p95_m": lambda one: one.plane_on_floor.p95_m,
        "space_mean_m": lambda one: one.space.mean_m,
        "space_median_m": lambda one: one.space.median_m,
        "ipin_m": lambda one: one.ipin_m,
        "building_hit": lambda one: one.building_hit,
        "inside_68": lambda one: one.inside_68,
        "inside_95": lambda one: one.inside_95,
        "answered": lambda one: one.answered,
    }
)
"""What is reported of a test part (:mod:`.metrics`): shares 0 to 1, else metres."""
SHARES = frozenset({"floor_hit", "building_hit", "inside_68", "inside_95", "answered"})
"""Those that are shares; intervals of theirs end at 0 and 1."""


def benchmark_rows(runs: Sequence[RunRecord]) -> list[BenchmarkRow]:
    """Sum up by split, fold and model, in the order of the runs; a row for all folds first where there are several."""
    rows = []
    for split in _distinct(run.split for run in runs):
        here = [run for run in runs if run.split == split]
        folds = _distinct(run.fold for run in here)
        names = _distinct(run.model for run in here)
        for fold in ([ALL] if len(folds) > 1 else []) + folds:
            for name in names:
                own = [run for run in here if run.model == name and fold in (ALL, run.fold)]
                if {run.fold for run in own} == set(folds if fold == ALL else [fold]):
                    rows.append(_row(split, fold, name, own))
    return rows


def _row(split: str, fold: str, model: str, runs: Sequence[RunRecord]) -> BenchmarkRow:
    seeds = _distinct(run.seed for run in runs)
    by_seed = [[run.score for run in runs if run.seed == seed] for seed in seeds]
    figures = {
        name: interval([_mean([value(score) for score in scores]) for scores in by_seed], share=name in SHARES)
        for name, value in FIGURES.items()
    }
    tested = {run.fold: run.score.scans for run in runs}
    return BenchmarkRow(
        split=split, fold=fold, model=model, runs=len(seeds), test_scans=sum(tested.values()), figures=figures
    )


def interval(values: Sequence[float | None], *, share: bool = False) -> FigureWithInterval:
    """Mean of a figure over seeds, and the interval that Student's t gives it; unknown where one of them is."""
    known = np.array([value for value in values if value is not None])
    if len(known) < len(values) or not len(known):
        return FigureWithInterval(value=None)
    mean = float(known.mean())
    if len(known) == 1:
        return FigureWithInterval(value=round(mean, _DIGITS))
    half = float(student_t.ppf((1 + LEVEL) / 2, len(known) - 1) * known.std(ddof=1) / np.sqrt(len(known)))
    low, high = np.clip((mean - half, mean + half), 0, 1) if share else (mean - half, mean + half)
    return FigureWithInterval(
        value=round(mean, _DIGITS), low=round(float(low), _DIGITS), high=round(float(high), _DIGITS)
    )


def model_times(runs: Sequence[tuple[RunRecord, RunTime]]) -> list[ModelTime]:
    """Mean times by model, and their ratios to those of :data:`REFERENCE` where it was run."""
    fit_s, predict_ms = {}, {}
    for name in _distinct(run.model for run, _ in runs):
        own = [(run, time) for run, time in runs if run.model == name]
        fit_s[name] = float(np.mean([time.fit_s for _, time in own]))
        predict_ms[name] = 1000 * sum(time.predict_s for _, time in own) / sum(run.score.scans for run, _ in own)
    return [
        ModelTime(
            model=name,
            fit_s=fit_s[name],
            predict_ms=predict_ms[name],
            fit_ratio=_ratio(fit_s[name], fit_s.get(REFERENCE)),
            predict_ratio=_ratio(predict_ms[name], predict_ms.get(REFERENCE)),
        )
        for name in fit_s
    ]


def _ratio(own: float, reference: float | None) -> float | None:
    return own / reference if reference else None


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if len(known) == len(values) else None


def _distinct(values: Iterable[_T]) -> list[_T]:
    return list(dict.fromkeys(values))
