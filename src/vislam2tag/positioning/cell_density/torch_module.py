"""``cell-density`` as a PyTorch module, including kernels, for export to ONNX.

It gives the same results as :class:`.DensityModel`, step by step and in double precision.
"""

from __future__ import annotations

import math

import torch

from vislam2tag.core.arrays import AnyArray, FloatArray
from vislam2tag.positioning.cell_density.density_model import LEAST_DENSITY, DensityModel
from vislam2tag.positioning.cell_density.level_field import OFFSET_DB
from vislam2tag.positioning.cell_density.novelty import COMPARED, LEAST_EXCESS, PLACED, TIE, NoveltyRadii, RadiusGrowth
from vislam2tag.positioning.cell_density.scan_kernels import EXPONENT, LEAST_LENGTH
from vislam2tag.positioning.error_radii import SMALLEST_SCALE_M
from vislam2tag.positioning.places import MEDIAN_STEPS, SMOOTH_M
from vislam2tag.positioning.radio_scans import FAINTEST_DBM


class DensityModule(torch.nn.Module):  # type: ignore[misc]  # torch counts as Any
    """From levels (n, a) in dBm, NaN if not heard, to what a locator returns."""

    def __init__(self, model: DensityModel, half_novelty: float, radii: NoveltyRadii, height_m: FloatArray) -> None:
        super().__init__()
        self.half_novelty, self.radii = half_novelty, radii
        self.sharpness = model.density.kernel.sharpness
        self._keep("height_m", height_m)
        self._keep("cell_centre_m", model.cells.centre_m)
        self._keep("cell_storey", model.cells.storey)
        self._keep("centre", model.density.kernel.centre)
        self._keep("centre_xy", model.references.xy)
        self._keep("centre_apart", model.references.apart)
        for name, values in (model.field.arrays() if model.field else {}).items():
            self._keep(name, values)
        self._keep("storey_threshold", model.storeys.kernel.threshold)
        self._keep("storey_steps", model.storeys.kernel.steps)
        self._keep("storey_weight", model.storeys.weight)
        self._keep("storey_mean", model.storeys.mean)
        self._keep("density_weight", model.density.weight)
        self._keep("density_mean", model.density.mean)

    def _keep(self, name: str, values: AnyArray) -> None:
        self.register_buffer(name, torch.from_numpy(values.copy()))

    def forward(self, level_dbm: torch.Tensor) -> tuple[torch.Tensor, ...]:
        """Return OUTPUTS of :mod:`.networks.layers` for levels (n, a); one that hears nothing is unknown: NaN, -1."""
        known = (~torch.isnan(level_dbm)).any(dim=1)
        above = torch.where(torch.isnan(level_dbm), FAINTEST_DBM, level_dbm) - FAINTEST_DBM
        level = above.clamp(0.0, -FAINTEST_DBM) / -FAINTEST_DBM
        direction = _directions(level)
        cosine = direction @ self.centre.T
        probability, density = self._storeys_and_density(level, cosine)
        storey = probability.argmax(dim=1)
        xy = self._median(density * (self.cell_storey == storey[:, None]))
        spread_m, novelty = self._spread(density, cosine, xy)
        xy = self._blended(xy, novelty, level_dbm, storey)
        novelty = novelty.clamp(max=self.radii.most_novel)
        scale_m = torch.sqrt(self.radii.base_m**2 + spread_m**2).clamp(min=SMALLEST_SCALE_M)
        return (
            torch.where(known[:, None], xy, torch.nan),
            torch.where(known, self.height_m[storey], torch.nan),
            torch.where(known, storey, -1),
            torch.where(known[:, None], probability, torch.nan),
            torch.where(known, _radius_m(self.radii.growth_68, scale_m, novelty), torch.nan),
            torch.where(known, _radius_m(self.radii.growth_95, scale_m, novelty), torch.nan),
        )

    def _blended(
        self, xy: torch.Tensor, novelty: torch.Tensor, level_dbm: torch.Tensor, storey: torch.Tensor
    ) -> torch.Tensor:
        """(n, 2) blend density and field as :meth:`DensityAnswer.blended` does."""
        if math.isinf(self.half_novelty):
            return xy
        field_xy = self._field_place(level_dbm, storey)
        if self.half_novelty == 0:
            return field_xy
        share = (novelty**2 / (novelty**2 + self.half_novelty**2))[:, None]
        return (1 - share) * xy + share * field_xy

    def _field_place(self, level_dbm: torch.Tensor, storey: torch.Tensor) -> torch.Tensor:
        """(n, 2) mean over the storey by the likelihood of levels, as :meth:`LevelField.place` has it."""
        heard = (~torch.isnan(level_dbm)).to(torch.float64)
        level = torch.where(torch.isnan(level_dbm), 0.0, level_dbm)
        count = heard.sum(dim=1, keepdim=True)
        expected, variance = self.field_level_dbm, self.field_variance
        total = level.sum(dim=1, keepdim=True) - heard @ expected.T
        squares = level.square().sum(dim=1, keepdim=True) - 2 * level @ expected.T + heard @ expected.square().T
        shared = OFFSET_DB**2 / (variance + count * OFFSET_DB**2)
        spread = (count - 1) * torch.log(variance) + torch.log(variance + count * OFFSET_DB**2)
        log = -((squares - shared * total.square()) / variance + spread) / 2
        on = self.field_storey == storey[:, None]
        log = torch.where(on | ~on.any(dim=1, keepdim=True), log, -torch.inf)
        return torch.softmax(log, dim=1) @ self.field_centre_m

    def _storeys_and_density(self, level: torch.Tensor, cosine: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return storey probabilities (n, s) and densities (n, c)."""
        similarity = torch.exp(2 * self.sharpness * (cosine - 1))
        density = _shares(similarity @ self.density_weight + self.density_mean, LEAST_DENSITY)
        above = (level[:, :, None] > self.storey_threshold).to(torch.float64).flatten(start_dim=1)
        above = above / torch.sqrt(above.sum(dim=1, keepdim=True)).clamp(min=LEAST_LENGTH)
        similarity = torch.exp(2 * (cosine - 1)) + torch.exp(2 * (above @ self.storey_steps.T - 1))
        return _shares(similarity @ self.storey_weight + self.storey_mean, 0.0), density

    def _median(self, density: torch.Tensor) -> torch.Tensor:
        """(n, 2) by Weiszfeld's steps from densities (n, c), as :meth:`DensityCells.median` takes them."""
        pull = density
        for _ in range(MEDIAN_STEPS):
            xy = (pull @ self.cell_centre_m) / pull.sum(dim=1, keepdim=True)
            pull = density / torch.sqrt(self._distance_m2(xy) + SMOOTH_M**2)
        return (pull @ self.cell_centre_m) / pull.sum(dim=1, keepdim=True)

    def _distance_m2(self, xy: torch.Tensor) -> torch.Tensor:
        """(n, c) squared distances of points (n, 2) from the cells' centres."""
        return (xy[:, None] - self.cell_centre_m).square().sum(dim=2)

    def _spread(
        self, density: torch.Tensor, cosine: torch.Tensor, xy: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the spread of guesses and the novelty, both (n,)."""
        of_density_m = (density * torch.sqrt(self._distance_m2(xy))).sum(dim=1) / density.sum(dim=1)
        distance = torch.sqrt((2 - 2 * cosine).clamp(min=0.0))
        count = self.centre_apart.shape[0]
        ranked = distance + TIE * torch.arange(count)
        nearest = torch.topk(ranked, min(PLACED, count), dim=1, largest=False).indices
        dispersal_m = torch.sqrt((self.centre_xy[nearest] - xy[:, None]).square().sum(dim=2)).mean(dim=1)
        compared = nearest[:, :COMPARED]
        unlike = torch.gather(distance, 1, compared).mean(dim=1)
        excess = (unlike - self.centre_apart[compared].mean(dim=1) - LEAST_EXCESS).clamp(min=0.0)
        return torch.sqrt(of_density_m * dispersal_m), excess * unlike


def _directions(level: torch.Tensor) -> torch.Tensor:
    """(n, a) as :func:`.scan_kernels.directions` makes them."""
    powed = level**EXPONENT
    return powed / torch.sqrt(powed.square().sum(dim=1, keepdim=True)).clamp(min=LEAST_LENGTH)


def _shares(score: torch.Tensor, least: float) -> torch.Tensor:
    """Raise scores (n, t) to a minimum and normalise their sums to 1."""
    score = score.clamp(min=least)
    return score / score.sum(dim=1, keepdim=True).clamp(min=LEAST_DENSITY)


def _radius_m(growth: RadiusGrowth, scale_m: torch.Tensor, novelty: torch.Tensor) -> torch.Tensor:
    """(n,) as :meth:`.RadiusGrowth.radius_m` has it."""
    return scale_m * (growth.factor + growth.by_novelty * novelty)
