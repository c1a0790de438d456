"""``vislam2tag export``."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import (
    ALL_CORES,
    AsJson,
    FollowLinks,
    HashBssid,
    IncludeNomap,
    Jobs,
    NoSsid,
    format_help,
    privacy_of,
)
from vislam2tag.cli.progress import SessionBar, outputs_of_interrupted, session_bar
from vislam2tag.cli.tables import print_warnings
from vislam2tag.cli.terminal import say, say_json

if TYPE_CHECKING:
    from vislam2tag.pipeline.datasets.export import ExportOptions, ExportRecord


HELP = """
Export a data set, or what `process` wrote, in a format that others read.

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

gia, mcap and tum are made of what `process` wrote; the others of a data set, or of what `process` wrote by building the
data set on the way. What a format has no place for is printed, listed in OUT/export.json, and in
docs/reference/exporting.md.

Exit code: 0 written, 2 wrong usage, the source cannot be used, or the output cannot be written, 130 interrupted.

\b
Examples:
  vislam2tag export fingerprints --format uji --split random --out uji
  vislam2tag export fingerprints --format hdf5 --out matrices \\
      --hash-bssid key.txt --no-ssid
  vislam2tag export labels --format gia --survey survey --out giaIndoorLoc
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("export", help=HELP)(_export)


def _export(
    source: Annotated[Path, typer.Argument(help="Data set, or output folder of process.")],
    format_name: Annotated[str, typer.Option("--format", help=format_help())],
    out: Annotated[Path, typer.Option(help="Folder to write: new, empty or from an earlier export.")],
    split: Annotated[
        str | None,
        typer.Option(help="Split whose parts become training and test files (uji, comford); else the official one."),
    ] = None,
    fold: Annotated[str | None, typer.Option(help="Fold of the split, where it has several.")] = None,
    survey: Annotated[
        Path | None,
        typer.Option(help="The survey that labels were made of: raw files go beside (gia), plans (mcap)."),
    ] = None,
    include_nomap: IncludeNomap = False,
    hash_bssid: HashBssid = None,
    no_ssid: NoSsid = False,
    keep_formulas: Annotated[
        bool,
        typer.Option(
            "--keep-formulas",
            help="Leave names that begin with =, +, - or @ as they are in uji's tables of names; else an apostrophe "
            "goes before them, which import takes off, so that no spreadsheet computes them.",
        ),
    ] = False,
    follow_links: FollowLinks = False,
    json: AsJson = False,
    jobs: Jobs = ALL_CORES,
) -> None:
    from vislam2tag.pipeline.datasets.export import ExportOptions

    privacy = privacy_of(include_nomap, hash_bssid, no_ssid)
    options = ExportOptions(split, fold, survey, privacy, not keep_formulas, follow_links)
    with outputs_of_interrupted(out):
        record = _exported(source, out, format_name, options, jobs)
    if json:
        say_json(record)
    else:
        _print(record, out)
        next_step("export", out=out)


def _exported(source: Path, out: Path, format_name: str, options: ExportOptions, jobs: int) -> ExportRecord:
    from vislam2tag.pipeline.datasets.export import export

    with ExitStack() as stack:
        bars: dict[str, SessionBar] = {}

        def advance(stage: str, total: int) -> None:
            if stage not in bars:
                stack.close()  # one bar at a time
                bars[stage] = stack.enter_context(session_bar(stage))
            bars[stage].advance(total, None)

        return export(source, out, format_name, options, jobs=jobs, progress=advance, tell=print_warnings)


def _print(record: ExportRecord, out: Path) -> None:
    count = len(record.files)
    say(f"{out}: {record.format}, {count} file{'' if count == 1 else 's'}")
    for finding in record.findings:
        if finding.message.startswith("columns"):  # of rows that are written
            rows = f"{finding.count:,} {finding.file.replace('_', ' ')}"
            say(f"{finding.kind}: {finding.message} ({rows} have them)")
        else:
            say(f"{finding.kind} {finding.count}: {finding.message}")
