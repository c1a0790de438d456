"""A density over small cells by kernel regression: the most accurate model here (docs/positioning.md).

Every label is a blob over the cells around it; the regression says the blob that a scan's altered copies have in
common. Storeys have a kernel of their own. The place is the geometric median of the density on the likeliest storey.
It is solved, not trained: no step sizes, no early stopping, seconds.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from vislam2tag.core.arrays import AnyArray, BoolArray, FloatArray
from vislam2tag.errors import UsageError
from vislam2tag.positioning.base import Arrays, Positioner, register
from vislam2tag.positioning.cell_kernel import (
    STOREY_SHARPNESS,
    CellKernel,
    Setup,
    Shape,
    errors_on_storey_m,
    learned,
)
from vislam2tag.positioning.density_cells import DensityCells
from vislam2tag.positioning.held_out import folds, usable, walk_of
from vislam2tag.positioning.places import Places, Positions
from vislam2tag.positioning.scan_kernel import ScanKernel
from vislam2tag.positioning.scans import RadioScans
from vislam2tag.positioning.spread import SpreadRadii, fitted_radii

SHARPNESS = (1.0, 2.0, 4.0, 8.0)
RIDGES = (1.0, 0.3, 0.1, 0.03)
"""What is tried by cross-validation."""
_CHOSEN_WITH = 1200
"""Most scans that the choice looks at."""
_FOLDS = 3
Part = tuple[RadioScans, Places]


class CellDensity(Positioner):
    """The model.

    How sharp and how smooth it is follows from cross-validation over walks of the training data. Radii are fitted to
    errors on scans it did not learn from: those of other phones where there are several, else of other walks.
    """

    shape_: Shape
    kernel_: CellKernel
    radii_: SpreadRadii
    height_m_: FloatArray

    def __init__(self, *, cell_m: float = 3.0, width_m: float = 3.0, copies: int = 4, seed: int = 0) -> None:
        """Take the side of cells, how far a label's blob reaches (standard deviation), and altered copies a scan."""
        self.cell_m = cell_m
        self.width_m = width_m
        self.copies = copies
        self.seed = seed

    def _fit(self, scans: RadioScans, places: Places, validation: Part | None) -> None:
        setup = self._setup()
        self.height_m_ = places.storey_height_m
        self.shape_ = self._chosen(scans, places, setup)
        self._tell(0.5)
        self.kernel_ = learned(scans, places, self.shape_, setup)
        self._tell(0.7)
        given = usable(validation)
        tried = [_tried(self.kernel_, given)] if given else list(self._left_out(scans, places, setup))
        error_m, spread_m = np.concatenate(tried, axis=1) if tried else np.empty((2, 0))
        self.radii_ = fitted_radii(error_m, spread_m)
        self._tell(1.0)

    def _setup(self) -> Setup:
        if min(self.cell_m, self.width_m) <= 0 or self.copies < 0:
            raise UsageError(
                f"cell_m={self.cell_m}, width_m={self.width_m}, copies={self.copies}: the first two must be above 0, "
                "copies 0 or more"
            )
        return Setup(self.cell_m, self.width_m, self.copies, self.seed)

    def _tell(self, share: float) -> None:
        if self.progress:
            self.progress(share)

    def _chosen(self, scans: RadioScans, places: Places, setup: Setup) -> Shape:
        """Return what puts left-out walks nearest to their labels."""
        drawn = np.sort(np.random.default_rng(self.seed).permutation(len(scans))[:_CHOSEN_WITH])
        scans, places = scans[drawn], places[drawn]
        masks = list(folds(walk_of(scans, places), _FOLDS, self.seed))
        if not masks:
            return Shape(SHARPNESS[0], RIDGES[0])
        error_m = np.zeros((len(SHARPNESS), len(RIDGES)))
        for number, sharpness in enumerate(SHARPNESS):
            for learn, left in masks:
                parts = (scans[learn], places[learn]), (scans[left], places[left])
                error_m[number] += errors_on_storey_m(*parts, sharpness, RIDGES, setup).sum(axis=1)
            self._tell(0.5 * (number + 1) / len(SHARPNESS))
        best = np.unravel_index(error_m.argmin(), error_m.shape)
        return Shape(SHARPNESS[best[0]], RIDGES[best[1]])

    def _left_out(self, scans: RadioScans, places: Places, setup: Setup) -> Iterator[FloatArray]:
        for learn, left in _phones_or_walks(scans, places, self.seed):
            yield _tried(learned(scans[learn], places[learn], self.shape_, setup), (scans[left], places[left]))

    def _predict(self, scans: RadioScans) -> Positions:
        probability, xy, spread_m = self.kernel_.answer(scans)
        storey = probability.argmax(axis=1)
        radius_68_m, radius_95_m = self.radii_.radii_m(spread_m)
        return Positions(self.storeys_, storey, xy, self.height_m_[storey], probability, radius_68_m, radius_95_m)

    def arrays(self) -> Arrays:
        """Return cells, the two regressions, radii and heights."""
        cells, density, storeys = self.kernel_.cells, self.kernel_.density, self.kernel_.storeys
        return {
            "cell_storey": cells.storey,
            "cell_centre_m": cells.centre_m,
            "centre": density.centre,
            "sharpness": np.array([density.sharpness]),
            "density_weight": density.weight,
            "density_mean": density.mean,
            "storey_weight": storeys.weight,
            "storey_mean": storeys.mean,
            "radii": self.radii_.array(),
            "height_m": self.height_m_,
        }

    def restore(self, arrays: Mapping[str, AnyArray]) -> None:
        """Take back what :meth:`arrays` gave."""
        centre, (sharpness,) = arrays["centre"], arrays["sharpness"]
        self.kernel_ = CellKernel(
            DensityCells(arrays["cell_storey"], arrays["cell_centre_m"]),
            ScanKernel(centre, arrays["density_weight"], arrays["density_mean"], float(sharpness)),
            ScanKernel(centre, arrays["storey_weight"], arrays["storey_mean"], STOREY_SHARPNESS),
        )
        self.radii_ = SpreadRadii.restored(arrays, "radii")
        self.height_m_ = arrays["height_m"]


def _phones_or_walks(scans: RadioScans, places: Places, seed: int) -> Iterator[tuple[BoolArray, BoolArray]]:
    """Yield what learns and what is left out."""
    names, phone = np.unique(scans.device, return_inverse=True)
    yield from folds(phone if len(names) > 1 else walk_of(scans, places), _FOLDS, seed)


def _tried(kernel: CellKernel, part: Part) -> FloatArray:
    """Return errors and spreads (2, n) on scans that were not learned from."""
    scans, places = part
    _, xy, spread_m = kernel.answer(scans)
    return np.stack([np.hypot(*(xy - places.xy).T), spread_m])


register("cell-density", CellDensity)
