"""What is split: every fingerprint and window of a data set, with all that a split can go by."""

from __future__ import annotations

import polars as pl

from vislam2tag.core.status import Status
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.schema import FINGERPRINTS, IMU_WINDOWS, MAGNETIC, SESSIONS

IMU = "imu"
_RANKS = {"wifi": 0, MAGNETIC: 2, IMU: 3}
_OTHER_RADIO = 1
COLUMNS = ("id", "kind", "building", "floor", "x", "y", "device", "session", "date", "time_ns", "labelled")


def split_items(dataset: Dataset) -> pl.DataFrame:
    """One row for each fingerprint, magnetic fingerprint and IMU window, in no particular order.

    ``id``, ``kind`` (the technology, ``magnetic`` or ``imu``), ``building``, ``floor``, ``x``, ``y`` (m, BCS; those of
    an IMU window are the middle of its ends), ``device``, ``session``, ``date``, ``time_ns`` (middle of a fingerprint,
    start of a window) and ``labelled``: whether floor and position are known, and of a fingerprint sure (``ok``).
    """
    day = pl.col("started").dt.date()
    dates = dataset.tables[SESSIONS].select("session", date=day).unique("session", keep="any")
    parts = [_fingerprints(dataset.tables[FINGERPRINTS])]
    if MAGNETIC in dataset.tables:
        magnetic = dataset.tables[MAGNETIC].with_columns(kind=pl.lit(MAGNETIC), time_ns=_middle_ns())
        parts.append(_windows(magnetic, dates))
    if IMU_WINDOWS in dataset.tables:
        x, y = ((pl.col(f"{axis}_start") + pl.col(f"{axis}_end")) / 2 for axis in "xy")
        imu = dataset.tables[IMU_WINDOWS].with_columns(x=x, y=y, kind=pl.lit(IMU), time_ns="start_ns")
        parts.append(_windows(imu, dates))
    return pl.concat(parts).with_columns(pl.col("building").fill_null("")).collect()


def rank_of_kind() -> pl.Expr:
    """Order in which kinds lead: Wi-Fi, other radio technologies, magnetic fingerprints, IMU windows."""
    return pl.col("kind").replace_strict(_RANKS, default=_OTHER_RADIO, return_dtype=pl.Int8)


def kind_order(kinds: pl.Series) -> list[str]:
    """Return the kinds that there are, the leading ones first."""
    return sorted(kinds.unique(), key=lambda kind: (_RANKS.get(kind, _OTHER_RADIO), kind))


def _fingerprints(table: pl.LazyFrame) -> pl.LazyFrame:
    sure = (pl.col("status") == Status.OK.label).fill_null(False)
    renamed = table.with_columns(id="scan_id", kind="technology", time_ns=_middle_ns(), labelled=_known() & sure)
    return renamed.select(COLUMNS)


def _windows(table: pl.LazyFrame, dates: pl.LazyFrame) -> pl.LazyFrame:
    """Windows have the day on which their walk started."""
    named = table.with_columns(id="window_id", labelled=_known())
    return named.join(dates, on="session", how="left").select(COLUMNS)


def _known() -> pl.Expr:
    return pl.all_horizontal(pl.col("floor", "x", "y").is_not_null())


def _middle_ns() -> pl.Expr:
    """Middle of start and end; the start where no end is known."""
    return pl.col("start_ns") + (pl.col("end_ns").fill_null(pl.col("start_ns")) - pl.col("start_ns")) // 2
