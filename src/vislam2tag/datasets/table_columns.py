"""Columns of a table of fingerprints, wide or long: by name, or as the user names them in ``columns.toml``."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.datasets.recordings import table_with_times
from vislam2tag.intake.cells import with_numbers
from vislam2tag.intake.columns import (
    Column,
    ColumnNames,
    columns_toml,
    find_columns,
    matching_columns,
    missing_column,
    plain_name,
    shown,
)
from vislam2tag.intake.foreign_table import ForeignTable
from vislam2tag.intake.readings import is_address

ROLES = (
    *("x", "y", "z", "latitude", "longitude", "floor", "building", "time", "address", "level", "ssid", "frequency"),
    *("technology", "scan", "device", "user", "session", "split", "uuid", "major", "minor"),
)
BEACON = ("uuid", "major", "minor")
_NUMBERED = re.compile(r"(?:w?ap|mac|bssid|rssi?|i?beacon|b|wifi|ble|router|node)?[ _-]?\d+", re.IGNORECASE)
UUID = r"[0-9a-f]{8}-(?:[0-9a-f]{4}-){3}[0-9a-f]{12}(?:[-_]\d+[-_]\d+)?"
_NAMES_SHOWN = 5
_GREATEST_FLOOR = 15
"""Whole numbers up to this one may be those of floors."""
DRAFT_BELOW = "Draft of the file:\n"
"""End of a message; below it are lines of a ``columns.toml``."""
CELL = r"^([A-Za-z])[ _-]?(\d+)$"


@dataclass(frozen=True)
class Layout:
    """The columns of a table by role, those of access points, and those that are not used."""

    found: Mapping[str, Column]
    access_points: tuple[str, ...]
    """Columns of a wide table; empty if the table is long."""
    unused: tuple[str, ...] = ()

    @property
    def has_degrees(self) -> bool:
        """Whether places are latitude and longitude."""
        return not {"x", "y"} <= self.found.keys() and "cell" not in self.found


def layout_of(table: ForeignTable, names: ColumnNames) -> Layout:
    """Find the columns; raises DatasetError if there is no place, or no level."""
    columns, sample = table.columns, table.head()
    given = names.access_points
    patterns = () if given is None else (given,) if isinstance(given, str) else given
    said = set(names.named.values())
    wide = [name for name in columns if name not in said and _is_one_of(name, patterns)]
    if patterns and not wide:
        raise DatasetError(f"{table.path}: no column is {' or '.join(patterns)}; found the columns {shown(columns)}")
    if not patterns:
        wide = access_point_columns([name for name in columns if name not in said])
    free = [name for name in columns if name not in set(wide)]
    roles = ROLES if names.cell is None else (*ROLES, "cell")
    try:
        found = find_columns(free, roles, names.named, sample.select(free))
    except UsageError as error:
        raise DatasetError(f"{table.path}: {error}") from error
    if "level" not in names.named:
        is_wide = bool(wide) and (bool(patterns) or not _names_senders(found))
        found = _with_level(found, sample.select(free), names, is_wide=is_wide)
    is_long = not patterns and "level" in found and _names_senders(found)
    points = () if is_long else tuple(name for name in columns if name in set(wide))
    used = {*points, *(column.name for column in found.values())}
    layout = Layout(found, points, tuple(name for name in columns if name not in used))
    if "cell" in found and names.cell_m is None:
        raise DatasetError(f"{table.path}: {_cell_size(found['cell'].name)}")
    _refuse_incomplete(table, sample, layout, is_long=is_long)
    return layout


def access_point_columns(columns: Sequence[str]) -> list[str]:
    """The columns of a wide table that are named as access points: addresses, UUIDs and numbered names."""
    addresses = [name for name in columns if is_address(name) or re.fullmatch(UUID, name, re.IGNORECASE)]
    return addresses + [name for name in columns if name not in addresses and _NUMBERED.fullmatch(name)]


def refuse_unknown_access_points(path: Path, layouts: Sequence[Layout], names: ColumnNames) -> None:
    """Raise DatasetError if a name or pattern in ``access_points`` is that of no column, or of one with a role."""
    if names.access_points is None or isinstance(names.access_points, str):
        return
    points = {name for layout in layouts for name in layout.access_points}
    unknown = [each for each in names.access_points if not any(_is_one_of(name, (each,)) for name in points)]
    if not unknown:
        return
    role = next((role for role, name in names.named.items() if name == unknown[0]), None)
    why = "no column has this name" if role is None else f"the column is named as {role}, too"
    raise DatasetError(
        f"{path}: columns.toml: access_points has {', '.join(unknown[:_NAMES_SHOWN])}: {why}; remove the name from the "
        "list, or correct it"
    )


def _names_senders(found: Mapping[str, Column]) -> bool:
    return "address" in found or found.keys() >= set(BEACON)


def _with_level(
    found: dict[str, Column], sample: pl.DataFrame, names: ColumnNames, *, is_wide: bool
) -> dict[str, Column]:
    """A column ``level`` is the floor in a wide table, next to a better name of levels, or if its cells are no levels.

    The floor is then that column, unless another one is.
    """
    column = found.get("level")
    if column is None or plain_name(column.name) != "level":
        return found
    own = {each.name for each in found.values()}
    better = matching_columns([name for name in sample.columns if name not in own], "level")
    better = [each for each in better if _may_be_levels(sample, each.name)]
    if not is_wide and not better and (names.levels is not None or _may_be_levels(sample, column.name)):
        return found
    changed = {role: each for role, each in found.items() if role != "level"}
    if better and not is_wide:
        changed["level"] = better[0]
    if "floor" not in names.named and not (_numbers(sample, column.name) < -_GREATEST_FLOOR).any():
        changed.setdefault("floor", column)
    return {role: changed[role] for role in (*ROLES, "cell") if role in changed}


def _may_be_levels(sample: pl.DataFrame, name: str) -> bool:
    """Whether cells are numbers in dBm, or in another form of levels; small whole numbers are not, but those of floors.

    Also true if there are none.
    """
    numbers = _numbers(sample, name)
    known = numbers.drop_nulls()
    are_levels = (known.abs() > _GREATEST_FLOOR) | (known != known.round())
    return not len(numbers) or (2 * len(known) > len(numbers) and are_levels.any())


def _numbers(sample: pl.DataFrame, name: str) -> pl.Series:
    """The numbers of the cells that are not empty, null for text."""
    cells = sample.select(pl.lit(0).alias("row"), pl.col(name).cast(pl.String)).drop_nulls()
    return with_numbers(cells, [name], "")[0][name]


def _is_one_of(name: str, patterns: Iterable[str]) -> bool:
    return any(name == pattern or fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def _refuse_incomplete(table: ForeignTable, sample: pl.DataFrame, layout: Layout, *, is_long: bool) -> None:
    found = layout.found
    placed = "cell" in found or {"latitude", "longitude"} <= found.keys()
    missing = [] if placed else [axis for axis in "xy" if axis not in found]
    if missing == ["x", "y"]:
        for name, cells in sample.select(layout.unused).select(pl.col(pl.String)).to_dict().items():
            if cells.count() and cells.str.contains(CELL).all():
                raise DatasetError(f"{table.path}: {_cell_size(name)}")
    if not is_long and not layout.access_points:
        missing += [role for role in ("address", "level") if role not in found]
    if not missing:
        return
    if not table.header_line:
        raise DatasetError(
            f"{table.path}: has no header; found {len(table.columns)} columns. Write a line with their names above the "
            "values, such as x,y,floor,time,bssid,rssi. If it is a file of a recording, pass the recording's folder"
        )
    wide = ', or access_points = ["AP*"] for a column for each access point' if "level" in missing else ""
    draft = columns_toml(columns_used([layout], ColumnNames())) + "".join(f'{role} = ""\n' for role in missing)
    instead = f"{table_with_times(table.path, found['time'].name)}. Otherwise: " if _is_recording(layout) else ""
    raise DatasetError(
        f"{table.path}: {instead}{missing_column(table.columns, missing)}{wide}; then pass --columns columns.toml. "
        f"{DRAFT_BELOW}{draft}"
    )


def _is_recording(layout: Layout) -> bool:
    """Whether a table has times, but neither a place nor columns of access points."""
    placed = {"x", "y"} <= layout.found.keys() and "level" in layout.found
    return "time" in layout.found and not placed and not layout.access_points


def _cell_size(column: str) -> str:
    return (
        f"the column {column} contains cells of a grid such as O02, whose size in metres is unknown. Write to "
        f'columns.toml: cell = "{column}" and cell_m = 3.0, with the true distance between neighbouring cells; then '
        "pass --columns columns.toml"
    )


def columns_used(layouts: Sequence[Layout], stated: ColumnNames) -> ColumnNames:
    """What repeats the import of tables; names that differ between them are left to be found again."""
    first, *others_found = ({role: column.name for role, column in layout.found.items()} for layout in layouts)
    named = {role: name for role, name in first.items() if all(each.get(role) == name for each in others_found)}
    points = list(dict.fromkeys(name for layout in layouts for name in layout.access_points))
    others = {
        *(column.name for layout in layouts for column in layout.found.values()),
        *(name for layout in layouts for name in layout.unused),
    }
    return stated.model_copy(update={**named, "access_points": _pattern(points, others)})


def _pattern(points: Sequence[str], others: Collection[str]) -> str | tuple[str, ...] | None:
    """One pattern of all access points and no other column, else their names; None if there are none."""
    for pattern in ("??:??:??:??:??:??", *(f"{name.rstrip('0123456789')}*" for name in points[:1])):
        fits = all(fnmatch.fnmatchcase(name, pattern) for name in points)
        if len(points) > 1 and pattern != "*" and fits and not any(_is_one_of(name, (pattern,)) for name in others):
            return pattern
    return tuple(points) or None


def assumed_columns(table: ForeignTable, layout: Layout) -> Finding:
    """Report how the columns of a table were read."""
    read = [f"{column.name} as {role}" for role, column in layout.found.items()]
    if "floor" not in layout.found:
        read.append("no column as floor, so that all fingerprints are on floor 0")
    if layout.access_points:
        read.append(f"{len(layout.access_points)} columns such as {layout.access_points[0]} as access points")
    form = "".join(f"; {note}" for note in table.notes)
    message = f"columns were read as follows: {', '.join(read)}{form}. Correct them with --columns if this is wrong"
    severity = Severity.INFO
    return Finding(kind="assumed_columns", file=table.path.name, count=len(read), message=message, severity=severity)
