"""Statistics of a data set: the paper's Table III and Figure 8, and the cost and yield of labels.

Counts are over walks, with one walk in memory at a time.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import polars as pl

from vislam2tag.common import error_statistics
from vislam2tag.core.status import Status
from vislam2tag.datasets import statistics_record as record
from vislam2tag.datasets.model import Dataset, RunningTotal, SessionTables, each_session
from vislam2tag.datasets.place_sums import PlaceMeans, device_offsets
from vislam2tag.datasets.technologies import parts_of

LABELLED = Status.OK.label
"""Status of labelled fingerprints; ``uncertain`` ones keep their position, but do not count as labelled."""
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


_LABEL_KEYS = list(_LABELS)[:-2]
_COUNT = ("what", "technology", "device", "number")
_COUNTS = {"what": pl.String, "technology": pl.String, "device": pl.String, "number": pl.Int64, "count": pl.Int64}


class StatisticsTally:
    """Counts of the walks added so far."""

    def __init__(self) -> None:
        """Start with no counts."""
        self.labels = RunningTotal(_LABEL_KEYS, (pl.col("fingerprints", "labelled").sum(),), _LABELS)
        """Fingerprints, and labelled ones, by technology, session, device, building, floor and status."""
        self.counts = RunningTotal(_COUNT, (pl.col("count").sum(),), _COUNTS)
        """How often (``count``) each ``number`` occurs, by quantity (``what``), technology and device.

        ``readings``: 1 for those with a position, else 0. ``heard``: access points of a fingerprint. ``rssi``: whole
        dBm of a reading. ``sigma``: bin of a fingerprint's sigma.
        """
        self.places = PlaceMeans()

    def add(self, tables: SessionTables, floors: Mapping[str, int | None]) -> None:
        """Count one walk; ``floors`` is the floor, by session, for its fingerprints without a label."""
        scans = tables.fingerprints.with_columns(
            pl.col("floor").fill_null(pl.lit(floors.get(tables.session), pl.Int32)),
            pl.col("device").fill_null(record.UNKNOWN),
            pl.col("building").fill_null(""),
            pl.col("status").fill_null(record.UNKNOWN),
        )
        labelled = pl.col("status") == LABELLED
        counts = {"fingerprints": pl.len().cast(pl.Int64), "labelled": labelled.sum().cast(pl.Int64)}
        self.labels.add(scans.group_by(_LABEL_KEYS).agg(**counts))
        sure = scans.drop_nulls(["x", "sigma"])
        heard = tables.readings.group_by("scan_id").agg(heard=pl.col("bssid").n_unique())
        own = scans.select("scan_id", "technology", "building", "device")
        readings = tables.readings.join(own, on="scan_id", how="left")
        levels = readings.drop_nulls("rssi_dbm")
        self._count("sigma", sure, pl.Series(error_statistics.bins_of(sure["sigma"].to_numpy())))
        self._count("heard", own.join(heard, on="scan_id", how="left"), pl.col("heard").fill_null(0))
        self._count("readings", readings, pl.col("x").is_not_null())
        self._count("rssi", levels, pl.col("rssi_dbm").round())
        self.places.add(levels.drop_nulls("x"))

    def _count(self, what: str, rows: pl.DataFrame, number: pl.Expr | pl.Series) -> None:
        numbered = rows.with_columns(what=pl.lit(what), number=number).cast({"number": pl.Int64})
        self.counts.add(numbered.group_by(_COUNT).agg(count=pl.len().cast(pl.Int64)))


def _numbers(counts: pl.DataFrame, what: str) -> dict[int, int]:
    """How often each number occurs, over all devices."""
    return dict(counts.filter(what=what).group_by("number").agg(pl.col("count").sum()).sort("number").iter_rows())


def rows_of(table: pl.DataFrame, *columns: str) -> Iterator[tuple[Any, ...]]:
    """Sum fingerprints and labelled ones by columns; yield those values, then the two sums, in order."""
    sums = table.group_by(columns).agg(pl.col("fingerprints", "labelled").sum()).sort(columns, nulls_last=True)
    return sums.iter_rows()


_MINUTE_S, _HOUR_S = 60.0, 3600.0


def dataset_statistics(dataset: Dataset, field_work: record.FieldWork | None = None) -> record.DatasetStatistics:
    """Compute the statistics of a data set; ``field_work`` is the effort of the whole survey, if known.

    One walk is in memory at a time.
    """
    walks = dataset.sessions.with_columns(
        pl.col("device").fill_null(record.UNKNOWN), pl.col("building").fill_null("")
    ).collect()
    tally = StatisticsTally()
    floors = dict(walks.select("session", "floor").iter_rows())
    for tables in each_session(dataset.fingerprints, dataset.readings):
        tally.add(tables, floors)
    labels, counts = tally.labels.table, tally.counts.table
    sessions = _sessions(walks, labels)
    cost = _Cost.of(sessions, field_work)
    transmitters = dict(dataset.access_points.group_by("technology").agg(pl.len()).collect().iter_rows())
    shared = tally.places.shared()
    names = labels["technology"].unique().sort()
    return record.DatasetStatistics(
        name=dataset.info.name,
        walks=_walks(sessions),
        by_device={
            device: _walks([walk for walk in sessions if walk.device == device])
            for device in sorted({walk.device for walk in sessions})
        },
        effort=cost.effort if cost else None,
        technologies={
            name: _technology(
                labels.filter(technology=name),
                counts.filter(technology=name),
                shared.filter(technology=name),
                sum(transmitters.get(part, 0) for part in parts_of(name)),
                cost,
            )
            for name in names
        },
        sessions=sessions,
    )


def _sessions(walks: pl.DataFrame, labels: pl.DataFrame) -> tuple[record.SessionStatistics, ...]:
    by_session: dict[str, dict[str, record.LabelCounts]] = {}
    for session, technology, *counts in rows_of(labels, "session", "technology"):
        by_session.setdefault(session, {})[technology] = record.LabelCounts.of(*counts)
    names = [name for name in record.SessionStatistics.model_fields if name != "labels"]
    return tuple(
        record.SessionStatistics(**{name: walk[name] for name in names}, labels=by_session.get(walk["session"], {}))
        for walk in walks.sort("session").iter_rows(named=True)
    )


def _walks(sessions: Sequence[record.SessionStatistics]) -> record.WalkTotals:
    both = [walk for walk in sessions if walk.duration_s and walk.distance_m is not None]
    velocity = _ratio(_sum(walk.distance_m for walk in both), _sum(walk.duration_s for walk in both))
    return record.WalkTotals(
        trajectories=len(sessions),
        duration_s=_sum(walk.duration_s for walk in sessions),
        distance_m=_sum(walk.distance_m for walk in sessions),
        velocity_m_s=velocity,
        labelled_s=_sum(walk.labelled_s for walk in sessions),
        labelled_m=_sum(walk.labelled_m for walk in sessions),
    )


@dataclass(frozen=True)
class _Cost:
    """The walks with known duration and length, and their sums."""

    timed: frozenset[str]
    minutes: float
    effort: record.Effort

    @classmethod
    def of(cls, sessions: Iterable[record.SessionStatistics], field_work: record.FieldWork | None) -> _Cost | None:
        timed = [walk for walk in sessions if walk.duration_s and walk.distance_m is not None]
        walked_s = _sum(walk.duration_s for walk in timed)
        if not walked_s:
            return None
        hours = field_work.people * field_work.hours if field_work else walked_s / _HOUR_S
        labelled_m = _sum(walk.labelled_m for walk in timed)
        effort = record.Effort(
            basis="total time" if field_work else "walking time",
            people=field_work.people if field_work else None,
            person_hours=round(hours, 4),
            labelled_m_per_minute=_ratio(labelled_m, walked_s / _MINUTE_S),
            labelled_m_per_person_hour=_ratio(labelled_m, hours),
        )
        return cls(frozenset(walk.session for walk in timed), walked_s / _MINUTE_S, effort)


def _technology(
    labels: pl.DataFrame, counts: pl.DataFrame, shared: pl.DataFrame, transmitters: int, cost: _Cost | None
) -> record.TechnologyStatistics:
    timed = _total(labels.filter(pl.col("session").is_in(cost.timed))) if cost else None
    readings = _numbers(counts, "readings")
    return record.TechnologyStatistics(
        labels=_total(labels),
        readings=sum(readings.values()),
        labelled_readings=readings.get(1, 0),
        transmitters=transmitters,
        by_device={device: record.LabelCounts.of(*counts) for device, *counts in rows_of(labels, "device")},
        by_floor=_floors(labels),
        statuses={status: count for status, count, _ in rows_of(labels, "status")},
        heard=record.Distribution.of(_numbers(counts, "heard")),
        rssi=_rssi(counts.filter(what="rssi"), shared),
        sigma=_sigma(_numbers(counts, "sigma")),
        labelled_per_minute=_ratio(timed.labelled, cost.minutes) if cost and timed else None,
        labelled_per_person_hour=_ratio(timed.labelled, cost.effort.person_hours) if cost and timed else None,
    )


def _total(labels: pl.DataFrame) -> record.LabelCounts:
    return record.LabelCounts.of(*labels.select(pl.col("fingerprints", "labelled").sum()).row(0))


def _floors(labels: pl.DataFrame) -> tuple[record.FloorLabels, ...]:
    devices: dict[tuple[Any, Any], dict[str, record.LabelCounts]] = {}
    for building, floor, device, *counts in rows_of(labels, "building", "floor", "device"):
        devices.setdefault((building, floor), {})[device] = record.LabelCounts.of(*counts)
    return tuple(
        record.FloorLabels(
            building=building, floor=floor, labels=record.LabelCounts.of(*counts), by_device=devices[building, floor]
        )
        for building, floor, *counts in rows_of(labels, "building", "floor")
    )


def _rssi(levels: pl.DataFrame, shared: pl.DataFrame) -> dict[str, record.DeviceRssi]:
    """The RSSI of each device with readings, and its offset."""
    devices = levels["device"].unique().sort().to_list()
    offsets = device_offsets(shared, devices)
    return {
        device: record.DeviceRssi(
            rssi_dbm=record.Distribution.of(dict(levels.filter(device=device).select("number", "count").iter_rows())),
            offset_db=offsets[device][0],
            shared=offsets[device][1],
        )
        for device in devices
    }


def _sigma(counts: Mapping[int, int]) -> record.SigmaDistribution | None:
    if not counts:
        return None
    return record.SigmaDistribution(
        fingerprints=sum(counts.values()),
        median_m=round(error_statistics.quantile_m(counts, 0.5), 4),
        p95_m=round(error_statistics.quantile_m(counts, 0.95), 4),
        counts=dict(sorted(counts.items())),
    )


def _sum(values: Iterable[float | None]) -> float | None:
    """Sum of the known values; None if there are none."""
    known = [value for value in values if value is not None]
    return round(sum(known), 3) if known else None


def _ratio(value: float | None, base: float | None) -> float | None:
    return None if value is None or not base else round(value / base, 4)
