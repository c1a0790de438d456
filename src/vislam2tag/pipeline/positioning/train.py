"""Trains a model on a data set and saves it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError, OutputError, UsageError
from vislam2tag.common.files.given_files import AnyPath, path_or_none
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.tabular import Frames, TabularResult, listed_frame
from vislam2tag.datasets.folder import FILE as READINGS_FILE
from vislam2tag.datasets.folder import is_dataset, open_dataset
from vislam2tag.datasets.model import Dataset, Fold, Split
from vislam2tag.datasets.technologies import BLE, BOTH, main_technology
from vislam2tag.positioning.learning_data import LearningData, ModelUpdate, learning_data, updated
from vislam2tag.positioning.model_files import FloorName, ModelOrigin, SavedModel, load_model, save_model, write_onnx
from vislam2tag.positioning.model_scores import BUDGET_S, ModelTrial, Score, score, tried_models
from vislam2tag.positioning.places import LabelledScans
from vislam2tag.positioning.registry import Positioner, model_named
from vislam2tag.site.model import is_own_name

SEED = "seed"


@dataclass(frozen=True)
class TrainPlan:
    """What to train, and on what."""

    model: str | None = None
    """None: the one that :func:`~vislam2tag.positioning.model_scores.tried_models` finds best."""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    split: str | None = None
    """Train on the training part of this split only; None: on all labelled fingerprints."""
    fold: str | None = None
    """Fold of the split; optional if it has only one."""
    seed: int | None = None
    technology: str | None = None
    """None: that of :func:`~vislam2tag.datasets.technologies.main_technology`."""
    onnx: AnyPath | None = None
    """Write the model as ONNX, too (networks and cell-density)."""
    budget_s: float = BUDGET_S
    """Time limit for trying models, if none is named."""
    update: AnyPath | None = None
    """File of a model that also learns this data set; its kind and settings stay."""


@dataclass(frozen=True)
class HeldOutResult:
    """Errors of a model on the test set."""

    score: Score
    radius_68_m: float
    """Median; NaN if all answers are unknown."""
    radius_95_m: float
    """The same."""


@dataclass(frozen=True, repr=False)
class TrainedModel(TabularResult):
    """A model that was trained and saved."""

    saved: SavedModel
    tested: HeldOutResult | None
    """None without a test set."""
    trial: ModelTrial | None = None
    """None if the model was named."""
    update: ModelUpdate | None = None
    """None if nothing was updated."""
    findings: tuple[Finding, ...] = ()
    """Readings of the data set that were skipped because they are impossible."""

    def _facts(self) -> dict[str, object]:
        median_m = None if self.tested is None else self.tested.score.plane.median_m
        tested = {} if median_m is None else {"median error": f"{median_m:.2f} m"}
        return {**self.saved._facts(), **tested}

    def _frames(self) -> Frames:
        frames = super()._frames()
        return frames if self.trial is None else {**frames, "tried": partial(listed_frame, self.trial.tried)}


def train(folder: AnyPath, plan: TrainPlan, out: AnyPath, progress: Progress[float] = silent) -> TrainedModel:
    """Train a model on a data set's folder and save it.

    Raises UsageError for options that do not fit the data set or model, DatasetError without training data,
    ModelError for a model's file that cannot be updated, OutputError if ``out`` cannot be written.
    """
    folder, out, onnx = Path(folder), Path(out), path_or_none(plan.onnx)
    for file in [out] if onnx is None else [out, onnx]:
        if file.is_dir() or not file.parent.is_dir():
            raise OutputError(
                f"{file}: cannot be written (it is a folder, or its folder does not exist); choose another name"
            )
    if onnx is not None and onnx.resolve() == out.resolve():
        raise UsageError(f"--onnx {onnx}: this is also the file of --out; choose another name")
    _check(plan)
    before = None if plan.update is None else load_model(plan.update)
    dataset = open_dataset(folder)
    for file in [out] if onnx is None else [out, onnx]:
        if file.exists() and any(map(is_dataset, file.resolve().parents)):
            raise OutputError(f"{file}: would overwrite a file of a data set; choose another name")
    technology = plan.technology or main_technology(dataset)
    plan = replace(plan, technology=technology)
    learned, tested, part = _parts(dataset, plan)
    labelled = learned.scans, learned.places
    origin = _origin(dataset, technology, part, len(learned))
    update = trial = None
    if before is not None:
        update = _updated(before, origin, labelled, plan)
        labelled, origin = update.learned, _joined_origin(before.origin, origin, update)
        name, model = before.name, model_named(before.name, **before.model.get_params())
    else:
        trial = tried_models(labelled, plan.budget_s, progress) if plan.model is None else None
        name, model = _model(plan, trial)
    model.progress = progress
    model.fit(*labelled)
    saved = SavedModel(name, model, origin)
    save_model(saved, out)
    if onnx is not None:
        write_onnx(model, onnx, {"model": name, "origin": saved.origin.model_dump_json()})
    return TrainedModel(saved, None if tested is None else _tested(model, tested), trial, update, _left_out(dataset))


def _left_out(dataset: Dataset) -> tuple[Finding, ...]:
    return tuple(each for each in dataset.info.findings if each.file == READINGS_FILE)


def _check(plan: TrainPlan) -> None:
    """Refuse unknown models or parameters before anything is read."""
    if plan.update is not None:
        if plan.model is not None or plan.parameters or plan.seed is not None or plan.onnx is not None:
            raise UsageError("--update keeps the model's kind and settings; remove --model, --set, --seed and --onnx")
    elif plan.model is not None:
        model_named(plan.model, **_parameters(plan.model, plan))
    elif plan.parameters or plan.seed is not None or plan.onnx is not None:
        raise UsageError("--set, --seed and --onnx need a model; choose one with --model")


def _updated(before: SavedModel, origin: ModelOrigin, later: LabelledScans, plan: TrainPlan) -> ModelUpdate:
    """Join a model's training data with a later survey; refuse if names or places differ in meaning."""
    known = before.model.learned()
    if known is None:
        raise UsageError(
            f"--update {plan.update}: {before.name} does not keep its fingerprints; join the data sets "
            "(vislam2tag join) and train on both"
        )
    for what in ("technology", "frame", "bssid_key"):
        own, other = getattr(before.origin, what), getattr(origin, what)
        if own != other:
            raise UsageError(f"--update {plan.update}: {what} is {own} in the model, but {other} in {origin.dataset}")
    return updated(known, later, origin.technology)


def _joined_origin(before: ModelOrigin, later: ModelOrigin, update: ModelUpdate) -> ModelOrigin:
    part = f"{before.part}; updated by {update.added} of {later.dataset} ({later.part})"
    beacons = tuple(sorted({*before.beacons, *later.beacons}))
    return before.model_copy(update={"part": part, "scans": len(update.learned[0]), "beacons": beacons})


def _model(plan: TrainPlan, trial: ModelTrial | None) -> tuple[str, Positioner]:
    """Create the model that was named or found best, without training."""
    if plan.model is not None:
        return plan.model, model_named(plan.model, **_parameters(plan.model, plan))
    if trial is None:
        raise ValueError("no model is named, and none was tried")
    return trial.chosen.name, model_named(trial.chosen.name)


def _tested(model: Positioner, part: LearningData) -> HeldOutResult:
    found = model.predict(part.scans)
    answered = found[found.known]
    radii = (np.median(one) if len(one) else np.nan for one in (answered.radius_68_m, answered.radius_95_m))
    return HeldOutResult(score(found, part.places.over(found.storeys)), *map(float, radii))


def _parameters(model: str, plan: TrainPlan) -> dict[str, Any]:
    if plan.seed is None:
        return dict(plan.parameters)
    if SEED not in model_named(model).get_params():
        raise UsageError(f"--seed: {model} does not use random numbers; remove this option")
    return {**plan.parameters, SEED: plan.seed}


def _parts(dataset: Dataset, plan: TrainPlan) -> tuple[LearningData, LearningData | None, str]:
    """Return training set, test set, and a name for the former."""
    if plan.split is None:
        if plan.fold is not None:
            raise UsageError(f"--fold {plan.fold}: a fold needs a split; add --split")
        return learning_data(dataset, plan.technology), None, "all"
    split, fold = _fold(dataset, plan.split, plan.fold)
    learned, tested = learning_data(dataset, plan.technology).train_test(split, fold)
    part = f"split {split.info.name}, fold {fold.name}"
    if not len(learned):
        raise DatasetError(f"{dataset.info.name}: {part} has no labelled training fingerprint; choose another fold")
    return learned, tested if len(tested) else None, part


def _fold(dataset: Dataset, split_name: str, fold_name: str | None) -> tuple[Split, Fold]:
    split = dataset.splits.get(split_name)
    if split is None:
        there = ", ".join(sorted(dataset.splits)) or "none (create one with vislam2tag split)"
        raise UsageError(f"--split {split_name}: the data set has no such split; available: {there}")
    names = [fold.name for fold in split.info.folds]
    if fold_name is None and len(names) == 1:
        fold_name = names[0]
    if fold_name not in names:
        given = "--fold" if fold_name is None else f"--fold {fold_name}"
        raise UsageError(f"{given}: choose one of split {split_name}: {', '.join(names)}")
    return split, split.fold(fold_name)


def _origin(dataset: Dataset, technology: str, part: str, scans: int) -> ModelOrigin:
    info = dataset.info
    beacons = dataset.access_points.filter(pl.col("technology") == BLE).select(pl.col("bssid").sort())
    return ModelOrigin(
        dataset=info.name,
        part=part,
        scans=scans,
        technology=technology,
        grouping=next((one for one in info.groupings if one.technology == technology), None),
        beacons=tuple(beacons.collect()["bssid"]) if technology == BOTH else (),
        floor_names=tuple(
            FloorName(
                building=floor.building,
                number=floor.number,
                name=floor.name if is_own_name(floor.name, floor.number) else "",
                rooms=floor.rooms,
            )
            for floor in info.floors
            if is_own_name(floor.name, floor.number) or floor.rooms
        ),
        frame=info.frame,
        bssid_key=info.bssid_key,
    )
