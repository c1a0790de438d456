"""Reader of tables of fingerprints at known points, with a description of each published data set or own table.

A data set consists of files of levels (one row for each fingerprint, one column for each access point). Further columns
or companion files contain position and time. :class:`FingerprintTables` describes them; the modules of
:mod:`.formats` define one each.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import polars as pl

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.archives import folder_of, names_in
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.findings import Finding, FindingKind, Severity, finding_if, pooled
from vislam2tag.datasets.access_points import NO_NAMES
from vislam2tag.datasets.description import Person
from vislam2tag.datasets.folder import sha256_of
from vislam2tag.datasets.format_registry import LEVEL_OPTIONS, ExportFormat, ImportContext, ImportFormat, register
from vislam2tag.datasets.model import Dataset, DatasetInfo, DatasetSource, Grouping
from vislam2tag.datasets.point_fingerprints import PointFingerprints, floor_infos, point_dataset
from vislam2tag.datasets.wide_tables import LevelRules, WideTable, is_wide, read_columns, read_matrix, read_wide
from vislam2tag.intake.extents import fingerprint_findings, fingerprint_problem, is_far
from vislam2tag.intake.level_scales import NOT_HEARD, SIGNAL_STRENGTH, LevelRange
from vislam2tag.intake.readings import NO_ADDRESS, is_address, is_masked, normal_addresses

LEVELS = "rss"
"""Role of the file of levels, the only one if file names have no group ``role``."""
FILE, FOLDER, WALK = "file", "folder", "walk"
"""Columns of every table: the file's name without suffix, its folder's name, and that of the walk (see ``files``)."""
_MOST_FILES_NAMED = 2
"""With more files than this, findings are summed over the files."""


@dataclass(frozen=True)
class SetDescription:
    """Origin of a data set and reference of its numbers."""

    format: str
    name: str = ""
    """Name of the data set; empty: the name of the file or folder."""
    title: str = ""
    description: str = ""
    licence: str | None = None
    """SPDX identifier."""
    creators: tuple[str, ...] = ()
    frame: str = "local, metres"
    clock: Literal["boot", "unix", "none"] = "unix"
    """Reference of the times, if there are any."""
    storey_m: float | None = None
    """Height of each storey, metres, for data sets that give floors as heights."""

    def dataset(self, path: Path, found: SetContent, names: pl.DataFrame = NO_NAMES) -> Dataset:
        """Make the data set from the content of ``path``; ``names`` as in :func:`point_dataset`.

        Raises DatasetError if the positions cannot be metres.
        """
        rows, odd = _in_metres(path, found.points.rows)
        floors = rows["floor"].drop_nulls().unique()
        elevations_m = {floor: round(self.storey_m * floor, 3) for floor in floors} if self.storey_m else None
        times = "time_ns" in rows.columns and rows["time_ns"].count()
        technologies = rows["technology"].unique().sort() if "technology" in rows.columns else ("wifi",)
        info = DatasetInfo(
            name=self.name or path.stem,
            title=self.title,
            description=self.description,
            licence=self.licence,
            creators=tuple(Person(name=name) for name in self.creators),
            frame=self.frame,
            clock=self.clock if times else "none",
            floors=floor_infos(rows, elevations_m),
            groupings=tuple(Grouping(technology=name, by="scan") for name in technologies),
            sources=(DatasetSource(kind=self.format, name=path.name, version=__version__, inputs=found.inputs),),
            findings=(*found.findings, *odd),
        )
        return point_dataset(info, replace(found.points, rows=rows), names)


def _in_metres(path: Path, rows: pl.DataFrame) -> tuple[pl.DataFrame, list[Finding]]:
    """The fingerprints without positions far from all others, and findings; raises DatasetError for another unit."""
    building = pl.col("building") if "building" in rows.columns else pl.lit("")
    placed = rows.select(building.fill_null("").alias("building"), pl.col("x", "y").cast(pl.Float64))
    if problem := fingerprint_problem(placed):
        raise DatasetError(f"{path}: {problem}")
    far = placed.select(is_far().fill_null(value=False)).to_series()
    kept = rows.with_columns(pl.when(~far).then(pl.col(axis)).alias(axis) for axis in ("x", "y"))
    return kept, fingerprint_findings(placed)


@dataclass(frozen=True)
class SetContent:
    """Content of the files of a data set."""

    points: PointFingerprints
    inputs: dict[str, str]
    """SHA-256 of each file."""
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class RowCheck:
    """A check for rows that are odd but usable."""

    kind: FindingKind
    role: str
    """Role of the file that the finding names."""
    odd: pl.Expr
    message: str


@dataclass(frozen=True)
class WalkFiles:
    """The files of one recording, by role."""

    folder: str
    walk: str
    files: Mapping[str, Path]


@dataclass(frozen=True)
class FingerprintTables:
    """Names of a data set's files, meaning of their columns, and the level that means "not heard"."""

    about: SetDescription
    files: re.Pattern[str]
    """Pattern of a whole file name. Files with the same group ``walk`` belong together; ``role`` is their purpose."""
    none_found: str
    """The message for a folder without such files."""
    fields: Mapping[str, pl.Expr]
    """Columns of :class:`PointFingerprints`, computed from those of the files and FILE, FOLDER and WALK."""
    columns: Mapping[str, pl.DataType] = field(default_factory=dict)
    """Columns of the file of levels other than access points."""
    access_points: re.Pattern[str] | None = None
    """Pattern of the access points' columns; None: files have no header and contain only levels."""
    access_point_name: str = "{}"
    """Format of an access point's name from its column."""
    access_points_of: str = ""
    """Group of ``files`` whose access points have the same columns, such as a building; their names begin with it."""
    needed: tuple[str, ...] = ()
    """Columns with the position of a fingerprint."""
    times: frozenset[str] = frozenset()
    """Columns of times: if a spreadsheet rounded them, they are not used, and this is reported."""
    gaps_allowed: bool = False
    """Whether the needed columns may be empty in some rows, which then have no position."""
    companions: Mapping[str, Mapping[str, pl.DataType]] = field(default_factory=dict)
    """Columns of companion files without a header, by role; a single text column is read line by line."""
    optional: tuple[str, ...] = ()
    """Roles that may be missing."""
    missing: str = ""
    """The message for a walk without a needed file, with ``{folder}``, ``{walk}`` and ``{role}``."""
    by_folder: bool = False
    """Whether walks of the same name in different folders are different walks."""
    not_heard: float = NOT_HEARD
    strength: LevelRange = SIGNAL_STRENGTH
    lone_part: bool = True
    """Whether a training or test set alone makes a split."""
    recognised_by: re.Pattern[str] | None = None
    """Pattern of ``FOLDER/NAME`` of a file of the data set (FOLDER may be the archive); None: its name is enough."""
    by_header: bool = False
    """Whether a CSV file of any name is recognised by its columns."""
    checks: tuple[RowCheck, ...] = ()

    def register(self, writes: ExportFormat | None = None) -> None:
        """Register the format, which is read by this description."""
        register(ImportFormat(self.about.format, self.read, self.recognises, takes=LEVEL_OPTIONS), writes)

    def recognises(self, path: Path) -> bool:
        """Whether the names of the files are those of the data set."""
        if self.by_header and path.is_file() and path.suffix.lower() == ".csv":
            return is_wide(path, frozenset(self.columns))
        roles = set()
        for name in names_in(path):
            known = self.recognised_by is None or self.recognised_by.fullmatch(
                f"{name.parent.name or path.name}/{name.name}"
            )
            if known and (found := self.files.fullmatch(name.name)):
                roles.add(_group(found, "role", LEVELS))
        return {LEVELS, *list(self.companions)[:1]} <= roles

    def read(self, path: Path, context: ImportContext) -> Dataset:
        """Read all files at a path; raises DatasetError if a file is missing or is not such a table."""
        return self.about.dataset(path, self.content(self.rows(path, context)))

    def rows(self, path: Path, context: ImportContext) -> SetContent:
        """Read the files with their own columns; ``points.rows`` also has FILE, FOLDER and WALK."""
        walks = list(self._walks(path, folder_of(path, context.scratch, context.most_unpacked)))
        rows, heard, first_row = [], [], 0
        findings: list[Finding] = []
        for each in walks:
            table = self._levels(each.files[LEVELS], context)
            own = self._described(each, table.rows)
            rows.append(own.with_columns(pl.col("row") + first_row))
            heard.append(table.heard.with_columns(pl.col("row") + first_row, self._names(each)))
            findings += [*table.findings, *self._odd_rows(each, own)]
            first_row += own.height
            context.progress(each.walk, len(walks))
        points = PointFingerprints(pl.concat(rows), pl.concat(heard))
        inputs = {self._input(each, file): sha256_of(file) for each in walks for file in each.files.values()}
        return SetContent(points, inputs, tuple(pooled(findings) if len(walks) > _MOST_FILES_NAMED else findings))

    def _names(self, each: WalkFiles) -> pl.Expr:
        """Names of the access points from their columns."""
        owner = self.files.fullmatch(each.files[LEVELS].name) if self.access_points_of else None
        before = f"{owner[self.access_points_of]} " if owner else ""
        return pl.format(before + self.access_point_name, "bssid").alias("bssid")

    def content(self, found: SetContent) -> SetContent:
        """Convert the files' own columns to those of :class:`PointFingerprints`."""
        rows = found.points.rows.select("row", **self.fields)
        if not self.lone_part and rows["part"].drop_nulls().n_unique() < 2:
            rows = rows.with_columns(part=pl.lit(None, pl.String))
        return SetContent(PointFingerprints(rows, found.points.heard), found.inputs, found.findings)

    def _walks(self, path: Path, folder: Path) -> Iterator[WalkFiles]:
        """Yield the files by walk; raises DatasetError if there are none, or one is missing or duplicated."""
        alone = path.is_file() and path.suffix.lower() == ".csv" and not self.companions
        if alone and (self.by_header or self.files.fullmatch(path.name)):
            yield WalkFiles(path.parent.name, path.stem.lower(), {LEVELS: path})
            return
        walks: dict[tuple[str, str], dict[str, Path]] = {}
        for file in sorted(folder.rglob("*.csv")):
            if match := self.files.fullmatch(file.name):
                name = _group(match, WALK, file.stem)
                files = walks.setdefault((file.parent.name if self.by_folder else "", name), {})
                role = _group(match, "role", LEVELS)
                if role in files:
                    raise DatasetError(
                        f"{path}: contains both {files[role].name} and {file.name}; expected one of each"
                        if files[role].name != file.name
                        else f"{path}: contains {file.name} twice; pass the folder of one data set"
                    )
                files[role] = file
        if not walks:
            raise DatasetError(f"{path}: {self.none_found}")
        needed = [role for role in (LEVELS, *self.companions) if role not in self.optional]
        for (parent, name), files in walks.items():
            if lacking := [role for role in needed if role not in files]:
                raise DatasetError(f"{path}: {self.missing.format(folder=parent, walk=name, role=lacking[0])}")
            yield WalkFiles(parent, name, files)

    def _levels(self, file: Path, context: ImportContext) -> WideTable:
        rules = LevelRules(self.not_heard, self.strength, context.not_heard, context.levels)
        names = self.access_points
        if names is None:
            return read_matrix(file, rules)

        def is_access_point(name: str) -> bool:
            return names.fullmatch(name) is not None or (self.access_point_name == "{}" and is_address(name))

        table = _with_addresses(file.name, read_wide(file, self.columns, is_access_point, rules, self.times))
        for name in self.needed:
            empty = table.rows[name].is_null()
            if empty.all() and self.gaps_allowed:
                raise DatasetError(f"{file}: no column {name} with numbers; expected {', '.join(self.needed)}")
            if empty.any() and not self.gaps_allowed:
                line = (empty.arg_max() or 0) + 2
                raise DatasetError(f"{file}: line {line} has no {name}; expected the columns {', '.join(self.columns)}")
        return table

    def _described(self, each: WalkFiles, rows: pl.DataFrame) -> pl.DataFrame:
        """Add the columns of the companion files, and the names of file, folder and walk."""
        parts = [rows]
        for role, columns in self.companions.items():
            file = each.files.get(role)
            part = _lines_or_columns(file, columns) if file else pl.DataFrame(schema=dict(columns)).clear(rows.height)
            if part.height != rows.height:
                raise DatasetError(f"{file}: {part.height} lines, expected {rows.height}: one for each line of levels")
            parts.append(part)
        place = {FILE: each.files[LEVELS].stem, FOLDER: each.folder, WALK: each.walk}
        return pl.concat(parts, how="horizontal").with_columns(**{name: pl.lit(text) for name, text in place.items()})

    def _odd_rows(self, each: WalkFiles, rows: pl.DataFrame) -> Iterator[Finding]:
        for check in self.checks:
            lines = (rows.select(check.odd.fill_null(value=False)).to_series().arg_true() + 1).to_list()
            if lines:
                yield Finding.at_lines(check.kind, each.files[check.role].name, lines, check.message, Severity.INFO)

    def _input(self, each: WalkFiles, file: Path) -> str:
        return f"{each.folder}/{file.name}" if self.by_folder else file.name


def _with_addresses(file: str, table: WideTable) -> WideTable:
    """Normalise the access points that are addresses; skip and report the columns of unknown ones."""
    masked = [name for name in table.access_points if is_masked(name)]
    heard = table.heard.filter(~pl.col("bssid").is_in(masked))
    message = f"columns of no address are skipped: {', '.join(masked)}. {NO_ADDRESS}"
    findings = finding_if(len(masked), "masked_addresses", message, file, Severity.WARNING)
    named = heard.with_columns(normal_addresses(heard["bssid"]))
    return replace(table, heard=named, findings=(*table.findings, *findings))


def _group(match: re.Match[str], name: str, otherwise: str) -> str:
    return (match.groupdict().get(name) or otherwise).lower()


def _lines_or_columns(file: Path, columns: Mapping[str, pl.DataType]) -> pl.DataFrame:
    """Read a companion file; lines without text are null."""
    if list(columns.values()) != [pl.String()]:
        return read_columns(file, columns)
    (name,) = columns
    lines = pl.Series(name, read_bytes(file).decode("utf-8", errors="replace").splitlines(), dtype=pl.String)
    return lines.str.strip_chars().replace("", None).to_frame()
