"""A small data set on disk and models that train in no time, for tests of the benchmark."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.datasets.factory import small_dataset
from vislam2tag.common.errors import DatasetError
from vislam2tag.core.arrays import FloatArray
from vislam2tag.datasets.folder import open_dataset, write_dataset
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.splits import standard_splits
from vislam2tag.positioning import registry as base
from vislam2tag.positioning.places import Positions, ScanPlaces
from vislam2tag.positioning.radio_scans import RadioScans
from vislam2tag.positioning.registry import NamedArrays, Positioner, register


def benchmark_dataset(folder: Path) -> Dataset:
    dataset = small_dataset()
    write_dataset(replace(dataset, splits=standard_splits(dataset)), folder)
    return open_dataset(folder)


class Loudest(Positioner):
    """Where the training scan lies that heard the same access point loudest; without a parameter that draws."""

    radius_m: float

    def __init__(self, radius_m: float = 10.0) -> None:
        self.radius_m = radius_m

    def _fit(self, scans: RadioScans, places: ScanPlaces, validation: tuple[RadioScans, ScanPlaces] | None) -> None:
        self.nearest_ = np.nanargmax(scans.dense(-200.0), axis=0)
        self.places_ = places

    def _predict(self, scans: RadioScans) -> Positions:
        rows = self.nearest_[np.nanargmax(scans.dense(-200.0), axis=1)]
        n = len(scans)
        return Positions(
            storeys=self.storeys_,
            storey=self.places_.storey[rows],
            xy=self.places_.xy[rows] + self.offset_m,
            z=self.places_.z[rows],
            storey_probability=np.full((n, len(self.storeys_)), 1 / len(self.storeys_)),
            radius_68_m=np.linspace(0.5, 1.0, n) * self.radius_m,
            radius_95_m=np.linspace(0.5, 1.0, n) * 2 * self.radius_m,
        )

    @property
    def offset_m(self) -> float:
        return 0.0

    def arrays(self) -> NamedArrays:
        return {}

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        raise NotImplementedError


class Drawn(Loudest):
    """The same, off by what its seed draws."""

    def __init__(self, radius_m: float = 10.0, seed: int = 0) -> None:
        super().__init__(radius_m)
        self.seed = seed

    @property
    def offset_m(self) -> float:
        return float(np.random.default_rng(self.seed).normal())


class Telling(Drawn):
    """The same, telling when it is half way."""

    def _fit(self, scans: RadioScans, places: ScanPlaces, validation: tuple[RadioScans, ScanPlaces] | None) -> None:
        self.progress(0.5, 1)
        super()._fit(scans, places, validation)


class Picky(Loudest):
    """Learns of no phone but one."""

    def _fit(self, scans: RadioScans, places: ScanPlaces, validation: tuple[RadioScans, ScanPlaces] | None) -> None:
        if set(scans.device) != {"Pixel"}:
            raise DatasetError("it takes a Pixel")
        super()._fit(scans, places, validation)


MODELS = {"test-loudest": Loudest, "test-drawn": Drawn, "test-telling": Telling, "test-picky": Picky}


def register_all() -> None:
    """Make them known for the rest of this process; tests in one process with others use :func:`known_models`."""
    for name, model in MODELS.items():
        register(name, model)


@pytest.fixture
def known_models(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, model in MODELS.items():
        monkeypatch.setitem(base.MODELS._items, name, model)
