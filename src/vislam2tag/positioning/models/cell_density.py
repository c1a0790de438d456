"""A density over small cells by kernel regression, the most accurate model here (docs/explanation/positioning.md).

Every label is a density over the cells around it. The regression predicts the density from scans and augmented copies
of them. Storeys have their own kernel. The place is the geometric median of the density on the most likely storey. The
model is solved in seconds, without step sizes or early stopping.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from vislam2tag.common.errors import UsageError, import_extra
from vislam2tag.core.arrays import AnyArray, BoolArray, FloatArray
from vislam2tag.positioning.cell_density.density_model import (
    DensityAnswer,
    DensityModel,
    DensityShape,
    LearningSetup,
    errors_on_storey_m,
    learned_model,
)
from vislam2tag.positioning.cell_density.level_field import NOISES_DB, LevelField, learned_fields
from vislam2tag.positioning.cell_density.novelty import (
    MOST_NOVEL,
    HeldOutErrors,
    NoveltyRadii,
    ReferenceScans,
    fitted_novelty_radii,
)
from vislam2tag.positioning.cell_density.scan_kernels import DirectionKernel, KernelRegression, StoreyKernel
from vislam2tag.positioning.error_radii import conformal_quantile
from vislam2tag.positioning.places import (
    DensityCells,
    LabelledScans,
    Positions,
    ScanPlaces,
    area_numbers,
    folds,
    usable_validation,
    walk_numbers,
)
from vislam2tag.positioning.radio_scans import CheckedArrays, RadioScans, joined_rows
from vislam2tag.positioning.registry import NamedArrays, Positioner, register

MOST_COPIES = 1000
SHARPNESS = (1.0, 2.0, 4.0, 8.0)
RIDGES = (1.0, 0.3, 0.1, 0.03)
WIDTHS_M = (2.5, 5.0)
"""Candidates for cross-validation."""
_CHOSEN_WITH = 1000
"""Largest number of scans in this choice."""
_CHOICE_FOLDS = 3
_FOLDS, _FOLDS_LEFT_OUT = 5, 3
"""Number of folds of scans and areas, and how many of these are left out in turn."""
_HALF_NOVELTIES = (0.0, 1 / 8, 1 / 4, 1 / 2, 1.0, 2.0)
"""Candidates, in median novelties of scans from left-out areas."""
LIKE = 0.99
"""A scan is unlike the training set if it is newer than this share of scans from left-out areas."""
_AREA_M = 15.0
"""Side of the squares that are left out to learn how radii grow at places that were not surveyed."""
FoldMasks = tuple[BoolArray, BoolArray]
"""(n,) training scans, and held-out scans."""


class HeldOutAnswers(NamedTuple):
    """Answers to held-out scans, and their true places."""

    answer: DensityAnswer
    places: ScanPlaces

    def error_m(self, half_novelty: float) -> FloatArray:
        """Return errors (n,) in the plane, metres, with this ``half_novelty`` of :meth:`DensityAnswer.blended`."""
        return self.places.distance_m(self.answer.blended(half_novelty))


class CellDensity(Positioner):
    """Kernel regression onto densities over cells.

    Sharpness and smoothness follow from cross-validation over walks of the training set. Radii are fitted to errors on
    held-out scans, and their growth with novelty to errors in left-out areas. For scans unlike the training set the
    field of levels is used, because a density knows only learned places.
    """

    shape_: DensityShape
    density_: DensityModel
    half_novelty_: float
    """Novelty at which density and field have the same weight (:meth:`DensityAnswer.blended`)."""
    radii_: NoveltyRadii
    like_: float
    """Novelty above which a scan is unlike the training set."""
    height_m_: FloatArray
    """(s,) height of each storey, metres; NaN if unknown."""

    def __init__(self, *, copies: int = 4, seed: int = 0) -> None:
        """Make a model with ``copies`` augmented copies of each scan; ``seed`` is that of all random draws."""
        self.copies = copies
        self.seed = seed

    def _fit(self, scans: RadioScans, places: ScanPlaces, validation: LabelledScans | None) -> None:
        setup = self._setup()
        self.height_m_ = places.storey_height_m
        self.shape_ = self._chosen(scans, places, setup)
        self.progress(0.5, 1)
        self.density_ = learned_model(scans, places, self.shape_, setup)
        self.progress(0.7, 1)
        given = usable_validation(validation)
        if given:
            familiar = [_answered(self.density_, given)]
        else:
            apart = folds(np.arange(len(scans)), _FOLDS, self.seed)
            familiar = list(self._left_out(scans, places, apart))
        self.progress(0.85, 1)
        strange = list(self._left_out(scans, places, self._areas(places)))
        self.half_novelty_ = _half_novelty(familiar, strange)
        if np.isinf(self.half_novelty_):
            self.density_ = replace(self.density_, field=None)
        near, far = (_errors(part, self.half_novelty_) for part in (familiar, strange))
        self.radii_ = fitted_novelty_radii(near, far)
        self.like_ = conformal_quantile(np.sort(far.novelty), LIKE) if len(far) else MOST_NOVEL
        # The memory layout of arrays affects the last digit of products, and a saved model must give the same answers.
        self.restore({name: np.ascontiguousarray(array) for name, array in self.arrays().items()})
        self.progress(1.0, 1)

    def _setup(self) -> LearningSetup:
        if not 0 <= self.copies <= MOST_COPIES:
            raise UsageError(f"copies={self.copies}: expected 0 to {MOST_COPIES}")
        return LearningSetup(self.copies, self.seed)

    def _chosen(self, scans: RadioScans, places: ScanPlaces, setup: LearningSetup) -> DensityShape:
        """Return the shape with the smallest error on left-out walks."""
        chosen = np.sort(np.random.default_rng(self.seed).permutation(len(scans))[:_CHOSEN_WITH])
        scans, places = scans[chosen], places[chosen]
        noise_db = self._chosen_noise_db(scans, places)
        masks = list(folds(walk_numbers(scans, places), _CHOICE_FOLDS, self.seed))
        if not masks:
            return DensityShape(SHARPNESS[0], RIDGES[0], WIDTHS_M[0], noise_db)
        families = [
            [DensityShape(sharpness, ridge, width_m) for ridge in RIDGES]
            for width_m in WIDTHS_M
            for sharpness in SHARPNESS
        ]
        error_m = np.zeros((len(families), len(RIDGES)))
        for number, family in enumerate(families):
            for learn, held_out in masks:
                parts = (scans[learn], places[learn]), (scans[held_out], places[held_out])
                error_m[number] += errors_on_storey_m(*parts, family, setup).sum(axis=1)
            self.progress(0.5 * (number + 1) / len(families), 1)
        best = np.unravel_index(error_m.argmin(), error_m.shape)
        return replace(families[best[0]][best[1]], noise_db=noise_db)

    def _chosen_noise_db(self, scans: RadioScans, places: ScanPlaces) -> float:
        """Return the noise with the smallest error of the field on scans of left-out areas and walks.

        Both kinds have the same weight, as multiples of the smallest error.
        """
        level_dbm = scans.dense()
        kinds = (self._areas(places), folds(walk_numbers(scans, places), _FOLDS, self.seed))
        error_m = np.zeros((len(kinds), len(NOISES_DB)))
        for kind, masks in enumerate(kinds):
            for learn, held_out in islice(masks, _FOLDS_LEFT_OUT):
                fields = learned_fields(level_dbm[learn], places[learn], NOISES_DB)
                found = (field.place(level_dbm[held_out], places.storey[held_out]) for field in fields)
                error_m[kind] += [places[held_out].distance_m(xy).sum() for xy in found]
        share = error_m / np.maximum(error_m.min(axis=1, keepdims=True), 1e-9)
        return NOISES_DB[share.sum(axis=0).argmin()]

    def _areas(self, places: ScanPlaces) -> Iterator[FoldMasks]:
        return folds(area_numbers(places, _AREA_M), _FOLDS, self.seed)

    def _left_out(self, scans: RadioScans, places: ScanPlaces, masks: Iterator[FoldMasks]) -> Iterator[HeldOutAnswers]:
        """Yield the answers to left-out scans."""
        setup = self._setup()
        for learn, held_out in islice(masks, _FOLDS_LEFT_OUT):
            model = learned_model(scans[learn], places[learn], self.shape_, setup)
            yield _answered(model, (scans[held_out], places[held_out]))

    def _predict(self, scans: RadioScans) -> Positions:
        answer = self.density_.answer(scans)
        probability, novelty = answer.storey_probability, answer.novelty
        storey, xy = probability.argmax(axis=1), answer.blended(self.half_novelty_)
        radii_m = self.radii_.radii_m(answer.spread_m, novelty)
        unlike = novelty > self.like_
        return Positions(self.storeys_, storey, xy, self.height_m_[storey], probability, *radii_m, unlike)

    def remarks(self) -> Sequence[str]:
        """Return the number of ignored scans in a sentence."""
        count = self.density_.mislabelled
        remark = (
            f"{count} fingerprint{'' if count == 1 else 's'} ignored in training, because similar scans are on "
            "another floor"
        )
        return [remark] if count else []

    def torch_module(self) -> Any:
        """Return the same as a PyTorch module, for export; raises UsageError if PyTorch is not installed."""
        module = import_extra("vislam2tag.positioning.cell_density.torch_module")
        return module.DensityModule(self.density_, self.half_novelty_, self.radii_, self.height_m_)

    def arrays(self) -> NamedArrays:
        """Return cells, the two regressions, the field of levels if it is asked, radii and heights."""
        cells, density, storeys = self.density_.cells, self.density_.density, self.density_.storeys
        return {
            "cell_storey": cells.storey,
            "cell_centre_m": cells.centre_m,
            "centre": density.kernel.centre,
            "sharpness": np.array([density.kernel.sharpness]),
            "density_weight": density.weight,
            "density_mean": density.mean,
            "storey_weight": storeys.weight,
            "storey_mean": storeys.mean,
            **storeys.kernel.arrays(),
            "half": np.array([self.half_novelty_]),
            "centre_xy": self.density_.references.xy,
            "centre_apart": self.density_.references.apart,
            "radii": self.radii_.array(),
            "like": np.array([self.like_]),
            "height_m": self.height_m_,
            "contradicted": np.array([self.density_.mislabelled]),
            **(self.density_.field.arrays() if self.density_.field else {}),
        }

    def restore(self, arrays: Mapping[str, AnyArray]) -> None:
        """Restore from the result of :meth:`arrays`."""
        without_field = bool(np.isposinf(arrays["half"]).all())
        known = CheckedArrays(arrays, a=len(self.access_points_), s=len(self.storeys_))
        centre, (sharpness,) = known.floats("centre", "m", "a"), known.floats("sharpness", 1, least=0.0)
        by_direction, by_steps = DirectionKernel(centre, float(sharpness)), StoreyKernel.restored(centre, known)
        cells = DensityCells(
            known.integers("cell_storey", "c", below=len(self.storeys_)), known.floats("cell_centre_m", "c", 2)
        )
        self.density_ = DensityModel(
            cells,
            KernelRegression(by_direction, known.floats("density_weight", "m", "c"), known.floats("density_mean", "c")),
            KernelRegression(by_steps, known.floats("storey_weight", "m", "s"), known.floats("storey_mean", "s")),
            None if without_field else LevelField.restored(known),
            ReferenceScans(centre, known.floats("centre_xy", "m", 2), known.floats("centre_apart", "m")),
            int(known.integers("contradicted", 1)[0]),
        )
        self.half_novelty_ = np.inf if without_field else float(known.floats("half", 1, least=0.0)[0])
        self.radii_ = NoveltyRadii.restored(known, "radii")
        self.like_ = float(known.floats("like", 1)[0])
        self.height_m_ = known.floats("height_m", "s", unknown=True)


def _answered(model: DensityModel, labelled: LabelledScans) -> HeldOutAnswers:
    scans, places = labelled
    return HeldOutAnswers(model.answer(scans), places)


def _errors(answers: Sequence[HeldOutAnswers], half_novelty: float) -> HeldOutErrors:
    errors = [HeldOutErrors(one.error_m(half_novelty), one.answer.spread_m, one.answer.novelty) for one in answers]
    return joined_rows([HeldOutErrors(*np.empty((3, 0))), *errors])


def _half_novelty(familiar: Sequence[HeldOutAnswers], strange: Sequence[HeldOutAnswers]) -> float:
    """Return the novelty at which density and field have the same weight, so that both kinds of errors are small.

    Both kinds have the same weight, as shares of the density's errors; infinite if nothing is new.
    """
    novelty = np.concatenate([np.empty(0), *(one.answer.novelty for one in strange)])
    if not familiar or not (novelty > 0).any():
        return np.inf
    tried = [*(float(np.median(novelty[novelty > 0])) * np.array(_HALF_NOVELTIES)), np.inf]
    error_m = np.array([[_mean_error_m(kind, half) for kind in (familiar, strange)] for half in tried])
    return float(tried[(error_m / np.maximum(error_m[-1], 1e-9)).sum(axis=1).argmin()])


def _mean_error_m(answers: Sequence[HeldOutAnswers], half_novelty: float) -> float:
    return float(np.concatenate([one.error_m(half_novelty) for one in answers]).mean())


register("cell-density", CellDensity)
