"""Commands between our data sets and the formats of others: ``import`` and ``export``."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import (
    ALL_CORES,
    AsJson,
    Description,
    FollowLinks,
    Jobs,
    PrivacyOptions,
    Replace,
    format_help,
)
from vislam2tag.cli.progress import interrupted_with, outputs_of_interrupted, session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.tables import print_warnings
from vislam2tag.cli.terminal import answer, say
from vislam2tag.common.errors import UsageError
from vislam2tag.common.findings import Severity

if TYPE_CHECKING:
    from vislam2tag.datasets.model import FloorInfo


_NAMES_SHOWN = 12
_NOTHING_USABLE = "no reading of these files can be used: correct what the findings name and import again"


def degrees_of(text: str, option_name: str) -> tuple[float, float]:
    """Read latitude and longitude from ``49.46,11.02``; raises UsageError for anything else."""
    try:
        latitude, longitude = (float(part) for part in text.split(","))
    except ValueError as error:
        raise UsageError(
            f"{option_name} {text}: give latitude and longitude in degrees, such as 49.4609,11.0252"
        ) from error
    if not (abs(latitude) <= 90 and abs(longitude) <= 180):
        raise UsageError(f"{option_name} {text}: latitudes reach from -90 to 90, longitudes from -180 to 180 degrees")
    return latitude, longitude


@dataclass(frozen=True, kw_only=True)
class ImportArguments:
    """Arguments and options of ``vislam2tag import``."""

    path: Path = argument("File, folder or archive (.zip, .tar.xz, ...) of another format.")
    out: Path = option(..., "Folder for the data set: new, empty or an earlier data set.")
    format_name: str | None = option(None, format_help("; else found by content"), "--format")
    name: str | None = option(None, "Name of the data set; else the format's own.")
    origin: tuple[float, float] | None = option(
        None,
        "Where metres count from (degrees), for logs with geographic positions; else their south-west corner.",
        metavar="LAT,LON",
        parse=degrees_of,
    )
    not_heard: float | None = option(
        None,
        "Level that stands for 'not heard' in tables with a column for each access point; else the format's.",
        metavar="LEVEL",
    )
    describe: Description = None
    max_unpacked_gb: float = option(
        20.0, "Most that an archive may unpack to, gigabytes (10^9 bytes).", least=0.0, most=1e6, hidden=True
    )
    hiding: PrivacyOptions
    replace: Replace = False
    follow_links: FollowLinks = False
    json: AsJson = False


@command
def import_command(given: ImportArguments) -> None:
    """Import a data set that others published, or logs of other programs, into ours.

    \b
    Formats, recognised by names and first lines unless --format says which:
      comford        COMFORD: folder or archive with Samples.csv, RSSI.csv and
                     APs.csv
      getsensordata  GetSensorData logs (IPIN competitions): a .txt log, or a
                     folder or archive of them; Wi-Fi and BLE between POSI marks,
                     in metres east and north of --origin
      gia            giaIndoorLoc's labelled layout: folder or archive with
                     floor_K/DEVICE/SESSION/wifi_annotated.csv; its Wi-Fi and,
                     where sensors_annotated.csv is beside, magnetic field
      ilc20          Indoor Location Competition 2.0: folder or archive with
                     SITE/FLOOR/path_data_files/*.txt, floor_info.json and
                     floor_image.png; Wi-Fi and BLE between waypoints
      parquet        the plain Parquet tables that export wrote (folder, archive)
      tampere        Tampere University's quartet (Lohan et al. 2017): folder or
                     archive with Training_rss_DATE.csv,
                     Training_coordinates_DATE.csv, Training_device_DATE.csv,
                     Training_date_DATE.csv and the same of Test_; their split
      uji            UJIIndoorLoc: folder, archive or one of trainingData.csv,
                     validationData.csv; with their split, and the names that
                     export wrote beside them
      uji-library    UJI's long-term library set (Mendoza-Silva et al. 2018):
                     folder or archive with MM/trnNNrss.csv, ...crd.csv,
                     ...tms.csv and the same of tst; their split
      uts            UTSIndoorLoc: folder or archive with UTS_training.csv and
                     UTS_test.csv, or one of them; with their split
      wifine         WiFine (Khassanov et al. 2021): folder or archive with
                     train/train_*.csv, val/val_*.csv, test/test_*.csv; with
                     their split

    All readings, positions, floors, devices and the split that comes with the data are taken; what is not is in
    docs/reference/importing.md. The data set gets the standard splits, statistics and card as one that `dataset` makes.

    Exit code: 0 all right (what was odd is printed and in the manifest), 1 a part of the files had to be left out, no
    reading can be used, or no fingerprint has a position, 2 wrong usage, files that are not of the format, or DS cannot
    be written, 130 interrupted.

    \b
    Examples:
      vislam2tag import tampere-2017-08-21.tar.xz --out tampere
      vislam2tag import indoor-location-competition-20/data --format ilc20 \\
          --out malls
      vislam2tag import ipin2023/training --origin 49.4609,11.0252 --out ipin \\
          --json
    """
    from vislam2tag.datasets.description import read_description

    options = api.ImportOptions(
        given.format_name,
        given.name,
        given.origin,
        given.hiding.privacy,
        None if given.describe is None else read_description(given.describe),
        given.replace,
        _bytes(given.max_unpacked_gb),
        given.follow_links,
        given.not_heard,
    )
    with interrupted_with(f"no data set was written to {given.out}"), session_bar("files") as bar:
        dataset = api.import_format(given.path, given.out, options, progress=bar.count)
    odd = any(finding.severity is Severity.ERROR for finding in dataset.info.findings)
    if given.json and not dataset.measured:
        say(_NOTHING_USABLE, err=True)
    failed = odd or not dataset.measured or not dataset.labelled
    answer(dataset.info, given.json, lambda: _print_import(dataset, given.out), failed=failed)


def _print_import(dataset: api.Dataset, out: Path) -> None:
    from vislam2tag.pipeline.datasets.finish import PAGE_FILE

    say("\n".join(_summary(dataset, out)))
    if dataset.measured:
        next_step("import" if dataset.labelled else "no position", dataset=out, page=out / PAGE_FILE)
    else:
        say(_NOTHING_USABLE, err=True)


def _bytes(gigabytes: float) -> int:
    if not gigabytes < math.inf:
        raise UsageError("--max-unpacked-gb: give a number of gigabytes, such as 20")
    return round(gigabytes * 1e9)


def _summary(dataset: api.Dataset, out: Path) -> list[str]:
    import polars as pl

    info = dataset.info
    counted = dataset.fingerprints.group_by("technology").agg(all=pl.len(), labelled=pl.col("x").count())
    kinds = counted.sort("technology").collect(engine="streaming").rows()
    devices = dataset.fingerprints.select(pl.col("device").drop_nulls().unique().sort()).collect()["device"].to_list()
    floors = [floor_words(floor) for floor in info.floors]
    rows = {name: account.rows for name, account in info.tables.items()}
    return [
        f"{out}: {info.sources[0].kind}, {info.title or info.name}",
        *(f"fingerprints ({kind}): {count}, with a position {labelled}" for kind, count, labelled in kinds),
        *(f"{name.replace('_', ' ')}: {count}" for name, count in rows.items() if name != "fingerprints"),
        f"floors: {_listed(floors)}",
        f"devices: {_listed(devices)}",
        f"splits: {_listed(list(info.splits))}",
        *(
            f"{finding.kind} {finding.count}: {_place(finding.file, finding.lines)}{finding.message}"
            for finding in info.findings
        ),
    ]


def floor_words(floor: FloorInfo) -> str:
    """Tell a floor by building, name and number, each once."""
    own = floor.name if str(floor.number) in floor.name.split() else f"{floor.name} ({floor.number})"
    return " ".join(filter(None, (floor.building, own if floor.name else str(floor.number))))


def _listed(names: list[str]) -> str:
    shown = ", ".join(names[:_NAMES_SHOWN]) + (", ..." if len(names) > _NAMES_SHOWN else "")
    return f"{len(names)} ({shown})" if names else "none known"


def _place(file: str, lines: tuple[int, ...]) -> str:
    where = f"{file}:{','.join(map(str, lines))}" if lines else file
    return f"{where}: " if where else ""


@dataclass(frozen=True, kw_only=True)
class ExportArguments:
    """Arguments and options of ``vislam2tag export``."""

    source: Path = argument("Data set, or output folder of process.")
    format_name: str = option(..., format_help(), "--format")
    out: Path = option(..., "Folder to write: new, empty or from an earlier export.")
    split: str | None = option(
        None, "Split whose parts become training and test files (uji, comford); else the official one."
    )
    fold: str | None = option(None, "Fold of the split, where it has several.")
    survey: Path | None = option(None, "The survey that labels were made of: raw files go beside (gia), plans (mcap).")
    hiding: PrivacyOptions
    keep_formulas: bool = option(
        False,
        "Leave names that begin with =, +, - or @ as they are in uji's tables of names; else an apostrophe "
        "goes before them, which import takes off, so that no spreadsheet computes them.",
        hidden=True,
    )
    follow_links: FollowLinks = False
    json: AsJson = False
    jobs: Jobs = ALL_CORES


@command
def export_command(given: ExportArguments) -> None:
    """Export a data set, or what `process` wrote, in a format that others read.

    \b
    Formats:
      comford   COMFORD's intermediate/Samples.csv, RSSI.csv and APs.csv, which
                the package comford loads
      geojson   fingerprints.geojson: a point a fingerprint, in WGS84 where the
                floors have a georeference, else in metres
      gia       giaIndoorLoc's layout: floor_K/DEVICE/SESSION with
                wifi_annotated.csv and sensors_annotated.csv; --survey puts the
                raw files beside
      hdf5      fingerprints.h5: matrix of levels, positions, floors, devices and
                the parts of every split, for training
      mcap      a file a session, SLUG.mcap, for Foxglove: poses, transforms,
                fixes (where there is a georeference), outline of floors, labelled
                Wi-Fi and BLE; --survey adds the plans' images
      parquet   plain Parquet tables, splits as one table, columns.csv; for
                pandas, Polars, DuckDB, R
      tum       a file a session, SLUG.tum: t tx ty tz qx qy qz qw, seconds and
                metres in the BCS, which evo reads; SLUG_covariance.txt beside
      uji       UJIIndoorLoc's trainingData.csv and validationData.csv: one column
                an access point, 100 = not heard

    gia, mcap and tum are made of what `process` wrote; the others of a data set, or of what `process` wrote by building
    the data set on the way. What a format has no place for is printed, listed in OUT/export.json, and in
    docs/reference/exporting.md.

    Exit code: 0 written, 2 wrong usage, the source cannot be used, or the output cannot be written, 130 interrupted.

    \b
    Examples:
      vislam2tag export fingerprints --format uji --split random --out uji
      vislam2tag export fingerprints --format hdf5 --out matrices \\
          --hash-bssid key.txt --no-ssid
      vislam2tag export labels --format gia --survey survey --out giaIndoorLoc
    """
    options = api.ExportOptions(
        given.split, given.fold, given.survey, given.hiding.privacy, not given.keep_formulas, given.follow_links
    )
    with outputs_of_interrupted(given.out), session_bar("files") as bar:
        record = api.export(
            given.source,
            given.out,
            given.format_name,
            options,
            jobs=given.jobs,
            progress=bar.step,
            tell=print_warnings,
        )
    answer(record, given.json, lambda: _print_export(record, given.out))


def _print_export(record: api.ExportRecord, out: Path) -> None:
    count = len(record.files)
    say(f"{out}: {record.format}, {count} file{'' if count == 1 else 's'}")
    for finding in record.findings:
        if finding.message.startswith("columns"):  # of rows that are written
            rows = f"{finding.count:,} {finding.file.replace('_', ' ')}"
            say(f"{finding.kind}: {finding.message} ({rows} have them)")
        else:
            say(f"{finding.kind} {finding.count}: {finding.message}")
    next_step("export", out=out)
