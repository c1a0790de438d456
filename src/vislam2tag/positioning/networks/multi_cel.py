"""multi-CEL (Laska and Blankenbach 2022; the paper's better model): classifies a cell and regresses a code within it.

Trained on all cells that reach a place, so that a neighbour of the right cell decodes to the right place, too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch

from vislam2tag.core.arrays import AnyArray, FloatArray
from vislam2tag.positioning.networks.layers import Locator, NetworkAnswer, dense, linear
from vislam2tag.positioning.networks.overlapping_cells import CellCodes, CellLattice, decoded, lattice_over
from vislam2tag.positioning.networks.positioner import NetworkPositioner, NetworkSettings
from vislam2tag.positioning.places import ScanPlaces

_SHORTEST_CODE = 1e-3
"""A place nearer to a cell's centre weighs no more than this one."""


@dataclass(frozen=True, kw_only=True)
class MultiCelSettings(NetworkSettings):
    """Parameters; by default as in the paper's table (other published settings: models/multi_cel.py)."""

    cell_m: float = 10.0
    """Side of a cell."""
    overlap: float = 0.3
    """How far a cell reaches past its side, as a share of the side."""
    heads: Sequence[int] = (512,)
    class_weight: float = 1.0
    """Of its loss, as ``code_weight``."""
    code_weight: float = 1.0


class TwoHeads(torch.nn.Module):  # type: ignore[misc]  # torch counts as Any
    """A common part, then a head that classifies cells and one that says a code for each."""

    def __init__(self, inputs: int, cells: int, settings: MultiCelSettings) -> None:
        super().__init__()
        width = settings.backbone[-1] if len(settings.backbone) else inputs
        ends = settings.heads[-1] if len(settings.heads) else width
        self.backbone = dense(inputs, settings.backbone, settings.dropout)
        self.class_head = dense(width, settings.heads, settings.head_dropout).append(linear(ends, cells))
        self.code_head = dense(width, settings.heads, settings.head_dropout).append(linear(ends, 2 * cells))

    def forward(self, inputs: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return logits (n, c) and codes (n, c, 2)."""
        hidden = self.backbone(inputs)
        return self.class_head(hidden), torch.tanh(self.code_head(hidden)).unflatten(1, (-1, 2))


class MultiCelLocator(Locator):
    """Decodes the best cell's code; the floor is the cell's."""

    def __init__(self, inputs: int, cells: int, storeys: int, settings: MultiCelSettings) -> None:
        super().__init__(TwoHeads(inputs, cells, settings), storeys)
        self.class_weight, self.code_weight = settings.class_weight, settings.code_weight
        self.constant("centre_m", torch.zeros(cells, 2))
        self.constant("reach_m", torch.ones(()))
        self.constant("on_storey", torch.zeros(cells, storeys))

    def set_cells(self, lattice: CellLattice) -> None:
        """Take where the cells lie."""
        self.centre_m.copy_(torch.from_numpy(lattice.centre_m))
        self.reach_m.fill_(lattice.reach_m)
        self.on_storey[torch.arange(lattice.count), torch.from_numpy(lattice.storey)] = 1.0

    def losses(self, inputs: torch.Tensor, *targets: torch.Tensor) -> torch.Tensor:
        """Cross-entropy against the weights of the cells that reach a place, plus the squared errors of their codes.

        ``targets``: cells (b, k), any where the weight is 0, weights (b, k) and codes (b, k, 2).
        """
        cell, weight, code = targets
        logits, codes = self.network(inputs)
        class_loss = -(weight * torch.log_softmax(logits, dim=1).gather(1, cell)).sum(dim=1)
        error = (_of_cells(codes, cell) - code).square().sum(dim=2)
        return self.class_weight * class_loss + self.code_weight * (error * (weight > 0)).sum(dim=1)

    def answer(self, inputs: torch.Tensor) -> NetworkAnswer:
        """Decode scaled scans (n, a); guesses are the places that all cells say, each as likely as its cell."""
        logits, codes = self.network(inputs)
        probability = torch.softmax(logits, dim=1)
        best = probability.argmax(dim=1)
        places_m = decoded(self.centre_m, codes, self.reach_m)
        xy = _of_cells(places_m, best[:, None])[:, 0]
        spread_m2 = (probability * (places_m - xy[:, None]).square().sum(dim=2)).sum(dim=1)
        return NetworkAnswer(
            xy=xy,
            storey=self.on_storey.argmax(dim=1)[best],
            storey_probability=probability @ self.on_storey,
            spread_m=spread_m2.sqrt(),
        )


class MultiCel(NetworkPositioner):
    """The model."""

    kind = MultiCelSettings
    settings: MultiCelSettings
    lattice_: CellLattice
    """Of the training data; a model that was loaded has none, as its locator knows the cells."""

    def _new_locator(self, places: ScanPlaces) -> Locator:
        self.lattice_ = lattice_over(places, self.settings.cell_m, self.settings.overlap)
        locator = self._locator(self.lattice_.count)
        locator.set_cells(self.lattice_)
        return locator

    def _empty_locator(self, arrays: Mapping[str, FloatArray]) -> Locator:
        return self._locator(len(arrays["centre_m"]))

    def _locator(self, cells: int) -> MultiCelLocator:
        return MultiCelLocator(len(self.access_points_), cells, len(self.storeys_), self.settings)

    def _targets(self, places: ScanPlaces) -> Sequence[AnyArray]:
        codes = self.lattice_.codes(places.storey, places.xy)
        return np.where(codes.valid, codes.cell, 0), _weights(codes).astype(np.float32), codes.code.astype(np.float32)


def _of_cells(values: torch.Tensor, cell: torch.Tensor) -> torch.Tensor:
    """Pick from (n, c, 2) those of cells (n, k): (n, k, 2)."""
    return values.gather(1, cell[..., None].expand(-1, -1, 2))


def _weights(codes: CellCodes) -> FloatArray:
    """(n, k) inverse squared length of each code, summing to 1 over a place's cells."""
    length = np.maximum((codes.code**2).sum(axis=2), _SHORTEST_CODE**2)
    weight = np.where(codes.valid, 1 / length, 0.0)
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))
