"""Counts over the walks of a data set, one walk in memory at a time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import polars as pl

from vislam2tag.common import log_bins
from vislam2tag.core.status import Status
from vislam2tag.dataset.by_session import SessionTables
from vislam2tag.dataset.device_offsets import PlaceMeans
from vislam2tag.dataset.statistics.record import UNKNOWN

LABELLED = Status.OK.label
"""Fingerprints that are ``uncertain`` keep their position, but count as labelled nowhere."""
_LABELS = {
    "technology": pl.String,
    "session": pl.String,
    "device": pl.String,
    "building": pl.String,
    "floor": pl.Int32,
    "status": pl.String,
    "fingerprints": pl.Int64,
    "labelled": pl.Int64,
}


@dataclass
class StatisticsTally:
    """Counts of the walks added so far."""

    readings: Counter[tuple[str, bool]] = field(default_factory=Counter)
    """Readings by technology, and whether they have a position."""
    heard: Counter[tuple[str, int]] = field(default_factory=Counter)
    """Fingerprints by technology and number of access points."""
    rssi: Counter[tuple[str, str, int]] = field(default_factory=Counter)
    """Readings by technology, device and RSSI, whole dBm."""
    sigma: Counter[tuple[str, int]] = field(default_factory=Counter)
    """Fingerprints by technology and bin of their sigma."""
    places: PlaceMeans = field(default_factory=PlaceMeans)
    _labels: list[pl.DataFrame] = field(default_factory=list)

    @property
    def labels(self) -> pl.DataFrame:
        """Fingerprints, and labelled ones, by technology, session, device, building, floor and status."""
        return pl.concat([pl.DataFrame(schema=_LABELS), *self._labels])

    def add(self, tables: SessionTables, floors: Mapping[str, int | None]) -> None:
        """Count one walk; ``floors`` says by session where its fingerprints without a label count."""
        scans = tables.fingerprints.with_columns(
            pl.col("floor").fill_null(pl.lit(floors.get(tables.session), pl.Int32)),
            pl.col("device").fill_null(UNKNOWN),
            pl.col("building").fill_null(""),
            pl.col("status").fill_null(UNKNOWN),
        )
        labelled = pl.col("status") == LABELLED
        keys = list(_LABELS)[:-2]
        counts = {"fingerprints": pl.len().cast(pl.Int64), "labelled": labelled.sum().cast(pl.Int64)}
        self._labels.append(scans.group_by(keys).agg(**counts).sort(keys))
        for (technology,), sure in scans.drop_nulls(["x", "sigma"]).group_by("technology"):
            for index, count in log_bins.counts_of(sure["sigma"].to_numpy()).items():
                self.sigma[str(technology), index] += count
        self._add_readings(scans.select("scan_id", "technology", "building", "device"), tables.readings)

    def _add_readings(self, scans: pl.DataFrame, readings: pl.DataFrame) -> None:
        heard = readings.group_by("scan_id").agg(heard=pl.col("bssid").n_unique())
        counted = scans.join(heard, on="scan_id", how="left").with_columns(pl.col("heard").fill_null(0))
        self.heard.update(_counts(counted, "technology", "heard"))
        known = readings.join(scans, on="scan_id", how="left").with_columns(labelled=pl.col("x").is_not_null())
        self.readings.update(_counts(known, "technology", "labelled"))
        whole = known.drop_nulls("rssi_dbm").with_columns(pl.col("rssi_dbm").round().cast(pl.Int32))
        self.rssi.update(_counts(whole, "technology", "device", "rssi_dbm"))
        self.places.add(known.drop_nulls(["x", "rssi_dbm"]))


def of_technology(counts: Mapping[tuple[str, int], int], technology: str) -> dict[int, int]:
    """The counts of one technology."""
    return {number: count for (own, number), count in counts.items() if own == technology}


def _counts(table: pl.DataFrame, *columns: str) -> dict[tuple[Any, ...], int]:
    """How often each combination of values occurs."""
    return {row[:-1]: row[-1] for row in table.group_by(columns).len().iter_rows()}


def rows_of(table: pl.DataFrame, *columns: str) -> Iterator[tuple[Any, ...]]:
    """Sum fingerprints and labelled ones by columns; yield those values, then the two sums, in order."""
    sums = table.group_by(columns).agg(pl.col("fingerprints", "labelled").sum()).sort(columns, nulls_last=True)
    return sums.iter_rows()
