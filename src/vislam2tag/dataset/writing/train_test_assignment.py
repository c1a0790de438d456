"""The parts of a split as formats with a training and a test file know them."""

from __future__ import annotations

from dataclasses import dataclass

import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.dataset.format_registry import ExportContext
from vislam2tag.dataset.model import TEST, TRAIN, Dataset, Fold, Split


@dataclass(frozen=True)
class TrainTestAssignment:
    """Which fingerprints train and which test."""

    part: pl.DataFrame
    """Columns ``scan_id`` and ``part``; fingerprints in neither part have no row."""
    findings: tuple[Finding, ...] = ()

    def neither(self, fingerprints: pl.LazyFrame) -> tuple[Finding, ...]:
        """Count the fingerprints that the split puts into neither part."""
        left = fingerprints.join(self.part.lazy(), on="scan_id", how="anti").select(pl.len())
        count = int(left.collect(engine="streaming").item())
        if not count:
            return ()
        message = "fingerprints are in neither part of the split: they are in no training or test set"
        return (Finding(kind="in_neither_part", file="", count=count, message=message, severity=Severity.INFO),)


def train_test_assignment(dataset: Dataset, context: ExportContext) -> TrainTestAssignment:
    """Return the parts of the chosen split and fold; without a choice the official one's, or all trains.

    Raises UsageError for a split or fold that is not there, and where a split has several folds and none is chosen.
    """
    if context.split is None:
        return _without_choice(dataset, context)
    if context.split not in dataset.splits:
        there = ", ".join(dataset.splits) or "none"
        raise UsageError(f"--split {context.split}: the data set has no such split; there are: {there}")
    split = dataset.splits[context.split]
    return _parts(split, _fold(split, context.fold))


def _without_choice(dataset: Dataset, context: ExportContext) -> TrainTestAssignment:
    if context.fold is not None:
        raise UsageError(f"--fold {context.fold}: say of which split by --split")
    official = [split for split in dataset.splits.values() if split.info.kind == "official"]
    if len(official) == 1 and len(official[0].info.folds) == 1:
        return _parts(official[0], official[0].info.folds[0])
    ids = dataset.fingerprints.select("scan_id", part=pl.lit(TRAIN)).collect(engine="streaming")
    message = "no split chosen (--split): all is training data" + (
        f"; there are: {', '.join(dataset.splits)}" if dataset.splits else ", as the data set has none"
    )
    return TrainTestAssignment(
        ids, (Finding(kind="no_split", file="", count=1, message=message, severity=Severity.INFO),)
    )


def _fold(split: Split, name: str | None) -> Fold:
    folds = split.info.folds
    if name is None and len(folds) == 1:
        return folds[0]
    there = ", ".join(fold.name for fold in folds)
    if name is None:
        raise UsageError(f"--split {split.info.name}: has {len(folds)} folds; choose one by --fold: {there}")
    try:
        return split.fold(name)
    except KeyError as error:
        raise UsageError(f"--fold {name}: split {split.info.name} has no such fold; there are: {there}") from error


def _parts(split: Split, fold: Fold) -> TrainTestAssignment:
    train, test = split.train_test_ids(fold)
    part = pl.concat(
        [pl.DataFrame({"scan_id": ids}).with_columns(part=pl.lit(name)) for ids, name in ((train, TRAIN), (test, TEST))]
    )
    return TrainTestAssignment(part)
