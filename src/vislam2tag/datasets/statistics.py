"""What a data set holds, in numbers: the paper's Table III and Figure 8, and what labels cost and are worth.

Counts are over its walks, one walk in memory at a time.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import polars as pl

from vislam2tag.common import log_bins
from vislam2tag.core.status import Status
from vislam2tag.datasets.model import Dataset, SessionTables, each_session
from vislam2tag.datasets.place_sums import PlaceMeans, device_offsets
from vislam2tag.datasets.statistics_record import (
    UNKNOWN,
    DatasetStatistics,
    DeviceRssi,
    Distribution,
    Effort,
    FieldWork,
    FloorLabels,
    LabelCounts,
    SessionStatistics,
    SigmaDistribution,
    TechnologyStatistics,
    WalkTotals,
)

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


_MINUTE_S, _HOUR_S = 60.0, 3600.0


def dataset_statistics(dataset: Dataset, field_work: FieldWork | None = None) -> DatasetStatistics:
    """Count a data set; ``field_work`` tells what the survey took as a whole, where that is known.

    One walk is in memory at a time.
    """
    walks = dataset.sessions.with_columns(
        pl.col("device").fill_null(UNKNOWN), pl.col("building").fill_null("")
    ).collect()
    tally = StatisticsTally()
    floors = dict(walks.select("session", "floor").iter_rows())
    for tables in each_session(dataset.fingerprints, dataset.readings):
        tally.add(tables, floors)
    sessions = _sessions(walks, tally.labels)
    cost = _Cost.of(sessions, field_work)
    transmitters = dict(dataset.access_points.group_by("technology").agg(pl.len()).collect().iter_rows())
    shared = tally.places.shared()
    names = tally.labels["technology"].unique().sort()
    return DatasetStatistics(
        name=dataset.info.name,
        walks=_walks(sessions),
        by_device={
            device: _walks([walk for walk in sessions if walk.device == device])
            for device in sorted({walk.device for walk in sessions})
        },
        effort=cost.effort if cost else None,
        technologies={name: _technology(name, tally, shared, transmitters.get(name, 0), cost) for name in names},
        sessions=sessions,
    )


def _sessions(walks: pl.DataFrame, labels: pl.DataFrame) -> tuple[SessionStatistics, ...]:
    by_session: dict[str, dict[str, LabelCounts]] = {}
    for session, technology, *counts in rows_of(labels, "session", "technology"):
        by_session.setdefault(session, {})[technology] = LabelCounts.of(*counts)
    names = [name for name in SessionStatistics.model_fields if name != "labels"]
    return tuple(
        SessionStatistics(**{name: walk[name] for name in names}, labels=by_session.get(walk["session"], {}))
        for walk in walks.sort("session").iter_rows(named=True)
    )


def _walks(sessions: Sequence[SessionStatistics]) -> WalkTotals:
    both = [walk for walk in sessions if walk.duration_s and walk.distance_m is not None]
    velocity = _ratio(_sum(walk.distance_m for walk in both), _sum(walk.duration_s for walk in both))
    return WalkTotals(
        trajectories=len(sessions),
        duration_s=_sum(walk.duration_s for walk in sessions),
        distance_m=_sum(walk.distance_m for walk in sessions),
        velocity_m_s=velocity,
        labelled_s=_sum(walk.labelled_s for walk in sessions),
        labelled_m=_sum(walk.labelled_m for walk in sessions),
    )


@dataclass(frozen=True)
class _Cost:
    """The walks whose duration and length are known, and what they took."""

    timed: frozenset[str]
    minutes: float
    effort: Effort

    @classmethod
    def of(cls, sessions: Iterable[SessionStatistics], field_work: FieldWork | None) -> _Cost | None:
        timed = [walk for walk in sessions if walk.duration_s and walk.distance_m is not None]
        walked_s = _sum(walk.duration_s for walk in timed)
        if not walked_s:
            return None
        hours = field_work.people * field_work.hours if field_work else walked_s / _HOUR_S
        labelled_m = _sum(walk.labelled_m for walk in timed)
        effort = Effort(
            basis="total time" if field_work else "walking time",
            people=field_work.people if field_work else None,
            person_hours=round(hours, 4),
            labelled_m_per_minute=_ratio(labelled_m, walked_s / _MINUTE_S),
            labelled_m_per_person_hour=_ratio(labelled_m, hours),
        )
        return cls(frozenset(walk.session for walk in timed), walked_s / _MINUTE_S, effort)


def _technology(
    name: str, tally: StatisticsTally, shared: pl.DataFrame, transmitters: int, cost: _Cost | None
) -> TechnologyStatistics:
    labels = tally.labels.filter(pl.col("technology") == name)
    timed = _total(labels.filter(pl.col("session").is_in(cost.timed))) if cost else None
    readings = {labelled: tally.readings[name, labelled] for labelled in (False, True)}
    return TechnologyStatistics(
        labels=_total(labels),
        readings=sum(readings.values()),
        labelled_readings=readings[True],
        transmitters=transmitters,
        by_device={device: LabelCounts.of(*counts) for device, *counts in rows_of(labels, "device")},
        by_floor=_floors(labels),
        statuses={status: count for status, count, _ in rows_of(labels, "status")},
        heard=Distribution.of(of_technology(tally.heard, name)),
        rssi=_rssi(name, tally, shared.filter(pl.col("technology") == name)),
        sigma=_sigma(of_technology(tally.sigma, name)),
        labelled_per_minute=_ratio(timed.labelled, cost.minutes) if cost and timed else None,
        labelled_per_person_hour=_ratio(timed.labelled, cost.effort.person_hours) if cost and timed else None,
    )


def _total(labels: pl.DataFrame) -> LabelCounts:
    return LabelCounts.of(*labels.select(pl.col("fingerprints", "labelled").sum()).row(0))


def _floors(labels: pl.DataFrame) -> tuple[FloorLabels, ...]:
    devices: dict[tuple[Any, Any], dict[str, LabelCounts]] = {}
    for building, floor, device, *counts in rows_of(labels, "building", "floor", "device"):
        devices.setdefault((building, floor), {})[device] = LabelCounts.of(*counts)
    return tuple(
        FloorLabels(building=building, floor=floor, labels=LabelCounts.of(*counts), by_device=devices[building, floor])
        for building, floor, *counts in rows_of(labels, "building", "floor")
    )


def _rssi(technology: str, tally: StatisticsTally, shared: pl.DataFrame) -> dict[str, DeviceRssi]:
    """The RSSI of each device that heard anything, and its offset."""
    by_device: dict[str, dict[int, int]] = {}
    for (own, device, rssi_dbm), count in tally.rssi.items():
        if own == technology:
            by_device.setdefault(device, {})[rssi_dbm] = count
    devices = sorted(by_device)
    offsets = device_offsets(shared, devices)
    return {
        device: DeviceRssi(
            rssi_dbm=Distribution.of(by_device[device]),
            offset_db=offsets[device].offset_db,
            shared=offsets[device].shared,
        )
        for device in devices
    }


def _sigma(counts: Mapping[int, int]) -> SigmaDistribution | None:
    if not counts:
        return None
    return SigmaDistribution(
        fingerprints=sum(counts.values()),
        median_m=round(log_bins.quantile_m(counts, 0.5), 4),
        p95_m=round(log_bins.quantile_m(counts, 0.95), 4),
        counts=dict(sorted(counts.items())),
    )


def _sum(values: Iterable[float | None]) -> float | None:
    """Sum of the values that are known; None where none is."""
    known = [value for value in values if value is not None]
    return round(sum(known), 3) if known else None


def _ratio(value: float | None, base: float | None) -> float | None:
    return None if value is None or not base else round(value / base, 4)
