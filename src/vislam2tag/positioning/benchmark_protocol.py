"""The benchmark's protocol: which runs there are, with which settings, and what becomes of one.

A run is one model, trained on what trains in one fold of one split with one seed, and scored on what tests there.
Everything is learned from the training part (:meth:`Positioner.fit` sees nothing else): access points, scales, when to
stop, how sure to be. Every scan of a test part stands with its true and its found place in a table
(``runs/*.parquet``).
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.progress import Progress, silent
from vislam2tag.core.arrays import FloatArray
from vislam2tag.datasets.model import Dataset, Split
from vislam2tag.datasets.schema import FINGERPRINTS, READINGS
from vislam2tag.positioning.benchmark_record import RunRecord, RunTime, versions
from vislam2tag.positioning.learning_data import LearningData
from vislam2tag.positioning.metrics import score
from vislam2tag.positioning.models import multi_cel, regression_net
from vislam2tag.positioning.places import Positions, ScanPlaces
from vislam2tag.positioning.radio_scans import TextArray
from vislam2tag.positioning.registry import Positioner, model_named

SEED = "seed"
"""Parameter of models that draw random numbers; a model without it gives the same each time and runs once."""

GIA = "giaIndoorLoc"
_PUBLISHED = {"multi-cel": multi_cel.PUBLISHED, "regression-net": regression_net.PUBLISHED}


@dataclass(frozen=True)
class ModelChoice:
    """A model by its registered name, and the parameters that differ from its own."""

    name: str
    parameters: Mapping[str, Any] = field(default_factory=dict)

    def made(self, seed: int | None) -> Positioner:
        """Make it, not fitted; raises UsageError where there is no such model or parameter."""
        seeded = {} if seed is None else {SEED: seed}
        return model_named(self.name, **self.parameters, **seeded)

    def seeds(self, count: int) -> Sequence[int | None]:
        """The seeds of its runs: ``count`` from 0, or none where it draws nothing or its seed is chosen."""
        draws = SEED in self.made(None).get_params(deep=False) and SEED not in self.parameters
        return range(count) if draws else (None,)


def published_choices(dataset: str | None = None) -> Iterator[ModelChoice]:
    """Choose the paper's two models as published for a data set (by public name), as for the paper's own elsewhere."""
    for name, settings in _PUBLISHED.items():
        yield ModelChoice(name, {"batch_size": 32, **settings.get(dataset or GIA, settings[GIA])})


@dataclass(frozen=True)
class BenchmarkRun:
    """One run, to be made."""

    model: ModelChoice
    split: Split
    fold: str
    seed: int | None
    """None: the model draws nothing."""

    def __str__(self) -> str:
        seed = "" if self.seed is None else f", seed {self.seed}"
        return f"{self.model.name}: {self.split.info.name} / {self.fold}{seed}"

    def key(self, dataset: Dataset, code: str) -> str:
        """SHA-256 of all that the run follows from: data (on disk), split, model, parameters, seed.

        ``code`` is the key of the source that makes it (:func:`~vislam2tag.pipeline.run.keys.code_key`).
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
        """All parameters of the model, as JSON has them."""
        own = self.model.made(self.seed).get_params(deep=False)
        parameters: dict[str, Any] = json.loads(json.dumps(own, default=str))
        return parameters


def planned(models: Sequence[ModelChoice], splits: Sequence[Split], seeds: int) -> Iterator[BenchmarkRun]:
    """List all runs, fold after fold, so that models compared stand next to each other."""
    for split in splits:
        for fold in split.info.folds:
            for model in models:
                yield from (BenchmarkRun(model, split, fold.name, seed) for seed in model.seeds(seeds))


def execute(
    run: BenchmarkRun, data: LearningData, key: str, progress: Progress[float] = silent
) -> tuple[RunRecord, RunTime, pl.DataFrame]:
    """Train and score; the table has every scan of the test part (:func:`predictions_table`).

    Raises DatasetError where a part is empty or the model cannot learn from it."""
    train, test = data.train_test(run.split, run.split.fold(run.fold))
    for what, part in (("trains", train), ("tests", test)):
        if not len(part):
            raise DatasetError(f"split {run.split.info.name}, fold {run.fold}: no labelled fingerprint {what}")
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
"""Columns: BCS metres; what the model did not say is null."""


def predictions_table(ids: TextArray, truth: ScanPlaces, found: Positions) -> pl.DataFrame:
    """Put truth (n,) and positions (n,) of the scans with these ids (n,) side by side; columns :data:`PREDICTIONS`."""
    places = (column for one in (truth, found) for column in _columns(one))
    columns = [ids.tolist(), *places, _nullable(found.radius_68_m), _nullable(found.radius_95_m)]
    return pl.DataFrame(dict(zip(PREDICTIONS, columns, strict=True)), schema=PREDICTIONS)


def _columns(places: ScanPlaces | Positions) -> tuple[Any, ...]:
    """Building, floor, x, y and z of places (n); None or null where they are unknown."""
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
