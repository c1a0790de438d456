"""What a benchmark finds, as JSON: one record a run (``runs/*.json``), and rows over seeds (``benchmark.json``).

How long a run took is no part of it (``times/*.json``): all else is the same each time, to the byte.
"""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from vislam2tag import __version__
from vislam2tag.common.records import Record
from vislam2tag.evaluation.record import FigureWithInterval
from vislam2tag.positioning.metrics import Score

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
    """By the names of :data:`~vislam2tag.positioning.benchmark.rows.FIGURES`: the mean over seeds and its interval."""


class ModelTime(Record):
    """How long a model takes, on average over runs, and as a multiple of the reference's time in the same benchmark."""

    model: str
    fit_s: float
    predict_ms: float
    """For one scan."""
    fit_ratio: float | None
    """None where the reference was not run."""
    predict_ratio: float | None


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
