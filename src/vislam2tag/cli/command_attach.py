"""``vislam2tag attach``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson
from vislam2tag.cli.terminal import say, say_json

if TYPE_CHECKING:
    from vislam2tag.pipeline.labels.attach import Attached


HELP = """
Tie a second recording of a walk to the one that has the poses, so that its readings are labelled with it.

An iPhone has poses and no Wi-Fi: let an Android phone log beside it. OTHER is the zip or folder of Sensor Logger (iOS,
Android), a log of GetSensorData, a session of our app without camera, or any CSV or Parquet table with a column of
times. By how much its clock is ahead, and how much faster it runs, is found by the turns or accelerations that both
felt, else by access points that both heard, or by taps on both; what is not clear is refused with its figures.

Writes companions/NAME.json into the walk's folder; neither recording is touched. `process` then gives OTHER's readings
positions, with the clock's sigma and the distance between both devices in theirs. Removing the file undoes it.
docs/how-to/two-phones.md goes through it.

Exit code: 0 tied, 2 wrong usage, a recording that cannot be read, or an offset that is not clear.

\b
Examples:
  vislam2tag attach survey/floor_1/iPhone/walk-1 2021-12-20_13-25-23.zip
  vislam2tag attach survey/floor_1/iPhone/walk-1 co2.csv --by motion
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("attach", help=HELP)(_attach)


def _attach(
    walk: Annotated[Path, typer.Argument(help="Folder of the session that has the poses.")],
    other: Annotated[Path, typer.Argument(help="Zip, folder or table that another device recorded on that walk.")],
    by: Annotated[
        str | None, typer.Option(metavar="BY", help="Only this may tell the offset: motion, levels (Wi-Fi) or taps.")
    ] = None,
    lever_arm_m: Annotated[
        float, typer.Option(help="How far apart both were carried, metres: part of the positions' sigma.")
    ] = 0.3,
    name: Annotated[str | None, typer.Option(metavar="NAME", help="Name of the tie, else OTHER's.")] = None,
    time_column: Annotated[str | None, typer.Option(metavar="NAME", help="The column of times of a table.")] = None,
    unit: Annotated[str | None, typer.Option(metavar="UNIT", help="Of a table's times: s, ms, us or ns.")] = None,
    zone: Annotated[
        str | None, typer.Option(metavar="ZONE", help="Of a table's dates that name none, such as Europe/Berlin.")
    ] = None,
    replace: Annotated[bool, typer.Option("--replace", help="Tie anew where a tie of that name is there.")] = False,
    json: AsJson = False,
) -> None:
    from vislam2tag.common.errors import UsageError
    from vislam2tag.pipeline.labels.attach import attach
    from vislam2tag.sessions.companions.tie import TableColumns

    if unit is not None and unit not in ("s", "ms", "us", "ns"):
        raise UsageError(f"--unit {unit}: there are s, ms, us, ns")
    if time_column is None and unit is not None:
        raise UsageError("--unit needs --time-column: which column is in it")
    columns = None if time_column is None else TableColumns(time_column=time_column, unit=unit, zone=zone)
    made = attach(walk, other, by=by, lever_arm_m=lever_arm_m, name=name, replace=replace, columns=columns, zone=zone)
    if json:
        say_json(made)
    else:
        _print(made)
        next_step("attach", survey=walk.parent.parent.parent)


def _print(made: Attached) -> None:
    tie = made.tie
    say(f"{made.taken_for}")
    say(
        f"its clock is {tie.offset_ns / 1e9:.3f} s ahead (+- {tie.sigma_s:.3f} s) by {tie.by} ({tie.figures})"
        + (f", and gains {1e6 * tie.rate:.0f} us each second" if tie.rate else "")
    )
    for table, rows in made.rows.items():
        say(f"  {table}: {rows} rows, {made.inside[table]} within the walk")
    for finding in made.findings:
        say(f"{finding.kind} {finding.count}: {finding.file}: {finding.message}")
    say(f"written: {made.written}")
