"""The Tampere quartet (Lohan et al., Data 2017, 2(4), 32): levels, coordinates, device and date, a row a fingerprint.

``Training_rss_*.csv``, ``..._coordinates_*.csv``, ``..._device_*.csv``, ``..._date_*.csv`` and the same of ``Test_``,
without headers. x, y, z in metres in a local frame; floors lie 3.7 m apart.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import polars as pl

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.archives import folder_of, names_in
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.datasets.folder import sha256_of
from vislam2tag.datasets.format_registry import ImportContext, ImportFormat, register
from vislam2tag.datasets.model import TEST, TRAIN, Dataset, DatasetInfo, DatasetSource, Grouping, Person
from vislam2tag.datasets.point_fingerprints import PointFingerprints, floor_infos, point_dataset
from vislam2tag.datasets.wide_tables import LevelRules, read_columns, read_matrix

FLOOR_HEIGHT_M = 3.7
_OFF_FLOOR_M = 0.05
"""A height farther than this from every floor is a finding; it goes to the nearest."""
_NAME = re.compile(r"^(Training|Test)_(rss|coordinates|device|date)(_.*)?\.csv$", re.IGNORECASE)
_PARTS = {"training": TRAIN, "test": TEST}
_ROLES = ("rss", "coordinates", "device", "date")


def recognises(path: Path) -> bool:
    """Whether there is a training set's levels and coordinates."""
    roles = {(found[1].lower(), found[2].lower()) for name in names_in(path) if (found := _NAME.match(name.name))}
    return {("training", "rss"), ("training", "coordinates")} <= roles


_CREATORS = (
    "Elena Simona Lohan",
    "Joaquín Torres-Sospedra",
    "Helena Leppäkoski",
    "Philipp Richter",
    "Zhe Peng",
    "Joaquín Huerta",
)


def read(path: Path, context: ImportContext) -> Dataset:
    """Read the eight files, or the four of one part."""
    files = _files(path, folder_of(path, context.scratch, context.most_unpacked))
    parts = sorted({part for part, _ in files})
    rows, heard = [], []
    findings: list[Finding] = []
    first_row = 0
    for part in parts:
        table = read_matrix(files[part, "rss"], LevelRules(said=context.not_heard))
        described, odd = _described(part, files, table.rows["row"].len())
        rows.append(described.with_columns(pl.col("row") + first_row))
        heard.append(table.heard.with_columns(pl.col("row") + first_row))
        findings += [*table.findings, *odd]
        first_row += described.height
        context.progress(part, len(parts))
    points = PointFingerprints(pl.concat(rows), pl.concat(heard))
    elevations_m = {floor: round(FLOOR_HEIGHT_M * floor, 3) for floor in points.rows["floor"].drop_nulls().unique()}
    inputs = {file.name: sha256_of(file) for _, file in sorted(files.items())}
    info = DatasetInfo(
        name="tampere",
        title="Wi-Fi Crowdsourced Fingerprinting Dataset for Indoor Positioning (Tampere)",
        description="One university building, crowdsourced; times are the phones' local time.",
        licence="CC-BY-4.0",
        creators=tuple(Person(name=name) for name in _CREATORS),
        frame="local, metres",
        clock="unix",
        floors=floor_infos(points.rows, elevations_m),
        groupings=(Grouping(technology="wifi", by="scan"),),
        sources=(DatasetSource(kind="tampere", name=path.name, version=__version__, inputs=inputs),),
        findings=tuple(findings),
    )
    return point_dataset(info, points)


def _files(path: Path, folder: Path) -> dict[tuple[str, str], Path]:
    """The files by part and role; raises DatasetError where one of a quartet lacks or there are two."""
    found: dict[tuple[str, str], Path] = {}
    for file in sorted(folder.rglob("*.csv")):
        if match := _NAME.match(file.name):
            key = (_PARTS[match[1].lower()], match[2].lower())
            if key in found:
                raise DatasetError(f"{path}: holds both {found[key].name} and {file.name}; expected one of each")
            found[key] = file
    for part in {part for part, _ in found}:
        lacking = [role for role in ("rss", "coordinates") if (part, role) not in found]
        if lacking:
            raise DatasetError(f"{path}: has no {part} {lacking[0]}.csv; expected {', '.join(_ROLES)} of each part")
    if not found:
        raise DatasetError(f"{path}: holds no Training_rss_*.csv or Test_rss_*.csv; expected the Tampere quartet")
    return found


def _described(part: str, files: Mapping[tuple[str, str], Path], count: int) -> tuple[pl.DataFrame, list[Finding]]:
    """What is known of each fingerprint of a part besides its levels."""
    file = files[part, "coordinates"]
    places = read_columns(file, {"x": pl.Float64(), "y": pl.Float64(), "z": pl.Float64()})
    _refuse_other_count(file, places.height, count)
    storey = places["z"] / FLOOR_HEIGHT_M
    floor = storey.round().cast(pl.Int32, strict=False)
    device, lines = _texts(files.get((part, "device")), count), _texts(files.get((part, "date")), count)
    time = lines.str.to_datetime("%Y-%m-%d %H:%M:%S", time_unit="ns", strict=False)
    rows = places.with_columns(
        floor.alias("floor"),
        device.alias("device"),
        time.cast(pl.Int64).alias("time_ns"),
        time.cast(pl.Date).alias("date"),
        pl.lit(part).alias("part"),
        row=pl.int_range(pl.len(), dtype=pl.Int64),
    ).with_columns(session=pl.concat_str("device", "date", separator=" ", ignore_nulls=True))
    off = ((storey - floor) * FLOOR_HEIGHT_M).abs() > _OFF_FLOOR_M
    undated = time.is_null() & lines.is_not_null()
    findings = []
    odd: tuple[tuple[FindingKind, pl.Series, str, str], ...] = (
        (
            "height_off_floor",
            off,
            file.name,
            "heights are no multiple of 3.7 m; the nearest floor counts",
        ),
        ("unreadable_dates", undated, f"{part} dates", "dates are not like 2017-08-18 11:59:23; they are left out"),
    )
    for kind, mask, name, message in odd:
        if mask.any():
            findings.append(Finding.at_lines(kind, name, [i + 1 for i in mask.arg_true()], message, Severity.INFO))
    return rows, findings


def _texts(file: Path | None, count: int) -> pl.Series:
    """The lines of a one-column file; nulls where there is no file or nothing on a line."""
    if file is None:
        return pl.Series([None] * count, dtype=pl.String)
    lines = pl.Series(read_bytes(file).decode("utf-8", errors="replace").splitlines(), dtype=pl.String)
    _refuse_other_count(file, lines.len(), count)
    stripped = lines.str.strip_chars()
    return stripped.set(stripped == "", None)


def _refuse_other_count(file: Path, found: int, expected: int) -> None:
    if found != expected:
        raise DatasetError(f"{file}: has {found} lines, expected {expected}, one for each line of levels")


register(ImportFormat("tampere", read, recognises, takes=("not_heard",)))
