"""Tables of a fleet, one file a survey and floor: ``tables/TABLE/survey=SURVEY/floor=FLOOR/TABLE.parquet``.

Polars and DuckDB read them by one pattern and open only what a condition on ``survey`` and ``floor`` leaves. Of the
labels that is what was heard, ``wifi`` and ``ble``; frames and sensors, most of all, stay with each survey's labels.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import polars as pl

from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.common.files.folder_store import AnyStore, any_store_at
from vislam2tag.common.files.table_files import parquet_bytes, scan_parquet, write_parquet
from vislam2tag.core.status import Status, labelled_share
from vislam2tag.labeling.results import SessionResult
from vislam2tag.pipeline.fleet.layout import LABELS, TABLES

SESSIONS = "sessions"
HEARD = ("wifi", "ble")
SESSION_COLUMNS: dict[str, pl.DataType] = {
    "floor": pl.Int32(),
    "device": pl.String(),
    "session": pl.String(),
    "slug": pl.String(),
    "format": pl.String(),
    "strategy": pl.String(),
    "error": pl.String(),
    "duration_s": pl.Float64(),
    "distance_m": pl.Float64(),
    "frames": pl.Int64(),
    "frames_labelled": pl.Int64(),
    "labelled_share": pl.Float64(),
    "sigma_median_m": pl.Float64(),
    "sigma_p95_m": pl.Float64(),
    "wifi_scans": pl.Int64(),
    "visits": pl.Int64(),
    "findings": pl.Int64(),
}
"""Columns of ``sessions``; ``slug`` is the file-name stem of the session's outputs."""


def session_row(result: SessionResult) -> dict[str, Any]:
    """A session's row of the fleet's table ``sessions``."""
    frames = sum(count for status, count in result.frames.items() if status != Status.DUPLICATE.label)
    return {
        **{name: getattr(result, name) for name in SESSION_COLUMNS if name in SessionResult.model_fields},
        "frames": frames,
        "frames_labelled": result.frames.get(Status.OK.label, 0),
        "labelled_share": labelled_share(result.frames),
        "sigma_median_m": None if result.sigma is None else result.sigma.median_m,
        "sigma_p95_m": None if result.sigma is None else result.sigma.p95_m,
        "wifi_scans": 0 if result.scans is None else result.scans.scans,
        "visits": len(result.visits),
        "findings": sum(finding.count for finding in result.findings),
    }


def write_tables(fleet: Path, survey: str, rows: Sequence[dict[str, Any]]) -> None:
    """Write a survey's part of the fleet's tables, of ``rows`` and of its labels; what it had before goes.

    A floor's readings lie on this machine while they are written.
    """
    sessions = pl.DataFrame(rows, schema=SESSION_COLUMNS, orient="row")
    floors = sorted(sessions["floor"].unique())
    at = any_store_at(fleet / TABLES / SESSIONS / f"survey={survey}")
    _replace(at, SESSIONS, ((floor, sessions.filter(pl.col("floor") == floor)) for floor in floors))
    for table in HEARD:
        _write_heard(fleet, survey, table, sessions["slug"].to_list())


def _write_heard(fleet: Path, survey: str, table: str, slugs: Sequence[str]) -> None:
    labels, to = any_store_at(fleet / LABELS / survey), any_store_at(fleet / TABLES / table / f"survey={survey}")
    with scratch_folder() as scratch:
        files: list[Path] = []
        for file in labels.list(table):
            slug = file.name.rpartition("/")[2].removesuffix(".parquet")
            if slug in slugs:
                files.append(scratch / f"{len(files):06d}.parquet")
                labels.fetch(f"{table}/{slug}.parquet", scratch, files[-1].name)
        found = scan_parquet(files) if files else pl.LazyFrame(schema={"floor": pl.Int32()})
        floors = found.select(pl.col("floor").unique().sort()).collect()["floor"].to_list()
        _replace(to, table, ((floor, found.filter(pl.col("floor") == floor)) for floor in floors))


def _replace(to: AnyStore, table: str, parts: Iterable[tuple[int, pl.DataFrame | pl.LazyFrame]]) -> None:
    """Put a file for each floor; those of other floors go. The floor is in the file's address, not in it."""
    ours = re.compile(rf"floor=-?\d+/{table}\.parquet")
    before, now = {file.name for file in to.list() if ours.fullmatch(file.name)}, set()
    for floor, part in parts:
        name = f"floor={floor}/{table}.parquet"
        part = part.drop("floor")
        if isinstance(part, pl.DataFrame):
            to.put(name, parquet_bytes(part))
        else:
            with scratch_folder() as scratch:
                write_parquet(part, scratch, table)
                to.put(name, scratch / table)
        now.add(name)
    to.delete(before - now)
