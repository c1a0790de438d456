"""A density over small cells by kernel regression: the most accurate model here (docs/positioning.md).

Every label is a blob over the cells around it; the regression says the blob that a scan's altered copies have in
common. Storeys have a kernel of their own. The place is the geometric median of the density on the likeliest storey.
It is solved, not trained: no step sizes, no early stopping, seconds. Networks that learn the same blobs can be averaged
in: ``cell-density-networks`` (only training them needs PyTorch).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from vislam2tag.common.errors import UsageError
from vislam2tag.common.extras import import_extra
from vislam2tag.core.arrays import AnyArray, BoolArray, FloatArray
from vislam2tag.positioning.cell_density.dense_layers import layer_arrays, layers_kept
from vislam2tag.positioning.cell_density.density_cells import DensityCells
from vislam2tag.positioning.cell_density.field import NOISES_DB, LevelField, learned_fields
from vislam2tag.positioning.cell_density.kernel import (
    CellAnswer,
    CellKernel,
    Setup,
    Shape,
    errors_on_storey_m,
    learned,
)
from vislam2tag.positioning.cell_density.novelty import AlikeScans, HeldOut, NoveltyRadii, fitted_novelty_radii
from vislam2tag.positioning.cell_density.scan_kernel import DirectionLikeness, ScanKernel
from vislam2tag.positioning.cell_density.storeys import StoreyLikeness
from vislam2tag.positioning.places import Places, Positions
from vislam2tag.positioning.registry import Arrays, Positioner, register
from vislam2tag.positioning.scans.held_out import area_of, folds, usable, walk_of
from vislam2tag.positioning.scans.radio_scans import RadioScans

SHARPNESS = (1.0, 2.0, 4.0, 8.0)
RIDGES = (1.0, 0.3, 0.1, 0.03)
WIDTHS_M = (2.5, 5.0)
"""What is tried by cross-validation."""
_CHOSEN_WITH = 1000
"""Most scans that the choice looks at."""
_CHOICE_FOLDS = 3
_DEALT, _TRIED = 5, 3
"""Scans and areas are dealt to so many folds, of which so many are left out in turn."""
_HALVES = (0.0, 1 / 8, 1 / 4, 1 / 2, 1.0, 2.0)
"""Tried, in median novelties of scans from areas that were left out."""
_AREA_M = 15.0
"""Side of the squares that are left out to learn how radii grow where nobody was."""
Mask = tuple[BoolArray, BoolArray]
Part = tuple[RadioScans, Places]


class Tried(NamedTuple):
    """What was said of scans that were not learned from, and where they were."""

    answer: CellAnswer
    places: Places

    def error_m(self, half: float) -> FloatArray:
        """Return errors (n,) in the plane with this ``half`` of :meth:`CellAnswer.between`."""
        return self.places.distance_m(self.answer.between(half))


class CellDensity(Positioner):
    """The model.

    How sharp and how smooth it is follows from cross-validation over walks of the training data. Radii are fitted to
    errors on scans it did not learn from; how they grow where a scan is unlike all that was learned, to errors in areas
    that were left out. There the field of levels is asked, as a density knows only places that were learned.
    """

    shape_: Shape
    kernel_: CellKernel
    half_: float
    radii_: NoveltyRadii
    height_m_: FloatArray

    def __init__(self, *, copies: int = 4, networks: Sequence[float] = (), seed: int = 0) -> None:
        """Take altered copies of each scan, and the exponent of levels for each network to average in."""
        self.copies = copies
        self.networks = networks
        self.seed = seed

    def _fit(self, scans: RadioScans, places: Places, validation: Part | None) -> None:
        setup = self._setup()
        self.height_m_ = places.storey_height_m
        self.shape_ = self._chosen(scans, places, setup)
        self._tell(0.5)
        self.kernel_ = learned(scans, places, self.shape_, setup)
        self._tell(0.7)
        given = usable(validation)
        apart = folds(np.arange(len(scans)), _DEALT, self.seed)
        familiar = [_tried(self.kernel_, given)] if given else list(self._left_out(scans, places, apart, networks=1))
        self._tell(0.85)
        strange = list(self._left_out(scans, places, self._areas(places), networks=0))
        self.half_ = _half(familiar, strange)
        if np.isinf(self.half_):
            self.kernel_ = replace(self.kernel_, field=None)
        self.radii_ = fitted_novelty_radii(_joined(familiar, self.half_), _joined(strange, self.half_))
        # How arrays lie in memory shows in the last digit of products: a saved model is to answer the same.
        self.restore({name: np.ascontiguousarray(array) for name, array in self.arrays().items()})
        self._tell(1.0)

    def _setup(self, networks: int | None = None) -> Setup:
        if self.copies < 0 or any(exponent <= 0 for exponent in self.networks):
            raise UsageError(f"copies={self.copies}, networks={self.networks}: must be 0 or more, and above 0")
        return Setup(self.copies, self.networks[:networks], self.seed)

    def _tell(self, share: float) -> None:
        if self.progress:
            self.progress(share)

    def _chosen(self, scans: RadioScans, places: Places, setup: Setup) -> Shape:
        """Return what puts left-out walks nearest to their labels."""
        drawn = np.sort(np.random.default_rng(self.seed).permutation(len(scans))[:_CHOSEN_WITH])
        scans, places = scans[drawn], places[drawn]
        noise_db = self._chosen_noise_db(scans, places)
        masks = list(folds(walk_of(scans, places), _CHOICE_FOLDS, self.seed))
        if not masks:
            return Shape(SHARPNESS[0], RIDGES[0], WIDTHS_M[0], noise_db)
        families = [
            [Shape(sharpness, ridge, width_m) for ridge in RIDGES] for width_m in WIDTHS_M for sharpness in SHARPNESS
        ]
        error_m = np.zeros((len(families), len(RIDGES)))
        for number, family in enumerate(families):
            for learn, left in masks:
                parts = (scans[learn], places[learn]), (scans[left], places[left])
                error_m[number] += errors_on_storey_m(*parts, family, setup).sum(axis=1)
            self._tell(0.5 * (number + 1) / len(families))
        best = np.unravel_index(error_m.argmin(), error_m.shape)
        return replace(families[best[0]][best[1]], noise_db=noise_db)

    def _chosen_noise_db(self, scans: RadioScans, places: Places) -> float:
        """Return with which noise the field puts scans of left-out areas and walks nearest to their labels.

        Both kinds weigh the same, as multiples of the least error.
        """
        level_dbm = scans.dense()
        kinds = (self._areas(places), folds(walk_of(scans, places), _DEALT, self.seed))
        error_m = np.zeros((len(kinds), len(NOISES_DB)))
        for kind, masks in enumerate(kinds):
            for learn, left in islice(masks, _TRIED):
                fields = learned_fields(level_dbm[learn], places[learn], NOISES_DB)
                found = (field.place(level_dbm[left], places.storey[left]) for field in fields)
                error_m[kind] += [places[left].distance_m(xy).sum() for xy in found]
        share = error_m / np.maximum(error_m.min(axis=1, keepdims=True), 1e-9)
        return NOISES_DB[share.sum(axis=0).argmin()]

    def _areas(self, places: Places) -> Iterator[Mask]:
        return folds(area_of(places, _AREA_M), _DEALT, self.seed)

    def _left_out(self, scans: RadioScans, places: Places, masks: Iterator[Mask], networks: int) -> Iterator[Tried]:
        """Yield what is said of scans left out; of the networks so many learn again, as that takes longest."""
        setup = self._setup(networks)
        for learn, left in islice(masks, _TRIED):
            yield _tried(learned(scans[learn], places[learn], self.shape_, setup), (scans[left], places[left]))

    def _predict(self, scans: RadioScans) -> Positions:
        answer = self.kernel_.answer(scans)
        storey = answer.storey_probability.argmax(axis=1)
        radius_68_m, radius_95_m = self.radii_.radii_m(answer.spread_m, answer.novelty)
        return Positions(
            storeys=self.storeys_,
            storey=storey,
            xy=answer.between(self.half_),
            z=self.height_m_[storey],
            storey_probability=answer.storey_probability,
            radius_68_m=radius_68_m,
            radius_95_m=radius_95_m,
        )

    def remarks(self) -> Sequence[str]:
        """Say how many scans were left out."""
        count = self.kernel_.contradicted
        said = f"{count} fingerprint{'' if count == 1 else 's'} not learned from: the others contradict the floor"
        return [said] if count else []

    def torch_module(self) -> Any:
        """Return the same as a PyTorch module, for export; raises UsageError where PyTorch is not installed."""
        module = import_extra("vislam2tag.positioning.cell_density.module")
        return module.CellModule(self.kernel_, self.half_, self.radii_, self.height_m_)

    def arrays(self) -> Arrays:
        """Return cells, the two regressions, the field of levels if it is asked, radii and heights."""
        cells, density, storeys = self.kernel_.cells, self.kernel_.density, self.kernel_.storeys
        return {
            "cell_storey": cells.storey,
            "cell_centre_m": cells.centre_m,
            "centre": density.like.centre,
            "sharpness": np.array([density.like.sharpness]),
            "density_weight": density.weight,
            "density_mean": density.mean,
            "storey_weight": storeys.weight,
            "storey_mean": storeys.mean,
            **storeys.like.arrays(),
            "half": np.array([self.half_]),
            "centre_xy": self.kernel_.alike.xy,
            "centre_apart": self.kernel_.alike.apart,
            "radii": self.radii_.array(),
            "height_m": self.height_m_,
            "contradicted": np.array([self.kernel_.contradicted]),
            **(self.kernel_.field.arrays() if self.kernel_.field else {}),
            **layer_arrays(self.kernel_.networks),
        }

    def restore(self, arrays: Mapping[str, AnyArray]) -> None:
        """Take back what :meth:`arrays` gave."""
        centre, (sharpness,), (half,) = arrays["centre"], arrays["sharpness"], arrays["half"]
        directions, steps = DirectionLikeness(centre, float(sharpness)), StoreyLikeness.restored(centre, arrays)
        self.kernel_ = CellKernel(
            DensityCells(arrays["cell_storey"], arrays["cell_centre_m"]),
            ScanKernel(directions, arrays["density_weight"], arrays["density_mean"]),
            ScanKernel(steps, arrays["storey_weight"], arrays["storey_mean"]),
            None if np.isinf(half) else LevelField.restored(arrays),
            AlikeScans(centre, arrays["centre_xy"], arrays["centre_apart"]),
            layers_kept(arrays, self.networks),
            int(arrays["contradicted"][0]),
        )
        self.half_ = float(half)
        self.radii_ = NoveltyRadii.restored(arrays, "radii")
        self.height_m_ = arrays["height_m"]


def _tried(kernel: CellKernel, part: Part) -> Tried:
    """Try scans that were not learned from."""
    scans, places = part
    return Tried(kernel.answer(scans), places)


def _joined(tried: Sequence[Tried], half: float) -> HeldOut:
    return HeldOut.joined([HeldOut(one.error_m(half), one.answer.spread_m, one.answer.novelty) for one in tried])


def _half(familiar: Sequence[Tried], strange: Sequence[Tried]) -> float:
    """Return at which novelty density and field count the same, so that familiar and strange errors are small.

    Both kinds weigh the same, as shares of what the density alone would err; infinite where nothing is new.
    """
    novelty = np.concatenate([np.empty(0), *(one.answer.novelty for one in strange)])
    if not familiar or not (novelty > 0).any():
        return np.inf
    halves = [*(float(np.median(novelty[novelty > 0])) * np.array(_HALVES)), np.inf]
    error_m = np.array([[_mean_error_m(kind, half) for kind in (familiar, strange)] for half in halves])
    return float(halves[(error_m / np.maximum(error_m[-1], 1e-9)).sum(axis=1).argmin()])


def _mean_error_m(tried: Sequence[Tried], half: float) -> float:
    return float(np.concatenate([one.error_m(half) for one in tried]).mean())


register("cell-density", CellDensity)
