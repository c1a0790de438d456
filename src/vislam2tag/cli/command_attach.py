"""``vislam2tag attach``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, one_of
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.terminal import answer, say
from vislam2tag.common.errors import UsageError

if TYPE_CHECKING:
    from vislam2tag.pipeline.labels.attach import Attached


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
    it. docs/how-to/two-phones.md goes through it.

    Exit code: 0 tied, 2 wrong usage, a recording that cannot be read, or an offset that is not clear.

    \b
    Examples:
      vislam2tag attach survey/floor_1/iPhone/walk-1 2021-12-20_13-25-23.zip
      vislam2tag attach survey/floor_1/iPhone/walk-1 co2.csv --by motion
    """
    from vislam2tag.pipeline.labels.attach import attach
    from vislam2tag.sessions.companion_ties import TableColumns

    if given.time_column is None and given.unit is not None:
        raise UsageError("--unit needs --time-column: which column is in it")
    columns = None
    if given.time_column is not None:
        columns = TableColumns(time_column=given.time_column, unit=given.unit, zone=given.zone)
    made = attach(
        given.walk,
        given.other,
        by=given.by,
        lever_arm_m=given.lever_arm_m,
        name=given.name,
        replace=given.replace,
        columns=columns,
        zone=given.zone,
    )
    answer(made, given.json, lambda: _print(made, given.walk))


def _print(made: Attached, walk: Path) -> None:
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
