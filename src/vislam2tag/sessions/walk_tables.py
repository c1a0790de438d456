"""The tables of a walk: their kinds, columns and times, as found or as ``columns.toml`` states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.files.toml_file import read_toml, toml_value
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.intake.cells import length_unit, unreadable_cells, with_numbers
from vislam2tag.intake.columns import COLUMNS_FILE, Column, matching_columns, shown
from vislam2tag.intake.foreign_table import read_foreign_table
from vislam2tag.intake.time_units import (
    MAX_STEP_S,
    NS_IN,
    ROUNDED,
    UNIT_NAMES,
    Steps,
    ns_of_seconds,
    recognised_ns,
    rounded_step,
)
from vislam2tag.sessions.foreign_tables import (
    MOST_NS,
    table_times,
    time_zone,
)
from vislam2tag.sessions.model import FileRecord
from vislam2tag.sessions.session_files import MISSING, SessionFiles
from vislam2tag.sessions.walk_columns import (
    SENSORS,
    TableColumns,
    WalkColumns,
    fits,
    kind_of,
    named_as_poses,
    resolved,
    sensor_of_file,
    unknown_kind,
)
from vislam2tag.sessions.walk_files import (
    is_wide,
    nearest_columns_file,
    partly_poses,
    tables_in,
)

_SAMPLE, _SHOWN = 50, 5
_RADIO = {"wifi": r"^\s*wi-?fi|^\s*wlan", "ble": r"^\s*bl|^\s*bt\b"}
"""Words for technologies, by the kind of table that has their readings."""
_OF_BOTH_RADIOS = ("time", "time_unit", "zone", "address", "level", "technology")
_DATE, ZONE = r"^\d{4}[-/]\d\d[-/]\d\d[T _-]", r"(?:[Zz]|[+-]\d\d:?(?:\d\d)?)$"


@dataclass
class WalkTable:
    """A table: its rows behind ``row``, its columns by role, and their section of ``columns.toml``."""

    kind: str
    file: str
    rows: pl.DataFrame
    roles: dict[str, Column]
    given: TableColumns

    @property
    def time_ns(self) -> IntArray:
        """Times (n,), ns."""
        return self.rows["time_ns"].to_numpy()

    def numbers(self, roles: Sequence[str], findings: list[Finding]) -> FloatArray:
        """Columns (n, k) as numbers; NaN for cells that are none."""
        names = [self.roles[role].name for role in roles]
        table, odd = with_numbers(self.rows, list(dict.fromkeys(names)), self.file)
        findings += odd
        return np.column_stack([table[name].fill_null(np.nan).to_numpy() for name in names])

    def lengths(self, roles: Sequence[str], findings: list[Finding]) -> FloatArray:
        """Columns (n, k) of lengths, m."""
        unit = self.given.length_unit
        metres = None if unit is None else length_unit(unit)
        if unit is not None and metres is None:
            raise UsageError(
                f"{COLUMNS_FILE}: [{self.kind}] length_unit = {unit!r} is unknown; use m, cm, ft or the like"
            )
        factors = [metres or self.roles[role].metres or 1.0 for role in roles]
        return self.numbers(roles, findings) * factors

    def level(self, findings: list[Finding]) -> pl.Series:
        """Levels (n,), dBm; null for cells that are none."""
        return pl.Series(self.numbers(("level",), findings)[:, 0]).cast(pl.Float32).fill_nan(None)

    def text(self, role: str) -> pl.Expr:
        """A column as text; null if the table has none."""
        if role not in self.roles:
            return pl.lit(None, dtype=pl.String)
        return pl.col(self.roles[role].name).cast(pl.String)


_Found: TypeAlias = dict[str, list[tuple[str, pl.DataFrame]]]
"""Files and their rows, by kind of table."""


class WalkTables:
    """The tables in a folder, sorted by kind; it keeps how their columns were resolved, and what is odd."""

    def __init__(self, folder: Path, beside: Path | None) -> None:
        self.folder = folder
        self.files = SessionFiles(folder, {})
        path = nearest_columns_file(folder) or (None if beside is None else nearest_columns_file(beside))
        self.columns = WalkColumns() if path is None else read_toml(path, WalkColumns)
        self.found: dict[tuple[str, str], TableColumns] = {}
        self.by_kind: _Found = {}
        self.unread: list[str] = []
        self.unknown: list[tuple[str, pl.DataFrame]] = []
        self._sort_tables()
        self.local = self._all_are_local_dates()

    def _sort_tables(self) -> None:
        """Find the kind of each table, and report those without one and those that are missing."""
        for path in tables_in(self.folder):
            try:
                self._sort(path)
            except UsageError as error:
                self.unread.append(str(error))
                why = str(error).removeprefix(f"{path}: ")
                self.files.note("unread_file", path.name, f"this file was not read: {why}")
        for kind, role in (("sightings", "landmarks"), ("wifi", "wifi"), ("sensors", "sensors")):
            alike = {"sensors", *SENSORS} if kind == "sensors" else {kind}
            if not alike & self.by_kind.keys():
                self.files.note("missing_file", self.columns.of(kind).file or f"{kind}.csv", *MISSING[role])

    def _sort(self, path: Path) -> None:
        """Find the kind of a table; raises UsageError if it cannot be read or is empty."""
        table = read_foreign_table(path)
        rows = table.rows
        if rows.is_empty():
            raise UsageError(f"{path}: the table has no rows; found the columns {shown(rows.columns)}")
        kinds = self._kinds(path.name, rows.head(_SAMPLE))
        if kinds == ["wifi"] and self.columns.ble == TableColumns() and _has_beacons(rows):
            kinds.append("ble")
            alike = {key: getattr(self.columns.wifi, key) for key in _OF_BOTH_RADIOS}
            self.columns = self.columns.model_copy(update={"ble": TableColumns(**alike)})
        for kind in kinds:
            numbered = rows.select(table.lines, pl.all().exclude("row"))
            self.by_kind.setdefault(kind, []).append((path.name, numbered))
        if kinds:
            role = "sensors" if kinds[0] in SENSORS else kinds[0]
            self.files.files.append(FileRecord.of(path.name, role, read_bytes(path), rows.height, rows.height))
            return
        own = self._kind(path.name, rows.head(_SAMPLE))
        if own is None:
            self.unknown.append((path.name, rows.select(table.lines, pl.all().exclude("row"))))
            message = f"the kind of this table was not recognised; {unknown_kind(rows.columns)}; or remove the file"
        else:
            entry = f"[{own}] file = {toml_value(self.columns.of(own).file)}"
            message = (
                f"{COLUMNS_FILE} names another file as {own} ({entry}), so this one is not read. Correct the entry or "
                "remove the file"
            )
        self.files.note("unread_file", path.name, message)

    def _kinds(self, file: str, sample: pl.DataFrame) -> list[str]:
        """The kinds of a table: as columns.toml says, else by its columns and the file's name."""
        named = [kind for kind in WalkColumns.model_fields if self.columns.of(kind).file == file]
        kind = self._kind(file, sample)
        return named or ([] if kind is None or self.columns.of(kind).file is not None else [kind])

    def _kind(self, file: str, sample: pl.DataFrame) -> str | None:
        """The kind of a table by its columns, the entries of columns.toml and the file's name; None if unknown."""
        columns = sample.columns
        kind = kind_of(file, columns, sample)
        if kind is None and is_wide(columns):
            return "sensors"
        named = (each for each in WalkColumns.model_fields if fits(columns, each, self.columns.of(each)))
        return kind or next(named, "poses" if named_as_poses(file) else sensor_of_file(file, columns))

    def only(self, kind: str) -> WalkTable:
        """The table of a kind; raises UsageError if there is none, or several."""
        files = self.by_kind.get(kind, [])
        if not files and self.unread:
            raise UsageError(self.unread[0])
        if not files and kind == "poses" and self.columns.poses.file is None:
            files = [(file, rows) for file, rows in self.unknown if partly_poses(file, rows.columns[1:])][:1]
        if not files:
            there = ", ".join(path.name for path in tables_in(self.folder))
            entry = self.columns.of(kind).file
            missing = f"has the columns of {kind}" if entry is None else f"has the name {entry} of [{kind}]"
            raise UsageError(
                f"{self.folder}: no table {missing}; found the files {there}; name one in {COLUMNS_FILE}: "
                f'[{kind}] file = "NAME"'
            )
        if len(files) > 1:
            names = " and ".join(name for name, _ in files)
            raise UsageError(
                f"{self.folder}: the files {names} may be {kind}; choose one in {COLUMNS_FILE}: "
                f'[{kind}] file = "{files[0][0]}"'
            )
        return self.table(kind, *files[0])

    def table(self, kind: str, file: str, rows: pl.DataFrame) -> WalkTable:
        """A table with its columns by role; raises UsageError if one is missing or ambiguous."""
        given, cells = self.columns.of(kind), rows.drop("row")
        roles = resolved(cells.columns, kind, given, file, cells.head(_SAMPLE))
        names = {role: column.name for role, column in roles.items()}
        table = WalkTable(kind, file, rows, roles, given)
        self.noted(table, **(given.model_dump() | names | {"file": file}))
        return table

    def noted(self, table: WalkTable, **entries: str) -> None:
        """Keep what was found out about a table."""
        place = table.kind, table.file
        known = self.found.get(place, TableColumns(file=table.file))
        self.found[place] = known.model_copy(update=entries)

    def times(
        self, table: WalkTable, steps: Steps, clock_ns: IntArray | None = None, alike: str | None = None
    ) -> WalkTable:
        """The table with ``time_ns``; rows without a time are left out and reported.

        ``steps`` limit the intervals between rows, if given between those with the most frequent value in ``alike``.
        """
        column = table.roles["time"]
        texts = table.rows[column.name].cast(pl.String).str.strip_chars()
        if have_dates(texts):
            return self._with_dates(table, texts)
        step, example = rounded_step(texts)
        numbers, odd = with_numbers(table.rows.with_columns(texts), [column.name], table.file)
        self.files.findings += odd
        known = numbers[column.name].is_not_null() & numbers[column.name].is_finite()
        rows, exact = table.rows.filter(known), texts.filter(known).cast(pl.Int64, strict=False)
        values = numbers[column.name].filter(known).to_numpy()
        if not len(values):
            raise UsageError(
                f"{table.file}: column {column.name} contains no time; expected numbers, or dates such as "
                "2021-12-20T09:14:05+01:00"
            )
        whole = exact.null_count() == 0
        stated = table.given.time_unit or column.unit
        if stated is not None and np.abs(values).max() * NS_IN[stated] >= MOST_NS:
            raise UsageError(
                f"{table.file}: column {column.name}: {values[0]:.15g} is not a time in {UNIT_NAMES[stated]}; write "
                f'the unit to {COLUMNS_FILE}: [{table.kind}] time_unit = "ns"'
            )
        factor = NS_IN[stated or ("ns" if whole else "s")]
        read_ns = (
            (exact * factor).to_numpy() if whole else np.round(values * factor).clip(-MOST_NS, MOST_NS).astype(int)
        )
        if table.given.time_unit is not None:
            time_ns = read_ns
        elif stated is None and not whole:
            time_ns, _ = ns_of_seconds(values, steps, table.file)
        else:
            rate_ns = read_ns if alike is None else read_ns[rows[alike].eq_missing(rows[alike].mode()[0]).to_numpy()]
            words = UNIT_NAMES[stated or "ns"]
            time_ns, other = recognised_ns(read_ns, rate_ns, steps, table.file, words, clock_ns)
            self.files.findings += [] if stated is None else other
        unit = _unit_of(values, time_ns) or stated or "ns"
        if step * NS_IN[unit] / 1e9 > MAX_STEP_S:
            raise UsageError(f"{table.file}: column {column.name}: times such as {example} are rounded; {ROUNDED}")
        self.noted(table, time_unit=unit)
        return replace(table, rows=rows.with_columns(time_ns=pl.Series(time_ns)))

    def _with_dates(self, table: WalkTable, texts: pl.Series) -> WalkTable:
        """The table with ``time_ns`` of dates; raises UsageError if their time zone is unknown."""
        zone, entry = table.given.zone, f"{COLUMNS_FILE}: [{table.kind}] zone ="
        if zone is not None:
            time_zone(zone, entry)
        elif _are_local(texts):
            if not self.local:
                example = texts.drop_nulls()[0]
                raise UsageError(
                    f"{table.file}: column {texts.name}: '{example}' has no time zone, and other tables of this walk "
                    f'have times with one, or numbers; write it to {entry} "Europe/Berlin"'
                )
            zone = "UTC"
            self.noted(table, zone=zone)
        try:
            times = table_times(texts, np.empty((0, 2), dtype=int), clock=None, unit=None, zone=zone)
        except UsageError as error:
            raise UsageError(f"{table.file}: {error}") from error
        usable = pl.Series(times.usable)
        self.files.findings += unreadable_cells(
            table.rows, texts.name, ~usable & (texts != ""), table.file, "and their rows are left out"
        )
        return replace(table, rows=table.rows.with_columns(time_ns=pl.Series(times.time_ns)).filter(usable))

    def _all_are_local_dates(self) -> bool:
        """Whether the times of all tables are dates without a time zone: then all are read as those of one clock."""
        return all(
            _are_local(rows[column].cast(pl.String).str.strip_chars())
            for kind, files in self.by_kind.items()
            for _, rows in files
            if (column := _time_column(rows, self.columns.of(kind))) is not None
        )

    def of_technology(self, table: WalkTable) -> WalkTable:
        """The rows of the radio technology of a table's kind, if a column states it; rows of others are reported."""
        if "technology" not in table.roles:
            return table
        said = table.rows.select(table.text("technology").fill_null("").str.to_lowercase()).to_series()
        kinds = [kind for kind in _RADIO if any(file == table.file for file, _ in self.by_kind.get(kind, ()))]
        read = said.str.contains("|".join(_RADIO[kind] for kind in kinds))
        if kinds[0] == table.kind and not read.all():
            others = ", ".join(sorted(set(said.filter(~read)))[:_SHOWN])
            message = f"rows of other technologies ({others}) are not read. No action needed if that is right"
            lines = table.rows.filter(~read)["row"].to_list()
            self.files.findings.append(
                Finding.at_lines("technology_left_out", table.file, lines, message, severity=Severity.INFO)
            )
        return replace(table, rows=table.rows.filter(said.str.contains(_RADIO[table.kind])))

    @property
    def text(self) -> str:
        """How the tables were read, as a columns.toml; kinds of several files are found again without it."""
        only = {kind: section for (kind, _), section in self.found.items() if len(self.by_kind[kind]) == 1}
        return self.columns.model_copy(update=only).text

    def report(self) -> None:
        """Say how the columns were read."""
        for (kind, file), section in self.found.items():
            given = self.columns.of(kind)
            entries = {
                key: value
                for key, value in section.model_dump().items()
                if value is not None and key != "file" and getattr(given, key) != value
            }
            if entries:
                words = ", ".join(f"{key} = {toml_value(value)}" for key, value in entries.items())
                rows = next(rows for name, rows in self.by_kind[kind] if name == file)
                others = [each.name for each in matching_columns(rows.columns, "time") if each.name != section.time]
                if others and given.time is None:
                    words += f" (not {' or '.join(others)})"
                message = f"read as {kind}: {words}. If that is wrong, write the right ones to {COLUMNS_FILE}: [{kind}]"
                self.files.note("columns_guessed", file, message, Severity.INFO)


def _has_beacons(rows: pl.DataFrame) -> bool:
    """Whether a column of technologies has some that are Bluetooth, as in a log of both radios."""
    return any(
        rows[column.name].cast(pl.String).str.to_lowercase().str.contains(_RADIO["ble"]).any()
        for column in matching_columns(rows.columns, "technology")[:1]
    )


def have_dates(texts: pl.Series) -> bool:
    """Whether most texts are dates with a time."""
    return (texts.str.contains(_DATE).sum() or 0) > len(texts) / 2


def _are_local(texts: pl.Series) -> bool:
    """Whether times are dates without a time zone."""
    return have_dates(texts) and not texts.str.contains(ZONE).any()


def _time_column(rows: pl.DataFrame, given: TableColumns) -> str | None:
    if given.time in rows.columns:
        return given.time
    return next((column.name for column in matching_columns(rows.columns, "time")), None)


def _unit_of(values: FloatArray, time_ns: IntArray) -> str | None:
    """The unit in which values (n,) were read as times (n,), ns; None if all are 0."""
    greatest = int(np.argmax(np.abs(values)))
    if values[greatest] == 0 or time_ns[greatest] == 0:
        return None
    factor = time_ns[greatest] / values[greatest]
    return min(NS_IN, key=lambda unit: abs(np.log(NS_IN[unit] / factor)))
