"""A data set's fingerprints as arrays to learn from: scans, places, and the ids that splits speak of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError
from vislam2tag.core.arrays import BoolArray
from vislam2tag.core.status import Status
from vislam2tag.datasets.model import Dataset, Fold, Split, Storey
from vislam2tag.positioning.places import ScanPlaces
from vislam2tag.positioning.radio_scans import RadioScans, Rows, TextArray, scans_from_readings

_FINGERPRINT = ["scan_id", "building", "floor", "x", "y", "z", "sigma", "device", "session", "start_ns"]


@dataclass(frozen=True)
class LearningData:
    """``n`` labelled fingerprints, ordered as in the data set."""

    ids: TextArray
    """(n,) scan_id."""
    scans: RadioScans
    places: ScanPlaces

    def __len__(self) -> int:
        return len(self.ids)

    def __getitem__(self, rows: Rows) -> LearningData:
        return LearningData(self.ids[rows], self.scans[rows], self.places[rows])

    def train_test(self, split: Split, fold: Fold) -> tuple[LearningData, LearningData]:
        """Return what trains and what tests in a fold."""
        train, test = split.train_test_ids(fold)
        return self[self._among(train)], self[self._among(test)]

    def _among(self, ids: pl.Series) -> BoolArray:
        """Which scans (n,) have one of these ids."""
        return np.isin(self.ids, ids.to_numpy().astype(np.str_))


def learning_data(dataset: Dataset, technology: str = "wifi") -> LearningData:
    """Read all labelled fingerprints of one technology.

    Those whose label is uncertain are left out, as everywhere where labelled ones count (no split holds them). Raises
    DatasetError where there is none.
    """
    labelled = (
        dataset.fingerprints.filter(
            (pl.col("technology") == technology)
            & (pl.col("status") == Status.OK.label)
            & pl.col("x").is_finite()
            & pl.col("y").is_finite()
        )
        .select(_FINGERPRINT)
        .collect()
        .with_row_index("row")
    )
    if labelled.is_empty():
        raise DatasetError(f"{dataset.info.name}: holds no labelled fingerprint of technology {technology}")
    readings = (
        dataset.readings.select("scan_id", "bssid", "rssi_dbm")
        .join(labelled.lazy().select("scan_id", "row"), on="scan_id")
        .collect(engine="streaming")
    )
    return LearningData(
        ids=labelled["scan_id"].to_numpy().astype(np.str_),
        scans=scans_from_readings(
            readings["row"].to_numpy().astype(np.int64),
            readings["bssid"].to_numpy().astype(np.str_),
            readings["rssi_dbm"].to_numpy().astype(np.float64),
            labelled.height,
            device=_text(labelled["device"]),
            session=_text(labelled["session"]),
            time_ns=labelled["start_ns"].fill_null(0).to_numpy(),
        ),
        places=_places(labelled, dataset),
    )


def _places(labelled: pl.DataFrame, dataset: Dataset) -> ScanPlaces:
    """Number the storeys over the manifest's floors and those that only the fingerprints have."""
    building = labelled["building"].fill_null("").to_list()
    floor = labelled["floor"].fill_null(0).to_list()
    here = [Storey(*pair) for pair in zip(building, floor, strict=True)]
    storeys = sorted({*here, *(Storey(info.building, info.number) for info in dataset.info.floors)})
    return ScanPlaces(
        storeys=tuple(storeys),
        storey=np.array([storeys.index(storey) for storey in here], dtype=np.int64),
        xy=labelled.select("x", "y").to_numpy().astype(np.float64),
        z=labelled["z"].cast(pl.Float64).fill_null(float("nan")).to_numpy(),
        sigma_m=labelled["sigma"].cast(pl.Float64).fill_null(float("nan")).to_numpy(),
    )


def _text(column: pl.Series) -> TextArray:
    """(n,) text; empty where null."""
    return column.fill_null("").to_numpy().astype(np.str_)
