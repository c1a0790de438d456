"""A data set on disk: ``dataset.json``, one Parquet file for each table, ``splits/`` and further files.

See docs/reference/datasets.md. Data sets that were made before the rules about radio readings are adapted to them when
they are opened.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path, PurePosixPath

import polars as pl
from pydantic import ValidationError

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError, OutputError, first_line
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import AnyPath, plain, read_bytes
from vislam2tag.common.files.own_files import OwnFiles
from vislam2tag.common.files.table_files import read_parquet, scan_parquet, write_parquet
from vislam2tag.common.files.whole_output import restore, whole_folder
from vislam2tag.common.findings import Finding
from vislam2tag.common.folder_kinds import PROCESS, PROGRAM, RUN, SURVEY, kind_of, survey_around, written_by
from vislam2tag.datasets.access_points import access_point_table
from vislam2tag.datasets.model import FORMAT_VERSION, Dataset, DatasetInfo, Split, SplitInfo, TableAccount
from vislam2tag.datasets.privacy import counted_without
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, IMU_WINDOWS, READINGS, REQUIRED, RTT, SCHEMAS, UNITS
from vislam2tag.intake.extents import MAX_GRID_M
from vislam2tag.intake.level_scales import LevelRange, strength_of
from vislam2tag.intake.readings import MASKED, level_findings, masked_addresses, normal_address
from vislam2tag.site.links import CURE, outside_link

FILE = f"{READINGS}.parquet"
"""File name in findings about readings that are skipped when a data set is opened."""
_DONE = "these readings are skipped; make the data set again to remove them"


def with_rules(dataset: Dataset) -> Dataset:
    """Normalise addresses; skip and report readings with an invalid address or level.

    A data set that follows the rules is returned unchanged; otherwise the table of access points is counted again.
    """
    points = dataset.access_points.select("bssid", "technology", "ssid", count=pl.col("readings").cast(pl.Int64))
    known = points.collect()
    names = {name: new for name in known["bssid"] if (new := normal_address(name)) != name or new in MASKED}
    strength = strength_of(source.kind for source in dataset.info.sources)
    counted = dataset.readings.select(all=pl.len(), odd=(~_kept(strength)).sum())
    count, odd = counted.collect(engine="streaming").row(0)
    if not names and not odd:
        return dataset
    readings = _named(dataset.readings, names)
    masked = pl.col("bssid").is_in(list(MASKED))
    kept = readings.filter(~masked, _kept(strength))
    gone = readings.filter(masked | ~_kept(strength))
    tables = {**dataset.tables, READINGS: kept, FINGERPRINTS: counted_without(dataset.fingerprints, gone)}
    if RTT in dataset.tables:
        tables[RTT] = _named(dataset.tables[RTT], names).filter(~masked)
    counts = known.with_columns(pl.col("bssid").replace(old=names))
    tables[ACCESS_POINTS] = access_point_table(tables[FINGERPRINTS], kept, counts).lazy()
    findings = (*dataset.info.findings, *_findings(gone.with_row_index("row", offset=1).collect(), count, strength))
    return replace(dataset, info=dataset.info.model_copy(update={"findings": findings}), tables=tables)


def _kept(strength: LevelRange) -> pl.Expr:
    return strength.contains(pl.col("rssi_dbm").cast(pl.Float64)).fill_null(value=True)


def _named(table: pl.LazyFrame, names: dict[str, str]) -> pl.LazyFrame:
    return table.with_columns(pl.col("bssid").replace(old=names)) if names else table


def _findings(gone: pl.DataFrame, count: int, strength: LevelRange) -> list[Finding]:
    masked = gone.filter(pl.col("bssid").is_in(list(MASKED)))
    found = level_findings(gone.filter(~pl.col("bssid").is_in(list(MASKED))), FILE, _DONE, strength, count)
    if masked.height:
        found.append(masked_addresses(FILE, masked["row"].to_list(), masked["bssid"].unique().to_list()))
    return [each.model_copy(update={"lines": ()}) for each in found]


MANIFEST = "dataset.json"
SPLITS = "splits"
RUN_DATASET = "dataset"
"""Folder of the data set in the output of ``run``."""
_ROWS_A_GROUP = 16_384
"""A few walks' readings, so that reading one walk reads little more."""
_WINDOWS_A_GROUP = 2_000
"""Rows of ``imu_windows`` contain thousands of numbers each, so groups are smaller."""
_BYTES_AT_ONCE = 1 << 20


def is_dataset(folder: Path) -> bool:
    """Whether the folder contains a data set."""
    return (folder / MANIFEST).is_file()


def dataset_in(folder: Path) -> Path:
    """The folder of a data set: the given one, or the data set in the output of `vislam2tag run`."""
    inner = folder / RUN_DATASET
    return inner if not is_dataset(folder) and is_dataset(inner) else folder


def open_dataset(folder: AnyPath) -> Dataset:
    """Open a data set's folder, or that in the output of `vislam2tag run`. The tables are lazy Polars frames.

    Raises DatasetError if the folder is not a data set, is incomplete, or was made by a later version.
    """
    folder = dataset_in(Path(folder))
    restore(folder)
    info = _manifest(folder)
    tables = {name: _table(folder, name, account) for name, account in info.tables.items()}
    missing = [name for name in REQUIRED if name not in tables]
    if missing:
        raise DatasetError(f"{folder / MANIFEST}: the table {', '.join(missing)} is missing; make the data set again")
    for floor in info.floors:
        if floor.plan and (PurePosixPath(floor.plan).is_absolute() or ".." in PurePosixPath(floor.plan).parts):
            raise DatasetError(f"{folder / MANIFEST}: the plan {floor.plan} is outside the data set")
    plans = {floor.plan: folder / floor.plan for floor in info.floors if floor.plan and (folder / floor.plan).is_file()}
    splits = {name: _split(folder, name, account) for name, account in info.splits.items()}
    return with_rules(Dataset(info, tables, splits, plans))


def open_dataset_to_share(folder: AnyPath, *, follow_links: bool = False) -> Dataset:
    """Open a data set in order to share its files; raises as :func:`open_dataset`.

    Also raises DatasetError if one of its files is a link out of the folder, unless ``follow_links`` is given.
    """
    folder = dataset_in(Path(folder))
    dataset = open_dataset(folder)
    files = [MANIFEST, *(f"{name}.parquet" for name in dataset.tables), *dataset.files]
    files += [f"{SPLITS}/{name}.{kind}" for name in dataset.splits for kind in ("json", "parquet")]
    links = [] if follow_links else sorted({link for name in files if (link := outside_link(folder, folder / name))})
    if links:
        raise DatasetError(f"{folder}: these links point to files outside the data set: {', '.join(links)}; {CURE}")
    return dataset


def write_dataset(dataset: Dataset, target: AnyPath) -> Dataset:
    """Write a data set, replacing an existing one; return it as opened from disk."""
    target = Path(target)
    with dataset_folder(target) as folder:
        folder.add(dataset)
        folder.finish(dataset.info)
    return open_dataset(target)


@contextmanager
def dataset_folder(target: Path, command: str = "", replace: bool = False) -> Iterator[FolderWriter]:
    """Open a new data set folder for writing; it appears at ``target`` when the block ends without an error.

    ``command`` is recorded in the manifest as the maker. Raises OutputError if ``target`` contains something else, or
    the output of another command without ``replace``, and if nothing can be written.
    """
    restore(target)
    maker = written_by(target)
    if command and maker not in (None, f"{PROGRAM} {command}"):
        refuse_unless_replaced(target, maker, replace)
    with whole_folder(target, lambda folder: is_dataset(folder) or (replace and written_by(folder) is not None)) as new:
        yield FolderWriter(new, command)


def refuse_unless_replaced(folder: Path, maker: str | None, replace: bool) -> None:
    """Raise OutputError for the output of another command without ``--replace``, or for a folder with a survey."""
    if not replace:
        raise OutputError(
            f"{folder}: contains the output of `{maker}`; pass --replace to replace the whole folder, or choose "
            "another --out"
        )
    if any(folder.glob("floor_*/")):
        raise OutputError(
            f"{folder}: contains the floor folders of a survey, which are never replaced; choose another --out"
        )


@dataclass(frozen=True)
class FolderWriter:
    """Writes the parts of a data set; :meth:`finish` must be called last and writes the manifest."""

    out: Folder
    command: str = ""
    """The command that the manifest names as the maker; empty: unchanged."""

    @property
    def root(self) -> Path:
        """Path of the folder, for reading."""
        return self.out.path

    def add(self, dataset: Dataset) -> None:
        """Write everything except the manifest."""
        self.add_tables(dataset.tables)
        self.add_splits(dataset.splits)
        self.add_files(dataset.files)

    def add_tables(self, tables: Mapping[str, pl.LazyFrame]) -> None:
        """Stream each table to its Parquet file; rows keep their order."""
        for name, table in tables.items():
            write_parquet(
                table,
                self.out,
                f"{name}.parquet",
                compression="zstd",
                row_group_size=_WINDOWS_A_GROUP if name == IMU_WINDOWS else _ROWS_A_GROUP,
                metadata={"vislam2tag": _table_metadata(name)},
            )

    def add_splits(self, splits: Mapping[str, Split]) -> None:
        """Write each split as ``splits/NAME.parquet`` (id, group) and ``splits/NAME.json`` (parameters and folds)."""
        for name, split in splits.items():
            table, description = split_files(name)
            write_parquet(split.groups, self.out, table, compression="zstd")
            self.out.write(description, _json(split.info))

    def add_files(self, files: Mapping[str, AnyPath]) -> None:
        """Copy further files to their paths in the folder."""
        for relative, source in files.items():
            self.out.copy(Path(source), relative)

    def finish(self, info: DatasetInfo) -> DatasetInfo:
        """Write the manifest with each file's rows, size and checksum, and return it."""
        tables = {
            name: self._account(f"{name}.parquet") for name in SCHEMAS if (self.root / f"{name}.parquet").is_file()
        }
        splits = {
            path.stem: self._account(f"{SPLITS}/{path.name}") for path in sorted((self.root / SPLITS).glob("*.parquet"))
        }
        maker = self.command or info.made_by
        whole = info.model_copy(update={"tables": tables, "splits": splits, "made_by": maker})
        self.out.write(MANIFEST, _json(whole))
        return whole

    def list_split(self, info: DatasetInfo, name: str) -> DatasetInfo:
        """Add a split, whose files exist, to the manifest; write and return it."""
        splits = {**info.splits, name: self._account(split_files(name)[0])}
        whole = info.model_copy(update={"splits": dict(sorted(splits.items()))})
        self.out.write(MANIFEST, _json(whole))
        return whole

    def opened(self, info: DatasetInfo) -> Dataset:
        """Open what has been written so far, for figures and cards."""
        self.finish(info)
        return open_dataset(self.root)

    def _account(self, relative: str) -> TableAccount:
        path = self.root / relative
        rows = int(scan_parquet(path).select(pl.len()).collect().item())
        return TableAccount(file=relative, rows=rows, size_bytes=path.stat().st_size, sha256=_kept_sha256(path))


def split_files(name: str) -> tuple[str, str]:
    """Paths of a split's table and its description in a data set's folder."""
    return f"{SPLITS}/{name}.parquet", f"{SPLITS}/{name}.json"


def listed_files(folder: Path) -> list[str]:
    """Paths of the files below a folder that belong in a list of its content, sorted.

    Hidden files are excluded and, if the folder records its own files, those that the user added.
    """
    own = OwnFiles.read(folder)
    found = (path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    names = sorted(path.as_posix() for path in found if not any(part.startswith(".") for part in path.parts))
    return [name for name in names if own is None or own.owns(name)]


def sha256_of(path: Path) -> str:
    """SHA-256 of a file, read piece by piece."""
    digest = hashlib.sha256()
    with plain(path).open("rb") as file:
        while piece := file.read(_BYTES_AT_ONCE):
            digest.update(piece)
    return digest.hexdigest()


def _kept_sha256(path: Path) -> str:
    """SHA-256 of a file, cached until the file changes, because a command opens a data set several times."""
    known = plain(path).stat()
    return _sha256_at(path.absolute(), known.st_size, known.st_mtime_ns)


@cache
def _sha256_at(path: Path, size_bytes: int, changed_ns: int) -> str:
    del size_bytes, changed_ns
    return sha256_of(path)


def _refuse_altered(path: Path, account: TableAccount) -> None:
    """Raise DatasetError if a file differs from the manifest, and OSError if it cannot be read."""
    if _kept_sha256(path) != account.sha256:
        raise DatasetError(
            f"{path}: the file is damaged, or was changed after the data set was made (its SHA-256 differs from "
            f"{MANIFEST}); copy it again, or make the data set again"
        )


def _json(model: DatasetInfo | SplitInfo) -> str:
    return model.model_dump_json(indent=1) + "\n"


def _table_metadata(name: str) -> str:
    units = {column: UNITS[column] for column in SCHEMAS[name] if column in UNITS}
    return json.dumps(
        {"frame": "BCS of the floor", "units": units, "stage": f"{name} of a data set", "version": __version__},
        sort_keys=True,
    )


def _instead(folder: Path) -> str:
    """What to do with a folder that is not a data set."""
    kind = kind_of(folder)
    if kind == SURVEY or written_by(folder) in (PROCESS, RUN):
        return f"it is {kind}, so first run `vislam2tag dataset {folder} --out fingerprints`, and pass fingerprints"
    if survey := survey_around(folder):
        return f"it is {kind}: run `vislam2tag dataset {survey} --out fingerprints`, and pass fingerprints"
    said = f"it is {kind}; " if kind else ""
    return f"{said}pass a folder that `vislam2tag run`, `vislam2tag dataset` or `vislam2tag import` wrote"


def _manifest(folder: Path) -> DatasetInfo:
    path = folder / MANIFEST
    try:
        text = read_bytes(path)
    except OSError as error:
        raise DatasetError(
            f"{folder}: not a data set ({MANIFEST} cannot be read: {error.strerror}); {_instead(folder)}"
        ) from error
    try:
        version = int(json.loads(text)["format_version"])
        if version > FORMAT_VERSION:
            raise DatasetError(
                f"{path}: the data set has format version {version}, but this program reads up to {FORMAT_VERSION}; "
                "update vislam2tag"
            )
        return DatasetInfo.model_validate_json(text)
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError, ValidationError) as error:
        raise DatasetError(f"{path}: the file is damaged ({first_line(error)}); make the data set again") from error


def _table(folder: Path, name: str, account: TableAccount) -> pl.LazyFrame:
    path = folder / f"{name}.parquet"
    expected = SCHEMAS.get(name)
    if expected is None:
        raise DatasetError(f"{folder / MANIFEST}: unknown table {name}; update vislam2tag")
    try:
        _refuse_altered(path, account)
        table = scan_parquet(path)
        found = table.collect_schema()
    except (OSError, pl.exceptions.PolarsError) as error:
        raise DatasetError(f"{path}: cannot be read ({first_line(error)}); make the data set again") from error
    wrong = [column for column, kind in expected.items() if found.get(column) != kind]
    if wrong:
        raise DatasetError(f"{path}: column {wrong[0]} is missing or not {expected[wrong[0]]}; make the data set again")
    if name in (FINGERPRINTS, READINGS):
        _refuse_far_places(path, table)
    return table


def _refuse_far_places(path: Path, table: pl.LazyFrame) -> None:
    """Raise DatasetError if a position is not on Earth, because counting by cells would never end."""
    places = pl.col("x", "y")
    try:
        far = table.select(pl.any_horizontal((~places.is_between(-MAX_GRID_M, MAX_GRID_M)).any())).collect().item()
    except (OSError, pl.exceptions.PolarsError) as error:
        raise DatasetError(f"{path}: cannot be read ({first_line(error)}); make the data set again") from error
    if far:
        raise DatasetError(
            f"{path}: contains positions beyond {MAX_GRID_M:g} m, or that are not finite; correct the source files"
        )


def _split(folder: Path, name: str, account: TableAccount) -> Split:
    path = folder / SPLITS / f"{name}.json"
    try:
        _refuse_altered(path.with_suffix(".parquet"), account)
        info = SplitInfo.model_validate_json(read_bytes(path))
        groups = read_parquet(path.with_suffix(".parquet"))
    except (OSError, ValidationError, pl.exceptions.PolarsError) as error:
        raise DatasetError(f"{path}: cannot be read ({first_line(error)}); make the split again") from error
    return Split(info, groups)
