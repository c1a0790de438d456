"""Fingerprints of one session: its labelled radio readings, grouped by scan or by time windows.

Rows are written to files session by session and joined at the end.

The labelled radio tables of all technologies have the same columns. The published practice is one position for each
scan, the mean over its readings (paper, section VII). Here readings are weighted by their information, and cached
results of an earlier scan do not count.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import polars as pl

from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import scan_parquet, write_parquet
from vislam2tag.common.findings import Finding, finding_if
from vislam2tag.core.status import STATUS_LABELS
from vislam2tag.datasets.access_points import NO_NAMES, access_point_table
from vislam2tag.datasets.phone_motion import PhoneMotion
from vislam2tag.datasets.schema import FINGERPRINTS, READINGS, SCHEMAS, empty_table, in_schema
from vislam2tag.datasets.settings import DatasetSettings
from vislam2tag.datasets.technologies import BLE, WIFI
from vislam2tag.labeling.tables import STATUS_TYPE
from vislam2tag.sessions.foreign_tables import FIRST_UNIX_S
from vislam2tag.site.corrections.file import session_start

TECHNOLOGIES = (BLE, WIFI)
"""Tables in the output of ``process`` that become fingerprints."""
LEAST_SIGMA_M = 1e-3
"""Smallest sigma of a position, which keeps weights finite."""


def radio_rows(table: pl.DataFrame, technology: str) -> pl.DataFrame:
    """Give a labelled table of any technology the columns of ``wifi``.

    A BLE beacon is identified by ``UUID-MAJOR-MINOR`` if it sends them, because its address may change at any time, and
    otherwise by its address. BLE has no scans (null) and does not report its frequency.
    """
    if technology == WIFI:
        return table
    beacon = pl.format("{}-{}-{}", "uuid", "major", "minor")
    return table.with_columns(
        bssid=pl.when(pl.col("uuid").is_not_null()).then(beacon).otherwise("address"),
        ssid="name",
        frequency_mhz=pl.lit(None, dtype=pl.Float32),
        scan=pl.lit(None, dtype=pl.Int32),
    ).drop("address", "name", "uuid", "major", "minor")


def mean_position(placed: pl.Expr) -> dict[str, pl.Expr]:
    """Aggregate ``x``, ``y``, ``z``, ``sigma`` and ``floor`` over the readings of a group for which ``placed`` is true.

    Positions are weighted by 1 / sigma^2. An unknown sigma counts as the greatest of the group; if all are unknown,
    weights are equal. The sigma of the mean is the weighted mean of the sigmas, because readings of one moment share
    the error of the trajectory, which averaging does not reduce. It is null if none is known; ``z`` is null unless all
    have one. The floor is that of most readings, in a tie the lowest. All are null if nothing is placed.
    """
    sigma = pl.col("sigma").filter(placed).clip(lower_bound=LEAST_SIGMA_M)
    known = sigma.fill_null(sigma.max()).fill_null(1.0)
    weight = known**-2
    z = pl.col("z").filter(placed)

    def mean(values: pl.Expr) -> pl.Expr:
        return pl.when(placed.any()).then((weight * values).sum() / weight.sum())

    return {
        "x": mean(pl.col("x").filter(placed)),
        "y": mean(pl.col("y").filter(placed)),
        "z": pl.when(z.null_count() == 0).then(mean(z)),
        "sigma": pl.when(sigma.count() > 0).then(mean(known)),
        "floor": pl.col("floor").filter(placed).mode().min(),
    }


@dataclass(frozen=True)
class SessionWalk:
    """Identity of a session in the data set, and the motion of its phone."""

    session: str
    """Its slug, unique in the data set."""
    building: str
    device: str
    name: str
    """The session folder's own name."""
    motion: PhoneMotion

    @property
    def started(self) -> datetime | None:
        """Start: local time by its folder's name, else UTC if its frames have Unix times, else None."""
        named, time_ns = session_start(self.name), self.motion.time_ns
        if named is not None or not len(time_ns) or time_ns[0] < FIRST_UNIX_S * 1e9:
            return named
        return datetime.fromtimestamp(int(time_ns[0]) // 1_000_000 / 1e3, UTC).replace(tzinfo=None)


@dataclass(frozen=True)
class SessionFingerprints:
    """Rows of the tables ``fingerprints`` and ``readings`` of one session and technology, in order of time."""

    fingerprints: pl.DataFrame
    readings: pl.DataFrame
    names: pl.DataFrame
    """How often each transmitter was heard with each name: columns bssid, technology, ssid, count."""
    findings: tuple[Finding, ...]


def fingerprints_of(
    rows: Mapping[str, pl.DataFrame],
    technology: str,
    walk: SessionWalk,
    settings: DatasetSettings,
    max_sigma_m: float,
) -> SessionFingerprints:
    """Make the fingerprints of a session's labelled readings by technology (:func:`radio_rows`).

    Repeated readings (``duplicate``) and those without a level are skipped and counted. A fingerprint's position is the
    weighted mean of its readings' positions (:func:`mean_position`). Readings more than ``settings.scan_length_s``
    older than the newest of their scan are cached results. They keep their own position, and the scan's position,
    spread and times are those of the other readings.
    """
    grouped, findings = grouped_readings(rows, settings)
    table = _summarised(grouped)
    table = table.sort("start_ns", "number").with_columns(scan_id=_scan_id(walk.session, technology))
    grouped = table.select("number", "scan_id", pl.int_range(pl.len()).alias("place")).join(grouped, on="number")
    floor = pl.when(pl.col("x").is_not_null()).then("floor").alias("floor")
    columns = (floor if name == "floor" else name for name in SCHEMAS[READINGS])
    readings = grouped.sort("place", "time_ns", "row").select(columns)
    return SessionFingerprints(
        in_schema(FINGERPRINTS, _finished(table, technology, walk, max_sigma_m)),
        in_schema(READINGS, readings),
        _names(grouped),
        (*findings, *_group_findings(table, grouped, settings.scan_length_s)),
    )


def grouped_readings(
    rows: Mapping[str, pl.DataFrame], settings: DatasetSettings
) -> tuple[pl.DataFrame, tuple[Finding, ...]]:
    """Number the separate readings of a session by scan or window; ``rows`` (:func:`radio_rows`) by technology.

    Sorted by ``number`` and time. ``current``: not a cached result; ``technology``: that of the reading. Wi-Fi readings
    of several technologies are numbered by scan, with the BLE readings around each scan.
    """
    heard = {name: _heard(table, name) for name, table in rows.items()}
    kept = {name: table.with_columns(technology=pl.lit(name)) for name, (table, _) in heard.items()}
    findings = [finding for _, found in heard.values() for finding in found]
    window_s = settings.window_of(WIFI if WIFI in kept else BLE)
    if window_s is not None:
        grouped = _by_window(pl.concat(kept.values(), how="diagonal"), window_s)
    else:
        grouped = _by_scan(kept[WIFI], settings.scan_length_s)
        if BLE in kept:
            beside = _beside(kept[BLE], grouped, settings.ble_window_s)
            grouped = pl.concat([grouped, beside], how="diagonal")
            far = f"ble: readings are more than {settings.ble_window_s / 2:g} s from every Wi-Fi scan and are left out"
            findings += finding_if(kept[BLE].height - beside.height, "readings_beside_no_scan", far)
    return grouped.sort("number", "time_ns", "row", maintain_order=True), tuple(findings)


def _heard(rows: pl.DataFrame, technology: str) -> tuple[pl.DataFrame, tuple[Finding, ...]]:
    """Skip rows that are not separate readings, and count them."""
    repeated = rows["status"] == "duplicate"
    mute = ~repeated & rows["rssi_dbm"].is_null()
    again = f"{technology}: readings that repeat an earlier one are skipped"
    none = f"{technology}: readings without a measured level are skipped"
    findings = (
        *finding_if(int(repeated.sum()), "repeated_readings", again),
        *finding_if(int(mute.sum()), "readings_without_level", none),
    )
    return rows.filter(~repeated & ~mute), findings


def _by_scan(heard: pl.DataFrame, scan_length_s: float) -> pl.DataFrame:
    """Number by the raw file's scan; ``current``: not a cached result."""
    newest = pl.col("time_ns").max().over("scan")
    return heard.with_columns(
        number=pl.col("scan").cast(pl.Int64), current=pl.col("time_ns") >= newest - round(scan_length_s * 1e9)
    )


def _beside(beacons: pl.DataFrame, scans: pl.DataFrame, window_s: float) -> pl.DataFrame:
    """Number BLE readings by the scan of the Wi-Fi reading nearest in time, if they are within its span.

    A span reaches from half a window before the first current reading of the scan to half a window after the last.
    """
    half_ns = round(window_s * 1e9 / 2)
    current = scans.filter("current").select("time_ns", "number").sort("time_ns")
    spans = current.group_by("number").agg(
        first=pl.col("time_ns").min() - half_ns, last=pl.col("time_ns").max() + half_ns
    )
    return (
        beacons.sort("time_ns", maintain_order=True)
        .join_asof(current, on="time_ns", strategy="nearest")
        .join(spans, on="number", maintain_order="left")
        .filter(pl.col("time_ns").is_between("first", "last"))
        .drop("first", "last")
        .with_columns(current=pl.lit(value=True))
    )


def _by_window(heard: pl.DataFrame, window_s: float) -> pl.DataFrame:
    """Number by windows of the clock, counted from the window of the session's first reading."""
    window = pl.col("time_ns") // round(window_s * 1e9)
    return heard.with_columns(number=window - window.min(), current=pl.lit(value=True))


def _summarised(grouped: pl.DataFrame) -> pl.DataFrame:
    """One row for each scan or window, by ``number``; position and sigma are null if no current reading is labelled."""
    placed = pl.col("current") & pl.col("x").is_not_null()
    position = mean_position(placed)
    x, y = (pl.col(name).filter(placed) for name in ("x", "y"))
    return grouped.group_by("number", maintain_order=True).agg(
        **position,
        readings=pl.len(),
        labelled=pl.col("x").count(),
        placed=placed.any(),
        start_ns=pl.col("time_ns").filter("current").min(),
        end_ns=pl.col("time_ns").filter("current").max(),
        x_median=x.median(),
        y_median=y.median(),
        spread=((x - position["x"]) ** 2 + (y - position["y"]) ** 2).mean().sqrt(),
        cause=_most_frequent(pl.col("status").filter(pl.col("current") & pl.col("x").is_null())),
    )


def _most_frequent(cause: pl.Expr) -> pl.Expr:
    """The most frequent of the causes; in a tie the first in order of the status codes."""
    code = cause.cast(STATUS_TYPE).to_physical()
    return code.mode().min()


def _finished(table: pl.DataFrame, technology: str, walk: SessionWalk, max_sigma_m: float) -> pl.DataFrame:
    heading, speed = walk.motion.heading_and_speed(table["start_ns"].to_numpy(), table["end_ns"].to_numpy())
    start = walk.started
    return table.with_columns(
        pl.Series("heading_deg", heading, nan_to_null=True),
        pl.Series("speed_m_s", speed, nan_to_null=True),
        technology=pl.lit(technology),
        building=pl.lit(walk.building),
        labelled_share=pl.col("labelled") / pl.col("readings"),
        status=pl.when(~pl.col("placed"))
        .then(pl.col("cause").replace_strict(dict(enumerate(STATUS_LABELS)), default=None, return_dtype=pl.String))
        .when(pl.col("sigma").fill_null(0.0) > max_sigma_m)
        .then(pl.lit("uncertain"))
        .otherwise(pl.lit("ok")),
        device=pl.lit(walk.device),
        session=pl.lit(walk.session),
        date=pl.lit(None if start is None else start.date(), dtype=pl.Date),
    ).drop("number", "placed", "cause")


def _scan_id(session: str, technology: str) -> pl.Expr:
    """Session, technology and the scan's or window's own number, which identifies the raw rows."""
    return pl.concat_str(pl.lit(f"{session}/{technology}/"), pl.col("number").cast(pl.String).str.zfill(6))


def _names(heard: pl.DataFrame) -> pl.DataFrame:
    named = ("bssid", "technology", "ssid")
    return heard.group_by(named).agg(count=pl.len().cast(pl.Int64)).sort(named).select(*named, "count")


def _group_findings(table: pl.DataFrame, grouped: pl.DataFrame, scan_length_s: float) -> tuple[Finding, ...]:
    """Count fingerprints without a label, by cause, and cached results."""
    cached = (
        f"readings are more than {scan_length_s:g} s older than the newest of their scan. They are cached results: "
        "each "
        "keeps its own position, and they do not affect the position of the scan"
    )
    unlabelled = "fingerprints have no position; their status gives the reason"
    return (
        *finding_if(int((~grouped["current"]).sum()), "cached_readings", cached),
        *finding_if(int((~table["placed"]).sum()), "unlabelled_fingerprints", unlabelled),
    )


def radio_parts(made: Iterable[SessionFingerprints]) -> tuple[dict[str, pl.DataFrame], list[Finding]]:
    """Join the results of a session's technologies, in order of time: rows by table (and NAMES), and all findings."""
    parts = list(made)
    fingerprints = pl.concat([empty_table(FINGERPRINTS), *(part.fingerprints for part in parts)])
    fingerprints = fingerprints.sort("start_ns", "technology", maintain_order=True)
    readings = pl.concat([empty_table(READINGS), *(part.readings for part in parts)])
    in_order = fingerprints.select("scan_id").join(readings, on="scan_id", maintain_order="left_right")
    names = pl.concat([NO_NAMES, *(part.names for part in parts)])
    findings = [finding for part in parts for finding in part.findings]
    return {FINGERPRINTS: fingerprints, READINGS: in_order, NAMES: names}, findings


NAMES = "names"
"""Part with the names of each transmitter; not a table of the data set."""


def write_part(folder: Folder, number: int, tables: Mapping[str, pl.DataFrame]) -> None:
    """Write one session's rows of some tables, and its NAMES; ``number`` is its rank among all."""
    for name, rows in tables.items():
        write_parquet(rows, folder, f"{name}/{number:06d}.parquet", compression="lz4")


def tables_of(folder: Path) -> dict[str, pl.LazyFrame]:
    """Scan the rows of all sessions, table by table."""
    return {name: _rows_of_all(folder, name) for name in SCHEMAS if (folder / name).is_dir()}


def access_points_of(folder: Path, fingerprints: pl.LazyFrame, readings: pl.LazyFrame) -> pl.DataFrame:
    """Make the table of access points from the readings of all sessions, and their NAMES in ``folder``."""
    names = _rows_of_all(folder, NAMES).group_by("bssid", "technology", "ssid").agg(pl.col("count").sum())
    counted = names.sort("bssid", "technology", "ssid").collect(engine="streaming")
    return access_point_table(fingerprints, readings, counted)


def _rows_of_all(folder: Path, name: str) -> pl.LazyFrame:
    return scan_parquet(sorted((folder / name).glob("*.parquet")))
