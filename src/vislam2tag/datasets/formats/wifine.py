"""WiFine (Khassanov et al. 2021): trajectories of scans, a CSV each, in the folders ``train``, ``val`` and ``test``.

Columns of levels (-100: not heard) named by numbers from 0, then ``num_visible_APs``, ``timestamp`` in seconds since
the walk's start, ``x``, ``y``, ``z`` in metres and ``floorID``.
"""

from __future__ import annotations

import re
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
from vislam2tag.datasets.wide_tables import LevelRules, read_wide

NOT_HEARD = -100.0
_NAME = re.compile(r"(train|val|test)_[0-9a-z_]+\.csv", re.IGNORECASE)
_COLUMNS: dict[str, pl.DataType] = {
    "num_visible_APs": pl.Float64(),
    **dict.fromkeys(("timestamp", "x", "y", "z", "floorID"), pl.Float64()),
}


def recognises(path: Path) -> bool:
    """Whether there is a trajectory in a folder of its part's name."""
    return any((found := _NAME.fullmatch(name.name)) and name.parent.name == found[1] for name in names_in(path))


def read(path: Path, context: ImportContext) -> Dataset:
    """Read all trajectories; a session is one of them. Raises DatasetError where a file is no such table."""
    folder = folder_of(path, context.scratch, context.most_unpacked)
    files = sorted(file for file in folder.rglob("*.csv") if _NAME.fullmatch(file.name))
    if not files:
        raise DatasetError(f"{path}: holds no train/train_*.csv, val/val_*.csv or test/test_*.csv of WiFine")
    parts = {file: TRAIN if file.name.lower().startswith("train") else TEST for file in files}
    split = len(set(parts.values())) > 1
    findings: list[Finding] = []
    points = numbered_on(
        _walk(file, part if split else None, len(files), context, findings) for file, part in parts.items()
    )
    inputs = {file.name: sha256_of(file) for file in files}
    info = DatasetInfo(
        name="wifine",
        title="WiFine: finer-level sequential WiFi-based indoor localization",
        description="One university building, three floors, walked with one phone.",
        licence="MIT",
        creators=tuple(Person(name=name) for name in _CREATORS),
        frame="local, metres",
        clock="boot",
        floors=floor_infos(points.rows),
        groupings=(Grouping(technology="wifi", by="scan"),),
        sources=(DatasetSource(kind="wifine", name=path.name, version=__version__, inputs=inputs),),
        findings=tuple(pooled(findings)),
    )
    return point_dataset(info, points)


def _walk(
    file: Path, part: str | None, files: int, context: ImportContext, findings: list[Finding]
) -> PointFingerprints:
    table = read_wide(file, _COLUMNS, str.isdecimal, LevelRules(NOT_HEARD, said=context.not_heard))
    if table.rows.select("x", "y", "floorID").null_count().sum_horizontal()[0]:
        raise DatasetError(f"{file}: a line has no x, y or floorID; expected the columns {', '.join(_COLUMNS)}")
    rows = table.rows.select(
        "row",
        "x",
        "y",
        "z",
        floor=pl.col("floorID").cast(pl.Int32),
        session=pl.lit(file.stem),
        time_ns=(pl.col("timestamp") * 1e9).round().cast(pl.Int64),
        part=pl.lit(part, dtype=pl.String),
    )
    heard = table.heard.with_columns(bssid=pl.format("ap{}", pl.col("bssid")))
    findings += table.findings
    context.progress(file.name, files)
    return PointFingerprints(rows, heard)


_CREATORS = (
    "Yerbolat Khassanov",
    "Mukhamet Nurpeiissov",
    "Azamat Sarkytbayev",
    "Askat Kuzdeuov",
    "Huseyin Atakan Varol",
)
register(ImportFormat("wifine", read, recognises, takes=("not_heard",)))
