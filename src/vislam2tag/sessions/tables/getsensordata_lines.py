"""Lines of a GetSensorData log: parsed by kind, brought onto one clock, and counted where they are none."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
import polars as pl

from vislam2tag.common.files.table_files import read_csv
from vislam2tag.common.findings import Finding, Severity

RESET_S = 1.0
"""Times of the app's clock that go back by more mean that it was set anew; rows are some milliseconds out of order."""
GREATEST_S = 1e9
"""No clock of a phone counts that far: the number is a fault."""
_NUMBER = r"\s*[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?\s*"
_ADDRESS = r"\s*(?:(?:[0-9A-Fa-f]{2}[:.-]?){5}[0-9A-Fa-f]{2})?\s*"
"""In any notation; empty if the phone did not tell it."""
_SENSOR = rf"^\w+;(?<app>{_NUMBER});(?<seen>{_NUMBER});%s(?<v1>{_NUMBER});(?<v2>{_NUMBER});(?<v3>{_NUMBER})(?:;|$)"
_ANGLES = rf"{_NUMBER};{_NUMBER};{_NUMBER};"
KINDS: Mapping[str, str] = {
    "POSI": rf"^POSI;(?<app>{_NUMBER});[^;]*;(?<latitude>{_NUMBER});(?<longitude>{_NUMBER});(?<floor>{_NUMBER});"
    rf"(?<building>{_NUMBER});?\s*$",
    # The name of a network may hold the separator: what follows it is found from the end of the line.
    "WIFI": rf"^WIFI;(?<app>{_NUMBER});(?<seen>[^;]*);(?<ssid>.*);(?<bssid>{_ADDRESS});"
    rf"(?:(?<frequency_mhz>{_NUMBER});)?(?<rssi_dbm>{_NUMBER});?\s*$",
    "BLE4": rf"^BLE4;(?<app>{_NUMBER});[^;]*;(?<bssid>{_ADDRESS});(?<rssi_dbm>{_NUMBER});?(?<rest>.*)$",
    "ACCE": _SENSOR % "",
    "GYRO": _SENSOR % "",
    "MAGN": _SENSOR % "",
    "AHRS": _SENSOR % _ANGLES,
    "PRES": rf"^PRES;(?<app>{_NUMBER});(?<seen>{_NUMBER});(?<v1>{_NUMBER})(?:;|$)",
}
"""Pattern of each kind of rows that is taken; all others are not."""
SENSOR_KINDS = ("ACCE", "GYRO", "MAGN", "AHRS", "PRES")
_TEXTS = ("ssid", "bssid", "rest")


def looks_like_a_log(data: bytes) -> bool:
    """Whether the first bytes of a file are of such a log."""
    return re.search(rb"(?m)^(?:WIFI|POSI|ACCE|GYRO|MAGN|AHRS|PRES|BLE4|SOUN|LIGH);\s*\d+(?:\.\d+)?;", data) is not None


def log_lines(data: bytes) -> pl.DataFrame:
    """One row a line: ``row`` (from 1), ``line``, ``kind`` (its first four letters), ``app`` (seconds; null: none)."""
    lines = read_csv(
        b"line\n" + data.replace(b"\r", b""),
        separator="\x1f",
        quote_char=None,
        schema={"line": pl.String},
        truncate_ragged_lines=True,
        encoding="utf8-lossy",
    )
    fields = pl.col("line").str.splitn(";", 3)
    return lines.with_row_index("row", offset=1).with_columns(
        pl.col("row").cast(pl.Int64),
        kind=fields.struct.field("field_0").fill_null(""),
        app=fields.struct.field("field_1").str.strip_chars().cast(pl.Float64, strict=False),
    )


def on_one_clock(lines: pl.DataFrame, file: str) -> tuple[pl.DataFrame, list[Finding]]:
    """Leave out single rows whose time is far ahead, and all that follows once the app's clock was set anew."""
    app = pl.col("app")
    timed = lines.filter(pl.col("kind").is_in(list(KINDS)) & app.is_not_null())
    ahead = (app > app.shift(-1) + RESET_S) & (app.shift(1).fill_null(-np.inf) <= app.shift(-1) + RESET_S)
    odd = timed.filter(ahead)["row"]
    back = timed.filter(~pl.col("row").is_in(odd.implode())).filter(app < app.cum_max() - RESET_S)["row"]
    findings = []
    if len(odd):
        message = "times of single rows are ahead of those around them; the rows are left out"
        findings.append(Finding.at_lines("odd_times", file, odd.to_list(), message))
    if len(back):
        lost = timed.filter(pl.col("row") >= back[0])["row"].to_list()
        message = "the app's clock went back: what follows has no time of its own and is left out; split the log there"
        findings.append(Finding.at_lines("clock_reset", file, lost, message, Severity.ERROR))
        lines = lines.filter(pl.col("row") < back[0])
    return lines.filter(~pl.col("row").is_in(odd.implode())), findings


def rows_of_kind(lines: pl.DataFrame, kind: str) -> pl.DataFrame:
    """Rows of one kind that parse: ``row`` and the fields of its pattern, numbers as float64."""
    rows = (
        lines.filter(pl.col("kind") == kind)
        .select("row", pl.col("line").str.extract_groups(KINDS[kind]))
        .unnest("line")
    )
    numbers = [name for name in rows.columns if name not in ("row", *_TEXTS)]
    table = rows.filter(pl.col("app").is_not_null()).with_columns(
        pl.col(numbers).str.strip_chars().cast(pl.Float64, strict=False)
    )
    times = pl.col("app", "seen") if "seen" in numbers and kind in SENSOR_KINDS else pl.col("app")
    return table.filter(pl.all_horizontal(times.is_between(0, GREATEST_S)))


def boot_offset_s(rows: Mapping[str, pl.DataFrame]) -> float:
    """Seconds from the app's clock to the phone's.

    Sensors are read some milliseconds after they measured: the median tells it. Without any, the freshest Wi-Fi result
    does; without either the clock stays the app's.
    """
    for kind in SENSOR_KINDS:
        measured = rows[kind].filter(pl.col("seen") > 0)
        if measured.height:
            return float(np.median((measured["seen"] - measured["app"]).to_numpy()))
    known = rows["WIFI"].filter(pl.col("seen") > 0)
    return float((known["seen"] - known["app"]).to_numpy().max()) if known.height else 0.0


def line_findings(lines: pl.DataFrame, rows: Mapping[str, pl.DataFrame], data: bytes, file: str) -> list[Finding]:
    """Count lines of a kind that is taken which do not parse, and lines that are neither rows nor comments."""
    good = pl.concat(table["row"] for table in rows.values())
    taken = pl.col("kind").is_in(list(KINDS))
    row = pl.col("line").str.contains(r"^\w{4};") | pl.col("line").str.contains(r"^\s*(%|$)") | pl.col("line").is_null()
    broken = lines.filter((taken & ~pl.col("row").is_in(good.implode())) | ~row)["row"].to_list()
    findings = []
    if broken and broken[-1] == lines["row"][-1] and not data.endswith(b"\n"):
        message = "the last line is cut off, as when the recorder is killed; it is left out"
        findings.append(Finding.at_lines("partial_last_line", file, [broken.pop()], message))
    if broken:
        message = "these lines do not have the expected fields; they are left out: look at the first ones"
        findings.append(Finding.at_lines("malformed_lines", file, broken, message))
    return findings
