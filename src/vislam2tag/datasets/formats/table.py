"""Tables of fingerprints in layouts of their own: wide or long, with columns that are recognised or named by the user.

Wide: one row for each fingerprint, one column for each access point. Long: one row for each reading. Several files of
a folder are one data set; names with train and test are parts of its split.
"""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.files.archives import folder_of
from vislam2tag.common.findings import Finding, Severity, finding_if
from vislam2tag.datasets.fingerprint_tables import SetContent, SetDescription
from vislam2tag.datasets.folder import sha256_of
from vislam2tag.datasets.format_registry import LEVEL_OPTIONS, ImportContext, ImportFormat, register
from vislam2tag.datasets.model import TEST, TRAIN, Dataset
from vislam2tag.datasets.point_fingerprints import PointFingerprints
from vislam2tag.datasets.wide_tables import LevelRules, measured_levels
from vislam2tag.intake.cells import with_numbers
from vislam2tag.intake.columns import (
    Column,
    ColumnNames,
    columns_toml,
    find_columns,
    missing_column,
    shown,
)
from vislam2tag.intake.foreign_table import SUFFIXES, ForeignTable, read_foreign_table
from vislam2tag.intake.level_scales import NOT_HEARD
from vislam2tag.intake.readings import admitted, is_address, normal_addresses
from vislam2tag.intake.time_units import NS_OF, are_dates, unix_unit
from vislam2tag.site.georeference import Georeference, from_wgs84

FORMAT = "table"
ROLES = (
    *("x", "y", "z", "latitude", "longitude", "floor", "building", "time", "address", "level", "ssid", "frequency"),
    *("technology", "scan", "device", "user", "session", "split"),
)
_NUMBERED = re.compile(r"(?:w?ap|mac|bssid|rssi?|beacon|b|wifi|ble|router|node)?[ _-]?\d+", re.IGNORECASE)
_UUID = re.compile(r"[0-9a-f]{8}-(?:[0-9a-f]{4}-){3}[0-9a-f]{12}(?:[-_]\d+[-_]\d+)?", re.IGNORECASE)
_FLOOR = re.compile(r"(?:floor|f|etage|og|level|l|stock|ebene)?[ _.-]*(-?\d+)(?:\.0*)?(?:\.? ?(?:og|f|floor|stock))?")
_BASEMENT = re.compile(r"(?:ug|b|kg|basement)[ _.-]*(\d*)|(\d+)\.? ?ug")
_GROUND = frozenset({"eg", "g", "gf", "ground", "groundfloor", "ground floor", "erdgeschoss", "rez"})
_TRAIN, _TEST = re.compile(r"trn|train", re.IGNORECASE), re.compile(r"tst|test|val", re.IGNORECASE)


@dataclass(frozen=True)
class _Layout:
    found: Mapping[str, Column]
    access_points: tuple[str, ...]
    """Columns of a wide table; empty if the table is long."""


def recognises(path: Path) -> bool:
    """Whether a file, or each table of a folder, is one in which a place and levels are found by name."""
    try:
        files = [path] if path.is_file() else sorted(path.iterdir())
        tables = [file for file in files if file.suffix.lower() in SUFFIXES and file.is_file()]
        for file in tables:
            _layout(read_foreign_table(file), ColumnNames())
    except (OSError, UsageError, DatasetError):
        return False
    return bool(tables)


def read(path: Path, context: ImportContext) -> Dataset:
    """Read a table, or all tables of a folder or archive.

    Raises DatasetError with the columns found and those expected if a place or levels are not found.
    """
    names = context.columns or ColumnNames()
    files = [path] if path.suffix.lower() in SUFFIXES and path.is_file() else _files(path, context)
    rows, heard, findings, first = [], [], list[Finding](), 0
    layout: _Layout | None = None
    for file in files:
        table = read_foreign_table(file)
        before, layout = layout, _layout(table, names)
        if before is not None and before.found.keys() != layout.found.keys():
            raise DatasetError(
                f"{file}: has other columns than {files[0].name} (found {', '.join(layout.found)}; expected "
                f"{', '.join(before.found)}); import the files one by one, or name their columns with --columns"
            )
        own_rows, own_heard, odd = (_wide if layout.access_points else _long)(table, layout, names, context)
        part = TRAIN if _TRAIN.search(file.stem) else TEST if _TEST.search(file.stem) else None
        placed = own_rows if "part" in own_rows.columns else own_rows.with_columns(part=pl.lit(part, pl.String))
        rows.append(placed.with_columns(pl.col("row") + first, file=pl.lit(file.stem)))
        heard.append(own_heard.with_columns(pl.col("row") + first))
        findings += odd
        first += own_rows.select(pl.col("row").max().fill_null(0)).item() + 1
        context.progress(file.name, len(files))
    assert layout is not None
    whole, settings = _located(path, pl.concat(rows), layout, context)
    if "session" not in whole.columns:
        whole = whole.with_columns(session=pl.col("file"))
    if whole["part"].n_unique() < 2:
        whole = whole.with_columns(part=pl.lit(None, pl.String))
    content = SetContent(
        PointFingerprints(whole.drop("file"), pl.concat(heard)), {file.name: sha256_of(file) for file in files}, ()
    )
    content = replace(content, findings=(_assumed(path, layout), *findings))
    dataset = SetDescription(FORMAT).dataset(path, content)
    (source,) = dataset.info.sources
    sources = (source.model_copy(update={"settings": settings}),)
    return replace(dataset, info=dataset.info.model_copy(update={"sources": sources}))


def _files(path: Path, context: ImportContext) -> list[Path]:
    folder = folder_of(path, context.scratch, context.most_unpacked)
    files = sorted(file for file in folder.rglob("*") if file.is_file() and file.suffix.lower() in SUFFIXES)
    if not files:
        raise DatasetError(f"{path}: contains no table; expected files such as train.csv and test.csv")
    return files


def _layout(table: ForeignTable, names: ColumnNames) -> _Layout:
    """Find the columns; raises DatasetError if there is no place, or no level."""
    columns, sample = table.columns, table.head()
    given = names.access_points
    patterns = () if given is None else (given,) if isinstance(given, str) else given
    wide = [name for name in columns if any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)]
    if patterns and not wide:
        raise DatasetError(f"{table.path}: no column is {' or '.join(patterns)}; found the columns {shown(columns)}")
    said = set(names.named.values())
    free = [name for name in columns if name not in wide]
    if not patterns:
        wide = [name for name in free if name not in said and (is_address(name) or _UUID.fullmatch(name))]
        wide += [name for name in free if name not in said and name not in wide and _NUMBERED.fullmatch(name)]
        free = [name for name in free if name not in wide]
    try:
        found = find_columns(free, ROLES, names.named, sample.select(free))
    except UsageError as error:
        raise DatasetError(f"{table.path}: {error}") from error
    is_long = not patterns and {"address", "level"} <= found.keys()
    layout = _Layout(found, () if is_long else tuple(wide))
    missing = [] if {"latitude", "longitude"} <= found.keys() else [axis for axis in "xy" if axis not in found]
    if not is_long and not wide:
        missing += [role for role in ("address", "level") if role not in found]
    if missing:
        draft = columns_toml(_described(layout)) + "".join(f'{role} = ""\n' for role in missing)
        raise DatasetError(
            f'{table.path}: {missing_column(columns, missing)}, or access_points = ["AP*"] for a column for each '
            f"access point; then pass --columns columns.toml. Draft of the file:\n{draft}"
        )
    return layout


def _described(layout: _Layout) -> ColumnNames:
    named = {role: column.name for role, column in layout.found.items()}
    return ColumnNames.model_validate({**named, "access_points": layout.access_points or None})


def _assumed(path: Path, layout: _Layout) -> Finding:
    read = [f"{column.name} as {role}" for role, column in layout.found.items()]
    if "floor" not in layout.found:
        read.append("no column as floor, so that all fingerprints are on floor 0")
    if layout.access_points:
        read.append(f"{len(layout.access_points)} columns such as {layout.access_points[0]} as access points")
    message = f"columns were read by their names: {', '.join(read)}. Correct them with --columns if this is wrong"
    severity = Severity.INFO
    return Finding(kind="assumed_columns", file=path.name, count=len(read), message=message, severity=severity)


def _common(
    table: ForeignTable, lines: pl.Series, rows: pl.DataFrame, layout: _Layout, names: ColumnNames
) -> tuple[pl.DataFrame, list[Finding]]:
    """The columns of fingerprints other than levels, with numbers in metres."""
    found = layout.found
    plain = rows.select(pl.col(column.name).cast(pl.String).alias(role) for role, column in found.items())
    numbers = [role for role in ("x", "y", "z", "latitude", "longitude") if role in found]
    made, odd = with_numbers(plain.insert_column(0, lines), numbers, table.path.name)
    metres = {axis: names.metres or found[axis].metres or 1.0 for axis in numbers if axis in "xyz"}
    made = made.with_columns(pl.col(axis) * factor for axis, factor in metres.items())
    made = made.with_columns(pl.col(axis).fill_nan(None) for axis in numbers)
    if "floor" in found:
        levels = {text: _floor_number(text) for text in made["floor"].drop_nulls().unique()}
        unread = made.filter(pl.col("floor").is_in([text for text, number in levels.items() if number is None]))
        message = "floors such as {} have no number; these fingerprints have no position"
        if unread.height:
            text = message.format(unread["floor"][0])
            odd.append(Finding.at_lines("unknown_floor", table.path.name, unread["row"].to_list(), text))
        made = made.with_columns(pl.col("floor").replace_strict(levels, default=None, return_dtype=pl.Int32))
    else:
        made = made.with_columns(floor=pl.lit(0, pl.Int32))
    if "time" in found:
        time_ns = _times(made["time"], found["time"], names)
        unread_times = int((made["time"].is_not_null() & time_ns.is_null()).sum())
        text = f"times such as {made['time'][0]} are not used: expected Unix times or dates; state their time_unit"
        odd += finding_if(unread_times, "unreadable_dates", text, table.path.name, Severity.WARNING)
        date = pl.from_epoch("time_ns", time_unit="ns").dt.date()
        made = made.with_columns(time_ns.alias("time_ns")).with_columns(date=date)
    if "split" in found:
        split = pl.col("split").str.to_lowercase()
        part = pl.when(split.str.contains("trn|train")).then(pl.lit(TRAIN)).when(split.str.contains("tst|test|val"))
        made = made.with_columns(part=part.then(pl.lit(TEST)))
    return made, odd


def _floor_number(text: str) -> int | None:
    """The number of a floor from ``3.0``, ``F2``, ``EG``, ``2. OG`` or ``UG``; None if it is unknown."""
    plain = text.strip().lower()
    if plain in _GROUND:
        return 0
    if match := _BASEMENT.fullmatch(plain):
        return -int(match[1] or match[2] or 1)
    match = _FLOOR.fullmatch(plain)
    return None if match is None else int(match[1])


def _times(texts: pl.Series, column: Column, names: ColumnNames) -> pl.Series:
    """Unix times, ns, of numbers or dates; null where there is none. Times without a zone are read as UTC."""
    numbers = texts.str.replace(",", ".", literal=True).cast(pl.Float64, strict=False)
    if numbers.null_count() < len(texts) / 2:
        unit = {"s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}.get(
            names.time_unit or column.unit or "", unix_unit(numbers.drop_nulls().to_numpy())
        )
        exact = texts.cast(pl.Int64, strict=False)
        whole = exact if exact.null_count() <= numbers.null_count() else None
        factor = NS_OF[unit]
        time_ns = (numbers * factor).round().cast(pl.Int64, strict=False) if whole is None else whole * factor
        return time_ns.set(~are_dates(time_ns / 1e9).fill_null(value=False), None)
    plain = texts.str.replace_all("/", "-").str.replace(r"^(\d{4}-\d+-\d+)[-T ]+", "${1} ")
    return plain.str.to_datetime(time_unit="ns", strict=False, time_zone="UTC").dt.timestamp("ns")


_Parts = tuple[pl.DataFrame, pl.DataFrame, list[Finding]]


def _wide(table: ForeignTable, layout: _Layout, names: ColumnNames, context: ImportContext) -> _Parts:
    """The fingerprints of a wide table, read in batches; ``row`` is the line."""
    points = layout.access_points
    rules = LevelRules(NOT_HEARD, said=_not_heard(names, context), scale=context.levels)
    kind = pl.Enum(list(points))
    rows, heard, odd, empty = [], [], list[Finding](), 0
    for lines, batch in table.batches():
        cells, unread = with_numbers(batch.select(points).insert_column(0, lines), points, table.path.name)
        odd += unread
        levels = cells.select(points).cast(pl.Float32).to_numpy()
        row, column = np.nonzero(levels != rules.stated)
        level = levels[row, column]
        known = ~np.isnan(level)
        empty += int((~known).sum())
        numbers, places = lines.to_numpy()[row[known]].astype(np.int32), column[known].astype(np.uint32)
        bssid = pl.Series(list(points), dtype=kind).gather(places)
        heard.append(pl.DataFrame({"row": numbers, "bssid": bssid, "rssi_dbm": level[known]}))
        made, about = _common(table, lines, batch, layout, names)
        rows.append(made)
        odd += about
    found = pl.concat(heard)
    counts = (len(points), table.height * len(points) - found.height)
    measured, about_levels = measured_levels(table.path, found, counts, 0, rules)
    message = "cells are empty; they count as not heard"
    odd += [*finding_if(empty, "empty_levels", message, table.path.name), *about_levels]
    named = measured.with_columns(pl.col("row").cast(pl.Int64), normal_addresses(measured["bssid"].cast(pl.String)))
    return pl.concat(rows), named, odd


def _long(table: ForeignTable, layout: _Layout, names: ColumnNames, context: ImportContext) -> _Parts:
    """The fingerprints of a long table: rows of one scan, or of equal place, time and device."""
    rows, odd = _common(table, table.lines, table.rows, layout, names)
    stated = _not_heard(names, context)
    readings, unread = with_numbers(
        rows, ["level", *(["frequency"] if "frequency" in rows.columns else [])], table.path.name
    )
    readings = readings.rename({"address": "bssid", "level": "rssi_dbm"})
    if context.levels is not None:
        readings = readings.with_columns(context.levels.dbm(pl.col("rssi_dbm")))
    if stated is not None:
        readings = readings.filter(pl.col("rssi_dbm").ne_missing(stated))
    by = ("scan", "session", "device") if "scan" in rows.columns else None
    same = [name for name in by or _PLACE if name in rows.columns]
    same += ["technology"] if "technology" in rows.columns else []
    kept, about_levels = admitted(readings, "bssid", table.path.name)
    first = rows.group_by(same, maintain_order=True).agg(pl.all().first())
    first = first.with_columns(technology=pl.col("technology").str.to_lowercase()) if "technology" in same else first
    owner = rows.select("row", owner=pl.col("row").first().over(same))
    heard = (
        kept.drop_nulls("rssi_dbm")
        .join(owner, on="row")
        .select(
            pl.col("owner").alias("row"),
            "bssid",
            pl.col("rssi_dbm").cast(pl.Float32),
            *([pl.col("frequency").cast(pl.Float32).alias("frequency_mhz")] if "frequency" in rows.columns else []),
        )
    )
    return first, heard, [*odd, *unread, *about_levels]


_PLACE = ("x", "y", "z", "latitude", "longitude", "floor", "building", "time", "device", "user", "session", "split")


def _not_heard(names: ColumnNames, context: ImportContext) -> float | None:
    return names.not_heard if context.not_heard is None else context.not_heard


def _located(
    path: Path, rows: pl.DataFrame, layout: _Layout, context: ImportContext
) -> tuple[pl.DataFrame, dict[str, object]]:
    """The rows with x and y in metres, and the settings that repeat this."""
    settings: dict[str, object] = {"columns": _described(layout).model_dump(exclude_none=True, mode="json")}
    if {"x", "y"} <= layout.found.keys():
        return rows, settings
    degrees = rows.select("longitude", "latitude").to_numpy()
    if np.nanmax(np.abs(degrees[:, 0])) > 180 or np.nanmax(np.abs(degrees[:, 1])) > 90:
        raise DatasetError(
            f"{path}: the columns {layout.found['latitude'].name} and {layout.found['longitude'].name} are not "
            "degrees, because some exceed 90 and 180; if they are metres, write to columns.toml: "
            f'x = "{layout.found["longitude"].name}", y = "{layout.found["latitude"].name}", latitude = "", '
            'longitude = "", and pass --columns columns.toml'
        )
    corner = np.floor(np.nanmin(degrees, axis=0) * 1e4) / 1e4
    latitude, longitude = context.origin or (round(float(corner[1]), 4), round(float(corner[0]), 4))
    place = from_wgs84(degrees, Georeference(latitude_deg=latitude, longitude_deg=longitude))
    located = rows.with_columns(x=pl.Series(place[:, 0], nan_to_null=True), y=pl.Series(place[:, 1], nan_to_null=True))
    return located, {**settings, "origin": [latitude, longitude]}


register(ImportFormat(FORMAT, read, recognises, takes=("origin", "columns", *LEVEL_OPTIONS)))
