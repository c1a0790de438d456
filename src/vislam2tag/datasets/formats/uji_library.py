"""UJI's long-term library set (Mendoza-Silva et al., Data 2018, 3(1), 3): months of a folder each, four files a walk.

``MM/trnNNrss.csv`` (levels, 100: not heard), ``...crd.csv`` (x, y in metres, floor), ``...tms.csv`` (local time as
digits from year to millisecond) and ``...ids.csv``, and the same of ``tst``; no headers.
"""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path

import polars as pl

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.archives import folder_of, names_in
from vislam2tag.common.findings import Finding, pooled
from vislam2tag.datasets.folder import sha256_of
from vislam2tag.datasets.format_registry import ImportContext, ImportFormat, register
from vislam2tag.datasets.model import TEST, TRAIN, Dataset, DatasetInfo, DatasetSource, Grouping, Person
from vislam2tag.datasets.point_fingerprints import PointFingerprints, floor_infos, numbered_on, point_dataset
from vislam2tag.datasets.wide_tables import LevelRules, read_columns, read_matrix

_NAME = re.compile(r"(trn|tst)(\d\d)(rss|crd|tms|ids)\.csv", re.IGNORECASE)
_ROLES = ("rss", "crd", "tms")
_PLACE: dict[str, pl.DataType] = {"x": pl.Float64(), "y": pl.Float64(), "floor": pl.Float64()}


def recognises(path: Path) -> bool:
    """Whether there are levels and coordinates of a walk in a month's folder."""
    roles = {found[3].lower() for name in names_in(path) if (found := _NAME.fullmatch(name.name))}
    return {"rss", "crd"} <= roles


def read(path: Path, context: ImportContext) -> Dataset:
    """Read all walks; the first month's ``trn`` trains in the split that comes along, what is later tests.

    Raises DatasetError where a walk lacks a file, or its files have different lengths.
    """
    walks = _walks(path, folder_of(path, context.scratch, context.most_unpacked))
    first = min(walks)[0]
    findings: list[Finding] = []
    points = numbered_on(_walk(*key, files, first, len(walks), context, findings) for key, files in walks.items())
    inputs = {f"{key[0]}/{file.name}": sha256_of(file) for key, files in walks.items() for file in files.values()}
    info = DatasetInfo(
        name="uji-library",
        title="Long-Term Wi-Fi fingerprinting dataset for robust indoor positioning",
        description="Two floors of a university library, walked each month with one phone.",
        licence="CC-BY-4.0",
        creators=tuple(Person(name=name) for name in _CREATORS),
        frame="local, metres",
        clock="unix",
        floors=floor_infos(points.rows),
        groupings=(Grouping(technology="wifi", by="scan"),),
        sources=(DatasetSource(kind="uji-library", name=path.name, version=__version__, inputs=inputs),),
        findings=tuple(pooled(findings)),
    )
    return point_dataset(info, points)


def _walk(
    month: str,
    walk: str,
    files: dict[str, Path],
    first: str,
    walks: int,
    context: ImportContext,
    findings: list[Finding],
) -> PointFingerprints:
    table = read_matrix(files["rss"], LevelRules(said=context.not_heard))
    rows = _described(files, table.rows.height).with_columns(
        session=pl.lit(f"month_{month}.{walk}"), part=pl.lit(_part(month, walk, first), dtype=pl.String)
    )
    findings += table.findings
    context.progress(f"month {month}", walks)
    return PointFingerprints(rows, table.heard)


def _part(month: str, walk: str, first: str) -> str | None:
    """What a walk does in the split: null for the first month's own tests, which tell nothing of change."""
    if month > first:
        return TEST
    return TRAIN if walk.startswith("trn") else None


def _walks(path: Path, folder: Path) -> dict[tuple[str, str], dict[str, Path]]:
    """Files by role of each walk, by month and name."""
    found: dict[tuple[str, str], dict[str, Path]] = defaultdict(dict)
    for file in sorted(folder.rglob("*.csv")):
        if match := _NAME.fullmatch(file.name):
            found[file.parent.name, f"{match[1]}{match[2]}".lower()][match[3].lower()] = file
    if not found:
        raise DatasetError(f"{path}: holds no MM/trnNNrss.csv; expected UJI's long-term library set")
    for (month, walk), files in found.items():
        if lacking := [role for role in _ROLES if role not in files]:
            raise DatasetError(f"{path}: month {month} has no {walk}{lacking[0]}.csv; expected {', '.join(_ROLES)}")
    return dict(sorted(found.items()))


def _described(files: dict[str, Path], count: int) -> pl.DataFrame:
    """What is known of each fingerprint of a walk besides its levels."""
    places, times = read_columns(files["crd"], _PLACE), read_columns(files["tms"], {"time": pl.String()})
    for role, table in (("crd", places), ("tms", times)):
        if table.height != count:
            raise DatasetError(f"{files[role]}: has {table.height} lines, expected {count}, one a line of levels")
    time = times["time"].str.strip_chars().str.to_datetime("%Y%m%d%H%M%S%3f", time_unit="ns", strict=False)
    return places.with_columns(
        pl.col("floor").cast(pl.Int32),
        time.cast(pl.Int64).alias("time_ns"),
        time.cast(pl.Date).alias("date"),
        row=pl.int_range(pl.len(), dtype=pl.Int64),
    )


_CREATORS = (
    "Germán Martín Mendoza-Silva",
    "Philipp Richter",
    "Joaquín Torres-Sospedra",
    "Elena Simona Lohan",
    "Joaquín Huerta",
)
register(ImportFormat("uji-library", read, recognises, takes=("not_heard",)))
