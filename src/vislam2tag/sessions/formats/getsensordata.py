"""Logs of GetSensorData (CSIC), as the IPIN competitions publish them: ``TYPE;AppTimestamp;...``, ``%`` comments.

A log is one text file in a session's folder, without poses. Two clocks: the app's (seconds since recording began, in
every row, when it was written) and the phone's (seconds since it started, of sensors and Wi-Fi, when a value was
measured). What is parsed is on the phone's clock if the log has both. Position marks (``POSI``) are the fixes; they are
in degrees, so that the floor needs a georeference.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.files.given_files import plain, read_bytes
from vislam2tag.common.files.table_files import read_csv
from vislam2tag.common.findings import Finding, Severity, at_lines_if
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.intake.readings import admitted
from vislam2tag.sessions.model import FileRecord, GeographicFixes, Session
from vislam2tag.sessions.readings import (
    SENSOR_VALUES,
    ble_rows,
    mark_jittered,
    mark_wifi,
    sensor_rows,
    sensors_of_log,
    wifi_findings,
)
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.text_tables import line_count, ns_of_seconds, unreadable_findings
from vislam2tag.sessions.without_poses import session_of_log, track_of_log
from vislam2tag.site.model import SessionRef

RESET_S = 1.0
"""Times of the app's clock that go back by more mean that it was set again; rows are some milliseconds out of order."""
GREATEST_S = 1e9
"""No clock of a phone counts that far: the number is a fault."""
_NUMBER = r"\s*[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?\s*"
_ADDRESS = r"\s*(?:(?:[0-9A-Fa-f]{2}[:.-]?){5}[0-9A-Fa-f]{2})?\s*"
"""In any notation; empty if the phone did not log it."""
_SENSOR = rf"^\w+;(?<app>{_NUMBER});(?<seen>{_NUMBER});%s(?<v1>{_NUMBER});(?<v2>{_NUMBER});(?<v3>{_NUMBER})(?:;|$)"
_ANGLES = rf"{_NUMBER};{_NUMBER};{_NUMBER};"
KINDS: Mapping[str, str] = {
    "POSI": rf"^POSI;(?<app>{_NUMBER});[^;]*;(?<latitude>{_NUMBER});(?<longitude>{_NUMBER});(?<floor>{_NUMBER});"
    rf"(?<building>{_NUMBER});?\s*$",
    # The name of a network may contain the separator: what follows it is found from the end of the line.
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
    """Leave out single rows whose time is far ahead, and all that follows once the app's clock was set again."""
    app = pl.col("app")
    timed = lines.filter(pl.col("kind").is_in(list(KINDS)) & app.is_not_null())
    ahead = (app > app.shift(-1) + RESET_S) & (app.shift(1).fill_null(-np.inf) <= app.shift(-1) + RESET_S)
    odd = timed.filter(ahead)["row"]
    back = timed.filter(~pl.col("row").is_in(odd.implode())).filter(app < app.cum_max() - RESET_S)["row"]
    message = "the times of single rows are ahead of those around them; these rows are skipped"
    findings = at_lines_if("odd_times", file, odd.to_list(), message)
    if len(back):
        lost = timed.filter(pl.col("row") >= back[0])["row"].to_list()
        message = (
            "the clock of the app was set back: the rows after that have ambiguous times and are skipped; split the "
            "log there"
        )
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

    Sensors are read some milliseconds after they measured: the median estimates it. Without any, the freshest Wi-Fi
    result does; without either the clock stays the app's.
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
    return unreadable_findings(data, file, lines["row"][-1] if broken else 0, broken)


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
    ``floor`` and ``building`` (n,) as the rows number them. ``time_ns`` (n,) on the clock of the log's tables.
    """

    app_s: FloatArray
    position: FloatArray
    floor: IntArray
    building: IntArray
    time_ns: IntArray


@dataclass(frozen=True)
class GetSensorDataLog:
    """Contents of a log.

    ``tables`` (``wifi``, ``ble``, ``sensors``) are as a :class:`~vislam2tag.sessions.model.Session` has them, ``ble``
    as :func:`.fingerprints.radio_rows` makes it.
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
            *odd,
            *odd_adverts,
            *at_lines_if("unplaced_taps", file, rows["POSI"].filter(~_is_placed())["row"].to_list(), _UNPLACED),
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
    message = "the sensor time is not within ten minutes before the row was written; the time of the row is used"
    readings, left_out = admitted(_readings(table), "bssid", file)
    marked = mark_wifi(mark_jittered(readings, "bssid"))
    return marked, [*at_lines_if("unusable_sensor_time", file, odd, message), *left_out]


def _ble(rows: pl.DataFrame, offset_s: float, file: str) -> tuple[pl.DataFrame, list[Finding]]:
    """Adverts; an iBeacon is known by UUID, major and minor if it contains them (the order of its fields varies)."""
    whole = rows["rest"].str.extract_groups(rf"^[^;]*;(?<major>\d+);(?<minor>\d+);(?<uuid>{_UUID})").struct
    beacon = pl.concat_str(*(whole.field(name) for name in ("uuid", "major", "minor")), separator="-")
    time, none = pl.col("app") + offset_s, pl.lit(None)
    table = rows.with_columns(beacon=beacon, time=time, scan=none, ssid=pl.lit(""), frequency_mhz=none)
    readings, left_out = admitted(_readings(table.with_columns(bssid=pl.coalesce("beacon", "bssid"))), "bssid", file)
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
        own_s = float(np.median((table["seen"] - table["app"]).to_numpy())) if table.height else offset_s
        shift_s = 0.0 if abs(own_s - offset_s) < _NEWEST_S else offset_s - own_s
        timed = table.with_columns(time=pl.col("seen") + shift_s).with_columns(ns_of_seconds("time"))
        parts.append(sensor_rows(timed, name, [pl.col(value) for value in SENSOR_VALUES if value in table.columns]))
    return sensors_of_log(parts)


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


_UNPLACED = (
    "POSI rows have no valid latitude and longitude, or their floor is not a whole number; they are not used as taps"
)


def _is_placed() -> pl.Expr:
    """The app writes zeros where no one said where the mark is; halves of floors are stairs."""
    somewhere = (pl.col("latitude") != 0) | (pl.col("longitude") != 0)
    whole = pl.all_horizontal(
        (pl.col(name) == pl.col(name).round()) & pl.col(name).is_between(-_MOST, _MOST)
        for name in ("floor", "building")
    )
    return somewhere & whole & pl.col("latitude").is_between(-90, 90) & pl.col("longitude").is_between(-180, 180)


def _started(head: str) -> datetime | None:
    found = _DATE.search(head)
    if found is None or found[1] not in _MONTHS:
        return None
    day, hour, minute, second, year = (int(found[number]) for number in (2, 3, 4, 5, 6))
    try:
        return datetime(year, _MONTHS.index(found[1]) + 1, day, hour, minute, second)
    except (ValueError, OverflowError):
        return None


_LOOKED_AT_BYTES = 65_536


class GetSensorDataFormat:
    """Reads folders that contain one log; times are nanoseconds since the phone started."""

    name = "getsensordata"

    def recognises(self, folder: Path) -> bool:
        """The folder's one text file begins like a log."""
        return folder.is_dir() and len(self.input_files(folder)) == 1

    def input_files(self, folder: Path) -> list[Path]:
        """The log."""
        return [path for path in sorted(folder.glob("*.txt")) if _begins_like_a_log(path)]

    def read(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read a log whole; problems are findings. Raises SessionError if it has no inertial readings."""
        (path,) = self.input_files(ref.folder)
        data, name = read_bytes(path), path.name
        log = parse_log(data, name)
        refused = (
            f"{ref.key}: accelerometer or gyroscope readings in {name} are missing or too few; it cannot be mapped"
        )
        camera = track_of_log(log.tables["sensors"], None, refused)
        tables = {name: log.tables[name] for name in ("wifi", "sensors")} | {"ble": _ble_table(log.tables["ble"])}
        lines = line_count(data)
        record = FileRecord.of(name, "log", data, lines, lines)
        findings = (*log.findings, *wifi_findings(tables["wifi"], name, settings))
        return replace(session_of_log(ref.key, camera, tables, record, findings), geographic_fixes=_fixes(log, name))


def _begins_like_a_log(path: Path) -> bool:
    try:
        with plain(path).open("rb") as file:
            return looks_like_a_log(file.read(_LOOKED_AT_BYTES))
    except OSError:
        return False


def _fixes(log: GetSensorDataLog, file: str) -> GeographicFixes:
    """The marks in time order, of several at one time the first."""
    time_ns, first = np.unique(log.taps.time_ns, return_index=True)
    names = tuple(f"the mark at {at_s:.1f} s" for at_s in log.taps.app_s[first].tolist())
    return GeographicFixes(file, time_ns, log.taps.position[first], log.taps.floor[first], names)


def _ble_table(adverts: pl.DataFrame) -> pl.DataFrame:
    table = ble_rows(adverts, "bssid", pl.col("ssid"), "rssi_dbm")
    return table.insert_column(2, adverts["repeated"])


register(GetSensorDataFormat())
