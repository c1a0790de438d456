"""The labelled scans of one floor and technology, as arrays: what a radio map is made of."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import polars as pl

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.dataset.by_session import each_session
from vislam2tag.dataset.device_offsets import PlaceMeans, device_offsets
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.statistics.record import UNKNOWN

FOLDS = 5
_PLACE = ("building", "floor", "technology")


class MapPlace(NamedTuple):
    """A floor and the technology that is mapped on it."""

    building: str
    floor: int
    technology: str


@dataclass(frozen=True)
class MapReadings:
    """Scans (s) and the readings (k) of the access points (a) that are mapped; positions are BCS metres."""

    bssids: tuple[str, ...]
    scan_position: FloatArray
    """(s, 2)"""
    scan_fold: IntArray
    """(s,) part, 0 to FOLDS - 1, that is left out with the scan; walks stay whole where there are several."""
    scan: IntArray
    """(k,) index of the reading's scan."""
    access_point: IntArray
    """(k,) index of the reading's access point."""
    position: FloatArray
    """(k, 2) where the phone was when it heard it; NaN where that is not known."""
    rssi_dbm: FloatArray
    """(k,) as the mean of all devices would hear it: the offset of the reading's device is taken off."""

    def indices(self, bssids: Sequence[str]) -> IntArray:
        """Index of each of these access points (m,)."""
        return np.array([self.bssids.index(bssid) for bssid in bssids], dtype=np.int64)

    def of(self, access_point: int) -> tuple[FloatArray, FloatArray, IntArray]:
        """Position (n, 2), RSSI (n,) and fold (n,) of the readings of one access point that have a position."""
        own = (self.access_point == access_point) & np.isfinite(self.position[:, 0])
        return self.position[own], self.rssi_dbm[own], self.scan_fold[self.scan[own]]


def heard_at(dataset: Dataset) -> pl.DataFrame:
    """Count the labelled readings of each access point on each floor: building, floor, technology, bssid, readings.

    Most heard first on each floor.
    """
    heard = dataset.readings.join(_labelled(dataset).select("scan_id", *_PLACE), on="scan_id")
    counts = heard.group_by(*_PLACE, "bssid").agg(readings=pl.len()).collect(engine="streaming")
    return counts.sort(*_PLACE, "readings", "bssid", descending=[False, False, False, True, False])


def offsets_db(dataset: Dataset) -> dict[tuple[str, str], float]:
    """How much louder a device hears than the mean of those that share places with it, by technology and device."""
    places = PlaceMeans()
    scans = _labelled(dataset)
    devices = dict(scans.group_by("technology").agg(pl.col("device").unique().sort()).collect().iter_rows())
    if all(len(names) < 2 for names in devices.values()):
        return {}
    for tables in each_session(scans, dataset.readings):
        own = tables.fingerprints.select("scan_id", "technology", "building", "device")
        places.add(tables.readings.join(own, on="scan_id").drop_nulls(["x", "rssi_dbm"]))
    shared = places.shared()
    return {
        (technology, name): offset.offset_db
        for technology, names in sorted(devices.items())
        for name, offset in device_offsets(shared.filter(pl.col("technology") == technology), names).items()
        if offset.offset_db is not None
    }


def map_readings(
    dataset: Dataset, place: MapPlace, bssids: Collection[str], offsets: dict[tuple[str, str], float]
) -> MapReadings:
    """Collect what one floor's maps are made of; ``offsets`` as :func:`offsets_db` gives them."""
    here = pl.all_horizontal(pl.col(name) == value for name, value in place._asdict().items())
    scans = _labelled(dataset).filter(here).sort("scan_id").collect()
    scans = scans.with_columns(fold=_folds(scans)).with_row_index("scan")
    names = sorted(bssids)
    own = scans.lazy().select("scan_id", "scan", "device")
    readings = (
        dataset.readings.filter(pl.col("bssid").is_in(names), pl.col("rssi_dbm").is_not_null())
        .join(own, on="scan_id")
        .with_columns(pl.when(pl.col("floor") == place.floor).then(pl.col("x", "y")))
        .select("scan", "bssid", "device", "x", "y", "rssi_dbm")
        .sort("scan", "bssid", "x", "y", "rssi_dbm")
        .collect()
    )
    offset = {device: value for (technology, device), value in offsets.items() if technology == place.technology}
    off = readings["device"].replace_strict(offset, default=0.0, return_dtype=pl.Float64)
    index = {name: number for number, name in enumerate(names)}
    return MapReadings(
        bssids=tuple(names),
        scan_position=scans.select("x", "y").to_numpy(),
        scan_fold=scans["fold"].to_numpy().astype(np.int64),
        scan=readings["scan"].to_numpy().astype(np.int64),
        access_point=readings["bssid"].replace_strict(index, return_dtype=pl.Int64).to_numpy(),
        position=readings.select(pl.col("x", "y").fill_null(float("nan"))).to_numpy(),
        rssi_dbm=readings["rssi_dbm"].cast(pl.Float64).to_numpy() - off.to_numpy(),
    )


def _labelled(dataset: Dataset) -> pl.LazyFrame:
    known = dataset.fingerprints.filter(pl.col("x").is_not_null(), pl.col("floor").is_not_null())
    return known.with_columns(pl.col("device").fill_null(UNKNOWN), pl.col("building").fill_null(""))


def _folds(scans: pl.DataFrame) -> pl.Series:
    """Part of each scan (in order of scan_id): whole walks in turn, or fifths of the way where there is one walk."""
    walk = scans["session"].fill_null("").rank("dense").cast(pl.Int64) - 1
    if walk.n_unique() > 1:
        return walk % FOLDS
    return pl.Series(np.arange(len(scans)) * FOLDS // max(len(scans), 1))
