"""Long tables of readings: which rows are one scan, although scan numbers start again, or no column names scans."""

from __future__ import annotations

from collections.abc import Sequence

import polars as pl

from vislam2tag.common.findings import Finding, Severity, counted, finding_if

_PLACE = ("x", "y", "latitude", "longitude", "cell", "floor", "building")
_SHOWN = 5


def scans_of_rows(
    rows: pl.DataFrame, readings: pl.DataFrame, by: Sequence[str], file: str, unused: Sequence[str]
) -> tuple[pl.DataFrame, list[Finding]]:
    """The scan of each row: ``row`` and ``owner``, the first row of its scan, and findings.

    ``rows`` of equal columns ``by`` are one scan. It is split by place, then by time, if these differ and one of the
    addresses of its ``readings`` (``row``, ``bssid``) repeats. ``unused`` are the columns without a meaning.
    """
    whole = rows.with_columns(owner=pl.col("row").first().over(by))
    places = [name for name in _PLACE if name in rows.columns]
    placed, at_places = _split(whole, readings, places)
    timed, at_times = _split(placed, readings, ["time_ns"]) if "time_ns" in rows.columns else (placed, 0)
    scans = timed.select("row", "owner")
    message = (
        "scan numbers occur at several places or times with the same addresses; they are split by place and time. "
        'If the numbers start again in each walk, name the column of walks in columns.toml: session = "NAME"'
    )
    found = list(finding_if(at_places + at_times, "repeated_scan_numbers", message, file, Severity.WARNING))
    if "scan" in by:
        return scans, found
    repeats = _repeats(scans, readings).filter(pl.col("most") > 1)
    most = repeats.select(pl.col("most").max().fill_null(0)).item()
    columns = ", ".join(unused[:_SHOWN]) + (", ..." if len(unused) > _SHOWN else "") or "none"
    merged = (
        f"an address occurs up to {counted(most, 'time')} within a fingerprint: several scans at one place may be "
        f"merged. Name the column of scans or times in columns.toml (columns that are not used: {columns})"
    )
    return scans, [*found, *finding_if(repeats.height, "merged_scans", merged, file, Severity.WARNING)]


def _repeats(scans: pl.DataFrame, readings: pl.DataFrame) -> pl.DataFrame:
    """How often the most frequent address of each scan occurs: ``owner``, ``most``."""
    heard = readings.select("row", "bssid").join(scans.select("row", "owner"), on="row")
    return heard.group_by("owner", "bssid").len().group_by("owner").agg(most=pl.col("len").max().cast(pl.Int64))


def _split(rows: pl.DataFrame, readings: pl.DataFrame, by: Sequence[str]) -> tuple[pl.DataFrame, int]:
    """Split scans by the columns ``by``, and count those that are split.

    A scan whose places or times are those of its single readings stays whole. If most scans of several places repeat
    addresses, those without a repeated address are split, too.
    """
    values = rows.group_by("owner").agg(values=pl.struct(by).n_unique(), rows=pl.len())
    several = values.filter(pl.col("values") > 1).join(_repeats(rows, readings), on="owner", how="left")
    of_scans = (2 * pl.col("values") <= pl.col("rows")) | (pl.col("values") <= 2 * pl.col("most"))
    split = several.filter((pl.col("most") > 1) & of_scans)
    if 2 * split.height >= several.height:
        split = several
    apart = pl.col("owner").is_in(split["owner"].implode())
    own = pl.col("row").first().over("owner", *by)
    return rows.with_columns(owner=pl.when(apart).then(own).otherwise("owner")), split.height
