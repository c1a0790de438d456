"""Training data of a model: a data set's fingerprints as arrays, or a model's scans joined with a later survey.

Changes in the building are detected by the test of ``vislam2tag join`` (:mod:`vislam2tag.datasets.changes`). Readings
of access points that are gone or were moved are removed from the old scans. Old scans at places that were walked again
are kept, because errors are larger without them (docs/results/how-good.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.tabular import Frames, TabularResult, column_frame
from vislam2tag.core.arrays import BoolArray
from vislam2tag.core.status import Status
from vislam2tag.datasets.changes import APPEARED, MOVED, VANISHED, survey_changes
from vislam2tag.datasets.model import Dataset, DatasetInfo, Fold, Split, Storey
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, READINGS, in_schema
from vislam2tag.datasets.technologies import instead_of, main_technology, of_technology
from vislam2tag.positioning.places import LabelledScans, ScanPlaces, joined_places
from vislam2tag.positioning.radio_scans import RadioScans, Rows, TextArray, joined_scans, scans_from_readings

_FINGERPRINT = ["scan_id", "building", "floor", "x", "y", "z", "sigma", "device", "session", "start_ns"]


@dataclass(frozen=True, repr=False)
class LearningData(TabularResult):
    """``n`` labelled fingerprints, in the order of the data set."""

    main_table: ClassVar[str] = "fingerprints"

    ids: TextArray
    """(n,) scan_id."""
    scans: RadioScans
    places: ScanPlaces

    def __len__(self) -> int:
        return len(self.ids)

    def __getitem__(self, rows: Rows) -> LearningData:
        return LearningData(self.ids[rows], self.scans[rows], self.places[rows])

    def train_test(self, split: Split, fold: Fold) -> tuple[LearningData, LearningData]:
        """Return the training set and the test set of a fold."""
        train, test = split.train_test_ids(fold)
        return self[self._among(train)], self[self._among(test)]

    def _among(self, ids: pl.Series) -> BoolArray:
        """Which scans (n,) have one of these ids."""
        return np.isin(self.ids, ids.to_numpy().astype(np.str_))

    def _facts(self) -> dict[str, object]:
        return {
            "fingerprints": len(self),
            "access points": len(self.scans.access_points),
            "floors": len(self.places.storeys),
        }

    def _frames(self) -> Frames:
        return {"fingerprints": self._fingerprint_frame, "readings": self._reading_frame}

    def _fingerprint_frame(self) -> pl.DataFrame:
        """Places of the fingerprints, BCS metres; null if a value is not known."""
        storeys = [self.places.storeys[number] for number in self.places.storey.tolist()]
        x, y = self.places.xy.T
        numbers = {"x": x, "y": y, "z": self.places.z, "sigma": self.places.sigma_m}
        return column_frame(
            {
                "scan_id": self.ids,
                "building": [storey.building for storey in storeys],
                "floor": [storey.floor for storey in storeys],
                **numbers,
            }
        )

    def _reading_frame(self) -> pl.DataFrame:
        """Readings of the fingerprints, dBm."""
        scans = self.scans
        return column_frame(
            {
                "scan_id": self.ids[scans.row],
                "bssid": np.array(scans.access_points, dtype=np.str_)[scans.column],
                "rssi_dbm": scans.rssi_dbm,
            }
        )


def learning_data(dataset: Dataset, technology: str | None = None) -> LearningData:
    """Read all labelled fingerprints of one technology as arrays; None: that of :func:`main_technology`.

    Fingerprints with Wi-Fi and BLE also give those of one of them.

    Fingerprints with an uncertain label are excluded, as in all splits. Raises DatasetError if there are none.
    """
    technology = technology or main_technology(dataset)
    fingerprints, own = of_technology(dataset, technology)
    labelled = (
        fingerprints.filter((pl.col("status") == Status.OK.label) & pl.col("x").is_finite() & pl.col("y").is_finite())
        .select(_FINGERPRINT)
        .collect()
        .with_row_index("row")
    )
    if labelled.is_empty():
        raise DatasetError(
            f"{dataset.info.name}: the data set contains no labelled fingerprint of technology {technology}"
            f"{instead_of(dataset, technology)}"
        )
    readings = (
        own.select("scan_id", "bssid", "rssi_dbm")
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
    """Number the storeys over the manifest's floors and those that occur only in fingerprints."""
    building = labelled["building"].fill_null("").to_list()
    floor = labelled["floor"].fill_null(0).to_list()
    here = [Storey(*pair) for pair in zip(building, floor, strict=True)]
    storeys = sorted({*here, *(Storey(info.building, info.number) for info in dataset.info.floors)})
    number = {storey: row for row, storey in enumerate(storeys)}
    return ScanPlaces(
        storeys=tuple(storeys),
        storey=np.array([number[storey] for storey in here], dtype=np.int64),
        xy=labelled.select("x", "y").to_numpy().astype(np.float64),
        z=labelled["z"].cast(pl.Float64).fill_null(float("nan")).to_numpy(),
        sigma_m=labelled["sigma"].cast(pl.Float64).fill_null(float("nan")).to_numpy(),
    )


def _text(column: pl.Series) -> TextArray:
    """(n,) text; empty if null."""
    return column.fill_null("").to_numpy().astype(np.str_)


@dataclass(frozen=True)
class ModelUpdate:
    """Training data of an updated model."""

    learned: LabelledScans
    """Labelled scans, old ones first; scans that no longer hear anything are dropped."""
    added: int
    """Number of scans of the later survey that the model did not have."""
    gone: tuple[str, ...]
    """Access points with removed old readings, because they are no longer heard at strong places ..."""
    moved: tuple[str, ...]
    """... or because they were moved."""
    new: tuple[str, ...]
    """Access points that the old scans could not hear."""


def updated(known: LabelledScans, later: LabelledScans, technology: str = "wifi") -> ModelUpdate:
    """Join a model's scans with a later survey, which may be partial or contain the model's scans, too.

    Raises DatasetError if the later survey contains nothing new.
    """
    scans, places = joined_scans([known[0], later[0]]), joined_places([known[1], later[1]])
    old = np.arange(len(scans)) < len(known[0])
    kept = old | ~_known_already((scans, places), len(known[0]))
    scans, places, old = scans[kept], places[kept], old[kept]
    if old.all():
        raise DatasetError(
            "the model already contains all fingerprints of the later survey, so there is nothing to update"
        )
    before, since = (_as_dataset((scans[rows], places[rows]), technology) for rows in (old, ~old))
    points = survey_changes(before, since, technology).access_points
    change: dict[str, str] = dict(points.select("bssid", "change").iter_rows())
    outdated = np.array([change.get(name) in {VANISHED, MOVED} for name in scans.access_points])
    scans = scans.only(~(outdated[scans.column] & old[scans.row]))
    heard = scans.heard > 0
    gone, moved, new = (
        tuple(sorted(name for name, one in change.items() if one == kind)) for kind in (VANISHED, MOVED, APPEARED)
    )
    return ModelUpdate((scans[heard], places[heard]), int((~old).sum()), gone, moved, new)


def _known_already(labelled: LabelledScans, count: int) -> BoolArray:
    """Return which scans (n,) are the same as one of the first ``count``, at the same place."""
    scans, places = labelled
    ends = zip(scans.start[:-1].tolist(), scans.start[1:].tolist(), strict=True)
    heard = [(scans.column[a:b].tobytes(), scans.rssi_dbm[a:b].tobytes()) for a, b in ends]
    keys = list(zip(heard, places.storey.tolist(), map(tuple, places.xy.tolist()), strict=True))
    known = set(keys[:count])
    return np.array([key in known for key in keys])


def _as_dataset(labelled: LabelledScans, technology: str) -> Dataset:
    """Make the tables for the comparison of two surveys."""
    scans, places = labelled
    ids = pl.Series([f"{number:09d}" for number in range(len(scans))])
    storeys = [places.storeys[one] for one in places.storey.tolist()]
    fingerprints = pl.DataFrame(
        {
            "scan_id": ids,
            "building": [storey.building for storey in storeys],
            "floor": [storey.floor for storey in storeys],
            "x": places.xy[:, 0],
            "y": places.xy[:, 1],
            "device": scans.device.tolist(),
            "session": scans.session.tolist(),
        }
    ).with_columns(technology=pl.lit(technology), status=pl.lit(Status.OK.label))
    names = pl.Series(scans.access_points, dtype=pl.String)
    readings = pl.DataFrame({"scan_id": ids[scans.row], "bssid": names[scans.column], "rssi_dbm": scans.rssi_dbm})
    points = pl.DataFrame({"bssid": names, "technology": technology, "mobile": False})
    tables = {FINGERPRINTS: fingerprints, READINGS: readings, ACCESS_POINTS: points}
    return Dataset(
        DatasetInfo(name="", floors=()), {name: in_schema(name, table).lazy() for name, table in tables.items()}
    )
