"""What a data set holds, in numbers: the paper's Table III and Figure 8, and what labels cost and are worth."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import polars as pl

from vislam2tag.common import log_bins
from vislam2tag.dataset.by_session import each_session
from vislam2tag.dataset.device_offsets import device_offsets
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.statistics.record import (
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
from vislam2tag.dataset.statistics.tally import StatisticsTally, of_technology, rows_of

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
