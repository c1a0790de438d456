"""Commands for other recordings of a walk: ``label``, ``attach`` and ``sightings``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, SurveyFolder, one_of
from vislam2tag.cli.progress import interrupted_with, session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.tables import print_table
from vislam2tag.cli.terminal import answer, say
from vislam2tag.common.errors import UsageError

if TYPE_CHECKING:
    import polars as pl


@dataclass(frozen=True, kw_only=True)
class LabelOptions:
    """Arguments and options of ``vislam2tag label``."""

    table: Path = argument("CSV or Parquet table with a column of times.")
    labels: Path = option(..., "Output folder of process.", metavar="FOLDER")
    out: Path | None = option(None, "Output, .csv or .parquet.  [default: TABLE-labelled beside TABLE]", metavar="FILE")
    time_column: str | None = option(None, "Name of the column of times.", metavar="NAME")
    clock: str | None = option(None, "Zero of the times: boot or unix.", metavar="CLOCK", parse=one_of("boot", "unix"))
    unit: str | None = option(
        None, "Unit of numeric times: s, ms, us or ns.", metavar="UNIT", parse=one_of("s", "ms", "us", "ns")
    )
    zone: str | None = option(None, "Time zone of dates without one, such as Europe/Berlin.", metavar="ZONE")
    offset_s: float | None = option(
        None, "Offset of the table's clock from the boot clock, positive if ahead.", metavar="SECONDS"
    )
    by: str | None = option(None, "Estimate the clock offset from motion or from levels (Wi-Fi).", metavar="BY")
    session: str | None = option(None, "Only walks whose name in labels/sessions contains this.", metavar="NAME")
    survey: Path | None = option(None, "Raw survey, in which the phone app recorded both clocks.", metavar="SURVEY")
    json: AsJson = False


@command
def label_command(given: LabelOptions) -> None:
    """Add the positions of walks to any time-stamped table: BLE, UWB, CO2, 5G and others.

    TABLE is a CSV (; , or tab) or Parquet file with a column of times. These are times since the phone's boot (ns, us,
    ms, s), Unix times, or ISO 8601 with a zone. The command detects which by name and magnitude, and prints it. Rows
    keep their columns and get x_m, y_m, z_m, floor, sigma and status. Rows outside a walk have no position and are
    counted.

    Clocks other than the phone's boot clock need an offset. With --survey it comes from the phone app's recording. A
    table with a gyroscope or accelerometer (gyro_x, ...) is aligned by motion, and one with bssid and rssi by its
    access points. The uncertainty of the offset is added to sigma. Otherwise pass --offset-s. An offset that is not
    clear is refused.

    Exit code: 0 labelled, 2 wrong usage, no labels, or times that cannot be interpreted, 3 no row has a position, 130
    interrupted.

    \b
    Examples:
      vislam2tag label ble.csv --labels labels
      vislam2tag label co2.parquet --labels labels --survey survey \\
          --out co2-labelled.parquet
      vislam2tag label headset.csv --labels labels --by motion --session LG
      vislam2tag label uwb.csv --labels labels --clock boot --unit ms \\
          --session LG
    """
    made = api.label(
        given.table,
        given.labels,
        time_name=given.time_column,
        clock=given.clock,
        unit=given.unit,
        zone=given.zone,
        offset_s=given.offset_s,
        align=given.by,
        session=given.session,
        survey=given.survey,
    )
    written = given.out or given.table.with_name(f"{given.table.stem}-labelled{given.table.suffix}")
    _write(made.table, written)
    found = {"written": written, "rows": made.table.height, "notes": made.notes, "counts": made.counts}
    labelled = made.table["x_m"].count()
    answer(found, given.json, lambda: _print_label(made, labelled, written, given.labels), nothing=not labelled)


def _print_label(made: api.TableLabels, labelled: int, written: Path, labels: Path) -> None:
    for sentence in made.notes:
        say(sentence)
    outside = made.counts.get(api.Status.OUTSIDE_FRAMES.label, 0)
    say(f"{made.table.height} rows: {labelled} have a position, {outside} are outside every walk")
    for status, count in made.counts.items():
        say(f"  {status}: {count}")
    say(f"written: {written}")
    next_step("label" if labelled else "label, nothing", labels=labels)


def _write(table: pl.DataFrame, path: Path) -> None:
    from vislam2tag.common.files.table_files import parquet_bytes
    from vislam2tag.common.files.whole_output import write_file

    write_file(path, parquet_bytes(table) if path.suffix.lower() == ".parquet" else table.write_csv())


@dataclass(frozen=True, kw_only=True)
class AttachOptions:
    """Arguments and options of ``vislam2tag attach``."""

    walk: Path = argument("Folder of the session that has the poses.")
    other: Path = argument("Zip, folder or table that another device recorded on this walk.")
    by: str | None = option(None, "Estimate the clock offset only from motion, levels (Wi-Fi) or taps.", metavar="BY")
    lever_arm_m: float = option(0.3, "Distance between both devices, metres. Part of the sigma.")
    name: str | None = option(None, "Name of the attached recording.  [default: name of OTHER]", metavar="NAME")
    time_column: str | None = option(None, "Name of a table's column of times.", metavar="NAME")
    unit: str | None = option(
        None, "Unit of a table's numeric times: s, ms, us or ns.", metavar="UNIT", parse=one_of("s", "ms", "us", "ns")
    )
    zone: str | None = option(None, "Time zone of a table's dates without one, such as Europe/Berlin.", metavar="ZONE")
    replace: bool = option(False, "Replace an attached recording of the same name.")
    json: AsJson = False


@command
def attach_command(given: AttachOptions) -> None:
    """Add a second device's recording to a walk, so that its readings get positions.

    An iPhone records poses but no Wi-Fi. Let an Android phone record beside it. OTHER is a zip or folder of Sensor
    Logger (iOS, Android), a log of GetSensorData, a session of our app without camera, or a CSV or Parquet table with a
    column of times. Offset and drift of its clock are estimated from turns or accelerations of both devices, from
    common access points, or from taps on both. An offset that is not clear is refused.

    Writes companions/NAME.json into the walk's folder and changes neither recording. `process` then labels OTHER's
    readings. Their sigma includes the uncertainty of the clock and the distance between both devices. Delete the file
    to undo it. See docs/how-to/iphone.md.

    Exit code: 0 attached, 2 wrong usage, an unreadable recording, or an offset that is not clear, 130 interrupted.

    \b
    Examples:
      vislam2tag attach survey/floor_1/iPhone/walk-1 2021-12-20_13-25-23.zip
      vislam2tag attach survey/floor_1/iPhone/walk-1 co2.csv --by motion
    """
    if given.time_column is None and given.unit is not None:
        raise UsageError("--unit also needs --time-column, the name of the column of times")
    columns = None
    if given.time_column is not None:
        columns = api.TableColumns(time_column=given.time_column, unit=given.unit, zone=given.zone)
    made = api.attach(
        given.walk,
        given.other,
        by=given.by,
        lever_arm_m=given.lever_arm_m,
        name=given.name,
        replace=given.replace,
        columns=columns,
        zone=given.zone,
    )
    answer(made, given.json, lambda: _print_attach(made, given.walk))


def _print_attach(made: api.Attached, walk: Path) -> None:
    tie = made.tie
    say(made.taken_for)
    say(
        f"its clock is {tie.offset_ns / 1e9:.3f} s ahead (+- {tie.sigma_s:.3f} s), from {tie.by} ({tie.figures})"
        + (f", and gains {1e6 * tie.rate:.0f} us per second" if tie.rate else "")
    )
    for table, rows in made.rows.items():
        say(f"  {table}: {rows} rows, {made.inside[table]} within the walk")
    for finding in made.findings:
        say(f"{finding.kind} {finding.count}: {finding.file}: {finding.message}")
    say(f"written: {made.written}")
    next_step("attach", survey=walk.parent.parent.parent)


@command
def sightings_command(
    *,
    survey: SurveyFolder,
    images: Path | None = option(None, "Folder OUT/images that `sheets` wrote.", metavar="FOLDER"),
    tags: str | None = option(None, "Family of square tags, such as apriltag-36h11.", metavar="FAMILY"),
    tag_side_m: float | None = option(None, "Side length of a tag's black square, metres.", least=0.01),
    qr_side_m: float | None = option(
        None, "Side length of QR codes, metres. Their text after the last slash is the landmark id.", least=0.01
    ),
    replace: bool = option(False, "Search sessions again that already have a sightings.csv."),
    json: AsJson = False,
) -> None:
    """Find landmarks in the images of walks that an iPhone or another camera recorded.

    Such walks have poses and images, but their tracker does not know the landmarks. This command searches for sheets
    from `sheets` (--images, its folder OUT/images) and the tags on them, for square tags whose numbers are landmark ids
    (--tags with --tag-side-m), or for QR codes (--qr-side-m). Each sighting gets a pose, and a standard deviation from
    the pixels.

    Writes sightings.csv into each session's folder, which `process` reads. The recording is not changed. See
    docs/how-to/iphone.md.

    Exit code: 0 all sessions done, 1 a session has no usable images, 2 wrong usage or not a survey, 3 no session could
    be searched, 130 interrupted.

    \b
    Examples:
      vislam2tag sightings survey --images sheets/images
      vislam2tag sightings survey --tags apriltag-36h11 --tag-side-m 0.16
    """

    def there() -> str:
        done = bar.done - bar.failed
        return (
            f"{done} sessions are finished; run the same command again to continue"
            if done
            else "no session was finished"
        )

    with session_bar("sessions", lines=True) as bar, interrupted_with(there):
        found = api.sightings(
            survey,
            images,
            tags,
            tag_side_m,
            qr_side_m,
            replace,
            lambda one, total: bar.advance(total, one.error or None),
            lambda stage, total: bar.reach(stage.done, total),
        )
    failed = any(one.error for one in found)
    nothing = all(one.skipped and not one.landmarks for one in found)
    after = "sightings, failed" if failed or nothing else "sightings"
    answer(found, json, lambda: _print_sightings(found, survey, after), failed=failed, nothing=nothing)


def _print_sightings(found: Sequence[api.SightingsFound], survey: Path, after: str) -> None:
    rows = []
    for one in found:
        what = ", ".join(one.landmarks) or one.skipped or one.error or "none"
        rows.append((one.session, what, str(one.sightings), str(one.doubtful), str(one.missing)))
    print_table("Sightings", ("session", "landmarks"), ("sightings", "doubtful", "missing images"), rows)
    next_step(after, survey=survey)
