"""UTSIndoorLoc (Song et al., CNNLoc, IEEE Access 2019): ``UTS_training.csv`` and ``UTS_test.csv``, a row a fingerprint.

589 columns of levels (100: not heard), then ``Pos_x``, ``Pos_y`` in metres and ``Floor_ID``; the published files have
further columns, of which building, user and phone are taken.
"""

from __future__ import annotations

import re
from pathlib import Path

import polars as pl

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.archives import folder_of, names_in
from vislam2tag.common.findings import Finding
from vislam2tag.datasets.folder import sha256_of
from vislam2tag.datasets.format_registry import ImportContext, ImportFormat, register
from vislam2tag.datasets.model import TEST, TRAIN, Dataset, DatasetInfo, DatasetSource, Grouping
from vislam2tag.datasets.point_fingerprints import PointFingerprints, floor_infos, point_dataset
from vislam2tag.datasets.wide_tables import LevelRules, WideTable, read_wide

_FILES = {"uts_training.csv": TRAIN, "uts_test.csv": TEST}
_ACCESS_POINT = re.compile(r"W?AP[_ ]?\d+", re.IGNORECASE)
_PLACE = ("Pos_x", "Pos_y", "Floor_ID")
_COLUMNS: dict[str, pl.DataType] = {
    **dict.fromkeys(_PLACE, pl.Float64()),
    "Building_ID": pl.String(),
    "User_ID": pl.String(),
    "Phone_type": pl.String(),
}


def recognises(path: Path) -> bool:
    """Whether one of the two files is there."""
    return any(name.name.lower() in _FILES for name in names_in(path))


def read(path: Path, context: ImportContext) -> Dataset:
    """Read both files, or the one given; which rows belong together is not known: each file is one session."""
    files = _files(path, folder_of(path, context.scratch, context.most_unpacked))
    rows, heard = [], []
    findings: list[Finding] = []
    first_row = 0
    for file in files:
        rules = LevelRules(said=context.not_heard)
        table = read_wide(file, _COLUMNS, lambda name: _ACCESS_POINT.fullmatch(name) is not None, rules)
        rows.append(_described(file, table).with_columns(pl.col("row") + first_row))
        heard.append(table.heard.with_columns(pl.col("row") + first_row))
        findings += table.findings
        first_row += table.rows.height
        context.progress(file.name, len(files))
    points = PointFingerprints(pl.concat(rows), pl.concat(heard))
    inputs = {file.name: sha256_of(file) for file in files}
    info = DatasetInfo(
        name="uts",
        title="UTSIndoorLoc",
        description="One university building of several floors.",
        frame="local, metres",
        clock="none",
        floors=floor_infos(points.rows),
        groupings=(Grouping(technology="wifi", by="scan"),),
        sources=(DatasetSource(kind="uts", name=path.name, version=__version__, inputs=inputs),),
        findings=tuple(findings),
    )
    return point_dataset(info, points)


def _files(path: Path, folder: Path) -> list[Path]:
    """The files to read, in order of their names; raises DatasetError where one is there twice, or none."""
    if path.is_file() and path.name.lower() in _FILES:
        return [path]
    found = sorted(file for file in folder.rglob("*.csv") if file.name.lower() in _FILES)
    if not found:
        raise DatasetError(f"{path}: holds no UTS_training.csv or UTS_test.csv; expected UTSIndoorLoc's files")
    if len({file.name.lower() for file in found}) < len(found):
        raise DatasetError(f"{path}: holds {found[0].name} or another of the files twice; give the folder of one set")
    return found


def _described(file: Path, table: WideTable) -> pl.DataFrame:
    lacking = [name for name in _PLACE if table.rows[name].null_count() == table.rows.height]
    if lacking:
        raise DatasetError(f"{file}: has no column {lacking[0]} with numbers; expected {', '.join(_PLACE)}")
    return table.rows.select(
        "row",
        pl.col("Building_ID").alias("building"),
        pl.col("Floor_ID").cast(pl.Int32, strict=False).alias("floor"),
        pl.col("Pos_x").alias("x"),
        pl.col("Pos_y").alias("y"),
        pl.col("Phone_type").alias("device"),
        pl.col("User_ID").alias("user"),
        session=pl.lit(file.stem),
        part=pl.lit(_FILES[file.name.lower()]),
    )


register(ImportFormat("uts", read, recognises, takes=("not_heard",)))
