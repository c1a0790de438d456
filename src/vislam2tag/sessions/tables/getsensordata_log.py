"""Log files of GetSensorData (CSIC), as the IPIN competitions publish them: ``TYPE;AppTimestamp;...``, ``%`` comments.

Two clocks: the app's (seconds since recording began, in every row, when it was written) and the phone's (seconds since
it started, of sensors and Wi-Fi, when a value was measured). What is parsed is on the phone's where the log tells both.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

import numpy as np
import polars as pl

from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.intake.readings import admitted
from vislam2tag.sessions.tables.getsensordata_lines import (
    KINDS,
    boot_offset_s,
    line_findings,
    log_lines,
    on_one_clock,
    rows_of_kind,
)
from vislam2tag.sessions.tables.radio_text import mark_jittered
from vislam2tag.sessions.tables.raw_table import ns_of_seconds
from vislam2tag.sessions.tables.sensor_table import SENSOR_VALUES

OLDEST_S = 600.0
"""Phones cache results for a minute or so; a Wi-Fi time this much older is on another clock."""
_NEWEST_S = 1.0
"""A Wi-Fi result may seem this much younger than its row: the clocks are related by the delays of other sensors."""
_MOST = 10_000
"""Numbers of floors and buildings are smaller."""
_HEAD_BYTES = 8192
_SENSORS = {"ACCE": "ACC", "GYRO": "GYRO", "MAGN": "MAG", "AHRS": "ROT", "PRES": "PRESSURE"}
"""Names as in the table ``sensors``."""
_UUID = r"[0-9A-Fa-f]{8}-?(?:[0-9A-Fa-f]{4}-?){3}[0-9A-Fa-f]{12}"
_DATE = re.compile(r"Date of creation:\s*\w{3} (\w{3}) +(\d+) (\d\d):(\d\d):(\d\d) .*?(\d{4})")
_MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
_MAKER, _MODEL = (
    re.compile(rf"^%.*\b{name}\b[^:\n]*:[ \t]*(\S.*?)\s*$", re.MULTILINE) for name in ("Manufacturer", "[Mm]odel")
)


@dataclass(frozen=True)
class LoggedTaps:
    """Where the walker was: ``app_s`` (n,) on the app's clock, ``position`` (n, 2) longitude and latitude in degrees,
    ``floor`` and ``building`` (n,) as the rows number them; ``time_ns`` (n,) on the clock of the log's tables.
    """

    app_s: FloatArray
    position: FloatArray
    floor: IntArray
    building: IntArray
    time_ns: IntArray


@dataclass(frozen=True)
class GetSensorDataLog:
    """What a log holds.

    ``tables`` (``wifi``, ``ble``, ``sensors``) are as a :class:`~vislam2tag.sessions.model.Session` has them, ``ble``
    as :func:`.radio_tables.radio_rows` makes it.
    """

    device: str | None
    started: datetime | None
    taps: LoggedTaps
    tables: dict[str, pl.DataFrame]
    first_ns: int
    last_ns: int
    findings: tuple[Finding, ...]


def parse_taps(data: bytes) -> LoggedTaps:
    """Parse only where the walker was; times are on the app's clock."""
    rows = b"\n".join(line for line in data.split(b"\n") if line.startswith(b"POSI;"))
    return _taps(rows_of_kind(log_lines(rows), "POSI"), offset_s=0.0)


def parse_log(data: bytes, file: str) -> GetSensorDataLog:
    """Parse a log file; both variants of Wi-Fi rows (with and without frequency) are understood, also mixed."""
    lines, reset = on_one_clock(log_lines(data), file)
    rows = {kind: rows_of_kind(lines, kind) for kind in KINDS}
    offset_s = boot_offset_s(rows)
    wifi, odd = _wifi(rows["WIFI"], offset_s, file)
    ble, odd_adverts = _ble(rows["BLE4"], offset_s, file)
    left_out = (*odd, *odd_adverts)
    times_ns = _ns(np.append(np.concatenate([each["app"].to_numpy() for each in rows.values()]), np.nan) + offset_s)
    head = data[:_HEAD_BYTES].decode("utf-8", errors="replace")
    return GetSensorDataLog(
        device=" ".join(found[1] for pattern in (_MAKER, _MODEL) if (found := pattern.search(head))) or None,
        started=_started(head),
        taps=_taps(rows["POSI"], offset_s),
        tables={"wifi": wifi, "ble": ble, "sensors": _sensors(rows, offset_s)},
        first_ns=int(times_ns.min(initial=times_ns.max(initial=0))),
        last_ns=int(times_ns.max(initial=0)),
        findings=(
            *line_findings(lines, rows, data, file),
            *reset,
            *left_out,
            *_tap_findings(rows["POSI"], file),
        ),
    )


def _wifi(rows: pl.DataFrame, offset_s: float, file: str) -> tuple[pl.DataFrame, list[Finding]]:
    """Give each result the time when it was received; a scan is what was written at one time."""
    written = pl.col("app") + offset_s
    usable = (written - pl.col("seen")).is_between(-_NEWEST_S, OLDEST_S).fill_null(value=False)
    table = rows.with_columns(
        usable=usable, time=pl.when(usable).then("seen").otherwise(written), scan=pl.col("app").rank("dense")
    )
    odd = table.filter(~pl.col("usable"))["row"].to_list()
    message = "the sensor time is not within ten minutes before the row was written; the row's own time counts"
    findings = [Finding.at_lines("unusable_sensor_time", file, odd, message)] if odd else []
    readings, left_out = admitted(_readings(table), "bssid", file)
    return mark_jittered(readings, "bssid"), [*findings, *left_out]


def _ble(rows: pl.DataFrame, offset_s: float, file: str) -> tuple[pl.DataFrame, list[Finding]]:
    """Adverts; an iBeacon is known by UUID, major and minor where it tells them (the order of its fields varies)."""
    whole = rows["rest"].str.extract_groups(rf"^[^;]*;(?<major>\d+);(?<minor>\d+);(?<uuid>{_UUID})").struct
    beacon = pl.concat_str(*(whole.field(name) for name in ("uuid", "major", "minor")), separator="-")
    table = rows.with_columns(
        beacon=beacon,
        time=pl.col("app") + offset_s,
        scan=pl.lit(None),
        ssid=pl.lit(""),
        frequency_mhz=pl.lit(None),
    ).with_columns(bssid=pl.coalesce("beacon", "bssid"))
    readings, left_out = admitted(_readings(table), "bssid", file)
    return mark_jittered(readings, "bssid"), left_out


def _readings(table: pl.DataFrame) -> pl.DataFrame:
    return table.select(
        "row",
        ns_of_seconds("time"),
        pl.col("scan").cast(pl.Int32),
        pl.col("bssid").str.strip_chars(),
        "ssid",
        pl.col("rssi_dbm").cast(pl.Float32),
        pl.col("frequency_mhz").cast(pl.Float32),
    )


def _sensors(rows: Mapping[str, pl.DataFrame], offset_s: float) -> pl.DataFrame:
    """Sensor values at the phone's times; each sensor that counts from elsewhere is shifted by its own median."""
    parts = []
    for kind, name in _SENSORS.items():
        table = rows[kind]
        none = [pl.lit(0.0).alias(value) for value in SENSOR_VALUES if value not in table.columns]
        own_s = (table["seen"] - table["app"]).median() if table.height else offset_s
        shift_s = 0.0 if abs(float(own_s) - offset_s) < _NEWEST_S else offset_s - float(own_s)  # type: ignore[arg-type]
        times = table.with_columns(time=pl.col("seen") + shift_s)
        values = times.with_columns(none).select(SENSOR_VALUES)
        parts.append(times.select("row", ns_of_seconds("time"), pl.lit(name).alias("sensor")).hstack(values))
    whole = pl.concat(parts).sort("row")
    return whole.with_columns(repeated=~pl.struct("sensor", "time_ns").is_first_distinct())


def _ns(seconds: FloatArray) -> IntArray:
    """Finite times (n,) in seconds as nanoseconds."""
    times: IntArray = np.round(seconds[np.isfinite(seconds)] * 1e9).astype(np.int64)
    return times


def _taps(rows: pl.DataFrame, offset_s: float) -> LoggedTaps:
    placed = rows.filter(_is_placed())
    return LoggedTaps(
        placed["app"].to_numpy(),
        placed.select("longitude", "latitude").to_numpy(),
        placed["floor"].cast(pl.Int64).to_numpy(),
        placed["building"].cast(pl.Int64).to_numpy(),
        _ns(placed["app"].to_numpy() + offset_s),
    )


def _is_placed() -> pl.Expr:
    """The app writes zeros where nobody said where the mark is; halves of floors are stairs."""
    somewhere = (pl.col("latitude") != 0) | (pl.col("longitude") != 0)
    whole = pl.all_horizontal(
        (pl.col(name) == pl.col(name).round()) & pl.col(name).is_between(-_MOST, _MOST)
        for name in ("floor", "building")
    )
    return somewhere & whole & pl.col("latitude").is_between(-90, 90) & pl.col("longitude").is_between(-180, 180)


def _tap_findings(rows: pl.DataFrame, file: str) -> list[Finding]:
    odd = rows.filter(~_is_placed())["row"].to_list()
    message = "POSI rows name no place on the earth and no whole floor; they are no taps"
    return [Finding.at_lines("unplaced_taps", file, odd, message)] if odd else []


def _started(head: str) -> datetime | None:
    found = _DATE.search(head)
    if found is None or found[1] not in _MONTHS:
        return None
    day, hour, minute, second, year = (int(found[number]) for number in (2, 3, 4, 5, 6))
    try:
        return datetime(year, _MONTHS.index(found[1]) + 1, day, hour, minute, second)
    except (ValueError, OverflowError):
        return None
