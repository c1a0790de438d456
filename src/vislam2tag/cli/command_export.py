"""``vislam2tag export``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import (
    ALL_CORES,
    AsJson,
    FollowLinks,
    Jobs,
    PrivacyOptions,
    format_help,
)
from vislam2tag.cli.progress import outputs_of_interrupted, session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.tables import print_warnings
from vislam2tag.cli.terminal import answer, say

if TYPE_CHECKING:
    from vislam2tag.pipeline.datasets.export import ExportRecord


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
    from vislam2tag.pipeline.datasets.export import ExportOptions, export

    options = ExportOptions(
        given.split, given.fold, given.survey, given.hiding.privacy, not given.keep_formulas, given.follow_links
    )
    with outputs_of_interrupted(given.out), session_bar("files") as bar:

        def advance(stage: str, total: int) -> None:
            bar.enter(stage)
            bar.advance(total, None)

        record = export(
            given.source,
            given.out,
            given.format_name,
            options,
            jobs=given.jobs,
            progress=advance,
            tell=print_warnings,
        )
    answer(record, given.json, lambda: _print(record, given.out))


def _print(record: ExportRecord, out: Path) -> None:
    count = len(record.files)
    say(f"{out}: {record.format}, {count} file{'' if count == 1 else 's'}")
    for finding in record.findings:
        if finding.message.startswith("columns"):  # of rows that are written
            rows = f"{finding.count:,} {finding.file.replace('_', ' ')}"
            say(f"{finding.kind}: {finding.message} ({rows} have them)")
        else:
            say(f"{finding.kind} {finding.count}: {finding.message}")
    next_step("export", out=out)
