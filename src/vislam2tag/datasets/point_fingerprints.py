"""Data sets made from fingerprints at known points, as in published tables: one row for each scan, no walks."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

import polars as pl

from vislam2tag.common.findings import Finding, Severity, finding_if
from vislam2tag.datasets.access_points import NO_NAMES, access_point_table
from vislam2tag.datasets.model import TEST, Dataset, DatasetInfo, FloorInfo, Fold, Split, SplitInfo
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, READINGS, SCHEMAS, SESSIONS, in_schema
from vislam2tag.intake.extents import MAX_GRID_M
from vislam2tag.site.model import unique_slugs

OFFICIAL = "official"
_LABEL = ("floor", "x", "y", "z", "sigma", "heading_deg")
COLUMNS: Mapping[str, pl.DataType] = {
    "row": pl.Int64(),
    **{name: SCHEMAS[FINGERPRINTS][name] for name in ("technology", "building", *_LABEL, "device", "user", "session")},
    "time_ns": pl.Int64(),
    "date": pl.Date(),
    "part": pl.String(),
}
"""Columns of a fingerprint (see :class:`PointFingerprints`), and their types."""


@dataclass(frozen=True)
class PointFingerprints:
    """Fingerprints from a table.

    ``rows``: one for each fingerprint, with the columns of :data:`COLUMNS`; only ``row`` (any unique number) is
    required. ``session`` is a text that names the recording, ``time_ns`` the time, ``part`` is ``train`` or ``test`` in
    the official split (null: in neither). ``heard``: ``row``, ``bssid``, ``rssi_dbm`` and, if known, ``frequency_mhz``,
    of each access point heard.
    """

    rows: pl.DataFrame
    heard: pl.DataFrame


def point_dataset(info: DatasetInfo, points: PointFingerprints, names: pl.DataFrame = NO_NAMES) -> Dataset:
    """Make a data set from fingerprints at points, ordered by session, then time, then row.

    ``names`` is as in :func:`~vislam2tag.datasets.access_points.access_point_table`.
    """
    rows = _identified(points.rows)
    # Rows are sorted by transmitter within a scan, so that the bytes do not depend on the table's column order, and
    # while they are narrow, because there may be millions.
    heard = points.heard.join(rows.select("row", "order"), on="row").sort("order", "bssid").drop("order")
    place = rows.select("row", "scan_id", "floor", "x", "y", "time_ns", "sigma")
    readings = in_schema(READINGS, heard.join(place, on="row", maintain_order="left").drop("row"))
    del heard
    fingerprints = in_schema(FINGERPRINTS, _fingerprints(rows, readings))
    tables = {
        FINGERPRINTS: fingerprints,
        READINGS: readings,
        ACCESS_POINTS: access_point_table(fingerprints.lazy(), readings.lazy(), names),
        SESSIONS: in_schema(SESSIONS, _sessions(rows, info)),
    }
    whole = info.model_copy(update={"findings": (*info.findings, *_unlabelled(rows))})
    return Dataset(whole, {name: table.lazy() for name, table in tables.items()}, _splits(rows))


def _unlabelled(rows: pl.DataFrame) -> tuple[Finding, ...]:
    count = rows["x"].null_count()
    message = "fingerprints have no position or no floor, so their status is invalid"
    return finding_if(count, "unlabelled_fingerprints", message, severity=Severity.WARNING)


def floor_infos(rows: pl.DataFrame, elevation_m: Mapping[int, float] | None = None) -> tuple[FloorInfo, ...]:
    """List the floors of the fingerprints, by building and number."""
    building = pl.col("building") if "building" in rows.columns else pl.lit("")
    floors = rows.select(building.fill_null("").alias("building"), pl.col("floor").cast(pl.Int32))
    pairs = floors.drop_nulls().unique().sort(pl.all())
    return tuple(
        FloorInfo(building=name, number=number, elevation_m=(elevation_m or {}).get(number))
        for name, number in pairs.rows()
    )


def _identified(rows: pl.DataFrame) -> pl.DataFrame:
    """Add ``name`` (the session's own), its slug as ``session``, ``scan_id`` and ``order``; sort."""
    filled = rows.select(
        (pl.col(name) if name in rows.columns else pl.lit(None)).cast(kind).alias(name)
        for name, kind in COLUMNS.items()
    ).with_columns(
        pl.col("session").replace("", None).fill_null("fingerprints"),
        pl.col("technology").fill_null("wifi"),
        pl.col("building").fill_null(""),
    )
    # An incomplete position counts as none, and so do those of its readings.
    near = pl.all_horizontal(pl.col(name).is_between(-MAX_GRID_M, MAX_GRID_M) for name in ("x", "y"))
    whole = (pl.col("floor").is_not_null() & near).fill_null(value=False)
    names = filled["session"].unique().sort().to_list()
    slugs = dict(zip(names, unique_slugs(names), strict=True))
    named = filled.with_columns(pl.when(whole).then(pl.col(name)).alias(name) for name in _LABEL).select(
        pl.exclude("session"),
        pl.col("session").alias("name"),
        pl.col("session").replace_strict(slugs, return_dtype=pl.String),
    )
    ordered = named.sort("session", "technology", "time_ns", "row", nulls_last=True)
    number = pl.int_range(pl.len()).over("session", "technology")
    return ordered.with_columns(
        scan_id=pl.format("{}/{}/{}", "session", "technology", number.cast(pl.String).str.zfill(6)),
        order=pl.int_range(pl.len()),
    )


def _fingerprints(rows: pl.DataFrame, readings: pl.DataFrame) -> pl.DataFrame:
    counted = rows.join(readings.group_by("scan_id").agg(readings=pl.len()), on="scan_id", how="left").sort("order")
    labelled = pl.col("x").is_not_null()
    return counted.with_columns(pl.col("readings").fill_null(0)).select(
        "scan_id",
        "technology",
        "building",
        *_LABEL,
        pl.col("x").alias("x_median"),
        pl.col("y").alias("y_median"),
        "readings",
        pl.when(labelled).then("readings").otherwise(0).alias("labelled"),
        pl.when(labelled).then(1.0).otherwise(0.0).alias("labelled_share"),
        pl.when(labelled).then(pl.lit("ok")).otherwise(pl.lit("invalid")).alias("status"),
        "device",
        "user",
        "session",
        pl.col("time_ns").alias("start_ns"),
        pl.col("time_ns").alias("end_ns"),
        "date",
    )


def _sessions(rows: pl.DataFrame, info: DatasetInfo) -> pl.DataFrame:
    def common(name: str) -> pl.Expr:
        known = pl.col(name).drop_nulls()
        return pl.when(known.n_unique() == 1).then(known.first()).alias(name)

    started = pl.col("time_ns").min()
    return (
        rows.group_by("session", maintain_order=True)
        .agg(
            *(common(name) for name in ("building", "floor", "device", "user")),
            pl.col("name").first(),
            started=started.cast(pl.Datetime("ns")).cast(pl.Datetime("us")) if info.clock == "unix" else pl.lit(None),
            duration_s=(pl.col("time_ns").max() - started) / 1e9,
            fingerprints=pl.len(),
        )
        .with_columns(source=pl.lit(_source(info)))
    )


def _source(info: DatasetInfo) -> str:
    """One checksum of all inputs, because rows of one session may come from several files."""
    inputs = "\n".join(f"{digest} {name}" for source in info.sources for name, digest in sorted(source.inputs.items()))
    return hashlib.sha256(inputs.encode()).hexdigest()


def _splits(rows: pl.DataFrame) -> dict[str, Split]:
    if rows["part"].null_count() == rows.height:
        return {}
    info = SplitInfo(name=OFFICIAL, kind=OFFICIAL, folds=(Fold(name=OFFICIAL, test=(TEST,)),))
    return {OFFICIAL: Split(info, rows.select(id="scan_id", group="part"))}
