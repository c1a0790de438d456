"""Layout and catalogue of a fleet.

- ``fleet.json``: current snapshot of the catalogue, and totals
- ``catalogue/NUMBER-RANDOM.parquet``: a snapshot with one row for each survey
- ``surveys/SURVEY/``: raw survey
- ``labels/SURVEY/``: its output of ``process``
- ``tables/TABLE/survey=SURVEY/floor=FLOOR/TABLE.parquet``: tables of all surveys
- ``report/``: pages (``index.html``, ``SURVEY/index.html``, ``SURVEY/SESSION.html``)
- ``reduced/SURVEY.json``: key of its summary, tables and pages; removed while they are written
- ``sources/SURVEY.json``: origin of its raw survey, and SHA-256 of its files
- ``replaced/SURVEY/FILE/SHA256``: former versions of raw files

The catalogue is a set of plain Parquet files; ``fleet.json`` names the current one.

A change writes a new file and then replaces ``fleet.json`` by a conditional write. If another program was faster, its
snapshot is changed instead. So readers see complete changes only, and no change is lost.
"""

from __future__ import annotations

import re
import secrets
from dataclasses import dataclass
from pathlib import Path

import polars as pl
from pydantic import ValidationError

from vislam2tag.common.errors import StoreConflictError, StoreError, UsageError
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.files.store import Version, shown
from vislam2tag.common.files.stored_folder import AnyStore, any_store_at
from vislam2tag.common.files.table_files import parquet_bytes, parquet_of_bytes
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result

FLEET_FILE = "fleet.json"
SNAPSHOTS, SURVEYS, LABELS, TABLES, REPORT = "catalogue", "surveys", "labels", "tables", "report"
REDUCED, SOURCES, REPLACED = "reduced", "sources", "replaced"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


def survey_name(name: str) -> str:
    """The name of a survey in a fleet, which is part of addresses; raises UsageError if it is invalid."""
    if not _NAME.fullmatch(name):
        raise UsageError(
            f"{name}: not a valid name of a survey in a fleet; use letters, digits, '.', '_' and '-' only. Rename its "
            "folder or choose another --name"
        )
    return name


PROGRAM = "vislam2tag fleet"
NEW, CHANGED, DONE, FAILED, UNREADABLE = "new", "changed", "done", "failed", "unreadable"
"""States: never processed; files changed since then; every session is mapped; some are not, ids are wrong or no frame
has a position; it cannot be opened."""
STATES = (NEW, CHANGED, DONE, FAILED, UNREADABLE)
CATALOGUE: dict[str, pl.DataType] = {
    "survey": pl.String(),
    "site": pl.String(),
    "floors": pl.List(pl.Int32()),
    "devices": pl.List(pl.String()),
    "first_date": pl.Date(),
    "last_date": pl.Date(),
    "sessions": pl.Int64(),
    "failed": pl.Int64(),
    "state": pl.String(),
    "error": pl.String(),
    "duration_s": pl.Float64(),
    "distance_m": pl.Float64(),
    "frames": pl.Int64(),
    "frames_labelled": pl.Int64(),
    "inputs": pl.String(),
    "labels": pl.String(),
}
"""Columns. ``inputs`` is a mark of the survey's files, ``labels`` of the inputs of its labels; durations, distances and
frames (without repeated ones) are those of processed sessions."""
_COUNTS = ("survey", "sessions", "failed", "state", "duration_s", "distance_m", "frames", "frames_labelled")
"""Columns with a value for each survey."""
_KEPT = 4
"""Number of earlier snapshots to keep for readers."""
_TRIES = 20
"""Attempts for a change if other programs are faster."""


class FleetTotals(Result):
    """Sums over the surveys of a fleet."""

    surveys: int = 0
    sessions: int = 0
    failed: int = 0
    """Sessions that cannot be read or mapped."""
    duration_s: float = 0.0
    distance_m: float = 0.0
    frames: int = 0
    frames_labelled: int = 0
    states: dict[str, int] = {}
    """Surveys by state."""
    sessions_by_state: dict[str, int] = {}
    """Sessions by their survey's state."""


class FleetRecord(Record):
    """Contents of ``fleet.json``, which suffice for ``status``."""

    program: str
    number: int
    """Number of the snapshot, from 1."""
    snapshot: str
    before: list[str]
    """Earlier snapshots, the latest first."""
    totals: FleetTotals


@dataclass(frozen=True)
class Fleet:
    """A fleet by its folder or address."""

    root: Path

    @property
    def store(self) -> AnyStore:
        """Its folder or address."""
        return any_store_at(self.root)

    def record(self) -> FleetRecord:
        """Read the state; raises UsageError if there is no fleet."""
        found = self._record()
        if found is None:
            place = shown(self.root)
            raise UsageError(f"{place}: this is not a fleet; start one with vislam2tag fleet add {place} SURVEY")
        return found[0]

    def catalogue(self) -> pl.DataFrame:
        """Read the catalogue: one row for each survey, by name. Raises UsageError if there is no fleet."""
        for _ in range(_TRIES):
            record = self.record()
            table = self._snapshot(record)
            if table is not None:
                return table
        raise self._unusable(record, "missing")

    def change(self, rows: list[dict[str, object]]) -> FleetTotals:
        """Add rows, or replace those of the same surveys, in one step; return the new totals.

        Raises StoreError if that cannot be written, or other programs keep changing it.
        """
        new = pl.DataFrame(rows, schema=CATALOGUE, orient="row")
        missing: FleetRecord | None = None
        for _ in range(_TRIES):
            found = self._record()
            if found is None:
                record, version, old = None, None, pl.DataFrame(schema=CATALOGUE)
            else:
                record, version = found
                snapshot = self._snapshot(record)
                missing = record if snapshot is None else None
                if snapshot is None:
                    continue  # another program has replaced it
                old = snapshot
            table = pl.concat([old.join(new, on="survey", how="anti"), new]).sort("survey")
            if self._commit(table, record, version):
                return totals_of(table)
        if missing is not None:
            raise self._unusable(missing, "missing")
        raise StoreConflictError(
            f"{shown(self.root)}: other programs keep changing the catalogue; run again when they have ended"
        )

    def _commit(self, table: pl.DataFrame, before: FleetRecord | None, version: Version | None) -> bool:
        number = 1 if before is None else before.number + 1
        name = f"{SNAPSHOTS}/{number:08d}-{secrets.token_hex(4)}.parquet"
        self.store.put(name, parquet_bytes(table))
        earlier = [] if before is None else [before.snapshot, *before.before]
        record = FleetRecord(
            program=PROGRAM, number=number, snapshot=name, before=earlier[:_KEPT], totals=totals_of(table)
        )
        try:
            self.store.put_over(FLEET_FILE, (record.model_dump_json(indent=1) + "\n").encode(), version)
        except StoreConflictError:
            self.store.delete([name])
            return False
        self.store.delete(earlier[_KEPT:])
        return True

    def _record(self) -> tuple[FleetRecord, Version] | None:
        found = self.store.get(FLEET_FILE)
        if found is None:
            return None
        try:
            return FleetRecord.model_validate_json(found.data), found.version
        except ValidationError as error:
            raise UsageError(
                f"{shown(self.root)}/{FLEET_FILE}: the file is damaged or from a later version; update vislam2tag, or "
                f"remove the file and run fleet add {shown(self.root)}"
            ) from error

    def _snapshot(self, record: FleetRecord) -> pl.DataFrame | None:
        found = self.store.get(record.snapshot)
        if found is None:
            return None
        try:
            table = parquet_of_bytes(found.data).match_to_schema(CATALOGUE)
        except (OSError, pl.exceptions.PolarsError) as error:
            raise self._unusable(record, "damaged") from error
        if any(table.select(_COUNTS).null_count().row(0)):
            raise self._unusable(record, "damaged")
        return table

    def _unusable(self, record: FleetRecord, what: str) -> StoreError:
        place = shown(self.root)
        return StoreError(
            f"{place}/{record.snapshot}: the catalogue is {what}; remove {FLEET_FILE} there and run fleet add {place}"
        )


def is_fleet(place: Path) -> bool:
    """Whether the folder is a fleet; raises StoreError if a store cannot be read."""
    return any_store_at(place).get(FLEET_FILE) is not None


def fleet_list(fleet: AnyPath) -> pl.DataFrame:
    """The catalogue of a fleet: one row for each survey, by name. Raises UsageError if there is no fleet."""
    return Fleet(Path(fleet)).catalogue()


def fleet_status(fleet: AnyPath) -> FleetTotals:
    """The state of a fleet, from one small file. Raises UsageError if there is no fleet."""
    return Fleet(Path(fleet)).record().totals


def totals_of(table: pl.DataFrame) -> FleetTotals:
    """Totals of a catalogue."""
    by_state = table.group_by("state").agg(pl.len(), pl.col("sessions").sum()).sort("state")
    sums = table.select(
        pl.col("sessions", "failed", "duration_s", "distance_m", "frames", "frames_labelled").sum()
    ).row(0, named=True)
    return FleetTotals(
        surveys=len(table),
        states=dict(zip(by_state["state"], by_state["len"], strict=True)),
        sessions_by_state=dict(zip(by_state["state"], by_state["sessions"], strict=True)),
        **sums,
    )
