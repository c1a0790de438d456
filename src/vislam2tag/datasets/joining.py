"""Join a later survey to a data set: one data set of all walks; walks that are in both are used once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import polars as pl

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.findings import Finding, FindingKind, Severity, finding_if
from vislam2tag.datasets.access_points import access_point_table
from vislam2tag.datasets.description import Related
from vislam2tag.datasets.model import (
    Dataset,
    DatasetInfo,
    FloorInfo,
    Grouping,
    Split,
    one_session,
    session_readings,
)
from vislam2tag.datasets.schema import (
    ACCESS_POINTS,
    FINGERPRINTS,
    IMU_WINDOWS,
    KEYS,
    MAGNETIC,
    READINGS,
    SESSIONS,
    empty_table,
)
from vislam2tag.datasets.settings import SplitKind

SAME_SESSIONS: FindingKind = "sessions_in_both"
SPLITS_LEFT_OUT: FindingKind = "splits_left_out"
_SAME = "sessions are in both data sets with the same rows; each is used once"
_AGREE_M = 0.01
_FLOOR_FIELDS = ("width_m", "height_m", "elevation_m")
_CORNER = ("x of the plan's lower left corner", "y of the plan's lower left corner")
_MUST_AGREE = {
    "frame": "the positions have different frames",
    "clock": "the times have different origins",
    "bssid_key": "the access points have different names; hash both with one key, or neither",
}
_OF_THE_BASE_ALONE: dict[str, object] = {"version": None, "published": None, "doi": None, "tables": {}, "splits": {}}
"""Entries of the base's manifest that do not apply to the joined data set."""


def join_datasets(base: Dataset, later: Dataset) -> tuple[Dataset, Dataset]:
    """Join two data sets; return the joined set, and the later one without the walks that the base already has.

    Tables stay lazy and ordered by session, except the access points, which are counted again.

    Splits must be made again, except official ones, which are carried over with the new rows in neither part. Raises
    DatasetError if floors, frames, clocks, groupings or hashes disagree, or if a session has different rows in both.
    """
    _refuse_disagreement(base.info, later.info)
    floors = _floors(base.info.floors, later.info.floors)
    same = _same_sessions(base, later)
    news = _without_sessions(later, same)
    tables = {name: _table(name, base, news) for name in {**base.tables, **news.tables} if name != ACCESS_POINTS}
    tables[ACCESS_POINTS] = _access_points(base, news, tables).lazy()
    earlier = [Related(identifier=base.info.doi, relation="IsNewVersionOf")] if base.info.doi is not None else []
    info = base.info.model_copy(
        update=_OF_THE_BASE_ALONE
        | {
            "floors": floors,
            "groupings": _groupings(base.info.groupings, later.info.groupings),
            "sources": (*base.info.sources, *later.info.sources),
            "related": (*base.info.related, *earlier),
            "findings": (
                *base.info.findings,
                *later.info.findings,
                *finding_if(len(same), SAME_SESSIONS, f"{_SAME}: {', '.join(same)}"),
                *_lost_split_findings(base, later),
            ),
        }
    )
    carried = {name: _with_news(split, news) for name, split in base.splits.items() if not _made_by_us(split)}
    plans = {floor.plan for floor in floors}
    files = {**{path: file for path, file in later.files.items() if path in plans}, **base.files}
    return Dataset(info, tables, carried, files), news


def _refuse_disagreement(base: DatasetInfo, later: DatasetInfo) -> None:
    for name, consequence in _MUST_AGREE.items():
        one, other = getattr(base, name), getattr(later, name)
        if one != other:
            raise DatasetError(f"{name} is {one} in {base.name} and {other} in {later.name}: {consequence}")


def _floors(base: Sequence[FloorInfo], later: Sequence[FloorInfo]) -> tuple[FloorInfo, ...]:
    """Floors of both; those of the base if both have one."""
    found = {(floor.building, floor.number): floor for floor in base}
    for floor in later:
        key = (floor.building, floor.number)
        known = found.setdefault(key, floor)
        for name, one, other in _extents(known, floor):
            if one is not None and other is not None and abs(one - other) > _AGREE_M:
                building = f" of {floor.building}" if floor.building else ""
                raise DatasetError(
                    f"floor {floor.number}{building}: {name} is {one:g} in the base and {other:g} in the later survey, "
                    "so positions differ; correct one of them, or give the later survey's building another name"
                )
        if known.plan is None:
            found[key] = known.model_copy(update={"plan": floor.plan})
    return tuple(found[key] for key in sorted(found))


def _extents(known: FloorInfo, floor: FloorInfo) -> Iterator[tuple[str, float | None, float | None]]:
    """Values of a floor that must agree in both: name and both values."""
    for name in _FLOOR_FIELDS:
        yield name, getattr(known, name), getattr(floor, name)
    if known.width_m is not None and floor.width_m is not None:
        yield from zip(_CORNER, known.lower_left_m, floor.lower_left_m, strict=True)


def _groupings(base: Sequence[Grouping], later: Sequence[Grouping]) -> tuple[Grouping, ...]:
    found = {grouping.technology: grouping for grouping in base}
    for grouping in later:
        if found.setdefault(grouping.technology, grouping) != grouping:
            raise DatasetError(
                f"{grouping.technology}: the later survey groups readings differently (by {grouping.by}); "
                "make its data set with the same --window"
            )
    return tuple(found[name] for name in sorted(found))


def _same_sessions(base: Dataset, later: Dataset) -> tuple[str, ...]:
    """Sessions that are in both with the same rows; raises DatasetError if rows differ."""
    both = _sessions(base).join(_sessions(later), on="session", how="semi")["session"].sort()
    for session in both:
        one, other = (one_session(dataset.fingerprints, dataset.readings, session) for dataset in (base, later))
        if not (one.fingerprints.equals(other.fingerprints) and one.readings.equals(other.readings)):
            raise DatasetError(
                f"session {session} is in both data sets with different rows: either one walk was labelled twice, or "
                "two walks have the same name; remove it from the later survey, or compare both with `vislam2tag "
                "verify`"
            )
    return tuple(both)


def _sessions(dataset: Dataset) -> pl.DataFrame:
    """Names of all sessions, including those without a fingerprint."""
    tables = [dataset.tables[name].select("session") for name in (SESSIONS, FINGERPRINTS)]
    return pl.concat(tables).unique().collect(engine="streaming").sort("session")


def _made_by_us(split: Split) -> bool:
    return split.info.kind in set(SplitKind)


def _with_news(split: Split, news: Dataset) -> Split:
    """Carry a split over; fingerprints and windows of the later survey are in neither part."""
    keys = {name: KEYS[name] for name in (FINGERPRINTS, MAGNETIC, IMU_WINDOWS) if name in news.tables}
    ids = [news.tables[name].select(id=key, group=pl.lit(None, pl.String)) for name, key in keys.items()]
    return replace(split, groups=pl.concat([split.groups, *pl.collect_all(ids)]))


def _lost_split_findings(base: Dataset, later: Dataset) -> tuple[Finding, ...]:
    """Report the splits that are not carried over, except standard ones, which are made again by their names."""
    lost = {name for name, split in base.splits.items() if _made_by_us(split)} | later.splits.keys()
    lost -= set(SplitKind) | {name for name, split in base.splits.items() if not _made_by_us(split)}
    message = (
        f"skipped splits, because they do not cover all walks: {', '.join(sorted(lost))}; make them again with "
        "`vislam2tag split`"
    )
    return finding_if(len(lost), SPLITS_LEFT_OUT, message, severity=Severity.WARNING)


def _without_sessions(dataset: Dataset, same: Sequence[str]) -> Dataset:
    if not same:
        return dataset
    gone = pl.col("session").is_in(list(same))
    scans = dataset.fingerprints.filter(gone).select("scan_id")
    tables = {
        name: table.join(scans, on="scan_id", how="anti", maintain_order="left")
        if name == READINGS
        else table.filter(~gone)
        for name, table in dataset.tables.items()
        if name != ACCESS_POINTS
    }
    return replace(dataset, tables={**tables, ACCESS_POINTS: dataset.access_points})


def _table(name: str, base: Dataset, news: Dataset) -> pl.LazyFrame:
    """Rows of both, sorted by session name, so that the table has the usual order."""
    parts = [part for _, part in sorted(_parts(name, (base, news)), key=lambda item: item[0])]
    return pl.concat(parts) if parts else empty_table(name).lazy()


def _parts(name: str, datasets: Sequence[Dataset]) -> Iterator[tuple[str, pl.LazyFrame]]:
    """Rows of each session by its name, lazily."""
    for dataset in datasets:
        if name == READINGS:
            yield from session_readings(dataset.fingerprints, dataset.readings)
        elif name in dataset.tables:
            for session in _sessions(dataset)["session"]:
                yield session, dataset.tables[name].filter(pl.col("session") == session)


def _access_points(base: Dataset, news: Dataset, tables: Mapping[str, pl.LazyFrame]) -> pl.DataFrame:
    """Count all readings; carry over radios, and flags that cannot be derived from hashed identifiers."""
    columns = ("bssid", "technology", "ssid", "radio", "readings", "randomised", "mobile", "nomap")
    known = pl.concat([dataset.access_points.select(columns) for dataset in (base, news)]).collect()
    names = known.select("bssid", "technology", "ssid", count="readings")
    table = access_point_table(tables[FINGERPRINTS], tables[READINGS], names)
    flags = ("randomised", "mobile", "nomap")
    before = known.group_by("bssid").agg(
        pl.col(flags).max().name.suffix("_before"), radio_before=pl.col("radio").drop_nulls().min()
    )
    return (
        table.join(before, on="bssid", how="left", maintain_order="left")
        .with_columns(
            *(pl.max_horizontal(flag, f"{flag}_before").alias(flag) for flag in flags),
            radio=pl.coalesce("radio", "radio_before"),
        )
        .select(table.columns)
    )
