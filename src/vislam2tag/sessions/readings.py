"""Readings of a session: sensors, Wi-Fi scans and Bluetooth advertisements, and which of them repeat others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import polars as pl

from vislam2tag.common.findings import Finding, Severity, at_lines_if
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import PressureLog
from vislam2tag.core.limits import of_one_recording
from vislam2tag.intake.readings import level_number, normal_uuids
from vislam2tag.intake.sensor_units import sensor_factor
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.text_tables import LineTable
from vislam2tag.sessions.tracker_tables import FAR_TIMES, findings_of

_CARRIED = ("ACC", "GYRO")
"""Sensors whose unit is checked: a person carries the phone."""
_UNCALIBRATED = "_UN"
_MIN_READINGS = 100
"""Fewer show no unit: about a second."""
SENSOR_VALUES = tuple(f"v{i}" for i in range(1, 7))
_NEW_SCAN_NS = 1_000_000_000
_LONGEST_SCAN_NS = 60_000_000_000
SENSOR_SCHEMA = {"time_ns": pl.Int64, "sensor": pl.String, **dict.fromkeys(SENSOR_VALUES, pl.Float64)}


def sensor_table(rows: pl.DataFrame, file: str) -> tuple[pl.DataFrame, list[Finding]]:
    """Make the ``sensors`` table of the parsed rows of a sensor file: ``row`` first, ``repeated`` added.

    A row is ``repeated`` where an earlier one has the same sensor and time. All rows are kept as they are.
    """
    repeated, backward = _irregular(rows)
    table = rows.select("row", "time_ns", repeated.alias("repeated"), "sensor", *SENSOR_VALUES)
    infinite = ~rows.select(pl.all_horizontal(pl.col(SENSOR_VALUES).is_finite())).to_series().to_numpy()
    backwards = "readings are earlier than a preceding one of the same sensor; they are kept"
    again = "readings repeat the sensor and time of an earlier one; only the first is used"
    findings = findings_of(
        rows["row"].to_numpy(),
        file,
        ("far_times", ~of_one_recording(rows["time_ns"].to_numpy()), FAR_TIMES, Severity.WARNING),
        ("repeated_rows", repeated.to_numpy(), again, Severity.INFO),
        ("backward_times", backward.to_numpy(), backwards, Severity.WARNING),
        ("non_finite_values", infinite, "values are not finite; they are kept unchanged", Severity.WARNING),
    )
    return table, findings


def scan_numbers(time_ns: pl.Series, bssid: pl.Series, said: pl.Series | None) -> pl.Series:
    """Number the Wi-Fi scans (n,) of readings at ``time_ns`` (n,), ns, in the order of time.

    By the numbers or names ``said`` (n,), which may start again later. Without them, by equal times if readings share
    theirs, else a scan ends with a gap of a second, or when one of its access points is read again.
    """
    rows = pl.DataFrame({"time": time_ns, "bssid": bssid}).with_row_index("at")
    if said is not None:
        rows = rows.with_columns(said=said.cast(pl.String)).sort("time", "said")
        spans_ns = rows.group_by("said").agg(pl.col("time").max() - pl.col("time").min())["time"]
        if int(spans_ns.max() or 0) > _LONGEST_SCAN_NS:  # type: ignore[arg-type]
            return rows.with_columns(scan=pl.col("said").rle_id()).sort("at")["scan"].cast(pl.Int32)
        first = pl.col("time").min().over("said")
        return rows.with_columns(scan=pl.struct(first, "said").rank("dense")).sort("at")["scan"].cast(pl.Int32)
    if time_ns.n_unique() * 2 <= len(time_ns):
        return time_ns.rank("dense").cast(pl.Int32)
    rows = rows.sort("time").with_columns(gap=pl.col("time").diff().fill_null(0) > _NEW_SCAN_NS)
    scan, numbers, heard = 1, list[int](), set[str]()
    for point, gap in rows.select("bssid", "gap").iter_rows():
        if gap or point in heard:
            scan, heard = scan + 1, set()
        heard.add(point)
        numbers.append(scan)
    return rows.with_columns(scan=pl.Series(numbers, dtype=pl.Int32)).sort("at")["scan"]


def with_sensor_units(rows: pl.DataFrame, file: str) -> tuple[pl.DataFrame, list[Finding]]:
    """Convert the values of rows of a sensor file to the units of Android, if they are clearly in another one."""
    factors, findings = dict[str, float](), list[Finding]()
    for name in rows["sensor"].unique(maintain_order=True):
        sensor = name.removesuffix(_UNCALIBRATED)
        if sensor not in _CARRIED:
            continue
        values = rows.filter(pl.col("sensor") == name).select(SENSOR_VALUES[:3]).cast(pl.Float64).to_numpy()
        factor, odd = sensor_factor(values, sensor, None, file) if len(values) >= _MIN_READINGS else (1.0, [])
        if factor is not None and factor != 1.0:
            factors[name] = factor
            findings += odd
    if not findings:
        return rows, []
    by_sensor = pl.col("sensor").replace_strict(factors, default=1.0, return_dtype=pl.Float64)
    return rows.with_columns(pl.col(SENSOR_VALUES) * by_sensor), findings


def _irregular(rows: pl.DataFrame) -> tuple[pl.Series, pl.Series]:
    """Masks (n,) of readings that were there before, and of those before an earlier one of their sensor."""
    time_ns = pl.col("time_ns")
    none = pl.repeat(value=False, n=rows.height, eager=True)
    if not rows.select((time_ns.diff() <= 0).over("sensor").any()).item():
        return none, none
    repeated = pl.struct("sensor", "time_ns").is_first_distinct().not_()
    backward = (time_ns < time_ns.cum_max().shift(1)).over("sensor").fill_null(value=False) & ~repeated
    found = rows.select(repeated.alias("repeated"), backward.alias("backward"))
    return found["repeated"], found["backward"]


def sensor_rows(rows: pl.DataFrame, sensor: str, values: Sequence[pl.Expr | pl.Series]) -> pl.DataFrame:
    """``row``, ``time_ns`` and one sensor's values as a sensor table has them; values that it does not have are 0."""
    whole = [*values, *(pl.lit(0.0) for _ in SENSOR_VALUES[len(values) :])]
    named = [value.alias(name) for name, value in zip(SENSOR_VALUES, whole, strict=True)]
    return rows.select("row", "time_ns", pl.lit(sensor).alias("sensor"), *named)


def sensors_of_log(parts: Sequence[pl.DataFrame]) -> pl.DataFrame:
    """The table ``sensors`` of a log, of :func:`sensor_rows` of its sensors; ``repeated`` is added."""
    return pl.concat(parts).sort("row").with_columns(repeated=~pl.struct("sensor", "time_ns").is_first_distinct())


def readings_of(sensors: pl.DataFrame, sensor: str, values: Sequence[str]) -> tuple[IntArray, FloatArray]:
    """Times (k,), increasing strictly, ns, and values (k, v) of a sensor's readings in a ``sensors`` table.

    Repeated readings are left out, and those whose times cannot be of one recording.
    """
    rows = np.flatnonzero(((sensors["sensor"] == sensor) & ~sensors["repeated"]).to_numpy())
    all_ns = sensors["time_ns"].to_numpy()
    rows = rows[of_one_recording(all_ns[rows])]
    if np.any(np.diff(all_ns[rows]) < 0):
        rows = rows[np.argsort(all_ns[rows], kind="stable")]
    return all_ns[rows], np.column_stack([sensors[name].to_numpy()[rows] for name in values])


PRESSURE = "PRESSURE"
"""Sensor type of the barometer; ``v1`` is in hPa."""
PLAUSIBLE_HPA = (500.0, 1200.0)
"""What the air around somebody walking may press with; other numbers are faults."""


def pressure_log(sensors: pl.DataFrame) -> PressureLog | None:
    """Take the barometer's readings out of a ``sensors`` table, in time order; None where there are not two."""
    time_ns, values = readings_of(sensors, PRESSURE, ("v1",))
    sound = (values[:, 0] >= PLAUSIBLE_HPA[0]) & (values[:, 0] <= PLAUSIBLE_HPA[1])
    return PressureLog(time_ns[sound], values[sound, 0]) if sound.sum() > 1 else None


_US_TO_NS = 1000
_LEVEL = r"(?<rssi_dbm>[^;\s]+(?:\s+(?i:dbm))?)"
_TIME_US = pl.col("time_us").cast(pl.Int64, strict=False)
WIFI_LINES = LineTable(
    # The fields after the text are found from the end of the line.
    r"^\s*(?<scan>[+-]?\d+)\s*;(?<blank>\s*)(?<time_us>\d+)\s*;\s*WLAN\s*;(?<ssid>.*);\s*(?<bssid>[^;\s]*)\s*;"
    rf"\s*{_LEVEL}\s*$",
    (
        (pl.when(_TIME_US <= (2**63 - 1) // _US_TO_NS).then(_TIME_US) * _US_TO_NS).alias("time_ns"),
        pl.col("scan").cast(pl.Int32, strict=False),
        pl.col("bssid", "ssid"),
        level_number(pl.col("rssi_dbm")).cast(pl.Float32),
        pl.lit(None, dtype=pl.Float32).alias("frequency_mhz"),
    ),
    pl.all_horizontal(pl.col("time_ns", "scan", "bssid", "ssid", "rssi_dbm").is_not_null()),
    "ssid",
)
"""Wi-Fi scans of the published layout: ``scan; t; WLAN; ssid; bssid; rss``, t in microseconds, no frequency (null).

Addresses and levels are as the file has them; an address may be empty.
"""


def mark_repeated(rows: pl.DataFrame, *sender: str) -> pl.DataFrame:
    """Add ``repeated``: an earlier row has the same sender and time, as when a scan returns stale results."""
    return rows.with_columns(repeated=pl.struct(*sender, "time_ns").is_first_distinct().not_())


def mark_wifi(rows: pl.DataFrame) -> pl.DataFrame:
    """Make ``repeated`` true for all rows of stale scans, too: see :func:`repeated_scans`."""
    return rows.with_columns(repeated=pl.col("repeated") | pl.col("scan").is_in(repeated_scans(rows)))


def stale_scans(rows: pl.DataFrame, file: str) -> list[Finding]:
    """Report scans that repeat the scan before, whatever their times; ``lines`` are their first ones."""
    return _stale_findings(rows, repeated_scans(rows), file)


def _stale_findings(rows: pl.DataFrame, scans: Sequence[int], file: str) -> list[Finding]:
    stale = rows.filter(pl.col("scan").is_in(scans))
    message = (
        "scans repeat all addresses and levels of the scan before, so they are old results and are not used; disable "
        "'Wi-Fi scan throttling' in the developer options of the phone"
    )
    starts = stale.group_by("scan").agg(pl.col("row").min())["row"].sort().to_list()
    return at_lines_if("stale_scans", file, starts, message)


def wifi_findings(rows: pl.DataFrame, file: str, settings: FindingSettings) -> list[Finding]:
    """Report stale rows and scans, and throttled scanning; ``rows`` are of :func:`mark_wifi`."""
    message = "a scan repeats readings of an earlier one (same BSSID and time); each counts once"
    stale = repeated_scans(rows)
    findings = _stale_findings(rows, stale, file)
    again = rows.filter(pl.col("repeated"), ~pl.col("scan").is_in(stale))["row"].to_list()
    findings += at_lines_if("stale_wifi_rows", file, again, message, Severity.INFO)
    interval_s = median_scan_interval_s(rows)
    if interval_s is not None and interval_s > settings.scan_interval_s:
        message = (
            f"scans start every {interval_s:.1f} s (median): the phone throttles scanning; disable 'Wi-Fi scan "
            "throttling' in its developer options"
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


_GREATEST_NUMBER = 65535
"""Of major and minor, which have 16 bits."""
_IDENTITY = pl.col("uuid", "major", "minor")
BEACON = ("address", "uuid", "major", "minor")
"""Columns that identify the sender of an advertisement."""
BLE_LINES = LineTable(
    # The shortest name that leaves a level, with or without an identity after it.
    rf"^\s*(?<time_ns>\d+)\s*;(?<blank>\s*)(?<address>[^;\s]*)\s*;(?<name>.*?);\s*{_LEVEL}\s*"
    r"(?:;\s*(?<uuid>[0-9A-Fa-f-]{32,36})?\s*;\s*(?<major>\d+)?\s*;\s*(?<minor>\d+)?\s*)?$",
    (
        pl.col("time_ns").cast(pl.Int64, strict=False),
        pl.col("address", "name"),
        pl.col("uuid").map_batches(normal_uuids, return_dtype=pl.String),
        pl.col("major", "minor").cast(pl.Int32, strict=False),
        level_number(pl.col("rssi_dbm")).cast(pl.Float32),
    ),
    pl.all_horizontal(
        pl.col("time_ns", "address", "name", "rssi_dbm").is_not_null(),
        pl.sum_horizontal(_IDENTITY.is_not_null()).is_in((0, 3)),
        pl.max_horizontal("major", "minor").fill_null(0) <= _GREATEST_NUMBER,
    ),
    "name",
)
"""Bluetooth advertisements: ``t; address; name; rss``, t in nanoseconds; a beacon's identity may follow, whole:
``; uuid; major; minor`` (iBeacon).

UUIDs come out in one notation; addresses, which may be empty, and levels are as the file has them.
"""


SAME_READING_NS = 5_000_000
"""Rows of one transmitter this close in time are one reading: loggers turn boot time into their own with a jitter."""


def mark_jittered(rows: pl.DataFrame, sender: str) -> pl.DataFrame:
    """Add ``repeated``: an earlier row of the same sender is at most :data:`SAME_READING_NS` older or younger.

    Rows keep their order.
    """
    fresh = (pl.col("time_ns").diff() > SAME_READING_NS).over(sender, order_by=["time_ns", "row"])
    return rows.with_columns(repeated=~fresh.fill_null(value=True))


def ble_rows(rows: pl.DataFrame, address: str, name: pl.Expr, level: str) -> pl.DataFrame:
    """Advertisements of no known beacon (``row``, ``time_ns`` and these columns) as a table ``ble`` has them."""
    none = pl.lit(None, dtype=pl.Int32)
    identity = {"uuid": pl.lit(None, dtype=pl.String), "major": none, "minor": none}
    rssi_dbm = pl.col(level).cast(pl.Float32)
    return rows.select("row", "time_ns", address=pl.col(address), name=name, **identity, rssi_dbm=rssi_dbm)


def ble_findings(rows: pl.DataFrame, file: str) -> list[Finding]:
    """Report repeated rows; ``rows`` carry ``repeated``."""
    message = "advertisements repeat the transmitter and time of an earlier one; each counts once"
    return at_lines_if("repeated_rows", file, rows.filter("repeated")["row"].to_list(), message, Severity.INFO)


FEWEST_READINGS = 4
"""Scans of fewer readings may be alike by chance."""


def repeated_scans(wifi: pl.DataFrame) -> list[int]:
    """Numbers of the scans with the addresses and levels of the scan before, in order; ``wifi`` as in a session."""
    scans = (
        wifi.filter(pl.col("rssi_dbm").is_not_null())
        .group_by("scan", maintain_order=True)
        .agg(
            pl.col("time_ns").max().alias("last_ns"),
            pl.struct("bssid", "rssi_dbm").hash(seed=0).sort().alias("readings"),
            pl.len().alias("count"),
        )
        .sort("last_ns", maintain_order=True)
    )
    alike = (pl.col("readings") == pl.col("readings").shift(1)) & (pl.col("count") >= FEWEST_READINGS)
    return scans.filter(alike.fill_null(value=False))["scan"].to_list()
