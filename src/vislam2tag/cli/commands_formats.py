"""Commands that convert between our data sets and other formats: ``import`` and ``export``."""

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
_NOTHING_USABLE = "no reading of these files is usable; correct the problems above and import again"


def degrees_of(text: str, option_name: str) -> tuple[float, float]:
    """Read latitude and longitude from ``49.46,11.02``; raises UsageError for anything else."""
    try:
        latitude, longitude = (float(part) for part in text.split(","))
    except ValueError as error:
        raise UsageError(
            f"{option_name} {text}: expected latitude and longitude in degrees, such as 49.4609,11.0252"
        ) from error
    if not (abs(latitude) <= 90 and abs(longitude) <= 180):
        raise UsageError(f"{option_name} {text}: latitude must be -90 to 90 and longitude -180 to 180 degrees")
    return latitude, longitude


def scale_of(text: str, option_name: str) -> tuple[tuple[float, float], tuple[float, float]]:
    """Read two numbers with their levels from ``0=-100,100=-50``; raises UsageError for anything else."""
    try:
        (first, low), (second, high) = ([float(each) for each in pair.split("=")] for pair in text.split(","))
    except ValueError:
        first = second = low = high = 0.0
    if first == second or low == high or not math.isfinite(first + second + low + high):
        raise UsageError(f"{option_name} {text}: expected two numbers with their dBm, such as 0=-100,100=-50")
    return (first, low), (second, high)


@dataclass(frozen=True, kw_only=True)
class ImportArguments:
    """Arguments and options of ``vislam2tag import``."""

    path: Path = argument("File, folder or archive (.zip, .tar.xz, ...) of another format.")
    out: Path = option(..., "Folder for the data set: new, empty or an earlier data set.")
    format_name: str | None = option(None, format_help("; detected from the content by default"), "--format")
    name: str | None = option(None, "Name of the data set.  [default: that of the format]")
    origin: tuple[float, float] | None = option(
        None,
        "Origin in degrees for logs with geographic positions.  [default: their south-west corner]",
        metavar="LAT,LON",
        parse=degrees_of,
    )
    not_heard: float | None = option(
        None,
        "RSSI value that means 'not received' in tables with a column for each access point.",
        metavar="LEVEL",
    )
    levels: tuple[tuple[float, float], tuple[float, float]] | None = option(
        None,
        "Levels in dBm of two numbers, for such tables in another form, such as 0=-100,100=-50 for percent.",
        metavar="NUMBER=DBM,NUMBER=DBM",
        parse=scale_of,
    )
    columns: Path | None = option(
        None, 'File columns.toml that names the columns of a table of your own, such as x = "ECoord".'
    )
    describe: Description = None
    max_unpacked_gb: float = option(
        20.0, "Largest unpacked size of an archive, gigabytes (10^9 bytes).", least=0.0, most=1e6, hidden=True
    )
    hiding: PrivacyOptions
    replace: Replace = False
    follow_links: FollowLinks = False
    json: AsJson = False


@command
def import_command(given: ImportArguments) -> None:
    """Convert a public data set, or logs of other programs, to a data set.

    \b
    Formats, detected from names and first lines unless you pass --format:
      comford        COMFORD: folder or archive with Samples.csv, RSSI.csv and
                     APs.csv
      dungeon-assistant
                     dataset.csv of DungeonAssistant, or its folder or archive
      getsensordata  GetSensorData logs (IPIN competitions): a .txt log, or a
                     folder or archive of them; Wi-Fi and BLE between POSI marks,
                     in metres east and north of --origin
      gia            giaIndoorLoc's labelled layout: folder or archive with
                     floor_K/DEVICE/SESSION/wifi_annotated.csv; Wi-Fi, and the
                     magnetic field if sensors_annotated.csv exists
      ilc20          Indoor Location Competition 2.0: folder or archive with
                     SITE/FLOOR/path_data_files/*.txt, floor_info.json and
                     floor_image.png; Wi-Fi and BLE between waypoints
      parquet        plain Parquet tables from export (folder or archive)
      sodindoorloc   SODIndoorLoc (Bi et al. 2022): folder or archive with
                     Training_CETC331.csv, Training_HCXY_AP_30.csv, ... and
                     the tests; with split
      table          a table of your own, wide or long (.csv, .parquet, .xlsx),
                     or a folder of them; --columns names its columns
      tampere        Tampere University's quartet (Lohan et al. 2017): folder or
                     archive with Training_rss_DATE.csv,
                     Training_coordinates_DATE.csv, Training_device_DATE.csv,
                     Training_date_DATE.csv and the same of Test_; with split
      trn-tst        NAME_trnrss.csv, NAME_trncrd.csv and the same of tst, as
                     DSI, LIB, MINT and TUT are published; with split
      tuji1          TUJI1: folder or archive with RSS_training.csv,
                     Coordinates_training.csv and the same of testing
      uji            UJIIndoorLoc: folder, archive or one of trainingData.csv,
                     validationData.csv; with split, and the tables of names
                     from export
      uji-library    UJI's long-term library set (Mendoza-Silva et al. 2018):
                     folder or archive with MM/trnNNrss.csv, ...crd.csv,
                     ...tms.csv and the same of tst; with split
      uts            UTSIndoorLoc: folder or archive with UTS_training.csv and
                     UTS_test.csv, or one of them; with split
      wifine         WiFine (Khassanov et al. 2021): folder or archive with
                     train/train_*.csv, val/val_*.csv, test/test_*.csv; with
                     split

    Imports all readings, positions, floors, devices and the split of the data. docs/reference/importing.md lists what
    is not imported. The data set also gets the standard splits, statistics and card of `dataset`.

    Exit code: 0 imported (findings are printed and in the manifest), 1 a part of the files was skipped, 2 wrong usage,
    or files of another format, 3 no reading is usable, or no fingerprint has a position, 130 interrupted.

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
        None if given.levels is None else api.LevelScale(*given.levels),
        given.columns,
    )
    with interrupted_with(f"no data set was written to {given.out}"), session_bar("files") as bar:
        dataset = api.import_format(given.path, given.out, options, progress=bar.count)
    odd = any(finding.severity is Severity.ERROR for finding in dataset.info.findings)
    if given.json and not dataset.measured:
        say(_NOTHING_USABLE, err=True)
    nothing = not dataset.measured or not dataset.labelled
    answer(dataset.info, given.json, lambda: _print_import(dataset, given.out), failed=odd, nothing=nothing)


def _print_import(dataset: api.Dataset, out: Path) -> None:
    from vislam2tag.pipeline.datasets.finish import PAGE_FILE

    say("\n".join(_summary(dataset, out)))
    if dataset.measured:
        next_step("import" if dataset.labelled else "no position", dataset=out, page=out / PAGE_FILE)
    else:
        say(_NOTHING_USABLE, err=True)


def _bytes(gigabytes: float) -> int:
    if not gigabytes < math.inf:
        raise UsageError("--max-unpacked-gb: expected a number of gigabytes, such as 20")
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
        *_extent(dataset),
        f"devices: {_listed(devices)}",
        f"splits: {_listed(list(info.splits))}",
        *(
            f"{finding.kind} {finding.count}: {_place(finding.file, finding.lines)}{finding.message}"
            for finding in info.findings
        ),
    ]


def _extent(dataset: api.Dataset) -> list[str]:
    """Where the fingerprints are, so that a wrong unit is seen."""
    import polars as pl

    bounds = [end for axis in "xy" for end in (pl.col(axis).min().alias(f"{axis}_min"), pl.col(axis).max())]
    found = dataset.fingerprints.select(bounds).collect(engine="streaming").row(0)
    if None in found:
        return []
    left, right, lowest, highest = found
    return [f"extent: x from {left:.1f} to {right:.1f} m, y from {lowest:.1f} to {highest:.1f} m"]


def floor_words(floor: FloorInfo) -> str:
    """Name a floor by building, name and number, each once."""
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
    split: str | None = option(None, "Split for the training and test files (uji, comford).  [default: official]")
    fold: str | None = option(None, "Fold of the split, if it has several.")
    survey: Path | None = option(
        None, "Survey of the labels, for its raw files (gia), plans (mcap) or pictures (colmap, kapture, lamar)."
    )
    hiding: PrivacyOptions
    keep_formulas: bool = option(
        False,
        "Keep names that begin with =, +, - or @ unchanged in the name tables of uji. By default they get an "
        "apostrophe, so that no spreadsheet runs them as formulas. import removes it.",
        hidden=True,
    )
    follow_links: FollowLinks = False
    json: AsJson = False
    jobs: Jobs = ALL_CORES


@command
def export_command(given: ExportArguments) -> None:
    """Write a data set, or the output of `process`, in another format.

    \b
    Formats:
      colmap    floor_K/cameras.txt, images.txt and points3D.txt of the pictures
                of the survey, with poses in the building
      comford   COMFORD's intermediate/Samples.csv, RSSI.csv and APs.csv, which
                the package comford loads
      csv       plain CSV tables, splits as one table, columns.csv
      geopackage
                fingerprints.gpkg: points and readings for GIS, in WGS84 if the
                floors have a georeference, otherwise in metres
      geoparquet
                fingerprints.parquet with points, and readings.parquet, in the
                same frames
      geojson   fingerprints.geojson: a point for each fingerprint, in WGS84 if
                the floors have a georeference, otherwise in metres
      gia       giaIndoorLoc's layout: floor_K/DEVICE/SESSION with
                wifi_annotated.csv and sensors_annotated.csv; --survey adds the
                raw files
      hdf5      fingerprints.h5: matrix of RSSI, positions, floors, devices and
                the parts of every split, for training
      kapture   floor_K/sensors/ with sensors.txt, trajectories.txt and
                records_camera.txt of the pictures of the survey
      lamar     floor_K/sessions/SLUG/ with sensors.txt, trajectories.txt and
                images.txt of the pictures of the survey
      mcap      SLUG.mcap for each session, for Foxglove: poses, transforms,
                fixes (if there is a georeference), outline of floors, labelled
                Wi-Fi and BLE; --survey adds the images of the plans
      parquet   plain Parquet tables, splits as one table, columns.csv; for
                pandas, Polars, DuckDB, R
      tum       SLUG.tum for each session, for evo: t tx ty tz qx qy qz qw,
                seconds and metres in the BCS; and SLUG_covariance.txt
      uji       UJIIndoorLoc's trainingData.csv and validationData.csv: a column
                for each access point, 100 = not received

    colmap, gia, kapture, lamar, mcap and tum need the output of `process`. The others also accept a data set. Data that
    a format cannot contain are printed and listed in OUT/export.json. See also docs/reference/exporting.md.

    Exit code: 0 written, 2 wrong usage or an unusable source, 130 interrupted.

    \b
    Examples:
      vislam2tag export fingerprints --format uji --split random --out uji
      vislam2tag export fingerprints --format hdf5 --out matrices \\
          --hash-bssid key.txt --no-ssid
      vislam2tag export labels --format gia --survey survey --out giaIndoorLoc
      vislam2tag export labels --format colmap --survey survey --out model
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
