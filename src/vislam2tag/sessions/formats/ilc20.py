"""Traces of the Indoor Location Competition 2.0: one text file a walk, tab separated records ``unix-ms TYPE_...
values``, taps on the plan, no poses.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.files.table_files import read_csv
from vislam2tag.common.findings import Finding, Severity, at_lines_if
from vislam2tag.core.context import FixLog
from vislam2tag.intake.readings import admitted, normal_addresses, normal_uuids
from vislam2tag.sessions.model import FileRecord, Session, too_few_fixes
from vislam2tag.sessions.readings import mark_jittered, mark_wifi, sensor_rows, sensors_of_log, wifi_findings
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.text_tables import line_count, unreadable_findings, with_lines
from vislam2tag.sessions.without_poses import session_of_log, track_of_log
from vislam2tag.site.model import SessionRef

_MARK = re.compile(rb"\tTYPE_")
_NEWLINE = ord("\n")
_DIGITS = 13
"""Of a time in milliseconds since 1970, until the year 2286."""
_LATEST_MS = 9 * 10**12
"""As nanoseconds, later times do not fit 64 bits."""
_NAMED = "bssid"
"""May be empty."""
_WIDTH = 10
"""Fields of the longest record taken."""
_MS_TO_NS = 1_000_000
_OLDEST_MS = 600_000
"""Phones cache results for a minute or so; a ``lastseen`` this much older is on another clock."""
_HEADER = re.compile(r"\b(SiteName|FloorName|Brand|Model):([^\t\r\n]*)")
_HEADER_BYTES = 4096
_TEXT, _I32, _F32, _F64 = pl.String(), pl.Int32(), pl.Float32(), pl.Float64()
SENSORS: Mapping[str, str] = {
    "TYPE_ACCELEROMETER": "ACC",
    "TYPE_GYROSCOPE": "GYRO",
    "TYPE_MAGNETIC_FIELD": "MAG",
    "TYPE_ROTATION_VECTOR": "ROT",
}
"""Sensors that are taken, by the names that the table ``sensors`` has."""
_RECORDS: Mapping[str, Mapping[str, tuple[str, pl.DataType]]] = {
    "TYPE_WAYPOINT": {"x": ("f2", _F64), "y": ("f3", _F64)},
    "TYPE_WIFI": {"bssid": ("f3", _TEXT), "rssi_dbm": ("f4", _F32), "frequency_mhz": ("f5", _F32)},
    "TYPE_BEACON": {"address": ("f8", _TEXT), "rssi_dbm": ("f6", _F32)},
    "TYPE_BLUE": {"address": ("f3", _TEXT), "rssi_dbm": ("f4", _F32)},
    **{kind: {"v1": ("f2", _F64), "v2": ("f3", _F64), "v3": ("f4", _F64)} for kind in SENSORS},
}
"""Fields without which a record is none, by type, with the name and type that they get."""


@dataclass(frozen=True)
class Ilc20Trace:
    """Contents of a trace file; times are nanoseconds since 1970.

    ``taps`` are in time order, each time once; ``wifi``, ``ble`` and ``sensors`` are as a
    :class:`~vislam2tag.sessions.model.Session` has them, a reading's time being when it was received, not when it was
    logged. ``header`` has what the comments say. ``TYPE_BLU4`` repeats ``TYPE_BLUE``, and ``TYPE_DIST1`` and
    ``TYPE_DIST2`` are the phone's own distances, which no one describes: these are not taken.
    """

    header: dict[str, str]
    taps: FixLog
    wifi: pl.DataFrame
    ble: pl.DataFrame
    sensors: pl.DataFrame
    first_ns: int
    last_ns: int
    lines: int
    records: int
    """Lines of the file, and records in it."""
    findings: tuple[Finding, ...]


def parse_trace(data: bytes, file: str) -> Ilc20Trace:
    """Parse a trace file; records that a missing newline joined are taken apart, lines that are none are counted."""
    separated, joined = _separated(data.replace(b"\r\n", b"\n"))
    lines = _lines(separated)
    comment = pl.all_horizontal(pl.col(f"f{number}").is_null() for number in range(_WIDTH)) | (
        pl.col("f0").str.starts_with("#").fill_null(value=False)
    )
    timed = pl.col("time_ms").is_between(0, _LATEST_MS) & pl.col("f1").str.starts_with("TYPE_")
    timed = timed.fill_null(value=False)
    records = lines.filter(timed)
    broken = lines.filter(~comment & ~timed)["row"].to_list()
    typed = {}
    for kind, fields in _RECORDS.items():
        rows = records.filter(pl.col("f1") == kind).with_columns(
            pl.col(field).cast(cast, strict=False).alias(name) for name, (field, cast) in fields.items()
        )
        whole = pl.all_horizontal(
            pl.col(name).is_not_null() | (name == _NAMED)
            if cast == _TEXT
            else pl.col(name).is_finite().fill_null(value=False)
            for name, (_, cast) in fields.items()
        )
        typed[kind] = rows.filter(whole)
        broken += rows.filter(~whole)["row"].to_list()
    wifi, odd = _wifi(typed["TYPE_WIFI"], file, joined)
    ble, odd_adverts = _ble(typed["TYPE_BEACON"], typed["TYPE_BLUE"], file, joined)
    time_ns = records["time_ms"].to_numpy() * _MS_TO_NS
    return Ilc20Trace(
        dict(_HEADER.findall(data[:_HEADER_BYTES].decode("utf-8", errors="replace"))),
        _taps(typed["TYPE_WAYPOINT"]),
        wifi,
        ble,
        _sensors(typed),
        int(time_ns.min()) if len(time_ns) else 0,
        int(time_ns.max()) if len(time_ns) else 0,
        line_count(data),
        records.height,
        (*_line_findings(separated, file, joined, broken), *odd, *odd_adverts),
    )


def _separated(data: bytes) -> tuple[bytes, list[int]]:
    """Begin a line with each record; also the 1-based lines, as separated, of records that did not begin one."""
    starts = (mark.start() - _DIGITS for mark in _MARK.finditer(data))
    inside = [at for at in starts if at > 0 and data[at - 1] != _NEWLINE and data[at : at + _DIGITS].isdigit()]
    if not inside:
        return data, []
    records = [data[start:stop] for start, stop in zip([0, *inside], [*inside, len(data)], strict=True)]
    newlines = accumulate(record.count(b"\n") + 1 for record in records[:-1])
    return b"\n".join(records), [before + 1 for before in newlines]


def _lines(data: bytes) -> pl.DataFrame:
    """One row a line: ``row`` (from 1), the fields ``f0`` ... as text, ``time_ms``."""
    names = [f"f{number}" for number in range(_WIDTH)]
    header = "\t".join(names).encode() + b"\n"
    table = read_csv(
        header + data,
        separator="\t",
        quote_char=None,
        schema=dict.fromkeys(names, pl.String),
        truncate_ragged_lines=True,
        encoding="utf8-lossy",
    )
    return table.with_row_index("row", offset=1).with_columns(
        pl.col("row").cast(pl.Int64), time_ms=pl.col("f0").cast(pl.Int64, strict=False)
    )


def _taps(rows: pl.DataFrame) -> FixLog:
    """Taps in time order; of several at one time the first counts."""
    time_ns, first = np.unique((rows["time_ms"] * _MS_TO_NS).to_numpy(), return_index=True)
    position = rows.select("x", "y").to_numpy()[first]
    return FixLog(time_ns, position, tuple(f"line {row}" for row in rows["row"].to_numpy()[first].tolist()))


def _wifi(rows: pl.DataFrame, file: str, joined: list[int]) -> tuple[pl.DataFrame, list[Finding]]:
    """Give each result the time when it was received; a scan is what was logged at one time.

    The logger turned times since boot into unix time again for each scan, which jitters by a millisecond.
    """
    seen_ms = pl.col("f6").cast(pl.Int64, strict=False)
    usable = seen_ms.is_between(pl.col("time_ms") - _OLDEST_MS, pl.col("time_ms")).fill_null(value=False)
    table = rows.with_columns(
        usable=usable,
        time_ns=pl.when(usable).then(seen_ms).otherwise("time_ms") * _MS_TO_NS,
        scan=pl.col("time_ms").rank("dense").cast(_I32),
        ssid=pl.col("f2").fill_null(""),
    )
    odd = _original(table.filter(~pl.col("usable"))["row"].to_list(), joined)
    message = "lastseen is not within ten minutes before the scan was logged; the time of the scan is used"
    readings, left_out = _admitted(table, "bssid", file, joined, "scan", "ssid", "frequency_mhz")
    marked = mark_wifi(mark_jittered(readings, "bssid"))
    return marked, [*at_lines_if("unusable_lastseen", file, odd, message), *left_out]


def _ble(
    beacons: pl.DataFrame, adverts: pl.DataFrame, file: str, joined: list[int]
) -> tuple[pl.DataFrame, list[Finding]]:
    """Take each advertisement once: those of iBeacons come twice, the second time with what they call themselves."""
    identity = {"uuid": pl.col("f2"), "major": pl.col("f3").cast(_I32, strict=False)}
    identity["minor"] = pl.col("f4").cast(_I32, strict=False)
    named = beacons.with_columns(normal_addresses(beacons["address"]), normal_uuids(beacons["f2"]))
    who = named.select("address", **identity).drop_nulls().unique("address", keep="first", maintain_order=True)
    both = pl.concat([beacons.with_columns(name=pl.lit("")), adverts.with_columns(name=pl.col("f2").fill_null(""))])
    table = both.with_columns(time_ns=pl.col("time_ms") * _MS_TO_NS)
    readings, left_out = _admitted(table, "address", file, joined, "name")
    heard = mark_jittered(readings, "address")
    known = heard.join(who, on="address", how="left", maintain_order="left").filter(~pl.col("repeated"))
    columns = ("row", "time_ns", "repeated", "address", "name", "uuid", "major", "minor", "rssi_dbm")
    return known.select(columns).sort("row"), left_out


def _sensors(typed: Mapping[str, pl.DataFrame]) -> pl.DataFrame:
    time_ns = (pl.col("time_ms") * _MS_TO_NS).alias("time_ns")
    values = [pl.col(name) for name in ("v1", "v2", "v3")]
    return sensors_of_log(
        [sensor_rows(typed[kind].with_columns(time_ns), name, values) for kind, name in SENSORS.items()]
    )


def _admitted(
    table: pl.DataFrame, sender: str, file: str, joined: list[int], *columns: str
) -> tuple[pl.DataFrame, list[Finding]]:
    """Row, time, sender, level (null if it is out of range) and further columns of radio readings."""
    rows, odd = admitted(table.select("row", "time_ns", sender, *columns, "rssi_dbm"), sender, file)
    return rows, [with_lines(each, _original(list(each.lines), joined)) for each in odd]


def _original(rows: list[int], joined: list[int]) -> list[int]:
    """Lines of the file from lines after separation."""
    return [row - bisect_right(joined, row) for row in sorted(rows)]


def _line_findings(data: bytes, file: str, joined: list[int], broken: list[int]) -> list[Finding]:
    message = "records that a missing line break joined were separated"
    findings = at_lines_if("joined_records", file, _original(joined, joined), message, Severity.INFO)
    what = "these lines are not records of the format; they are skipped: look at the first ones"
    unreadable = unreadable_findings(data, file, data.count(b"\n") + 1, broken, what)
    return findings + [with_lines(each, _original(list(each.lines), joined)) for each in unreadable]


class Ilc20Format:
    """Reads trace files; times are Unix time, positions those of the taps' frame."""

    name = "ilc20"

    def recognises(self, folder: Path) -> bool:
        """A trace is a text file, not a folder."""
        return folder.suffix == ".txt" and folder.is_file()

    def input_files(self, folder: Path) -> list[Path]:
        """The trace itself."""
        return [folder]

    def read(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read a trace whole; problems are findings. Raises SessionError if it has no inertial readings."""
        data, name = read_bytes(ref.folder), ref.folder.name
        trace = parse_trace(data, name)
        refused = f"{name}: accelerometer or gyroscope readings are missing or too few; the trace cannot be mapped"
        camera = track_of_log(trace.sensors, trace.taps, refused)
        findings = [*trace.findings, *wifi_findings(trace.wifi, name, settings)]
        if len(trace.taps.time_ns) < 2:
            findings.append(too_few_fixes(name, "TYPE_WAYPOINT"))
        tables = {"wifi": trace.wifi, "sensors": trace.sensors, "ble": trace.ble}
        record = FileRecord.of(name, "trace", data, trace.lines, trace.records)
        return session_of_log(ref.key, camera, tables, record, findings)


register(Ilc20Format())
