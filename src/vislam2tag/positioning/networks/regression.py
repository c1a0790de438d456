"""The paper's 3-D regression network: x, y and the floor as three numbers.

With several buildings each has one more number, 1 for the building and 0 for the others, because their frames may
overlap.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch

from vislam2tag.core.arrays import AnyArray, FloatArray
from vislam2tag.positioning.networks.layers import Locator, NetworkAnswer, dense, linear
from vislam2tag.positioning.networks.positioner import NetworkPositioner, NetworkSettings
from vislam2tag.positioning.places import ScanPlaces

FLOOR_DEVIATION = 0.5
"""Standard deviation of the number for the floor, in floors; used only for the probabilities of floors."""


@dataclass(frozen=True, kw_only=True)
class RegressionSettings(NetworkSettings):
    """Parameters; the defaults are those of the paper's table (other published settings: models/regression_net.py)."""

    head: Sequence[int] = (512,)


class RegressionLocator(Locator):
    """Answers with the floor of the most likely building that is closest to the third number."""

    def __init__(self, inputs: int, buildings: int, storeys: int, settings: RegressionSettings) -> None:
        width = settings.backbone[-1] if len(settings.backbone) else inputs
        ends = settings.head[-1] if len(settings.head) else width
        network = torch.nn.Sequential(
            *dense(inputs, settings.backbone, settings.dropout),
            *dense(width, settings.head, settings.head_dropout),
            linear(ends, 3 + buildings),
        )
        super().__init__(network, storeys)
        self.constant("mean", torch.zeros(3))
        self.constant("deviation", torch.ones(3))
        self.constant("floor", torch.zeros(storeys))
        self.constant("taught", torch.zeros(storeys))
        self.constant("in_building", torch.zeros(storeys, buildings))

    def set_places(self, places: ScanPlaces, in_building: FloatArray) -> None:
        """Set the scale of x, y and floor, the possible floors, and their buildings (s, buildings)."""
        targets = _targets(places)
        deviation = targets.std(axis=0)
        self.mean.copy_(torch.from_numpy(targets.mean(axis=0)))
        self.deviation.copy_(torch.from_numpy(np.where(deviation > 0, deviation, 1.0)))
        self.floor.copy_(torch.tensor([storey.floor for storey in places.storeys]))
        self.taught[torch.from_numpy(np.unique(places.storey))] = 1.0
        self.in_building.copy_(torch.from_numpy(in_building))

    def losses(self, inputs: torch.Tensor, *targets: torch.Tensor) -> torch.Tensor:
        """Mean squared error of x, y and floor (b, 3), each scaled, and of the building (b, buildings)."""
        true, building = targets
        scaled = torch.cat([((true - self.mean) / self.deviation).float(), building], dim=1)
        return (self.network(inputs) - scaled).square().mean(dim=1)

    def answer(self, inputs: torch.Tensor) -> NetworkAnswer:
        """Invert the scaling of the answers for scaled scans (n, a).

        There is only one guess. The spread from dropout (Gal and Ghahramani 2016) says little about the error: in
        cross-validation, circles from it were larger at 68 % and hardly smaller at 95 %.
        """
        found = self.network(inputs)
        place = found[:, :3] * self.deviation + self.mean
        off = self.floor - place[:, 2:]
        here = (self.taught > 0).expand_as(off)
        if self.in_building.shape[1]:
            building = found[:, 3:].argmax(dim=1)
            here = here & (self.in_building.T[building] > 0)
        closeness = torch.where(here, -0.5 * (off / FLOOR_DEVIATION).square(), -torch.inf)
        return NetworkAnswer(
            xy=place[:, :2],
            storey=closeness.argmax(dim=1),
            storey_probability=torch.softmax(closeness, dim=1),
            spread_m=torch.zeros_like(place[:, 0]),
        )


class RegressionNet(NetworkPositioner):
    """Regression of coordinates and floor."""

    kind = RegressionSettings
    settings: RegressionSettings
    buildings_: FloatArray
    """(s, buildings) 1 if a storey is in a building; no columns if there is one building."""

    def _new_locator(self, places: ScanPlaces) -> Locator:
        self.buildings_ = _buildings(places)
        locator = self._locator(self.buildings_.shape[1])
        locator.set_places(places, self.buildings_)
        return locator

    def _empty_locator(self, arrays: Mapping[str, FloatArray]) -> Locator:
        return self._locator(arrays["in_building"].shape[1])

    def _locator(self, buildings: int) -> RegressionLocator:
        return RegressionLocator(len(self.access_points_), buildings, len(self.storeys_), self.settings)

    def _targets(self, places: ScanPlaces) -> Sequence[AnyArray]:
        return _targets(places), self.buildings_[places.storey].astype(np.float32)


def _targets(places: ScanPlaces) -> FloatArray:
    """(n, 3) x and y in metres, and the floor's number."""
    return np.column_stack([places.xy, places.floor])


def _buildings(places: ScanPlaces) -> FloatArray:
    """(s, buildings) which storey is in which of the buildings of the places; no columns if there is only one."""
    names = [storey.building for storey in places.storeys]
    taught = sorted({names[storey] for storey in np.unique(places.storey)})
    if len(taught) == 1:
        return np.zeros((len(names), 0))
    return np.array([[float(name == building) for building in taught] for name in names])
