"""Density over small cells: networks and a kernel classifier say how likely each cell is, the place is its centre.

Each network learns a blob around the label, not one cell, so that neighbouring cells help each other. The floor is
voted for by the networks and a kernel classifier; the place is the geometric median of the density on that floor,
which far-off second guesses do not pull.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch

from vislam2tag.positioning.density_cells import DensityCells
from vislam2tag.positioning.networks.layers import dense, linear
from vislam2tag.positioning.networks.locator import Answer, Locator
from vislam2tag.positioning.networks.storey_kernel import StoreyKernel
from vislam2tag.positioning.representation import FAINTEST_DBM

_MEDIAN_STEPS = 12
_SMOOTH_M = 1.0
"""Distances below this count as this in the geometric median."""
_SMALLEST = 1e-6


class Member(torch.nn.Module):  # type: ignore[misc]  # torch counts as Any
    """One network: a scan's levels, seen its own way, to a logit a cell."""

    def __init__(self, inputs: int, cells: int, exponent: float, widths: Sequence[int], dropout: float) -> None:
        super().__init__()
        self.exponent = exponent
        self.layers = dense(inputs, widths, dropout).append(linear(widths[-1] if len(widths) else inputs, cells))

    def forward(self, level: torch.Tensor) -> torch.Tensor:
        """Return logits (n, c) for levels (n, a) from 0 to 1."""
        return self.layers(seen(level, self.exponent))


def seen(level: torch.Tensor, exponent: float) -> torch.Tensor:
    """Raise levels (n, a) to a power and scale each scan to length 5: a phone that hears all fainter looks alike.

    With exponent 1 levels stay as they are.
    """
    if exponent == 1.0:
        return level
    powed = level**exponent
    return 5.0 * powed / powed.norm(dim=1, keepdim=True).clamp(min=_SMALLEST)


class CellDensityLocator(Locator):
    """Averages the members' densities, and lets the kernel classifier vote on the floor."""

    def __init__(self, members: Sequence[Member], kernel: StoreyKernel, cells: int, storeys: int) -> None:
        super().__init__(torch.nn.ModuleList(members), storeys)
        self.kernel = kernel
        self.constant("centre_m", torch.zeros(cells, 2))
        self.constant("on_storey", torch.zeros(cells, storeys))
        self.scaling.faintest_dbm.fill_(FAINTEST_DBM)
        self.scaling.strongest_dbm.fill_(0.0)

    def set_cells(self, cells: DensityCells) -> None:
        """Take where the cells lie."""
        self.centre_m.copy_(torch.from_numpy(cells.centre_m))
        self.on_storey[torch.arange(len(cells)), torch.from_numpy(cells.storey)] = 1.0

    def density(self, level: torch.Tensor) -> torch.Tensor:
        """Return how likely each cell is (n, c), the floor's vote counted in."""
        density = torch.stack([torch.softmax(member(level), dim=1) for member in self.network]).mean(dim=0)
        of_storey = density @ self.on_storey
        vote = (of_storey + self.kernel(level)) / 2
        return density * ((vote / of_storey.clamp(min=_SMALLEST)) @ self.on_storey.T)

    def answer(self, inputs: torch.Tensor) -> Answer:
        """Decode; the spread is the mean distance of the whole density, other floors' too, from the answer."""
        density = self.density(inputs)
        density = density / density.sum(dim=1, keepdim=True)
        of_storey = density @ self.on_storey
        storey = of_storey.argmax(dim=1)
        xy = self._median(density * self.on_storey.T[storey])
        away = torch.cdist(xy, self.centre_m, compute_mode="donot_use_mm_for_euclid_dist")
        return Answer(xy, storey, of_storey, (density * away).sum(dim=1))

    def _median(self, weight: torch.Tensor) -> torch.Tensor:
        """Return the geometric median (n, 2) of cells of these weights (n, c) (Weiszfeld's steps from the mean)."""
        pull = weight
        for _ in range(_MEDIAN_STEPS):
            xy = (pull @ self.centre_m) / pull.sum(dim=1, keepdim=True)
            away2 = (xy[:, None] - self.centre_m).square().sum(dim=2)
            pull = weight / (away2 + _SMOOTH_M**2).sqrt()
        return (pull @ self.centre_m) / pull.sum(dim=1, keepdim=True)


def blobs(
    xy: torch.Tensor, storey: torch.Tensor, width_m: torch.Tensor, centre_m: torch.Tensor, on_storey: torch.Tensor
) -> torch.Tensor:
    """Return targets (b, c) summing to 1: a Gaussian of each place's width (b,) over the cells of its storey."""
    away2 = (xy[:, None] - centre_m).square().sum(dim=2)
    logit = -away2 / (2 * width_m[:, None] ** 2)
    return torch.softmax(logit.masked_fill(on_storey.T[storey] == 0, -torch.inf), dim=1)
