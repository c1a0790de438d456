"""What a benchmark finds, as JSON: one record a run (``runs/*.json``), and rows over seeds (``benchmark.json``).

Rows are the mean of each figure over seeds, and how far it would scatter with other seeds. How long a run took is no
part of it (``times/*.json``): all else is the same each time, to the byte.
"""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from scipy.stats import t as student_t

from vislam2tag import __version__
from vislam2tag.common.records import Record
from vislam2tag.positioning.metrics import Score
from vislam2tag.quality.evaluation.record import FigureWithInterval

ALIKE = 0.05
"""Means that differ by less than this share of the smaller one are called alike."""
_LIBRARIES = ("numpy", "scipy", "scikit-learn", "polars", "torch")


class RunRecord(Record):
    """One model, trained and tested once."""

    key: str
    """SHA-256 of all that the run follows from."""
    model: str
    parameters: dict[str, Any]
    """All of them, defaults too."""
    split: str
    fold: str
    seed: int | None
    """None: the model draws nothing."""
    train_scans: int
    access_points: int
    """What the training part heard."""
    score: Score
    versions: dict[str, str]


class RunTime(Record):
    """How long one run took."""

    fit_s: float
    predict_s: float
    """Wall time for all scans of the test part."""


class FailedRun(Record):
    """A run that could not be made."""

    run: str
    error: str


class BenchmarkRow(Record):
    """One model on one fold of a split, or on all its folds."""

    split: str
    fold: str
    """``all``: each fold counts the same."""
    model: str
    runs: int
    """Seeds, or 1 where the model draws nothing."""
    test_scans: int
    figures: dict[str, FigureWithInterval]
    """By the names of :data:`FIGURES`: the mean over seeds and its interval."""


class BestModel(Record):
    """The model with the smallest mean error on a split, of those that answer and find floors about as often as any."""

    split: str
    model: str
    mean_m: float
    floor_hit: float | None
    runner_up: str | None
    """The next one; None where there is no other."""
    behind_m: float
    """By how much that one's mean error is larger."""
    behind_interval_m: tuple[float, float] | None = None
    """Its 95 % interval, had other walks tested: both on the same scans, walks drawn again (Efron and Tibshirani 1993).
    None for few walks."""

    @property
    def alike(self) -> bool:
        """Whether the runner-up is as good for any use."""
        return self.runner_up is not None and self.behind_m < ALIKE * self.mean_m


class Benchmark(Record):
    """All of it."""

    version: str
    dataset: str
    data_sha256: dict[str, str]
    """Checksum of each table that was learned from."""
    seeds: int
    rows: list[BenchmarkRow]
    runs: list[RunRecord]
    failed: list[FailedRun]
    best: list[BestModel]
    """Of each split."""


def versions() -> dict[str, str]:
    """Versions of what computes."""
    found = {"vislam2tag": __version__, "Python": platform.python_version()}
    for library in _LIBRARIES:
        try:
            found[library] = version(library)
        except PackageNotFoundError:
            continue
    return found


ALL = "all"
"""Fold of a row over all folds."""
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


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if len(known) == len(values) else None


def _distinct(values: Iterable[_T]) -> list[_T]:
    return list(dict.fromkeys(values))
