"""One session after the other: what keeps memory flat however many sessions a data set has."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import polars as pl


@dataclass(frozen=True)
class SessionTables:
    """The fingerprints of one session and their readings, in memory."""

    session: str
    fingerprints: pl.DataFrame
    readings: pl.DataFrame


def each_session(fingerprints: pl.LazyFrame, readings: pl.LazyFrame) -> Iterator[SessionTables]:
    """Yield the tables session by session, in the order of their names; only one is in memory at a time."""
    sessions = fingerprints.select("session").unique().collect(engine="streaming")["session"].sort()
    for session in sessions:
        yield one_session(fingerprints, readings, session)


def one_session(fingerprints: pl.LazyFrame, readings: pl.LazyFrame, session: str) -> SessionTables:
    """Read the tables of one session.

    Readings are found by the range of the session's scan ids first: ids of a session share their beginning, so that
    Parquet's statistics spare reading the other sessions.
    """
    own = fingerprints.filter(pl.col("session") == session).collect()
    ids = own["scan_id"]
    heard = readings.filter(pl.col("scan_id").is_between(pl.lit(ids.min()), pl.lit(ids.max())))
    return SessionTables(session, own, heard.join(own.lazy().select("scan_id"), on="scan_id", how="semi").collect())


def readings_by_session(
    fingerprints: pl.LazyFrame, readings: pl.LazyFrame, work: Callable[[pl.LazyFrame], pl.LazyFrame]
) -> pl.LazyFrame:
    """Do lazily what ``work`` does to the readings of a session, one session after the other.

    For work that must see a scan whole, as grouping does: over all readings at once it would hold them all.
    """
    parts = [work(own) for _, own in session_readings(fingerprints, readings)]
    return pl.concat(parts) if parts else work(readings)


def session_readings(fingerprints: pl.LazyFrame, readings: pl.LazyFrame) -> Iterator[tuple[str, pl.LazyFrame]]:
    """Yield each session's name and, lazily, its readings, in the order of the names."""
    ids = pl.col("scan_id")
    ranges = fingerprints.group_by("session").agg(first=ids.min(), last=ids.max()).collect(engine="streaming")
    for session, first, last in ranges.sort("session").iter_rows():
        own = fingerprints.filter(pl.col("session") == session).select("scan_id")
        near = readings.filter(ids.is_between(pl.lit(first), pl.lit(last)))
        yield session, near.join(own, on="scan_id", how="semi", maintain_order="left")
