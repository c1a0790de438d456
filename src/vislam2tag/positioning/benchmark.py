"""The benchmark: its runs and their settings, the execution of a run, and rows over seeds, as JSON.

A run is one model, trained with one seed on the training set of one fold of a split, and scored on its test set. All
that is learned comes from the training set (:meth:`Positioner.fit` sees nothing else): access points, scales, early
stopping, uncertainty. A table (``runs/*.parquet``) contains every test scan with its true and its estimated place; each
run has a record (``runs/*.json``).

Rows (``benchmark.json``) contain the mean of each figure over seeds, and its interval over other seeds. Times are in
separate files (``times/*.json``), because everything else is reproducible to the byte.
"""

from __future__ import annotations

import hashlib
import json
import platform
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from types import MappingProxyType
from typing import Any, ClassVar, TypeVar

import numpy as np
import polars as pl
from scipy.stats import t as student_t

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result
from vislam2tag.core.arrays import FloatArray
from vislam2tag.datasets.model import Dataset, Split
from vislam2tag.datasets.schema import FINGERPRINTS, READINGS
from vislam2tag.positioning.learning_data import LearningData
from vislam2tag.positioning.model_scores import Score, score
from vislam2tag.positioning.places import Positions, ScanPlaces
from vislam2tag.positioning.radio_scans import TextArray
from vislam2tag.positioning.registry import Positioner, model_named
from vislam2tag.quality.evaluation.record import FigureWithInterval

ALIKE = 0.05
"""Means that differ by less than this share of the smaller one count as equal."""
_LIBRARIES = ("numpy", "scipy", "scikit-learn", "polars", "torch")


class RunRecord(Record):
    """One model, trained and tested once."""

    key: str
    """SHA-256 of everything that the run depends on."""
    model: str
    parameters: dict[str, Any]
    """All parameters, including defaults."""
    split: str
    fold: str
    seed: int | None
    """None: the model draws no random numbers."""
    train_scans: int
    access_points: int
    """Number of access points in the training set."""
    score: Score
    versions: dict[str, str]


class RunTime(Record):
    """Duration of one run."""

    fit_s: float
    predict_s: float
    """Wall time for all scans of the test set."""


class FailedRun(Record):
    """A run that failed."""

    run: str
    error: str


class BenchmarkRow(Record):
    """One model on one fold of a split, or on all its folds."""

    split: str
    fold: str
    """``all``: each fold has the same weight."""
    model: str
    runs: int
    """Number of seeds, or 1 if the model draws no random numbers."""
    test_scans: int
    figures: dict[str, FigureWithInterval]
    """The mean over seeds and its interval, by the names of :data:`FIGURES`."""


class BestModel(Record):
    """The model with the smallest mean error on a split, among those that answer and find floors about as often as
    any."""

    split: str
    model: str
    mean_m: float
    floor_hit: float | None
    runner_up: str | None
    """The second best; None if there is no other."""
    behind_m: float
    """Difference between their mean errors, metres."""
    behind_interval_m: tuple[float, float] | None = None
    """95 % interval of this difference over other walks: both models on the same scans, bootstrap over walks (Efron and
    Tibshirani 1993). None for few walks."""

    @property
    def alike(self) -> bool:
        """Whether the runner-up is practically as good."""
        return self.runner_up is not None and self.behind_m < ALIKE * self.mean_m


class Benchmark(Result):
    """The result of a benchmark."""

    main_table: ClassVar[str] = "rows"

    version: str
    dataset: str
    data_sha256: dict[str, str]
    """Checksum of each input table."""
    seeds: int
    rows: list[BenchmarkRow]
    runs: list[RunRecord]
    failed: list[FailedRun]
    best: list[BestModel]
    """The best model of each split."""


def versions() -> dict[str, str]:
    """Versions of the relevant packages."""
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
"""Figures of a test set (:class:`~vislam2tag.positioning.model_scores.Score`): shares from 0 to 1, else metres."""
SHARES = frozenset({"floor_hit", "building_hit", "inside_68", "inside_95", "answered"})
"""Figures that are shares; their intervals end at 0 and 1."""


def benchmark_rows(runs: Sequence[RunRecord]) -> list[BenchmarkRow]:
    """Summarise by split, fold and model, in the order of the runs; if there are several folds, all folds come
    first."""
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
    """Mean of a figure over seeds, and its interval by Student's t; unknown if one value is."""
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


SEED = "seed"
"""Parameter of models that draw random numbers; models without it are deterministic and run once."""

GIA = "giaIndoorLoc"


@dataclass(frozen=True)
class ModelChoice:
    """A model by its registered name, with parameters that differ from the defaults."""

    name: str
    parameters: Mapping[str, Any] = field(default_factory=dict)

    def made(self, seed: int | None) -> Positioner:
        """Make the model, not fitted; raises UsageError for an unknown model or parameter."""
        seeded = {} if seed is None else {SEED: seed}
        return model_named(self.name, **self.parameters, **seeded)

    def seeds(self, count: int) -> Sequence[int | None]:
        """The seeds of its runs: ``count`` from 0, or none if it draws no random numbers or its seed is given."""
        draws = SEED in self.made(None).get_params(deep=False) and SEED not in self.parameters
        return range(count) if draws else (None,)


def published_choices(dataset: str | None = None) -> Iterator[ModelChoice]:
    """Return the paper's two models with the published settings for a data set (by public name), or for the paper's."""
    from vislam2tag.positioning.models import multi_cel, regression_net  # records are read without the models' library

    for name, settings in (("multi-cel", multi_cel.PUBLISHED), ("regression-net", regression_net.PUBLISHED)):
        yield ModelChoice(name, {"batch_size": 32, **settings.get(dataset or GIA, settings[GIA])})


@dataclass(frozen=True)
class BenchmarkRun:
    """One planned run."""

    model: ModelChoice
    split: Split
    fold: str
    seed: int | None
    """None: the model draws no random numbers."""

    def __str__(self) -> str:
        seed = "" if self.seed is None else f", seed {self.seed}"
        return f"{self.model.name}: {self.split.info.name} / {self.fold}{seed}"

    def key(self, dataset: Dataset, code: str) -> str:
        """SHA-256 of everything that the run depends on: data (on disk), split, model, parameters, seed.

        ``code`` is the key of the source code (:func:`~vislam2tag.pipeline.run.keys.code_key`).
        """
        name = self.split.info.name
        follows = {
            "data": [dataset.info.tables[table].sha256 for table in (FINGERPRINTS, READINGS)],
            "split": [self.split.info.model_dump(mode="json"), dataset.info.splits[name].sha256],
            "fold": self.fold,
            "model": self.model.name,
            "parameters": self.parameters,
            "code": code,
        }
        return hashlib.sha256(json.dumps(follows, sort_keys=True).encode()).hexdigest()

    @property
    def parameters(self) -> dict[str, Any]:
        """All parameters of the model, for JSON."""
        own = self.model.made(self.seed).get_params(deep=False)
        parameters: dict[str, Any] = json.loads(json.dumps(own, default=str))
        return parameters


def planned(models: Sequence[ModelChoice], splits: Sequence[Split], seeds: int) -> Iterator[BenchmarkRun]:
    """List all runs, fold after fold, so that models to compare are next to each other."""
    for split in splits:
        for fold in split.info.folds:
            for model in models:
                yield from (BenchmarkRun(model, split, fold.name, seed) for seed in model.seeds(seeds))


def execute(
    run: BenchmarkRun, data: LearningData, key: str, progress: Progress[float] = silent
) -> tuple[RunRecord, RunTime, pl.DataFrame]:
    """Train and score; the table contains every test scan (:func:`predictions_table`).

    Raises DatasetError if a set is empty or the model cannot learn from it."""
    train, test = data.train_test(run.split, run.split.fold(run.fold))
    for what, part in (("training", train), ("test", test)):
        if not len(part):
            raise DatasetError(
                f"split {run.split.info.name}, fold {run.fold}: the {what} set contains no labelled fingerprint"
            )
    model = run.model.made(run.seed)
    model.progress = progress
    begun = time.perf_counter()
    model.fit(train.scans, train.places)
    fitted = time.perf_counter()
    found = model.predict(test.scans)
    ended = time.perf_counter()
    record = RunRecord(
        key=key,
        model=run.model.name,
        parameters=run.parameters,
        split=run.split.info.name,
        fold=run.fold,
        seed=run.seed,
        train_scans=len(train),
        access_points=len(model.access_points_),
        score=score(found, test.places),
        versions=versions(),
    )
    taken = RunTime(fit_s=fitted - begun, predict_s=ended - fitted)
    return record, taken, predictions_table(test.ids, test.places, found)


_PLACE = {"building": pl.String, "floor": pl.Int64, "x": pl.Float64, "y": pl.Float64, "z": pl.Float64}
PREDICTIONS = {
    "scan_id": pl.String,
    **_PLACE,
    **{f"found_{name}": kind for name, kind in _PLACE.items()},
    "radius_68_m": pl.Float64,
    "radius_95_m": pl.Float64,
}
"""Columns: BCS metres; unknown values are null."""


def predictions_table(ids: TextArray, truth: ScanPlaces, found: Positions) -> pl.DataFrame:
    """Put truth (n,) and positions (n,) of the scans with these ids (n,) side by side; columns :data:`PREDICTIONS`."""
    places = (column for one in (truth, found) for column in _columns(one))
    columns = [ids.tolist(), *places, _nullable(found.radius_68_m), _nullable(found.radius_95_m)]
    return pl.DataFrame(dict(zip(PREDICTIONS, columns, strict=True)), schema=PREDICTIONS)


def _columns(places: ScanPlaces | Positions) -> tuple[Any, ...]:
    """Building, floor, x, y and z of places (n); None or null if they are unknown."""
    named = [places.storeys[index] if index >= 0 else None for index in places.storey.tolist()]
    storeys = [one.building if one else None for one in named], [one.floor if one else None for one in named]
    return (*storeys, *map(_nullable, (*places.xy.T, places.z)))


def with_errors(predictions: pl.DataFrame) -> pl.DataFrame:
    """Add ``error_m`` in the plane (null: unknown) and ``on_floor``: whether building and floor are right."""
    error_m = ((pl.col("found_x") - pl.col("x")).pow(2) + (pl.col("found_y") - pl.col("y")).pow(2)).sqrt()
    same = [pl.col(name) == pl.col(f"found_{name}") for name in ("building", "floor")]
    return predictions.with_columns(error_m=error_m, on_floor=pl.all_horizontal(same).fill_null(value=False))


def _nullable(values: FloatArray) -> pl.Series:
    """Values (n,) with null for NaN."""
    return pl.Series(np.asarray(values, dtype=np.float64)).fill_nan(None)
