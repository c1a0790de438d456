"""Wi-Fi scans: ``scan; t; WLAN; ssid; bssid; rss`` with t in microseconds and any text in ssid."""

from __future__ import annotations

import codecs
from dataclasses import replace

import numpy as np
import polars as pl

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.tables.radio_text import level_dbm, text_lines, undecodable_findings
from vislam2tag.sessions.tables.raw_table import RawTable, parsed_rows

_US_TO_NS = 1000
_GREATEST_US = (2**63 - 1) // _US_TO_NS

# The ssid may hold the separator, so that the fields after it are found from the end of the line; a blank before it
# belongs to the separator where the line's first separator has one.
_LINE = (
    r"^\s*(?<scan>[+-]?\d+)\s*;(?<blank>\s*)(?<time_us>\d+)\s*;\s*WLAN\s*;(?<ssid>.*);\s*(?<bssid>[^;\s]*)\s*;"
    r"\s*(?<rssi_dbm>[^;\s]+)\s*$"
)


def parse_wifi(data: bytes, file: str) -> RawTable:
    """Parse a Wi-Fi file into ``row``, ``time_ns``, ``scan``, ``bssid``, ``ssid``, ``rssi_dbm``, ``frequency_mhz``.

    Undecodable bytes become U+FFFD and a finding. Addresses and levels are as the file has them; ``bssid`` may be
    empty. The published layout has no frequency (null).
    """
    data = data.removeprefix(codecs.BOM_UTF8)
    fields = pl.Series("line", text_lines(data), dtype=pl.String).str.extract_groups(_LINE).struct.unnest()
    table = fields.select(
        pl.int_range(1, pl.len() + 1, dtype=pl.Int64).alias("row"),
        _times_ns().alias("time_ns"),
        pl.col("scan").cast(pl.Int32, strict=False),
        pl.col("bssid"),
        pl.when(pl.col("blank") == "").then("ssid").otherwise(pl.col("ssid").str.strip_prefix(" ")).alias("ssid"),
        level_dbm(pl.col("rssi_dbm")),
        pl.lit(None, dtype=pl.Float32).alias("frequency_mhz"),
    )
    parsed = ("time_ns", "scan", "bssid", "ssid", "rssi_dbm")
    raw = parsed_rows(data, file, table, pl.all_horizontal(pl.col(name).is_not_null() for name in parsed))
    return replace(raw, findings=(*raw.findings, *undecodable_findings(data, raw, "ssid")))


def _times_ns() -> pl.Expr:
    time_us = pl.col("time_us").cast(pl.Int64, strict=False)
    return pl.when(time_us <= _GREATEST_US).then(time_us) * _US_TO_NS


def mark_repeated(rows: pl.DataFrame) -> pl.DataFrame:
    """Add ``repeated``: an earlier row has the same bssid and time, as when a scan returns stale results."""
    return rows.with_columns(pl.struct("bssid", "time_ns").is_first_distinct().not_().alias("repeated"))


def wifi_findings(rows: pl.DataFrame, file: str, settings: FindingSettings) -> list[Finding]:
    """Report stale rows and throttled scanning; ``rows`` carry ``repeated``."""
    findings = []
    stale = rows.filter("repeated")["row"].to_list()
    if stale:
        message = "a scan repeats readings of an earlier one (same bssid and time); each counts once"
        findings.append(Finding.at_lines("stale_wifi_rows", file, stale, message, Severity.INFO))
    interval_s = median_scan_interval_s(rows)
    if interval_s is not None and interval_s > settings.scan_interval_s:
        message = (
            f"scans start every {interval_s:.1f} s (median): the phone throttles scanning; switch off "
            "'Wi-Fi scan throttling' in its developer options"
        )
        scans = rows["scan"].n_unique()
        findings.append(Finding(kind="scan_throttling", file=file, count=scans, message=message))
    return findings


def median_scan_interval_s(rows: pl.DataFrame) -> float | None:
    """Median time between the starts of successive scans, seconds; None for fewer than two scans.

    A scan starts with its earliest fresh reading.
    """
    fresh = ~rows["repeated"].to_numpy()
    scan, time_ns = rows["scan"].to_numpy()[fresh], rows["time_ns"].to_numpy()[fresh]
    order = np.argsort(time_ns, kind="stable")
    starts_ns = np.sort(time_ns[order[np.unique(scan[order], return_index=True)[1]]])
    return float(np.median(np.diff(starts_ns))) / 1e9 if len(starts_ns) > 1 else None
