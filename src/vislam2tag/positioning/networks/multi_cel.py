"""multi-CEL (Laska and Blankenbach 2022; the paper's better model): classifies a cell and regresses a code within it.

Square cells overlap on every storey, and a place is a code within each cell that reaches it. The network is trained on
all of these cells, so that a neighbour of the right cell also decodes to the right place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from vislam2tag.common.errors import DatasetError
from vislam2tag.core.arrays import AnyArray, BoolArray, FloatArray, IntArray
from vislam2tag.positioning.networks.layers import Locator, NetworkAnswer, dense, linear
from vislam2tag.positioning.networks.positioner import NetworkPositioner, NetworkSettings
from vislam2tag.positioning.places import ScanPlaces

NO_CELL = -1
MOST_CELLS = 50_000
"""More cells mean a wrong place, or much too small cells: this is 5 km² in cells of 10 m."""


@dataclass(frozen=True)
class CellCodes:
    """The same ``n`` places seen from each of up to ``k`` cells that reach them, the nearest cell first."""

    cell: IntArray
    """(n, k) NO_CELL if fewer cells reach the place."""
    code: FloatArray
    """(n, k, 2) offset from the cell's centre; 1 is the end of its reach; 0 without a cell."""

    @property
    def valid(self) -> BoolArray:
        """(n, k)"""
        return np.asarray(self.cell != NO_CELL)


@dataclass(frozen=True)
class CellLattice:
    """Cells of all storeys, numbered through; centres lie at multiples of the cell's side."""

    cell_m: float
    """Side of a cell."""
    overlap: float
    """Distance that a cell reaches beyond its side, as a share of the side."""
    first: IntArray
    """(s, 2) column and row of each storey's first centre, in sides from the frame's origin."""
    size: IntArray
    """(s, 2) number of columns and rows; 0 on storeys without training data."""

    @property
    def reach_m(self) -> float:
        """Greatest distance along x or y from a centre that a code can express."""
        return self.cell_m * (0.5 + self.overlap)

    @property
    def count(self) -> int:
        """Number of cells."""
        return int(self.size.prod(axis=1).sum())

    @property
    def storey(self) -> IntArray:
        """(count,) storey of each cell."""
        return np.repeat(np.arange(len(self.size)), self.size.prod(axis=1))

    @property
    def centre_m(self) -> FloatArray:
        """(count, 2)"""
        rows = np.arange(self.count) - self._offset[self.storey]
        columns = np.maximum(self.size[self.storey, 0], 1)
        steps = self.first[self.storey] + np.stack([rows % columns, rows // columns], axis=1)
        return np.asarray(steps * self.cell_m)

    @property
    def _offset(self) -> IntArray:
        """(s,) number of each storey's first cell."""
        cells = self.size.prod(axis=1)
        return np.asarray(np.cumsum(cells) - cells)

    def codes(self, storey: IntArray, xy: FloatArray) -> CellCodes:
        """Encode places (n) and (n, 2) on storeys that have cells.

        Outside the lattice the nearest cell still counts; its code is then beyond 1.
        """
        within = np.rint(xy / self.cell_m).astype(np.int64) - self.first[storey]
        nearest = np.clip(within, 0, self.size[storey] - 1)
        step = int(np.floor(1 + self.overlap))
        steps = np.array([(dx, dy) for dy in range(-step, step + 1) for dx in range(-step, step + 1)])
        steps = steps[np.argsort(np.abs(steps).sum(axis=1), kind="stable")]
        at = nearest[:, None] + steps
        code = (xy[:, None] - (self.first[storey][:, None] + at) * self.cell_m) / self.reach_m
        valid = ((at >= 0) & (at < self.size[storey][:, None]) & (np.abs(code) < 1)).all(axis=2)
        valid[:, 0] = True
        cell = self._offset[storey][:, None] + at[..., 1] * self.size[storey, 0][:, None] + at[..., 0]
        kept = valid.any(axis=0)
        return CellCodes(
            cell=np.where(valid, cell, NO_CELL)[:, kept], code=np.where(valid[..., None], code, 0.0)[:, kept]
        )


def lattice_over(places: ScanPlaces, cell_m: float, overlap: float) -> CellLattice:
    """Cover the extent of the places on each storey, with one more row and column.

    Raises DatasetError if this needs more than MOST_CELLS.
    """
    first = np.zeros((len(places.storeys), 2), dtype=np.int64)
    size = np.zeros_like(first)
    for storey in np.unique(places.storey):
        xy = places.xy[places.storey == storey] / cell_m
        first[storey] = np.floor(xy.min(axis=0))
        size[storey] = np.ceil(xy.max(axis=0)) - first[storey] + 1
    lattice = CellLattice(cell_m, overlap, first, size)
    if lattice.count > MOST_CELLS:
        width, height = size.max(axis=0) * cell_m
        raise DatasetError(
            f"the floor's places extend over {width:.0f} x {height:.0f} m, which is {lattice.count} cells of "
            f"{cell_m:g} m; correct the labels, or make the cells larger (at most {MOST_CELLS} cells are possible)"
        )
    return lattice


def decoded(centre_m: Any, code: Any, reach_m: float) -> Any:
    """Return the places of codes (NumPy or PyTorch)."""
    return centre_m + reach_m * code


_SHORTEST_CODE = 1e-3
"""A place closer to a cell's centre has the same weight as this one."""


@dataclass(frozen=True, kw_only=True)
class MultiCelSettings(NetworkSettings):
    """Parameters; the defaults are those of the paper's table (other published settings: models/multi_cel.py)."""

    cell_m: float = 10.0
    """Side of a cell."""
    overlap: float = 0.3
    """Distance that a cell reaches beyond its side, as a share of the side."""
    heads: Sequence[int] = (512,)
    class_weight: float = 1.0
    """Weight of the classification loss; ``code_weight`` is that of the codes."""
    code_weight: float = 1.0


class TwoHeads(torch.nn.Module):  # type: ignore[misc]  # torch counts as Any
    """A common part, then a head that classifies cells and one that gives a code for each."""

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
    """Decodes the best cell's code; the floor is that of the cell."""

    def __init__(self, inputs: int, cells: int, storeys: int, settings: MultiCelSettings) -> None:
        super().__init__(TwoHeads(inputs, cells, settings), storeys)
        self.class_weight, self.code_weight = settings.class_weight, settings.code_weight
        self.constant("centre_m", torch.zeros(cells, 2))
        self.constant("reach_m", torch.ones(()))
        self.constant("on_storey", torch.zeros(cells, storeys))

    def set_cells(self, lattice: CellLattice) -> None:
        """Set the positions of the cells."""
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
        """Decode scaled scans (n, a); guesses are the places of all cells, each with its cell's probability."""
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
    """Classification of cells with codes."""

    kind = MultiCelSettings
    settings: MultiCelSettings
    lattice_: CellLattice
    """Lattice of the training data; a loaded model has none, because its locator contains the cells."""

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
    """Select cells (n, k) from (n, c, 2): (n, k, 2)."""
    return values.gather(1, cell[..., None].expand(-1, -1, 2))


def _weights(codes: CellCodes) -> FloatArray:
    """(n, k) inverse squared length of each code, summing to 1 over a place's cells."""
    length = np.maximum((codes.code**2).sum(axis=2), _SHORTEST_CODE**2)
    weight = np.where(codes.valid, 1 / length, 0.0)
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))
