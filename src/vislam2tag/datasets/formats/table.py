"""Tables of fingerprints in layouts of their own: wide or long, with columns that are recognised or named by the user.

Wide: one row for each fingerprint, one column for each access point. Long: one row for each reading. Several files of
a folder are one data set; names with train and test are parts of its split.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.files.archives import folder_of
from vislam2tag.common.findings import ROWS_NAMED, Finding, Severity, finding_if
from vislam2tag.datasets.fingerprint_tables import SetContent, SetDescription
from vislam2tag.datasets.folder import sha256_of
from vislam2tag.datasets.format_registry import LEVEL_OPTIONS, ImportContext, ImportFormat, register
from vislam2tag.datasets.long_tables import scans_of_rows
from vislam2tag.datasets.model import TEST, TRAIN, Dataset
from vislam2tag.datasets.point_fingerprints import PointFingerprints
from vislam2tag.datasets.table_columns import (
    BEACON,
    CELL,
    UUID,
    Layout,
    assumed_columns,
    columns_used,
    layout_of,
    refuse_unknown_access_points,
)
from vislam2tag.datasets.technologies import BLE, WIFI
from vislam2tag.datasets.wide_tables import (
    CellCounts,
    LevelRules,
    measured_levels,
    unknown_columns,
    without_shared_fillers,
)
from vislam2tag.intake.cells import unreadable_cells, with_numbers
from vislam2tag.intake.columns import (
    Column,
    ColumnNames,
)
from vislam2tag.intake.fillers import never_not_heard
from vislam2tag.intake.foreign_table import SUFFIXES, ForeignTable, read_foreign_table
from vislam2tag.intake.level_scales import NOT_HEARD, LevelScale
from vislam2tag.intake.readings import NO_ADDRESS, admitted, is_masked, normal_addresses
from vislam2tag.intake.time_units import NS_IN, NS_OF, are_dates, unix_unit
from vislam2tag.site.georeference import Georeference, from_wgs84

FORMAT = "table"
_OF_BLE = re.compile(rf"{UUID}|(?:i?beacon|ble|b)[ _-]?\d+", re.IGNORECASE)
"""Names of BLE beacons."""
_TECHNOLOGIES = {
    **dict.fromkeys(("wifi", "wi-fi", "wlan", "w"), WIFI),
    **dict.fromkeys(("ble", "bluetooth", "bluetooth le", "ibeacon", "beacon", "bt", "b"), BLE),
}
_PLACE = ("x", "y", "z", "latitude", "longitude", "floor", "building", "time", "device", "user", "session", "split")
_PLACED = ("x", "y", "latitude", "longitude", "cell", "floor", "technology")
_STOREY = "floor|f|etage|og|level|l|stock|ebene"
_FLOOR = re.compile(rf"(?:(?:{_STOREY})(?:-|[ _.]*))?(-?\d{{1,4}})(?:\.0*)?(?:\.? ?(?:og|f|floor|stock))?")
_BASEMENT = re.compile(r"(?:ug|b|kg|basement)[ _.-]*(\d{0,4})|(\d{1,4})\.? ?ug")
_GROUND = frozenset({"eg", "g", "gf", "ground", "groundfloor", "ground floor", "erdgeschoss", "rez"})
_NO_LEVEL = ("-", "--", "–")
"""Texts that mean an empty cell."""
_TRAIN, _TEST = re.compile(r"trn|train", re.IGNORECASE), re.compile(r"tst|test|val", re.IGNORECASE)
_DATES = tuple(
    f"{day} {time}".strip()
    for day in ("%Y-%m-%d", "%d-%m-%Y", "%m-%d-%Y")
    for time in ("%H:%M:%S%.f", "%H:%M", "%I:%M:%S %p", "")
)
"""Forms of dates, those that are preferred first."""


def recognises(path: Path) -> bool:
    """Whether a file, or each table of a folder, is one in which a place and levels are found by name."""
    try:
        files = [path] if path.is_file() else sorted(path.iterdir())
        tables = [file for file in files if file.suffix.lower() in SUFFIXES and file.is_file()]
        for file in tables:
            layout_of(read_foreign_table(file, only_head=True), ColumnNames())
    except (OSError, UsageError, DatasetError):
        return False
    return bool(tables)


def read(path: Path, context: ImportContext) -> Dataset:
    """Read a table, or all tables of a folder or archive.

    Raises DatasetError with the columns found and those expected if a place or levels are not found, or without rows.
    """
    names = _stated(context)
    files = [path] if path.suffix.lower() in SUFFIXES and path.is_file() else _files(path, context)
    rows, heard, fillers, findings, layouts, first = [], [], list[float](), list[Finding](), list[Layout](), 0
    for file in files:
        table = read_foreign_table(file)
        layout = layout_of(table, names)
        if not table.height:
            raise DatasetError(
                f"{file}: contains no row below its header; expected one for each fingerprint or reading"
            )
        if layouts and _needed(layouts[0]) != _needed(layout):
            raise DatasetError(
                f"{file}: has other columns of places or levels than {files[0].name} (found "
                f"{', '.join(_needed(layout))}; expected {', '.join(_needed(layouts[0]))}); import the files one by "
                "one, or name their columns with --columns"
            )
        layouts.append(layout)
        own_rows, own_heard, odd, filler = (_wide if layout.access_points else _long)(table, layout, names)
        part = TRAIN if _TRAIN.search(file.stem) else TEST if _TEST.search(file.stem) else None
        missing = {"part": pl.lit(part, pl.String), "session": pl.lit(file.stem)}
        own_rows = own_rows.with_columns(each.alias(k) for k, each in missing.items() if k not in own_rows.columns)
        rows.append(own_rows.with_columns(pl.col("row") + first))
        fillers.append(filler)
        heard.append(own_heard.with_columns(pl.col("row") + first))
        findings += [assumed_columns(table, layout), *odd, *unknown_columns(file, layout.unused)]
        first += own_rows.select(pl.col("row").max().fill_null(0)).item() + 1
        context.progress(file.name, len(files))
    refuse_unknown_access_points(path, layouts, names)
    heard, findings = without_shared_fillers([file.name for file in files], heard, fillers, names.levels, findings)
    whole, origin = _located(path, pl.concat(rows, how="diagonal"), layouts[0], names)
    if whole["part"].n_unique() < 2:
        whole = whole.with_columns(part=pl.lit(None, pl.String))
    points = PointFingerprints(*_with_technology(whole, pl.concat(heard, how="diagonal")))
    del rows, heard  # a large table is in memory once
    content = SetContent(points, {file.name: sha256_of(file) for file in files}, tuple(findings))
    dataset = SetDescription(FORMAT).dataset(path, content)
    (source,) = dataset.info.sources
    used = columns_used(layouts, names.model_copy(update={"origin": origin}))
    settings = {"columns": used.model_dump(exclude_none=True, mode="json")}
    sources = (source.model_copy(update={"settings": settings}),)
    return replace(dataset, info=dataset.info.model_copy(update={"sources": sources}))


def _needed(layout: Layout) -> list[str]:
    """The roles of places and levels, which all files must have in common."""
    levels = ["columns of access points"] if layout.access_points else ["address", "level"]
    return [role for role in _PLACED if role in layout.found] + levels


def _stated(context: ImportContext) -> ColumnNames:
    """What the user says, by options and ``columns.toml``; options count first."""
    names = context.columns or ColumnNames()
    scale = None if context.levels is None else (context.levels.first, context.levels.second)
    given = {"not_heard": context.not_heard, "origin": context.origin, "levels": scale}
    if names.zone is not None:
        try:
            ZoneInfo(names.zone)
        except (ZoneInfoNotFoundError, ValueError, OSError) as error:
            raise UsageError(
                f"columns.toml: zone = {names.zone!r} is unknown; expected a zone such as Europe/Berlin"
            ) from error
    return names.model_copy(update={key: value for key, value in given.items() if value is not None})


def _files(path: Path, context: ImportContext) -> list[Path]:
    folder = folder_of(path, context.scratch, context.most_unpacked)
    files = sorted(file for file in folder.rglob("*") if file.is_file() and file.suffix.lower() in SUFFIXES)
    if not files:
        raise DatasetError(f"{path}: contains no table; expected files such as train.csv and test.csv")
    return files


def _common(
    table: ForeignTable, lines: pl.Series, rows: pl.DataFrame, layout: Layout, names: ColumnNames
) -> tuple[pl.DataFrame, list[Finding]]:
    """The columns of fingerprints other than levels, with numbers in metres."""
    found, file = layout.found, table.path.name
    plain = rows.select(pl.col(column.name).cast(pl.String).alias(role) for role, column in found.items())
    numbers = [role for role in ("x", "y", "z", "latitude", "longitude") if role in found]
    made, odd = with_numbers(plain.insert_column(0, lines), numbers, file)
    metres = {axis: names.metres or found[axis].metres or 1.0 for axis in numbers if axis in "xyz"}
    made = made.with_columns(pl.col(axis) * factor for axis, factor in metres.items())
    made = made.with_columns(pl.col(axis).fill_nan(None) for axis in numbers)
    if "cell" in found:
        made, unread = _with_cells(made, file, names.cell_m or 1.0)
        odd += unread
    if "floor" in found:
        levels = {text: _floor_number(text) for text in made["floor"].drop_nulls().unique()}
        unknown = made.filter(pl.col("floor").is_in([text for text, number in levels.items() if number is None]))
        message = "floors such as {} are not floor numbers; these fingerprints have no position"
        if unknown.height:
            text = message.format(unknown["floor"][0])
            odd.append(Finding.at_lines("unknown_floor", file, unknown["row"].to_list(), text))
        made = made.with_columns(pl.col("floor").replace_strict(levels, default=None, return_dtype=pl.Int32))
    else:
        made = made.with_columns(floor=pl.lit(0, pl.Int32))
    if "time" in found:
        time_ns, about_times = _times(made["time"], found["time"], names, file)
        odd += about_times
        date = (
            pl.from_epoch("time_ns", time_unit="ns")
            .dt.replace_time_zone("UTC")
            .dt.convert_time_zone(names.zone or "UTC")
            .dt.date()
        )
        made = made.with_columns(time_ns.alias("time_ns")).with_columns(date=date)
    if "technology" in found:
        made = made.with_columns(pl.col("technology").str.to_lowercase().replace(old=_TECHNOLOGIES))
    if "split" in found:
        split = pl.col("split").str.to_lowercase()
        part = pl.when(split.str.contains("trn|train")).then(pl.lit(TRAIN)).when(split.str.contains("tst|test|val"))
        made = made.with_columns(part=part.then(pl.lit(TEST)))
    return made, odd


def _with_cells(rows: pl.DataFrame, file: str, cell_m: float) -> tuple[pl.DataFrame, list[Finding]]:
    """Add x and y of cells such as O02, metres; those of another form have none and are reported."""
    cell = pl.col("cell").str
    letter, number = cell.extract(CELL, 1).str.to_uppercase(), cell.extract(CELL, 2).cast(pl.Float64)
    column = letter.replace_strict({chr(65 + place): float(place) for place in range(26)}, default=None)
    placed = rows.with_columns(x=column.cast(pl.Float64) * cell_m, y=number * cell_m)
    return placed, unreadable_cells(placed, "cell", placed["cell"].is_not_null() & placed["x"].is_null(), file)


def _floor_number(text: str) -> int | None:
    """The number of a floor from ``3.0``, ``F2``, ``EG``, ``2. OG`` or ``UG``; None if it is unknown."""
    plain = text.strip().lower()
    if plain in _GROUND:
        return 0
    if match := _BASEMENT.fullmatch(plain):
        return -int(match[1] or match[2] or 1)
    match = _FLOOR.fullmatch(plain)
    return None if match is None else int(match[1])


def _times(texts: pl.Series, column: Column, names: ColumnNames, file: str) -> tuple[pl.Series, list[Finding]]:
    """Unix times, ns, of numbers or dates, null where there is none, and findings."""
    odd = list[Finding]()
    numbers = texts.str.replace(",", ".", literal=True).cast(pl.Float64, strict=False)
    if numbers.null_count() < len(texts) / 2:
        stated = names.time_unit or column.unit
        factor = NS_IN[stated] if stated else NS_OF[unix_unit(numbers.drop_nulls().to_numpy())]
        exact = texts.cast(pl.Int64, strict=False)
        whole = exact if exact.null_count() <= numbers.null_count() else None
        time_ns = (numbers * factor).round().cast(pl.Int64, strict=False) if whole is None else whole * factor
        time_ns = time_ns.set(~are_dates(time_ns / 1e9).fill_null(value=False), None)
    else:
        time_ns, has_zone = _dates(texts, names.zone or "UTC")
        if not has_zone and names.zone is None and (known := time_ns.is_not_null()).any():
            example = texts.filter(known)[0]
            message = (
                f"column {column.name}: dates such as {example} have no time zone and are read as UTC. If they are "
                'local times, write zone = "Europe/Berlin", or yours, to columns.toml and pass --columns columns.toml'
            )
            odd += finding_if(int(known.sum()), "assumed_zone", message, file)
    unread = texts.filter(texts.is_not_null() & time_ns.is_null())
    if len(unread):
        message = f"times such as {unread[0]} are not used: expected Unix times or dates; state their time_unit"
        odd += finding_if(len(unread), "unreadable_dates", message, file, Severity.WARNING)
    return time_ns, odd


def _dates(texts: pl.Series, zone: str) -> tuple[pl.Series, bool]:
    """Dates as Unix times, ns, null where there is none, and whether most state a zone; ``zone`` is that of others."""
    plain = texts.str.replace(r"^(\d+)[-/.](\d+)[-/.](\d+)[T _-]*", "${1}-${2}-${3} ").str.strip_chars()
    offset = r"(?:Z| ?[+-]\d\d:?\d\d)$"
    if plain.str.contains(rf":\d\d.*{offset}").sum() > len(texts) / 2:
        stated = plain.str.replace(r" ?Z$", "+00:00").str.replace(r" ?([+-]\d\d):?(\d\d)$", "${1}:${2}")
        return stated.str.to_datetime("%Y-%m-%d %H:%M:%S%.f%:z", time_unit="ns", strict=False).dt.timestamp("ns"), True
    read = (plain.str.to_datetime(form, time_unit="ns", strict=False) for form in _DATES)
    best = min(read, key=lambda each: each.null_count())
    local = best.dt.replace_time_zone(zone, ambiguous="earliest", non_existent="null")
    return local.dt.timestamp("ns"), False


_Parts = tuple[pl.DataFrame, pl.DataFrame, list[Finding], float]
"""Rows, levels heard, findings, and the level, dBm, that was found to mean "not heard" (NaN if none was)."""


def _wide(table: ForeignTable, layout: Layout, names: ColumnNames) -> _Parts:
    """The fingerprints of a wide table, read in batches; ``row`` is the line."""
    points = layout.access_points
    rules = LevelRules(NOT_HEARD, said=names.not_heard, scale=LevelScale(*names.levels) if names.levels else None)
    kind = pl.Enum(list(points))
    rows, heard, odd, unread, empty = [], [], list[Finding](), list[Finding](), 0
    for lines, batch in table.batches():
        texts = batch.select(points).with_columns(pl.col(pl.String).replace(dict.fromkeys(_NO_LEVEL)))
        cells, unread_here = with_numbers(texts.insert_column(0, lines), points, table.path.name)
        unread += unread_here
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
    counts = CellCounts(len(points), empty, table.height * len(points) - found.height - empty)
    measured, about_levels, filler = measured_levels(table.path, found, counts, 0, rules)
    message = "cells are empty; they count as not heard"
    odd += [*_joined(unread), *finding_if(empty, "empty_levels", message, table.path.name), *about_levels]
    if masked := [name for name in points if is_masked(name)]:
        text = f"columns of no address are skipped: {', '.join(masked)}. {NO_ADDRESS}"
        odd += finding_if(len(masked), "masked_addresses", text, table.path.name, Severity.WARNING)
        measured = measured.filter(~pl.col("bssid").cast(pl.String).is_in(masked))
    named = measured.with_columns(pl.col("row").cast(pl.Int64), normal_addresses(measured["bssid"].cast(pl.String)))
    return pl.concat(rows), named, odd, filler


def _joined(unread: Sequence[Finding]) -> list[Finding]:
    """One finding about the cells of access points that cannot be read, with the first one."""
    if len(unread) < 2:
        return list(unread)
    lines = sorted({line for each in unread for line in each.lines})[:ROWS_NAMED]
    message = f"cells of several columns of access points are no levels; {unread[0].message}"
    count = sum(each.count for each in unread)
    return [unread[0].model_copy(update={"count": count, "lines": tuple(lines), "message": message})]


def _long(table: ForeignTable, layout: Layout, names: ColumnNames) -> _Parts:
    """The fingerprints of a long table: rows of one scan, or of equal place, time and device."""
    rows, odd = _common(table, table.lines, table.rows, layout, names)
    measures = ["level", *(["frequency"] if "frequency" in rows.columns else [])]
    readings, unread = with_numbers(rows, measures, table.path.name)
    readings = _with_identity(readings).rename({"address": "bssid", "level": "rssi_dbm"})
    if names.not_heard is not None:
        if not (readings["rssi_dbm"] == names.not_heard).any():
            odd.append(never_not_heard(table.path.name, names.not_heard))
        readings = readings.filter(pl.col("rssi_dbm").ne_missing(names.not_heard))
    if names.levels is not None:
        readings = readings.with_columns(LevelScale(*names.levels).dbm(pl.col("rssi_dbm")))
    by = ("scan", "session", "device") if "scan" in rows.columns else None
    same = [name for name in by or _PLACE if name in rows.columns]
    same += ["technology"] if "technology" in rows.columns else []
    kept, about_levels = admitted(readings, "bssid", table.path.name)
    owner, about_scans = scans_of_rows(rows, kept, same, table.path.name, layout.unused)
    first = rows.filter(pl.col("row").is_in(owner["owner"].unique().implode()))
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
    return first, heard, [*odd, *unread, *about_levels, *about_scans], math.nan


def _with_identity(rows: pl.DataFrame) -> pl.DataFrame:
    """Name BLE beacons by UUID, major and minor, if these are known, as data sets of walks do."""
    if not set(BEACON) <= set(rows.columns):
        return rows
    beacon = pl.format("{}-{}-{}", pl.col("uuid").str.to_lowercase(), "major", "minor")
    address = pl.col("address") if "address" in rows.columns else pl.lit(None, pl.String)
    return rows.with_columns(address=pl.coalesce(beacon, address))


def _with_technology(rows: pl.DataFrame, heard: pl.DataFrame) -> tuple[pl.DataFrame, pl.DataFrame]:
    """Make fingerprints of BLE of the readings whose names are those of beacons, unless a column says what they are."""
    beacons = [name for name in heard["bssid"].unique() if _OF_BLE.fullmatch(name)]
    if "technology" in rows.columns or not beacons:
        return rows, heard
    if len(beacons) == heard["bssid"].n_unique():
        return rows.with_columns(technology=pl.lit(BLE)), heard
    next_row = int(rows.select(pl.col("row").max()).item()) + 1
    of_ble = pl.col("bssid").is_in(beacons)
    numbered = heard.with_columns(pl.when(of_ble).then(pl.col("row") + next_row).otherwise("row").alias("row"))
    there = pl.col("row").is_in(numbered["row"].unique().implode())
    silent = ~pl.col("row").is_in(heard["row"].unique().implode())
    wifi = rows.with_columns(technology=pl.lit(WIFI)).filter(there | silent)
    ble = rows.with_columns(pl.col("row") + next_row, technology=pl.lit(BLE)).filter(there)
    return pl.concat([wifi, ble]), numbered


def _located(
    path: Path, rows: pl.DataFrame, layout: Layout, names: ColumnNames
) -> tuple[pl.DataFrame, tuple[float, float] | None]:
    """The rows with x and y in metres, and the origin of degrees."""
    if not layout.has_degrees:
        return rows, None
    degrees = rows.select("longitude", "latitude").to_numpy()
    if np.nanmax(np.abs(degrees[:, 0])) > 180 or np.nanmax(np.abs(degrees[:, 1])) > 90:
        raise DatasetError(
            f"{path}: the columns {layout.found['latitude'].name} and {layout.found['longitude'].name} are not "
            "degrees, because some exceed 90 and 180; if they are metres, write to columns.toml: "
            f'x = "{layout.found["longitude"].name}", y = "{layout.found["latitude"].name}", latitude = "", '
            'longitude = "", and pass --columns columns.toml'
        )
    corner = np.floor(np.nanmin(degrees, axis=0) * 1e4) / 1e4
    latitude, longitude = names.origin or (round(float(corner[1]), 4), round(float(corner[0]), 4))
    place = from_wgs84(degrees, Georeference(latitude_deg=latitude, longitude_deg=longitude))
    located = rows.with_columns(x=pl.Series(place[:, 0], nan_to_null=True), y=pl.Series(place[:, 1], nan_to_null=True))
    return located, (latitude, longitude)


register(ImportFormat(FORMAT, read, recognises, takes=("origin", "columns", *LEVEL_OPTIONS)))
