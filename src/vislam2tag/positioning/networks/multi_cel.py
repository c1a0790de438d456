"""multi-CEL (Laska and Blankenbach 2022; the paper's better model): classifies a cell and regresses a code within it.

Trained on all cells that reach a place, so that a neighbour of the right cell decodes to the right place, too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import torch

from vislam2tag.core.arrays import AnyArray, FloatArray
from vislam2tag.positioning.networks.layers import InputScale, Locator, NetworkAnswer, dense, linear
from vislam2tag.positioning.networks.overlapping_cells import CellCodes, CellLattice, decoded, lattice_over
from vislam2tag.positioning.networks.positioner import NetworkPositioner
from vislam2tag.positioning.places import ScanPlaces
from vislam2tag.positioning.radio_scans import RadioScans

_SHORTEST_CODE = 1e-3
"""A place nearer to a cell's centre weighs no more than this one."""


class TwoHeads(torch.nn.Module):  # type: ignore[misc]  # torch counts as Any
    """A common part, then a head that classifies cells and one that says a code for each."""

    def __init__(self, inputs: int, cells: int, model: MultiCel) -> None:
        super().__init__()
        width = model.backbone[-1] if len(model.backbone) else inputs
        ends = model.heads[-1] if len(model.heads) else width
        self.backbone = dense(inputs, model.backbone, model.dropout)
        self.class_head = dense(width, model.heads, model.head_dropout).append(linear(ends, cells))
        self.code_head = dense(width, model.heads, model.head_dropout).append(linear(ends, 2 * cells))

    def forward(self, inputs: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return logits (n, c) and codes (n, c, 2)."""
        hidden = self.backbone(inputs)
        return self.class_head(hidden), torch.tanh(self.code_head(hidden)).unflatten(1, (-1, 2))


class MultiCelLocator(Locator):
    """Decodes the best cell's code; the floor is the cell's."""

    def __init__(self, inputs: int, cells: int, storeys: int, model: MultiCel) -> None:
        super().__init__(TwoHeads(inputs, cells, model), storeys)
        self.class_weight, self.code_weight = model.class_weight, model.code_weight
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
    """The model; parameters as in the paper's table by default (other published settings: models/multi_cel.py)."""

    lattice_: CellLattice
    """Of the training data; a model that was loaded has none, as its locator knows the cells."""

    def __init__(
        self,
        *,
        cell_m: float = 10.0,
        overlap: float = 0.3,
        backbone: Sequence[int] = (512,),
        heads: Sequence[int] = (512,),
        dropout: float = 0.5,
        head_dropout: float = 0.25,
        class_weight: float = 1.0,
        code_weight: float = 1.0,
        input_scale: str = "min-max",
        epochs: int = 50,
        batch_size: int = 0,
        learning_rate: float = 1e-3,
        weight_decay: float = 0.0,
        patience: int = 30,
        validation_share: float = 0.1,
        seed: int = 0,
        device: str = "auto",
    ) -> None:
        """Take the side of cells and by which share of it they reach further; widths of layers; the losses' weights."""
        self.cell_m = cell_m
        self.overlap = overlap
        self.backbone = backbone
        self.heads = heads
        self.dropout = dropout
        self.head_dropout = head_dropout
        self.class_weight = class_weight
        self.code_weight = code_weight
        self.input_scale = input_scale
        self.epochs = epochs
        self.batch_size = batch_size
        self.learning_rate = learning_rate
        self.weight_decay = weight_decay
        self.patience = patience
        self.validation_share = validation_share
        self.seed = seed
        self.device = device

    def _new_locator(self, scans: RadioScans, places: ScanPlaces) -> Locator:
        self.lattice_ = lattice_over(places, self.cell_m, self.overlap)
        locator = MultiCelLocator(len(self.access_points_), self.lattice_.count, len(self.storeys_), self)
        locator.set_cells(self.lattice_)
        locator.scaling.fit(scans, InputScale(self.input_scale))
        return locator

    def _empty_locator(self, arrays: Mapping[str, FloatArray]) -> Locator:
        return MultiCelLocator(len(self.access_points_), len(arrays["centre_m"]), len(self.storeys_), self)

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
