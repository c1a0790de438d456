"""Commands for what else was recorded on a walk: ``label``, ``attach`` and ``sightings``."""

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

    table: Path = argument("CSV or Parquet with a column of times.")
    labels: Path = option(..., "Output folder of process.", metavar="FOLDER")
    out: Path | None = option(
        None, "Where to write, .csv or .parquet; else TABLE-labelled beside TABLE.", metavar="FILE"
    )
    time_column: str | None = option(None, "The column of times.", metavar="NAME")
    clock: str | None = option(
        None, "What times count from: boot or unix.", metavar="CLOCK", parse=one_of("boot", "unix")
    )
    unit: str | None = option(
        None, "Of times as numbers: s, ms, us or ns.", metavar="UNIT", parse=one_of("s", "ms", "us", "ns")
    )
    zone: str | None = option(None, "Of dates that name none, such as Europe/Berlin.", metavar="ZONE")
    offset_s: float | None = option(None, "How far the table's clock is ahead of boot.", metavar="SECONDS")
    by: str | None = option(
        None, "Find the clock by motion or by levels (Wi-Fi), whatever its times look like.", metavar="BY"
    )
    session: str | None = option(None, "Only walks whose name in labels/sessions holds this.", metavar="NAME")
    survey: Path | None = option(None, "The raw survey: the phone app noted both its clocks.", metavar="SURVEY")
    json: AsJson = False


@command
def label_command(given: LabelOptions) -> None:
    """Give any time-stamped table the positions of the walks it was taken on: BLE, UWB, CO2, 5G, whatever was logged.

    TABLE is CSV (; , or tab) or Parquet with a column of times: since the phone's boot (ns, us, ms, s), Unix times, or
    ISO 8601 with a zone; which one is found by name and magnitude, and printed. Its rows stay as they are and get x_m,
    y_m, z_m, floor, sigma and status; rows outside a walk are counted and have no position.

    Unix times, dates and the clocks of other devices need to know how far they are ahead of the phone's boot clock:
    --survey takes it from what the phone app recorded; a table with a gyroscope or accelerometer (gyro_x, ...) is
    aligned by the motion that both felt, one with bssid and rssi by the access points that both heard, with the sigma
    of that, which the positions' sigma then holds; else --offset-s. What is not clear is refused with its figures.

    Exit code: 0 all right, 1 no row has a position, 2 wrong usage, no labels, or a table or clock that is not
    understood.

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
    answer(found, given.json, lambda: _print_label(made, labelled, written, given.labels), failed=not labelled)


def _print_label(made: api.TableLabels, labelled: int, written: Path, labels: Path) -> None:
    for sentence in made.notes:
        say(sentence)
    outside = made.counts.get(api.Status.OUTSIDE_FRAMES.label, 0)
    say(f"{made.table.height} rows: {labelled} have a position, {outside} lie outside every walk")
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
    other: Path = argument("Zip, folder or table that another device recorded on that walk.")
    by: str | None = option(None, "Only this may tell the offset: motion, levels (Wi-Fi) or taps.", metavar="BY")
    lever_arm_m: float = option(0.3, "How far apart both were carried, metres: part of the positions' sigma.")
    name: str | None = option(None, "Name of the tie, else OTHER's.", metavar="NAME")
    time_column: str | None = option(None, "The column of times of a table.", metavar="NAME")
    unit: str | None = option(
        None, "Of a table's times: s, ms, us or ns.", metavar="UNIT", parse=one_of("s", "ms", "us", "ns")
    )
    zone: str | None = option(None, "Of a table's dates that name none, such as Europe/Berlin.", metavar="ZONE")
    replace: bool = option(False, "Tie anew where a tie of that name is there.")
    json: AsJson = False


@command
def attach_command(given: AttachOptions) -> None:
    """Tie a second recording of a walk to the one that has the poses, so that its readings are labelled with it.

    An iPhone has poses and no Wi-Fi: let an Android phone log beside it. OTHER is the zip or folder of Sensor Logger
    (iOS, Android), a log of GetSensorData, a session of our app without camera, or any CSV or Parquet table with a
    column of times. By how much its clock is ahead, and how much faster it runs, is found by the turns or accelerations
    that both felt, else by access points that both heard, or by taps on both; what is not clear is refused with its
    figures.

    Writes companions/NAME.json into the walk's folder; neither recording is touched. `process` then gives OTHER's
    readings positions, with the clock's sigma and the distance between both devices in theirs. Removing the file undoes
    it. docs/how-to/iphone.md goes through it.

    Exit code: 0 tied, 2 wrong usage, a recording that cannot be read, or an offset that is not clear.

    \b
    Examples:
      vislam2tag attach survey/floor_1/iPhone/walk-1 2021-12-20_13-25-23.zip
      vislam2tag attach survey/floor_1/iPhone/walk-1 co2.csv --by motion
    """
    if given.time_column is None and given.unit is not None:
        raise UsageError("--unit needs --time-column: which column is in it")
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
        f"its clock is {tie.offset_ns / 1e9:.3f} s ahead (+- {tie.sigma_s:.3f} s) by {tie.by} ({tie.figures})"
        + (f", and gains {1e6 * tie.rate:.0f} us each second" if tie.rate else "")
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
    images: Path | None = option(None, "Images that `sheets` wrote.", metavar="FOLDER"),
    tags: str | None = option(None, "Tags of this family; a wrong one lists all.", metavar="FAMILY"),
    tag_side_m: float | None = option(None, "Side of a tag's black square, metres.", least=0.01),
    qr_side_m: float | None = option(
        None, "Side of QR codes whose text ends in the landmark's id, metres.", least=0.01
    ),
    replace: bool = option(False, "Look anew where sightings.csv is there already."),
    json: AsJson = False,
) -> None:
    """Find landmarks in the pictures of walks that an iPhone or another camera recorded.

    Such walks have poses and pictures, but nobody told their tracker of our landmarks. This looks for them: sheets that
    `sheets` printed (--images, its folder OUT/images), with the tags on them where there are some, square tags (--tags
    with --tag-side-m, whose numbers are the landmarks' ids), or QR codes (--qr-side-m). Each sighting gets a pose by
    the camera's lens, and a standard deviation by the pixels.

    Writes sightings.csv into each session's folder, beside the recording, which stays as it is; `process` reads it.
    docs/how-to/iphone.md goes through a survey with an iPhone.

    Exit code: 0 all sessions done, 1 at least one has no pictures that can be used, 2 wrong usage or not a survey, 130
    interrupted.

    \b
    Examples:
      vislam2tag sightings survey --images sheets/images
      vislam2tag sightings survey --tags apriltag-36h11 --tag-side-m 0.16
    """

    def there() -> str:
        done = bar.done - bar.failed
        return f"{done} sessions have their sightings; the same command goes on" if done else "no session was finished"

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
    failed = any(one.error for one in found) or all(one.skipped and not one.landmarks for one in found)
    after = "sightings, failed" if failed else "sightings"
    answer(found, json, lambda: _print_sightings(found, survey, after), failed=failed)


def _print_sightings(found: Sequence[api.SightingsFound], survey: Path, after: str) -> None:
    rows = []
    for one in found:
        what = ", ".join(one.landmarks) or one.skipped or one.error or "none"
        rows.append((one.session, what, str(one.sightings), str(one.doubtful), str(one.missing)))
    print_table("Sightings", ("session", "landmarks"), ("sightings", "doubtful", "pictures missing"), rows)
    next_step(after, survey=survey)
